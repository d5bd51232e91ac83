"""Fastening forces: rail motion at the seats, forces of the seats, and these projected on the rails' modes.

The seats move backwards through the window and keep their spacing d, so with s_0 the first seat, j counted from it

    sin(k_i (s_0 + j d)) = sin(k_i s_0) cos(k_i j d) + cos(k_i s_0) sin(k_i j d)

and the tables of cos(k_i j d), sin(k_i j d) are constant. A damper responds to the material rate D = d/dt - V d/ds, so
the force of a seat by the rail's motion is k u + c du/dt - V c u': one row of modal factors
(k q + c dq/dt | -V c k_i q) against sines and cosines. The products with the shapes are the host's; here are their
factors and the forces that follow.
Signs as MODEL: F_V down on the slab, F_L to the right on the slab, M_b right-handed on the slab.

The slab's own share of the fastening (its motion times k, c) is in the slab's implicit block. The force on the slab is
therefore evaluated with the slab at its predictor, that on the rail with the slab at the iterate: both are the same
force once the passes have converged. The rail's implicit block contains a smeared fastening; its contribution at the
iterate is subtracted here (``smeared``).
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array, Template


@ti.func
def seat_shapes(n: int, seats: int, s0: float, length: float, table: Array, shape_out: Array):
    """sin(k_i s_j), then cos(k_i s_j), shape (2 n, seats), from their constant tables by angle addition."""
    for i in range(n):
        k = (i + 1) * ti.math.pi / length
        s = ti.sin(k * s0)
        c = ti.cos(k * s0)
        for j in range(seats):
            shape_out[i, j] = s * table[i, j] + c * table[n + i, j]
            shape_out[n + i, j] = c * table[i, j] - s * table[n + i, j]


@ti.func
def pull_factors(
    b: int, dims: Array, V: float, constants: Array, row_u: Template, row_v: Template, motion: Array, factor_out: Array
):
    """Modal factors of the forces at the seats by the motion of both rails: vertical force, lateral force, moment.

    Displacements and velocities are in rows ``row_u`` and ``row_v``; ``factor_out[b, rail, row, :]`` has 2 n entries:
    those for the sines, then those for the cosines.
    """
    n = dims[at.MODES]
    kv, cv = constants[at.K_VERTICAL], constants[at.C_VERTICAL]
    kl, cl = constants[at.K_LATERAL], constants[at.C_LATERAL]
    a, base2 = constants[at.ARM_FASTENING], constants[at.HALF_BASE] * constants[at.HALF_BASE]
    step = -V * ti.math.pi / constants[at.LENGTH]
    for rail in range(2):
        w = (b * 2 + rail) * 2 * n
        v = dims[at.LATERAL] + (b * 2 + rail) * 3 * n
        for i in range(n):
            roll, droll = motion[row_u, v + 2 * n + i], motion[row_v, v + 2 * n + i]
            foot, dfoot = motion[row_u, v + i] - a * roll, motion[row_v, v + i] - a * droll
            flow = (i + 1) * step
            factor_out[b, rail, 0, i] = kv * motion[row_u, w + i] + cv * motion[row_v, w + i]
            factor_out[b, rail, 0, n + i] = cv * flow * motion[row_u, w + i]
            factor_out[b, rail, 1, i] = kl * foot + cl * dfoot
            factor_out[b, rail, 1, n + i] = cl * flow * foot
            factor_out[b, rail, 2, i] = base2 * (kv * roll + cv * droll)
            factor_out[b, rail, 2, n + i] = base2 * cv * flow * roll


@ti.func
def slab_pull_factors(
    b: int, dims: Array, constants: Array, row_u: Template, row_v: Template, motion: Array, factor_out: Array
):
    """Forces k u + c du/dt of all slab coordinates, shape (trains, slots, dofs); the last two are lateral."""
    n = dims[at.SLAB_DOFS]
    kv, cv = constants[at.K_VERTICAL], constants[at.C_VERTICAL]
    kl, cl = constants[at.K_LATERAL], constants[at.C_LATERAL]
    for slot in range(dims[at.SLOTS]):
        base = dims[at.SLABS] + (b * dims[at.SLOTS] + slot) * n
        for i in range(n - 2):
            factor_out[b, slot, i] = kv * motion[row_u, base + i] + cv * motion[row_v, base + i]
        for i in range(n - 2, n):
            factor_out[b, slot, i] = kl * motion[row_u, base + i] + cl * motion[row_v, base + i]


@ti.func
def seat_forces(
    b: int, first_seat: int, first_slab: int, s0: float, iterate: int, dims: Array, constants: Array, scale: Array,
    rail_pull: Array, slab_pull: Array, force_out: Array, slab_force_out: Array,
):  # fmt: skip
    """Force of every fastening on slabs and rails.

    A seat of a slab has five numbers: vertical left and right, moment left and right, and lateral.

    Args:
        b: Train.
        first_seat: Index of the window's rear seat along the track.
        first_slab: Index of its rear slab.
        s0: The rear seat in the window [m].
        iterate: Row of ``slab_pull`` that holds the slabs at the iterate; row 0 holds them at the predictors.
        dims: Sizes, see ``layout``.
        constants: Numbers, see ``layout``.
        scale: 1 for a sound fastening, 0 for a failed one, shape (trains, seats, 2).
        rail_pull: Forces by the rails' motion: vertical, lateral, moment [N, N, N m], shape (trains, 2, 3, seats).
        slab_pull: Forces by the slabs' motion, moment over b^2, shape (2, trains, slots, 5, seats per slab).
        force_out: F_V, F_L and the roll moment M_b - a F_L on the rails, shape (trains, 2, 3, seats).
        slab_force_out: Forces on the slabs, shape (trains, slots, 5, seats per slab).
    """
    per_slab, slots = dims[at.SEATS_PER_SLAB], dims[at.SLOTS]
    a, base2 = constants[at.ARM_FASTENING], constants[at.HALF_BASE] * constants[at.HALF_BASE]
    zone, length = constants[at.ABSORBING_ZONE], constants[at.LENGTH]
    for slot in range(slots):
        for row in range(5):
            for seat in range(per_slab):
                slab_force_out[b, slot, row, seat] = 0.0
    for j in range(dims[at.SEATS]):
        s = s0 + j * constants[at.SPACING]
        inside = s < length
        slab = (first_seat + j) // per_slab
        seat = (first_seat + j) % per_slab
        slot = slab % slots
        depth = ti.max(0.0, zone - ti.min(s, length - s)) / ti.max(zone, 1e-9)  # no zone: no depth
        lateral = 0.0
        for rail in range(2):
            F_V, F_L, M_b = 0.0, 0.0, 0.0
            if inside:
                factor = scale[b, j, rail]
                V, L, M = rail_pull[b, rail, 0, j], rail_pull[b, rail, 1, j], rail_pull[b, rail, 2, j]
                F_V, F_L, M_b = factor * V, factor * L, factor * M
                if slab < first_slab + slots:  # beyond the modelled slabs the ground is rigid
                    moment = base2 * slab_pull[0, b, slot, 2 + rail, seat]
                    slab_force_out[b, slot, rail, seat] = F_V - factor * slab_pull[0, b, slot, rail, seat]
                    slab_force_out[b, slot, 2 + rail, seat] = M_b - factor * moment
                    lateral += F_L - factor * slab_pull[0, b, slot, 4, seat]
                    F_V -= factor * slab_pull[iterate, b, slot, rail, seat]
                    M_b -= factor * base2 * slab_pull[iterate, b, slot, 2 + rail, seat]
                    F_L -= factor * slab_pull[iterate, b, slot, 4, seat]
                F_V += depth * depth * V  # to the ground: absorbs waves before the window's end reflects them
                F_L += depth * depth * L
                M_b += depth * depth * M
            force_out[b, rail, 0, j] = F_V
            force_out[b, rail, 1, j] = F_L
            force_out[b, rail, 2, j] = M_b - a * F_L
        if inside and slab < first_slab + slots:
            slab_force_out[b, slot, 4, seat] = lateral


@ti.func
def rail_forces(b: int, iterate: int, dims: Array, constants: Array, shape: Array, force: Array, motion: Array):
    """F of the rails: linear forces, seats by row-dot products, and the smeared seats A_s a at the iterate."""
    n, seats, lateral = dims[at.MODES], dims[at.SEATS], dims[at.LATERAL]
    kv, kl = constants[at.SMEARED_VERTICAL], constants[at.SMEARED_LATERAL]
    a, base2 = constants[at.ARM_FASTENING], constants[at.HALF_BASE] * constants[at.HALF_BASE]
    for rail in range(2):
        for i in range(n):
            vertical, across, turning = 0.0, 0.0, 0.0
            for j in range(seats):
                vertical += shape[i, j] * force[b, rail, 0, j]
                across += shape[i, j] * force[b, rail, 1, j]
                turning += shape[i, j] * force[b, rail, 2, j]
            w = (b * 2 + rail) * 2 * n + i
            v = lateral + (b * 2 + rail) * 3 * n + i
            smeared_w, smeared_v, smeared_x = 0.0, 0.0, 0.0
            if iterate > 0:  # the first iterate is a = 0
                foot = motion[at.A, v] - a * motion[at.A, v + 2 * n]
                smeared_w = kv * motion[at.A, w]
                smeared_v = kl * foot
                smeared_x = base2 * kv * motion[at.A, v + 2 * n] - a * kl * foot
            motion[at.F, w] = motion[at.LINEAR, w] + smeared_w - vertical
            motion[at.F, w + n] = motion[at.LINEAR, w + n]
            motion[at.F, v] = motion[at.LINEAR, v] + smeared_v - across
            motion[at.F, v + n] = motion[at.LINEAR, v + n]
            motion[at.F, v + 2 * n] = motion[at.LINEAR, v + 2 * n] + smeared_x - turning
