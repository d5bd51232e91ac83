"""Bending moments of all slabs in memory from their recorded motion."""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.engine.bed_pressure import designs_in_slots
from tiengine.engine.window import slabs_in_slots
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Reals
from tiengine.track.slab_moments import moment_table, moments_of_motion, moments_of_pressure, pressures_felt

__all__ = ["SlabMoments"]


class SlabMoments:
    """Operators of the slabs' designs; that of a design with voids is made when it is first met."""

    def __init__(self, ingredients: Ingredients) -> None:
        """Make the table of a sound slab."""
        self._given = ingredients
        self._sound = moment_table(ingredients.slab, ingredients.mortar, ingredients.fastening.baseplate)
        self._operator = cache(self._operator_of)
        self._of_pressure = cache(
            lambda design: moments_of_pressure(
                ingredients.slab, ingredients.designs.matrices[design], self._by_pressure()
            )
        )
        self._by_pressure = cache(lambda: moment_table(ingredients.slab, None, ingredients.fastening.baseplate))

    @property
    def points(self) -> int:
        """Places of a slab."""
        return int(self._sound.places.shape[1])

    def of(self, rear: int, motion: Reals) -> Reals:
        """M_x, then M_y [N m/m], shape (rows, slots, 2 points).

        Args:
            rear: Rear slab in memory.
            motion: Displacement, velocity, acceleration of the slabs' coordinates, shape (rows, 3, slots, dofs).
        """
        rows, _, slots, dofs = motion.shape
        designs = designs_in_slots(self._given.designs.of_slab, np.array([rear]), slots)[0]
        slabs = slabs_in_slots(np.array([rear]), slots)[0]
        moments = np.empty((rows, slots, 2 * self.points))
        for design in np.unique(designs).tolist():
            here = np.flatnonzero(designs == design)
            part = motion[:, :, here].transpose(0, 2, 1, 3).reshape(rows * len(here), 3 * dofs)
            values = part @ self._operator(design)
            if self._given.mortar.no_tension:
                rest = np.stack([self._given.pressure_at_rest(int(slab)).ravel() for slab in slabs[here]])
                values += self._beyond_linear(design, part, np.tile(rest, (rows, 1))) @ self._of_pressure(design)
            moments[:, here] = values.reshape(rows, len(here), -1)
        return moments

    def _operator_of(self, design: int) -> Reals:
        """Operator of a design from (u, v, a), shape (3 dofs, 2 points)."""
        g = self._given
        matrices = g.designs.matrices[design]
        free = self._by_pressure() if g.mortar.no_tension or np.any(matrices.bed_factor != 1.0) else None
        operator = moments_of_motion(g.slab, g.mortar, matrices, self._sound, free)
        return operator.reshape(-1, operator.shape[2])

    def _beyond_linear(self, design: int, motion: Reals, rest: Reals) -> Reals:
        """Pressure of a bed without tension less that of the linear bed [Pa], shape (samples, points) as ``rest``."""
        mortar, matrices = self._given.mortar, self._given.designs.matrices[design]
        u, v, _ = np.split(motion, 3, axis=1)
        linear = (mortar.stiffness * u + mortar.damping * v) @ pressures_felt(matrices)
        beyond: Reals = np.maximum(rest + linear, 0.0) - np.maximum(rest, 0.0) - linear
        return beyond
