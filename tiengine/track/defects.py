"""Defects of a scenario: failed or degraded fastenings, mortar voids.

Seats and slabs are counted from chainage 0: seat j stands at (j + 1/2) d and slab i in the middle of
[i p, (i + 1) p], half a gap at either end, with d the seat pitch and p the slab pitch.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q
from tiengine.track.mortar import LARGEST_GAP, MortarVoid, check_void, sound_with_gap
from tiengine.track.slab import Slab

__all__ = ["FailedFastenings", "check_defects", "fastening_factors", "fastening_plays", "largest_factor"]

RAILS = {"left": (0,), "right": (1,), "both": (0, 1)}

MOST_VOIDS = 100  # per slab

SeatIndex = Annotated[int, Field(ge=0)]


class FailedFastenings(Params):
    """Consecutive fastenings of one rail or both, scaled by a factor or hanging by a gap.

    A hanging fastening carries nothing until the rail has come down by the gap, nor up to the same play above. Beyond
    it is as stiff as `factor` says, which is 1 if it is left out; damping, lateral force and couple stand in the same
    proportion to those of a sound one as the vertical force. The weight of the rail uses a part of the gap up. Splines
    and a bed that transmits no tension are needed (`mortar_no_tension`).
    """

    rail: Annotated[Literal["left", "right", "both"], Field(description="rail of the fastenings")] = "both"
    seats: Annotated[
        tuple[SeatIndex, SeatIndex],
        Field(description="first and last; seat j stands at (j + 1/2) seat pitches"),
    ]
    factor: Annotated[float, Q("-", "0 failed, below 1 degraded; scales stiffness and damping", ge=0, le=10)] = 0.0
    gap: Annotated[float | None, Q("m", "by which the fastenings hang", ge=0, le=LARGEST_GAP)] = None

    _sound = model_validator(mode="before")(sound_with_gap)


def fastening_factors(failed: Iterable[FailedFastenings], first: int, count: int) -> NDArray[np.float64]:
    """Return the factors of consecutive seats.

    Args:
        failed: Entries of the scenario; where two overlap, their factors multiply.
        first: Index of the first seat.
        count: Number of seats.

    Returns:
        Factors, 1 where intact, shape (count, 2); side 0 is left.
    """
    factors = np.ones((count, 2))
    for row in failed:
        for side in RAILS[row.rail]:
            factors[max(row.seats[0] - first, 0) : max(row.seats[1] + 1 - first, 0), side] *= row.factor
    return factors


def fastening_plays(failed: Iterable[FailedFastenings], first: int, count: int) -> NDArray[np.float64]:
    """Return the play of consecutive seats, the gap by which they hang [m].

    Args:
        failed: Entries of the scenario; where two overlap, the larger gap counts.
        first: Index of the first seat.
        count: Number of seats.

    Returns:
        Gaps, 0 where none hangs, shape (count, 2); side 0 is left.
    """
    plays = np.zeros((count, 2))
    for row in failed:
        for side in RAILS[row.rail]:
            here = plays[max(row.seats[0] - first, 0) : max(row.seats[1] + 1 - first, 0), side]
            np.maximum(here, row.gap or 0.0, out=here)
    return plays


def largest_factor(failed: Iterable[FailedFastenings]) -> float:
    """Largest factor of any fastening, sound ones included; it is found where an entry begins.

    Args:
        failed: Entries of the scenario.
    """
    rows = [row for row in failed if row.factor != 1.0]
    starts = {row.seats[0] for row in rows if row.factor > 1.0}
    return max((float(fastening_factors(rows, start, 1).max()) for start in starts), default=1.0)


def check_defects(
    failed: Iterable[FailedFastenings],
    voids: Iterable[MortarVoid],
    *,
    end: float,
    slab: Slab,
) -> None:
    """Refuse defects that the run never reaches or that lie outside a slab.

    Args:
        failed: Fastenings of the scenario.
        voids: Voids of the scenario.
        end: Chainage of the window's front end at the end of the run [m].
        slab: Slab with its dimensions and the pitches of seats and slabs.

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
    by_slab: dict[int, list[MortarVoid]] = {}
    for i, void in enumerate(voids):
        where = f"track.mortar_voids[{i}]"
        if void.slab > last_slab:
            raise InputError(f"{where}.slab = {void.slab}: must be between 0 and {last_slab}, the last of this run")
        same_slab = by_slab.setdefault(void.slab, [])
        if len(same_slab) == MOST_VOIDS:
            raise InputError(f"track.mortar_voids: slab {void.slab} has more than {MOST_VOIDS} voids")
        check_void(void, slab.length, slab.width, same_slab, where)
        same_slab.append(void)
