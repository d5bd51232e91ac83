"""Slabs that a temperature gradient warps: parameters and curvature (MODEL §14).

A gradient T' from the upper to the lower side of a slab that is free to move bends it by alpha T' in both directions.
The upper side warmer, the middle rises and the corners sink; a colder upper side lifts the corners.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["SlabWarp", "check_slab_warps", "curvature_of"]

SlabIndex = Annotated[int, Field(ge=0)]


class SlabWarp(Params):
    """A temperature gradient in slabs since the rails were laid; where two overlap, their curvatures add.

    A bed that transmits no tension is needed (`mortar_no_tension`): slabs lift off where their weight does not hold
    them down, and the rails follow.
    """

    gradient: Annotated[
        float, Q("K/m", "temperature at the top less that at the bottom, over the thickness", ge=-200, le=200)
    ]
    expansion: Annotated[float, Q("1/K", "coefficient of thermal expansion of the slab", gt=0, le=3e-5)] = 1e-5
    slabs: Annotated[
        tuple[SlabIndex, SlabIndex] | None,
        Field(description="first and last; slab i lies between i and i + 1 slab pitches; all slabs if left out"),
    ] = None


def curvature_of(warps: Sequence[SlabWarp], slab: int) -> float:
    """Curvature of a slab that is free to move [1/m], positive with its middle up.

    Args:
        warps: Entries of the scenario.
        slab: Index of the slab.
    """
    return sum(
        warp.expansion * warp.gradient for warp in warps if warp.slabs is None or warp.slabs[0] <= slab <= warp.slabs[1]
    )


def check_slab_warps(warps: Sequence[SlabWarp], last_slab: int) -> None:
    """Refuse warped slabs that the run never reaches.

    Args:
        warps: Entries of the scenario.
        last_slab: Index of the last slab of the run.

    Raises:
        InputError: Names the entry, its value and the rule.
    """
    for i, warp in enumerate(warps):
        if warp.slabs is None:
            continue
        where = f"track.slab_warps[{i}].slabs = {list(warp.slabs)}"
        if warp.slabs[0] > warp.slabs[1]:
            raise InputError(f"{where}: must be [first, last] with first <= last")
        if warp.slabs[0] > last_slab:
            raise InputError(f"{where}: must begin between 0 and {last_slab}, the last slab of this run")
