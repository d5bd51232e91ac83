"""A pass of the spline step in NumPy, matrix by matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from tiengine.kernels import layout as at
from tiengine.kernels import spline_layout as sl
from tiengine.kernels.spline_seats import FACTOR
from tiengine.track.slab_matrices import seat_shapes

from .spline_bed import Bed

Floats = NDArray[np.float64]


@dataclass(eq=False)
class Motion:
    """u, v, a of one train: rails (2, n, 5), slabs (slots, N), train (n,)."""

    rails: Floats
    slabs: Floats
    train: Floats


def motion_of(bed: Bed, b: int) -> Motion:
    """The present state of train b, rows u, v, a first in every array."""
    s = bed.state
    rows = (sl.U, sl.V, sl.A)
    slots = bed.model.ingredients.slots
    return Motion(
        np.stack([s.rails(row)[b] for row in rows]),
        np.stack([s.slabs(row)[b].reshape(-1, s.slab_dofs)[:slots] for row in rows]),
        np.stack([s.vehicles(row)[b] for row in rows]),
    )


def reference_pass(
    bed: Bed, b: int, start: Motion, iterate: Motion | None, rail_force: Floats, wheelset_force: Floats, k: int = 0
) -> Motion:
    """One pass of step k by dense algebra, with given contact forces.

    Args:
        bed: The parts.
        b: Train, for the factors of its fastenings and the designs of its slabs.
        start: State at t_n.
        iterate: State after the pass before; None in the first pass.
        rail_force: On w, v, theta_x under the wheels, shape (W, 2, 3).
        wheelset_force: On y, z, roll, pitch, yaw, shape (W, 5).
        k: Step.
    """
    given, c, train = bed.model.ingredients, bed.model.constants, bed.model.ingredients.train
    newmark = given.newmark
    P = newmark.predictor
    tilde = Motion(*(np.tensordot(P, rows, 1) for rows in (start.rails, start.slabs, start.train)))
    at_iterate = iterate or Motion(
        *(np.concatenate([rows, 0 * rows[:1]]) for rows in (tilde.rails, tilde.slabs, tilde.train))
    )
    spline = BSpline(bed.rail.knots, np.eye(bed.rail.n), 3)
    slope_of = spline.derivative()
    seat_map = seat_shapes(given.designs.matrices[0]).reshape(bed.state.slab_dofs, 5, -1)
    kv, cv, kl, cl = (c[i] for i in (at.K_VERTICAL, at.C_VERTICAL, at.K_LATERAL, at.C_LATERAL))
    arm, b2 = c[at.ARM_FASTENING], c[at.HALF_BASE] ** 2
    n, slots, per_slab = bed.rail.n, given.slots, given.slab.fastenings
    x_gauss, w_gauss = bed.seats.point.T
    factors = bed.state.seats(FACTOR, 1)[b, :, 0]
    designs = bed.state.slab_design.reshape(bed.state._whole, -1)[b]
    F_rail = np.zeros((2, n, 5))
    F_slab = np.zeros((slots, bed.state.slab_dofs))
    forces = np.zeros((2, 3, len(bed.seats.place)))
    for j in range(len(bed.seats.place)):
        s = bed.clock[k, at.FIRST_SEAT_S] + j * c[at.SPACING]
        inside = (s + x_gauss >= 0.0) & (s + x_gauss <= given.length)
        if not inside.any():
            continue
        N = w_gauss[inside] @ spline(s + x_gauss[inside])
        D = w_gauss[inside] @ slope_of(s + x_gauss[inside])
        index = int(bed.clock[k, at.FIRST_SEAT]) + j
        slab, seat = divmod(index, per_slab)
        slot = slab % slots
        first_slab = int(bed.clock[k, at.FIRST_SLAB])
        modelled = first_slab <= slab < first_slab + slots
        zone, away = c[at.ABSORBING_ZONE], max(0.0, min(s, given.length - s))
        depth = max(0.0, zone - away) / zone if zone > 0.0 else 0.0
        for r in range(2):
            u, v = N @ at_iterate.rails[0, r], N @ at_iterate.rails[1, r] - bed.V * (D @ at_iterate.rails[0, r])
            V_pull = kv * u[0] + cv * v[0]
            L_pull = kl * (u[2] - arm * u[4]) + cl * (v[2] - arm * v[4])
            M_pull = b2 * (kv * u[4] + cv * v[4])
            rail = np.array([V_pull, L_pull, M_pull])
            ground = []
            for of in (tilde, at_iterate):
                motion = np.stack([seat_map[:, :, seat].T @ of.slabs[m, slot] for m in range(2)]) * modelled
                ground.append(
                    [
                        kv * motion[0, r] + cv * motion[1, r],
                        kl * motion[0, 4] + cl * motion[1, 4],
                        b2 * (kv * motion[0, 2 + r] + cv * motion[1, 2 + r]),
                    ]
                )
            on_slab = factors[r, j] * (rail - ground[0])
            F = factors[r, j] * (rail - ground[1]) + depth**2 * rail
            forces[r, :, j] = F[0], F[1], F[2] - arm * F[1]
            F_rail[r, :, 0] -= N * F[0]
            F_rail[r, :, 2] -= N * F[1]
            F_rail[r, :, 4] -= N * (F[2] - arm * F[1])
            if modelled:
                maps = seat_map[:, :, seat]
                F_slab[slot] += maps[:, r] * on_slab[0] + maps[:, 4] * on_slab[1] + maps[:, 2 + r] * on_slab[2]
    for w, s in enumerate(bed.wheel_s):
        N = spline(s)
        for r in range(2):
            for m, field in enumerate((0, 2, 4)):
                F_rail[r, :, field] += N * rail_force[w, r, m]
    a_rail = np.zeros((2, n, 5))
    for block, fields in ((bed.rail.vertical, slice(0, 2)), (bed.rail.lateral, slice(2, 5))):
        A = block.operator(newmark.beta_dt2, newmark.gamma_dt).toarray()
        free = np.setdiff1d(np.arange(len(A)), block.held)
        for r in range(2):
            u, v, a = (m[r, :, fields].ravel() for m in (tilde.rails[0], tilde.rails[1], at_iterate.rails[2]))
            F = F_rail[r, :, fields].ravel() - block.C @ v - block.K @ u + block.A_s @ a
            x = np.zeros(len(A))
            x[free] = np.linalg.solve(A[np.ix_(free, free)], F[free])
            a_rail[r, :, fields] = x.reshape(n, -1)
    a_slab = np.zeros_like(F_slab)
    for slot in range(slots):
        A, K, C = bed.designs[int(designs[slot])]
        a_slab[slot] = np.linalg.solve(A, F_slab[slot] - K @ tilde.slabs[0, slot] - C @ tilde.slabs[1, slot])
    F = train.gravity + 0.0
    v = at_iterate.train[1]
    for w, dof in enumerate(train.wheelset_dof):
        F[dof] += wheelset_force[w]
        J = train.wheelset_spin_inertia[w]
        F[dof[2]] += J * v[dof[3]] * v[dof[4]]
        F[dof[4]] -= J * v[dof[3]] * v[dof[2]]
    for e in range(len(train.element_kind)):
        q = train.element_row[e] @ at_iterate.train[1 - train.element_kind[e], train.element_index[e]]
        points = train.element_table[e]
        last = (points[-1, 1] - points[-2, 1]) / (points[-1, 0] - points[-2, 0])
        force = np.interp(abs(q), points[:, 0], points[:, 1]) + last * max(0.0, abs(q) - points[-1, 0])
        np.subtract.at(
            F, train.element_index[e], train.element_row[e] * (np.sign(q) * force - train.element_linear[e] * q)
        )
    C = train.C + bed.V * train.C_speed
    A = train.M + newmark.gamma_dt * C + newmark.beta_dt2 * train.K
    a_train = np.linalg.solve(A, F - C @ tilde.train[1] - train.K @ tilde.train[0])
    return Motion(
        *(
            np.stack([t[0] + newmark.beta_dt2 * a, t[1] + newmark.gamma_dt * a, a])
            for t, a in ((tilde.rails, a_rail), (tilde.slabs, a_slab), (tilde.train, a_train))
        )
    )
