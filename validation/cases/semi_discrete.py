"""The engine's semi-discrete equations as one first-order system, for general-purpose ODE solvers.

Written with matrices, independently of the step and its kernels, for either kind of trial functions: linear parts from
the host's M, C, K; fastenings as springs and dampers between a rail's shape at the moving seat and a slab's shape; only
the wheel-rail contact and the nonlinear suspension elements are evaluated by the engine's kernels. y = (u, du/dt),
u = (rails, slabs, vehicle), where a rail's coordinates are (w, theta_y) function by function, then (v, theta_z,
theta_x) function by function, n functions a field.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from tiengine.engine.equilibrium import ContactForces, evaluate_contact
from tiengine.engine.state import DISPLACEMENT, VELOCITY, State
from tiengine.irregularity.irregularity import Irregularity
from tiengine.kernels.suspension import suspension_forces
from tiengine.model.constant_data import Model
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals

NUDGE = np.concatenate([np.full(5, 1e-9), np.full(5, 1e-7), np.full(18, 1e-9)])
"""Steps for the contact's derivatives: wheelset u and du/dt, then w, v, theta_x, slopes, rates of either rail."""


class SemiDiscrete:
    """M u'' + C u' + K u + fastenings(t, u, u') = gravity + suspension + contact(t, u, u'); one train, constant V."""

    def __init__(self, model: Model, track: Irregularity, V: float, slabs: range) -> None:
        """Assemble.

        Args:
            model: Source of the matrices.
            track: Irregularity.
            V: Speed [m/s].
            slabs: All slabs that the window touches, from its beginning to its end.
        """
        self.model, self.track, self.V, self.slabs = model, track, V, slabs
        g = model.ingredients
        sound, train = g.designs.matrices[0], g.train
        rail = [
            la.block_diag(*(m.toarray() for m in pair))
            for pair in zip(g.operators.vertical(V), g.operators.lateral(V), strict=True)
        ]
        slab = [sound.M, sound.C_bed, sound.K_plate + sound.K_bed]
        vehicle = [train.M, train.C + V * train.C_speed, train.K]
        self.M, self.C, self.K = (
            la.block_diag(r, r, *[s] * len(slabs), v) for r, s, v in zip(rail, slab, vehicle, strict=True)
        )
        self.inverse = la.block_diag(*[la.inv(x) for x in (rail[0], rail[0], *[slab[0]] * len(slabs), vehicle[0])])
        functions = g.functions.count
        self.n, self.slab_dofs = len(self.M), sound.n
        self.first_slab_dof = 10 * functions
        one, three = 2 * np.arange(functions), 2 * functions + 3 * np.arange(functions)
        rail_fields = np.stack([one, three, three + 2])
        self.field = np.stack([rail_fields, 5 * functions + rail_fields])  # coordinates of w, v, theta_x by side
        self.wheel_shape = [g.functions.shape(g.wheel_s, derivative) for derivative in (0, 1)]
        self.first_vehicle_dof = self.n - train.n
        self.dof = self.first_vehicle_dof + train.wheelset_dof
        self._seats()

    def _seats(self) -> None:
        """The slabs' side of every fastening that can stand in the window, and stiffness and damping."""
        g, sound = self.model.ingredients, self.model.ingredients.designs.matrices[0]
        f, b = g.fastening, g.rail.half_base
        self.seats = np.arange(self.slabs.start * g.slab.fastenings, self.slabs.stop * g.slab.fastenings)
        self.on_slab = np.zeros((len(self.seats), 2, 3, self.n))
        for i, seat in enumerate(self.seats):
            slab, j = divmod(int(seat), g.slab.fastenings)
            base = self.first_slab_dof + (slab - self.slabs.start) * self.slab_dofs
            for side in range(2):
                np.add.at(self.on_slab[i, side, 0], base + sound.seat_index[j, side], sound.seat_w[j, side])
                np.add.at(self.on_slab[i, side, 1], base + sound.seat_index[j, side], b * sound.seat_slope[j, side])
                self.on_slab[i, side, 2, base + self.slab_dofs - 2 : base + self.slab_dofs] = 1.0, sound.seat_x[j]
        self.k = np.array([f.vertical_stiffness, f.vertical_stiffness, f.lateral_stiffness])
        self.arms = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, b], [0.0, 1.0, -g.rail.arm_fastening]])  # on w, v, theta_x
        self.c = np.array([f.vertical_damping, f.vertical_damping, f.lateral_damping])

    def shapes(self, t: float) -> tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]]:
        """Which seats stand in the window at time t, the rails' shape there and its rate -V d/ds."""
        g = self.model.ingredients
        s: Reals = np.asarray((self.seats + 0.5) * g.slab.fastening_pitch - self.V * t, dtype=np.float64)
        here = (s > -g.seat_reach) & (s < g.length + g.seat_reach)
        value, slope = (g.functions.shape(s[here], d, g.fastening.length) for d in (0, 1))
        return here, value, -self.V * slope

    def fastening_forces(self, t: float, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Generalised forces of all fastenings, shape (n,)."""
        here, phi, rate = self.shapes(t)
        rail_u, rail_v = u[self.field], v[self.field]
        W, D = phi @ rail_u.swapaxes(1, 2), phi @ rail_v.swapaxes(1, 2) + rate @ rail_u.swapaxes(1, 2)
        on_slab = self.on_slab[here][..., self.first_slab_dof : self.first_vehicle_dof].reshape(
            -1, self.first_vehicle_dof - self.first_slab_dof
        )
        slab_u, slab_v = ((on_slab @ x[self.first_slab_dof : self.first_vehicle_dof]).reshape(-1, 2, 3) for x in (u, v))
        e = (W @ self.arms.T).swapaxes(0, 1) - slab_u
        de = (D @ self.arms.T).swapaxes(0, 1) - slab_v
        force = self.k * e + self.c * de
        out = np.zeros(self.n)
        out[self.field] = -np.einsum("srm,mf,sn->rfn", force, self.arms, phi)
        out[self.first_slab_dof : self.first_vehicle_dof] = force.ravel() @ on_slab
        return out

    def fastenings(self, t: float) -> tuple[NDArray[np.float64], ...]:
        """Fastenings as matrices: elongations E u, their rates E u' + F u; with k and c by row."""
        here, phi, rate = self.shapes(t)
        E = -self.on_slab[here]
        F = np.zeros_like(E)
        for side in range(2):
            for kind, field in np.argwhere(self.arms):
                place, arm = self.field[side, field], self.arms[kind, field]
                E[:, side, kind, place] = arm * phi
                F[:, side, kind, place] = arm * rate
        rows = 2 * len(phi)
        return E.reshape(-1, self.n), F.reshape(-1, self.n), np.tile(self.k, rows), np.tile(self.c, rows)

    def under_wheels(self, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """w, v, theta_x, their slopes and rates of the rails under the wheels, shape (W, 2, 9)."""
        value, slope = self.wheel_shape
        rails = [x[self.field] for x in (u, v)]
        parts = [np.einsum("wn,rfn->wrf", a, x) for a, x in ((value, rails[0]), (slope, rails[0]), (value, rails[1]))]
        return np.concatenate(parts, axis=2)

    def contact(self, t: float, y: NDArray[np.float64]) -> ContactForces:
        """Contact of all wheels."""
        u, v = y[: self.n], y[self.n :]
        return self._contact(t, u[self.dof][None], v[self.dof][None], self.under_wheels(u, v)[None])

    def _contact(self, t: float, *motion: NDArray[np.float64]) -> ContactForces:
        channels = self.track.sample(self.V * t + self.model.ingredients.wheel_s)
        return evaluate_contact(self.model, self.V, channels, *motion)

    def rhs(self, t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """dy/dt."""
        u, v = y[: self.n], y[self.n :]
        f = self.fastening_forces(t, u, v) - self.C @ v - self.K @ u
        found = self.contact(t, y)
        np.add.at(f, self.dof, found.wheelset[0])
        f[: self.first_slab_dof] += self._on_rails(found.rail[0])
        f[self.first_vehicle_dof :] += self._on_vehicle(u[self.first_vehicle_dof :], v[self.first_vehicle_dof :])
        return np.concatenate([v, self.inverse @ f])

    def _on_rails(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Generalised forces of wheels on the rails, from forces on w, v, theta_x, shape (W, 2, 3)."""
        out = np.zeros(self.first_slab_dof)
        out[self.field] = np.einsum("wn,wrf->rfn", self.wheel_shape[0], force)
        return out

    def _on_vehicle(self, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gravity, nonlinear suspension, gyroscopic pair of the pitch rates."""
        train = self.model.ingredients.train
        motion = np.stack([u, v, train.gravity])
        suspension_forces(
            train.n, train.element_index, train.element_row, train.element_kind, train.element_linear,
            train.element_table, np.zeros(len(train.element_kind)), motion,
        )  # fmt: skip
        roll, pitch, yaw = train.wheelset_dof[:, 2:].T
        motion[2, roll] += train.wheelset_spin_inertia * v[pitch] * v[yaw]
        motion[2, yaw] -= train.wheelset_spin_inertia * v[pitch] * v[roll]
        return motion[2]

    def jacobian(self, t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivative of the right-hand side by y without the nonlinear suspension; a solver needs it to converge."""
        u, v, n = y[: self.n], y[self.n :], self.n
        E, F, k, c = self.fastenings(t)
        by_u = -self.K - E.T @ (k[:, None] * E + c[:, None] * F)
        by_v = -self.C - E.T @ (c[:, None] * E)
        for w, (J, inputs) in enumerate(zip(self._contact_derivatives(t, u, v), self._inputs(), strict=True)):
            place = np.zeros((n, 11))
            place[self.dof[w], np.arange(5)] = 1.0
            for side in range(2):
                for m in range(3):
                    place[self.field[side, m], 5 + 3 * side + m] = self.wheel_shape[0][w]
            by_u += place @ (J @ inputs[0])
            by_v += place @ (J @ inputs[1])
        return np.block([[np.zeros((n, n)), np.eye(n)], [self.inverse @ by_u, self.inverse @ by_v]])

    def _contact_derivatives(self, t: float, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces on wheelset (5) and rails (2, 3) by the 28 inputs of :meth:`_inputs`, shape (W, 11, 28)."""
        W = len(self.dof)
        base = np.concatenate([u[self.dof], v[self.dof], self.under_wheels(u, v).reshape(W, 18)], axis=1)
        nudge = np.diag(NUDGE)
        trials = base + np.concatenate([nudge, -nudge])[:, None, :]
        found = self._contact(t, trials[..., :5], trials[..., 5:10], trials[..., 10:].reshape(56, W, 2, 9))
        force = np.concatenate([found.wheelset, found.rail.reshape(56, W, 6)], axis=2)
        return np.einsum("kwm->wmk", (force[:28] - force[28:]) / (2.0 * NUDGE)[:, None, None])

    def _inputs(self) -> list[NDArray[np.float64]]:
        """Inputs of a wheelset's contact as linear functions of u and v, shape (2, 28, n) per wheelset."""
        out = []
        for w in range(len(self.dof)):
            rows = np.zeros((2, 28, self.n))
            rows[0, np.arange(5), self.dof[w]] = rows[1, 5 + np.arange(5), self.dof[w]] = 1.0
            for side in range(2):
                for m in range(3):
                    place = self.field[side, m]
                    rows[0, 10 + 9 * side + m, place] = rows[1, 16 + 9 * side + m, place] = self.wheel_shape[0][w]
                    rows[0, 13 + 9 * side + m, place] = self.wheel_shape[1][w]
            out.append(rows)
        return out

    def pack(self, state: State) -> NDArray[np.float64]:
        """The y of an engine's state whose window begins at the first of the slabs."""
        parts = {name: state.part(0, name) for name in ("vertical", "lateral", "slabs", "vehicles")}
        if isinstance(self.model, SineModel):  # whose coordinates stand field by field
            for name, fields in (("vertical", 2), ("lateral", 3)):
                by_field = parts[name].reshape(len(parts[name]), 2, fields, -1)
                parts[name] = by_field.swapaxes(2, 3).reshape(parts[name].shape)
        halves = []
        for row in (DISPLACEMENT, VELOCITY):
            vertical, lateral, slots, vehicle = (parts[name][row] for name in parts)
            slabs = [slots[slab % len(slots)] for slab in self.slabs]
            halves += [np.hstack([vertical, lateral]).ravel(), *slabs, vehicle]
        return np.concatenate(halves)
