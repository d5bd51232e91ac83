"""Tables of the compliance of the sines left out, as :mod:`tiengine.kernels.omitted_modes` reads them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiengine.kernels.omitted_modes import SPACING
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Reals
from tiengine.track.omitted_modes import REACH, OmittedModes

__all__ = ["OmittedTables"]


@dataclass(frozen=True, eq=False)
class OmittedTables:
    """Compliance in w, v, theta_x.

    Attributes:
        modes: The sines left out.
        by_wheel: Between a seat and a wheel every ``SPACING`` of their distance, shape (3, points).
        by_seat: Between seats a number of pitches apart, 0 for a seat's own, shape (3, pitches).
        by_place: Between the wheels, without their own, shape (3, W, W).
        wheel_s: Wheels in the window [m], shape (W,).
    """

    modes: OmittedModes
    by_wheel: Reals
    by_seat: Reals
    by_place: Reals
    wheel_s: Reals

    @classmethod
    def of(cls, ingredients: Ingredients) -> OmittedTables:
        """Tabulate."""
        g, d, s = ingredients, ingredients.slab.fastening_pitch, np.ascontiguousarray(ingredients.wheel_s)
        modes = OmittedModes(g.rail, g.length, g.modes, g.fastening.length)
        apart = np.subtract.outer(s, s)
        return cls(
            modes=modes,
            by_wheel=np.ascontiguousarray(modes.compliance(np.arange(0.0, REACH + 2.0 * SPACING, SPACING), 1)),
            by_seat=np.ascontiguousarray(modes.compliance(np.arange(0.0, REACH + d, d), 2)),
            by_place=np.ascontiguousarray(modes.compliance(apart, 0) * (1.0 - np.eye(len(s)))),
            wheel_s=s,
        )
