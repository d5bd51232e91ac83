"""Gauges of a scenario: fixed points of rail, slab or fastening, recorded while the window is over them.

::

    [[gauges]]
    name = "left_rail"
    on = "rail"
    chainage = 101.4        # m
    side = "left"           # rail and fastening; a slab has y instead, distance right of the centre line [m]
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q
from tiengine.track.slab import Slab

__all__ = ["Gauge", "check_gauges", "nearest_seat", "slab_under"]

NAME = re.compile(r"[A-Za-z0-9_-]+")


class Gauge(Params):
    """One measuring point; on a fastening it is moved to the seat nearest to the chainage.

    Attributes:
        name: Its group in the result is gauges/NAME; letters, digits, _ and -.
        on: Measured part; "gap" is the opening under a slab, at the bed's quadrature point nearest to the place.
        chainage: Position along the track; on a slab, not in a joint.
        side: Side of the rail or fastening.
        y: Position on or under a slab, from the centre line, positive to the right.
    """

    name: Annotated[str, Field(max_length=100)]
    on: Literal["rail", "slab", "fastening", "gap"]
    chainage: Annotated[float, Q("m", ge=0)]
    side: Literal["left", "right"] | None = None
    y: Annotated[float | None, Field(json_schema_extra={"unit": "m"})] = None

    @field_validator("name")
    @classmethod
    def _is_plain(cls, value: str) -> str:
        if not NAME.fullmatch(value):
            raise ValueError("must be made of letters, digits, _ and -")
        return value


def nearest_seat(chainage: float, slab: Slab) -> int:
    """Index of the seat nearest to a chainage [m]; seat j stands at (j + 1/2) d."""
    return int(np.floor(chainage / slab.fastening_pitch))


def slab_under(chainage: float, slab: Slab) -> tuple[int, float]:
    """Index of the slab at a chainage [m], and the distance from its centre [m], beyond its ends in a joint."""
    index = int(np.floor(chainage / slab.pitch))
    return index, chainage - (index + 0.5) * slab.pitch


def check_gauges(
    gauges: Sequence[Gauge], *, begin: float, end: float, slab: Slab, slabs_may_lift: bool = False
) -> None:
    """Refuse gauges that the run never reaches, that lie off the slab, or that share a name.

    Args:
        gauges: Gauges of the scenario.
        begin: Chainage of the window's rear end at the start of the run [m].
        end: Chainage of its front end at the end of the run [m].
        slab: Pitches of seats and slabs and size of a slab.
        slabs_may_lift: Whether a gap may open under a slab.

    Raises:
        InputError: Names the entry, its value and the rule.
    """
    names = [gauge.name for gauge in gauges]
    for i, gauge in enumerate(gauges):
        where = f"gauges[{i}]"
        if gauge.name in names[:i]:
            raise InputError(f"{where}.name = {gauge.name!r}: gauges[{names.index(gauge.name)}] already has this name")
        if not begin <= gauge.chainage <= end:
            raise InputError(
                f"{where}.chainage = {gauge.chainage:g}: must be between {begin:g} and {end:g} m,"
                " the range covered by the window"
            )
        if gauge.on == "gap" and not slabs_may_lift:
            raise InputError(
                f"{where}.on = 'gap': needs a bed that transmits no tension, track.mortar_no_tension, and splines"
            )
        if gauge.on in ("slab", "gap"):
            _check_slab_gauge(where, gauge, slab)
        elif gauge.side is None:
            raise InputError(f"{where}.side: missing; a gauge on a {gauge.on} needs 'left' or 'right'")
        elif gauge.y is not None:
            raise InputError(f"{where}.y = {gauge.y:g}: only for a gauge on a slab")


def _check_slab_gauge(where: str, gauge: Gauge, slab: Slab) -> None:
    """Check the rules of a gauge on or under a slab."""
    kind = "on a slab" if gauge.on == "slab" else "in a gap"
    if gauge.side is not None:
        raise InputError(f"{where}.side = {gauge.side!r}: a gauge {kind} has y instead")
    if gauge.y is None:
        raise InputError(f"{where}.y: missing; a gauge {kind} needs its distance from the centre line in m")
    if abs(gauge.y) > slab.width / 2.0:
        raise InputError(f"{where}.y = {gauge.y:g}: must be within half the slab's width, {slab.width / 2.0:g} m")
    index, x = slab_under(gauge.chainage, slab)
    if abs(x) > slab.length / 2.0:
        ends = [(index + 0.5) * slab.pitch + half * slab.length for half in (-0.5, 0.5)]
        raise InputError(
            f"{where}.chainage = {gauge.chainage:g}: lies in a joint; must be on a slab,"
            f" number {index} extends from {ends[0]:g} to {ends[1]:g} m"
        )
