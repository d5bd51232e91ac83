"""Ground that has settled or heaved under the slabs: its shape (MODEL §14)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["Settlement", "check_settlements", "ground_shape"]


class Settlement(Params):
    """A settlement of the ground under the slabs, or a heave; it is symmetrical about its middle.

    `cosine` is one wave depth (1 + cos)/2; `angles` are two straight ramps that meet in the middle, as where a pier has
    sunk between its neighbours. Slabs and rails follow with their stiffness; on a
    bed that transmits no tension slabs may bridge a part of it and leave a gap.
    """

    kind: Annotated[Literal["cosine", "angles"], Field(description="shape")]
    at: Annotated[float, Q("m", "chainage of the middle", ge=0, le=1e7)]
    length: Annotated[float, Q("m", "length of the whole settlement", ge=1, le=500)]
    depth: Annotated[float, Q("m", "depth in the middle; negative for a heave", ge=-0.2, le=0.2)]

    @property
    def reach(self) -> tuple[float, float]:
        """Chainage of its ends [m]."""
        return self.at - 0.5 * self.length, self.at + 0.5 * self.length


def ground_shape(settlement: Settlement, x: Reals) -> Reals:
    """Displacement z_g of the ground at chainages [m], down positive, shape as x.

    Args:
        settlement: The settlement.
        x: Chainages [m].
    """
    t = np.minimum(np.abs(x - settlement.at) / (0.5 * settlement.length), 1.0)
    form = 0.5 * (1.0 + np.cos(np.pi * t)) if settlement.kind == "cosine" else 1.0 - t
    return settlement.depth * form


def check_settlements(settlements: Sequence[Settlement], *, begin: float, end: float) -> None:
    """Refuse settlements that no wheel reaches.

    Args:
        settlements: Entries of the scenario.
        begin: Chainage of the leading wheel at the start [m].
        end: Its chainage at the end of the run [m].

    Raises:
        InputError: Names the entry, its value and the rule.
    """
    for i, each in enumerate(settlements):
        rear, front = each.reach
        if front <= begin or rear >= end:
            raise InputError(
                f"track.settlements[{i}].at = {each.at:g}: must lie between {begin:g} and {end:g} m, which the leading"
                " wheel covers in this run"
            )
