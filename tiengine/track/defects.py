"""Defects of a scenario: failed or degraded fastenings, mortar voids.

Seats and slabs are counted from chainage 0: seat j stands at (j + 1/2) d and slab i in the middle of
[i p, (i + 1) p], half a gap at either end, with d the seat pitch and p the slab pitch.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q
from tiengine.parameters.sides import SIDES
from tiengine.track.mortar import MortarVoid, bed_factors
from tiengine.track.slab import Slab

__all__ = ["FailedFastenings", "MortarDefect", "check_defects", "fastening_factors"]

MOST_VOIDS = 100  # of one slab

SeatIndex = Annotated[int, Field(ge=0)]


class FailedFastenings(Params):
    """A row of neighbouring fastenings of one rail or both, scaled by a factor."""

    rail: Annotated[Literal["left", "right", "both"], Field(description="which rail's")] = "both"
    seats: Annotated[
        tuple[SeatIndex, SeatIndex],
        Field(description="first and last; seat j stands at (j + 1/2) seat pitches"),
    ]
    factor: Annotated[float, Q("-", "0 failed, below 1 degraded; scales stiffness and damping", ge=0, le=10)] = 0.0


class MortarDefect(Params):
    """A rectangle of one slab whose bed is missing or scaled.

    x is measured from the slab's rear edge, y from its centre line, positive to the right.
    """

    slab: Annotated[int, Q("-", "slab i lies between i and i + 1 slab pitches", ge=0)]
    x: Annotated[tuple[float, float], Field(description="from, to", json_schema_extra={"unit": "m"})]
    y: Annotated[tuple[float, float], Field(description="from, to", json_schema_extra={"unit": "m"})]
    factor: Annotated[float, Q("-", "0 void, 1 sound; scales stiffness and damping", ge=0, le=10)] = 0.0

    @property
    def rectangle(self) -> MortarVoid:
        """The void in the form that the slab's matrices take."""
        x, y = self.x, self.y
        return MortarVoid(slab=self.slab, x_from=x[0], x_to=x[1], y_from=y[0], y_to=y[1], factor=self.factor)


def fastening_factors(failed: Iterable[FailedFastenings], first: int, count: int) -> NDArray[np.float64]:
    """Factors of a row of seats.

    Args:
        failed: Rows of the scenario; where two overlap, their factors multiply.
        first: Index of the first seat.
        count: Number of seats.

    Returns:
        Factors, 1 where sound, shape (count, 2); side 0 is left.
    """
    factors = np.ones((count, 2))
    for row in failed:
        sides = slice(None) if row.rail == "both" else SIDES.index(row.rail)
        factors[max(row.seats[0] - first, 0) : max(row.seats[1] + 1 - first, 0), sides] *= row.factor
    return factors


def check_defects(
    failed: Iterable[FailedFastenings],
    voids: Sequence[MortarDefect],
    *,
    end: float,
    slab: Slab,
) -> None:
    """Refuse defects that the run never meets or that lie outside a slab.

    Args:
        failed: Fastenings of the scenario.
        voids: Voids of the scenario.
        end: Chainage of the window's front end at the end of the run [m].
        slab: Gives the pitches of seats and slabs and a slab's size.

    Raises:
        InputError: Names the entry, its value and the range.
    """
    last_seat = int(np.floor(end / slab.fastening_pitch - 0.5))
    last_slab = int(np.floor(end / slab.pitch))
    for i, row in enumerate(failed):
        where = f"track.failed_fastenings[{i}].seats = {list(row.seats)}"
        if row.seats[0] > row.seats[1]:
            raise InputError(f"{where}: must be [first, last] with first <= last")
        if row.seats[1] > last_seat:
            raise InputError(f"{where}: must be between 0 and {last_seat}, the last seat of this run")
    for i, void in enumerate(voids):
        where = f"track.mortar_voids[{i}]"
        if void.slab > last_slab:
            raise InputError(f"{where}.slab = {void.slab}: must be between 0 and {last_slab}, the last of this run")
        _check_span(f"{where}.x", void.x, 0.0, slab.length, "the slab's length")
        _check_span(f"{where}.y", void.y, -slab.width / 2, slab.width / 2, "the slab's width")
    by_slab: dict[int, list[MortarVoid]] = {}
    for void in voids:
        by_slab.setdefault(void.slab, []).append(void.rectangle)
    for rectangles in by_slab.values():
        if len(rectangles) > MOST_VOIDS:
            index = rectangles[0].slab
            raise InputError(
                f"track.mortar_voids: {len(rectangles)} of slab {index}: must be at most {MOST_VOIDS} a slab"
            )
        bed_factors(slab.length, slab.width, (1, 1), rectangles)  # refuses voids that overlap


def _check_span(where: str, span: tuple[float, float], low: float, high: float, what: str) -> None:
    if not low <= span[0] < span[1] <= high:
        rule = f"must be [from, to] with {low:g} <= from < to <= {high:g} m ({what})"
        raise InputError(f"{where} = {list(span)}: {rule}")
