"""Inertia forces of rails and slabs on ground that moves in time.

Rails and slabs are measured from the ground, as the train is. On moving ground each feels -rho A a and -rho h a per
length and area, a being the acceleration of the ground under it. Slabs take that of their middle, rails that under each
of their trial functions: waves of the ground are much longer than either.
"""

from __future__ import annotations

import numpy as np

from tiengine.engine.window import slabs_in_slots
from tiengine.irregularity.base_motion import GroundRecord
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Reals
from tiengine.track.splines import Splines

__all__ = ["MovingGround"]

POINTS = 4  # Gauss points a span between knots


class MovingGround:
    """Inertia forces by the motion of the ground, for rails in splines.

    Attributes:
        record: Motion of the ground.
        rail_mass: Of each trial function, shape (n,) [kg].
        rail_s: Its middle in the window [m], shape (n,).
        slab_inertia: Force on a slab's coordinates by unit acceleration of the ground, against it, shape (N,).
    """

    def __init__(self, record: GroundRecord, ingredients: Ingredients) -> None:
        """Integrate the trial functions.

        Args:
            record: Motion of the ground.
            ingredients: Track and window.
        """
        functions = ingredients.functions
        assert isinstance(functions, Splines)
        self.record, self._slab, self._slots = record, ingredients.slab, ingredients.slots
        node, weight = np.polynomial.legendre.leggauss(POINTS)
        rear, span = functions.knots[:-1, None], np.diff(functions.knots)[:, None]
        s = (rear + 0.5 * span * (1.0 + node)).ravel()
        shape = (0.5 * span * weight).reshape(-1, 1) * functions.shape(s)
        area = shape.sum(axis=0)
        self.rail_mass, self.rail_s = ingredients.rail.mass_per_length * area, (s @ shape) / area
        matrices = ingredients.designs.matrices[0]
        down = np.zeros(matrices.n)
        down[:-2:3] = 1.0
        self.slab_inertia: Reals = matrices.M @ down
        self.slab_inertia[-2] = matrices.M[-2, -2]

    def on_rails(self, time: Reals, X: Reals) -> Reals:
        """Forces on w of all functions, then on v, shape (steps, 2 n).

        Args:
            time: Ends of the steps since the start of the run [s], shape (steps,).
            X: Chainage of the window's rear end then [m].
        """
        a = self._acceleration(time, X[:, None] + self.rail_s)
        return np.concatenate([-self.rail_mass * a[..., 0], -self.rail_mass * a[..., 1]], axis=1)

    def under_slabs(self, time: Reals, rear_slab: Reals) -> Reals:
        """Acceleration of the ground under the slab in each slot, down and to the right, shape (steps, slots, 2).

        Args:
            time: Ends of the steps since the start of the run [s], shape (steps,).
            rear_slab: Index of the rear slab then, shape (steps,).
        """
        slab = slabs_in_slots(rear_slab.astype(np.int64), self._slots)
        return self._acceleration(time, np.asarray((slab + 0.5) * self._slab.pitch, np.float64))

    def _acceleration(self, time: Reals, x: Reals) -> Reals:
        """Acceleration of the ground at chainages [m] of shape (steps, m), shape (steps, m, 2)."""
        if self.record.motion.wave_speed is None:
            alike = self.record.at(time, 2)[:, None]
            return np.asarray(np.broadcast_to(alike, (*x.shape, 2)), np.float64)
        return self.record.at(time[:, None] - self.record.delay(x), 2)
