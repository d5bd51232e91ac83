"""Bending moments of all slabs in memory, from their motion and the forces of their seats."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.state import ACCELERATION, DISPLACEMENT, VELOCITY
from tiengine.engine.stepper import Stepper
from tiengine.parameters.arrays import Reals
from tiengine.track.slab_moments import moment_table

__all__ = ["SlabMoments"]


class SlabMoments:
    """Reads moments off a stepper."""

    def __init__(self, stepper: Stepper) -> None:
        """Make the tables that the track needs."""
        g = stepper.ingredients
        designs, rectangle = g.designs.matrices, g.fastening.baseplate
        self._stepper = stepper
        self._factor = np.stack([design.bed_factor.ravel() for design in designs])
        self._rest = np.stack([design.bed_weight_pressure.ravel() for design in designs])
        self._linear = not g.mortar.no_tension
        self._odd = np.any(self._factor != 1.0, axis=1) | (not self._linear)
        self._sound = moment_table(g.slab, g.mortar, rectangle)
        self._by_pressure = moment_table(g.slab, None, rectangle) if self._odd.any() else self._sound

    @property
    def points(self) -> int:
        """Places of a slab."""
        return int(self._sound.places.shape[1])

    def read(self, moments_out: Reals) -> None:
        """M_x, then M_y of all slots at the last step [N m/m], shape (B, slots, 2 points)."""
        state, designs = self._stepper.state, self._designs()
        loads = [_forces_on_slabs(self._stepper), state.slab_motion(ACCELERATION), state.slab_motion(VELOCITY)]
        moments_out[:] = np.concatenate(loads, axis=2) @ self._sound.matrix
        odd = np.flatnonzero(self._odd[designs])
        if len(odd):
            loads[2] = self._pressure(designs)
            moments_out[:, odd] = np.concatenate(loads, axis=2)[:, odd] @ self._by_pressure.matrix

    def _pressure(self, designs: NDArray[np.int64]) -> Reals:
        """Pressure of the bed beyond that at rest at its quadrature points [Pa], shape (B, slots, points).

        Args:
            designs: Design of the slab in each slot, shape (slots,).
        """
        state, g = self._stepper.state, self._stepper.ingredients
        felt = g.mortar.stiffness * state.slab_motion(DISPLACEMENT) + g.mortar.damping * state.slab_motion(VELOCITY)
        first = g.designs.matrices[0]
        at_points = np.einsum("bsei,qi->bseq", felt[..., first.bed_index], first.bed_shape)
        pressure: Reals = self._factor[designs] * at_points.reshape(*felt.shape[:2], -1)
        if self._linear:
            return pressure
        rest = self._rest[designs]
        return np.maximum(rest + pressure, 0.0) - np.maximum(rest, 0.0)

    def _designs(self) -> NDArray[np.int64]:
        """Design of the slab in each slot, shape (slots,)."""
        state, of_slab = self._stepper.state, self._stepper.ingredients.designs.of_slab
        designs = np.zeros(state.slots, dtype=np.int64)
        for slab in range(state.first_slab, state.first_slab + state.slots):
            designs[slab % state.slots] = of_slab.get(slab, 0)
        return designs


def _forces_on_slabs(stepper: Stepper) -> Reals:
    """F_V left and right, M_b left and right of the seats of each slab, shape (B, slots, 4 seats per slab)."""
    state, g = stepper.state, stepper.ingredients
    vertical, lateral, roll = np.moveaxis(state.seat_forces, 2, 0)  # (B, 2, seats) each
    couple = roll + g.rail.arm_fastening * lateral
    per_slab, slots = g.slab.fastenings, state.slots
    slab, seat = np.divmod(state.first_seat + np.arange(vertical.shape[2]), per_slab)
    here = (slab >= state.first_slab) & (slab < state.first_slab + slots)
    forces = np.zeros((len(vertical), slots, 2, 2, per_slab))
    # seats come first in the result of indexing with two lists
    by_seat = np.stack([vertical, couple], axis=1)[..., here].transpose(3, 0, 1, 2)
    forces[:, slab[here] % slots, :, :, seat[here]] = by_seat
    return forces.reshape(len(vertical), slots, -1)
