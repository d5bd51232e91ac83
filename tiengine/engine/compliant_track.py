"""Track with rails in sines under steady loads, with the compliance of the sines left out at seats and wheels.

Beside the rails' coordinates q the forces f of the springs of all seats are unknowns, since they deflect the omitted
sines under themselves. With P and p the rows of the seats' stretch by the sines and what they pull, D the slabs'
compliance at the seats, H and h that of the omitted sines between seats and from wheels,

    K q + P^T f = loads,     f = p q - k D f - k H f + (k h - V c h') F

(the damper feels the convective rate of the wheels' part alone: a seat's own force hardly changes while it stands).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from tiengine.engine.sine_state import SineState
from tiengine.engine.static_track import Springs, seat_springs
from tiengine.kernels import layout as at
from tiengine.kernels.omitted_modes import BEFORE, NOW
from tiengine.model.omitted_tables import OmittedTables
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals

__all__ = ["CompliantTrack"]


class CompliantTrack:
    """Compliance of both rails on slabs; springs are ordered by seat, side and kind (vertical, rolling, lateral)."""

    def __init__(
        self, model: SineModel, tables: OmittedTables, state: SineState, first_seat_s: float, V: float, train: int = 0
    ) -> None:
        """Assemble and factorise; arguments as for ``StaticTrack``, and the tables of the omitted sines."""
        g, self.model, self.V = model.ingredients, model, V
        springs = seat_springs(model, state, first_seat_s, V, train)
        n, parts = g.modes, [springs[slab] for slab in sorted(springs)]
        self._s = first_seat_s + g.slab.fastening_pitch * np.arange(sum(len(part.stiffness) for part in parts) // 6)
        a, b = g.rail.arm_fastening, g.rail.half_base
        self._arms = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, b], [0.0, 1.0, -a]])  # kinds by w, v, theta_x
        self._tables = tables
        self._slots: dict[int, tuple[slice, Reals]] = {}
        on_slabs = la.block_diag(
            *(self._slab_compliance(state, slab, springs[slab], train) for slab in sorted(springs))
        )
        test, pull = (np.vstack([getattr(part, name) for part in parts]) for name in ("test", "pull"))
        k, c = (np.concatenate([getattr(part, name) for part in parts]) for name in ("stiffness", "damping"))
        rail = la.block_diag(model.window.vertical(V)[2].toarray(), model.window.lateral(V)[2].toarray())
        between = on_slabs + self._between_seats()
        K = np.block([[la.block_diag(rail, rail), test.T], [-pull, np.eye(len(k)) + k[:, None] * between]])
        self._lu = la.lu_factor(K)
        self._from_wheels, rate = self._from_places(slope=False), -V * self._from_places(slope=True)
        self._wheels_rate = rate
        W = len(g.wheel_s)
        place = np.zeros((2, 5, n, W, 2, 3))
        for side in range(2):
            place[side, [0, 2, 4], :, :, side, [0, 1, 2]] = model.wheel_shape[0].T
        felt = k[:, None] * self._by_spring(self._from_wheels) + c[:, None] * self._by_spring(rate)
        self._place = np.vstack([place.reshape(10 * n, -1), felt])
        self._compliance = self._under_wheels(la.lu_solve(self._lu, self._place))

    def under_wheels(self, force: Reals) -> Reals:
        """See :class:`tiengine.engine.steady.Track`."""
        flat = force.reshape(len(force), -1)
        under: Reals = np.einsum("wrfk,bk->bwrf", self._compliance, flat)
        return under

    def settled(self, force: Reals) -> None:
        """See :class:`tiengine.engine.steady.Track`; the bed of a track with sines transmits tension."""

    def motion(self, force: Reals) -> tuple[Reals, Reals, Reals]:
        """See :class:`tiengine.engine.steady.Track`."""
        n = self.model.ingredients.modes
        q = la.lu_solve(self._lu, self._place @ force.ravel())
        rails, springs = q[: 10 * n].reshape(2, -1), q[10 * n :]
        slabs = np.zeros((self.model.ingredients.slots, int(self.model.dims[at.SLAB_DOFS])))
        for slot, (part, answer) in self._slots.items():
            slabs[slot] = answer @ springs[part]
        return rails[:, : 2 * n], rails[:, 2 * n :], slabs

    def put_seats(self, state: SineState, force: Reals) -> None:
        """Give a state the forces of the seats and the motion of the omitted sines there, now and a step ago.

        Args:
            state: Of the same window.
            force: Forces on w, v, theta_x at the wheels, shape (W, 2, 3).
        """
        solved = la.lu_solve(self._lu, self._place @ force.ravel())[10 * self.model.ingredients.modes :]
        on_fields = solved.reshape(-1, 2, 3) @ self._arms  # seat, side, field
        here, dt = len(self._s), self.model.ingredients.newmark.dt
        moved = np.einsum("fjw,wrf->rfj", self._from_wheels, force) - np.einsum(
            "fji,irf->rfj", self._seat_matrix(), on_fields
        )
        rate = np.einsum("fjw,wrf->rfj", self._wheels_rate, force)
        state.seat_force[:, :, :, :here] = on_fields.transpose(1, 2, 0)
        state.omitted[:, :, :, :here, NOW], state.omitted[:, :, :, :here, BEFORE] = moved, moved - dt * rate

    def _slab_compliance(self, state: SineState, slab: int, springs: Springs, train: int) -> Reals:
        """Compliance of a slab between its springs, zero on rigid ground; notes the slab's answer to them."""
        g, count = self.model.ingredients, len(springs.stiffness)
        first = sum(part.stop - part.start for part, _ in self._slots.values())
        if slab >= state.first_slab + g.slots:
            return np.zeros((count, count))
        design = g.designs.matrices[state.design[train, slab % g.slots]]
        answer = la.solve(design.K_plate + design.K_bed, springs.slab.T, assume_a="pos")
        self._slots[slab % g.slots] = (slice(first, first + count), answer)
        compliance: Reals = springs.slab @ answer
        return compliance

    def _seat_matrix(self) -> Reals:
        """Compliance of the omitted sines between seats, shape (3, seats, seats)."""
        return self._tables.modes.compliance(np.subtract.outer(self._s, self._s), 2)

    def _between_seats(self) -> Reals:
        """The same between springs."""
        count = 6 * len(self._s)
        fields = np.einsum("kf,fji,lf->jkil", self._arms, self._seat_matrix(), self._arms)
        between = np.zeros((len(self._s), 2, 3, len(self._s), 2, 3))
        for side in range(2):
            between[:, side, :, :, side] = fields
        return between.reshape(count, count)

    def _from_places(self, *, slope: bool) -> Reals:
        """Compliance from wheels to seats, or its slope along the rail at the seat, shape (3, seats, W)."""
        apart = np.subtract.outer(self._s, self._tables.wheel_s)
        return self._tables.modes.slope(apart, 1) if slope else self._tables.modes.compliance(apart, 1)

    def _by_spring(self, fields: Reals) -> Reals:
        """Stretch of the springs by forces on w, v, theta_x at the wheels, shape (6 seats, 6 W)."""
        _, seats, W = fields.shape
        found = np.zeros((seats, 2, 3, W, 2, 3))
        for side in range(2):
            found[:, side, :, :, side] = np.einsum("kf,fjw->jkwf", self._arms, fields)
        return found.reshape(6 * seats, 6 * W)

    def _under_wheels(self, q: Reals) -> Reals:
        """w, v, theta_x, slopes and rates under the wheels by unit forces there, shape (W, 2, 9, 6 W)."""
        model, n = self.model, self.model.ingredients.modes
        fields, springs = q[: 10 * n].reshape(2, 5, n, -1)[:, [0, 2, 4]], q[10 * n :]
        value, slope = (np.einsum("wn,rfnk->wrfk", model.wheel_shape[kind], fields) for kind in (0, 1))
        value = value - (self._by_spring(self._from_wheels).T @ springs).reshape(value.shape)
        W = value.shape[0]
        own: NDArray[np.float64] = self._tables.by_place + np.einsum(
            "f,wk->fwk", model.constants[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1], np.eye(W)
        )
        direct = np.zeros((W, 2, 3, W, 2, 3))
        for side in range(2):
            for field in range(3):
                direct[:, side, field, :, side, field] = own[field]
        return np.concatenate([value + direct.reshape(value.shape), slope, np.zeros_like(value)], axis=2)
