"""Fastening forces: gather the rails' motion at the seats, scatter the forces to rails and slabs.

The seats move backwards through the window and keep their spacing d, so with s_0 the first seat and j its follower

    sin(k_i (s_0 + j d)) = sin(k_i s_0) cos(k_i j d) + cos(k_i s_0) sin(k_i j d)

and the tables of cos(k_i j d), sin(k_i j d) are constant. A damper feels the material rate D = d/dt - V d/ds.
Signs as MODEL: F_V down on the slab, F_L to the right on the slab, M_b right-handed on the slab.

The slab's own share of the fastening (its motion times k, c) stands in the slab's implicit block. The force on the
slab is therefore taken with the slab at its predictor, that on the rail with the slab at the iterate: both are the same
force once the passes have converged. The rail's implicit block holds a smeared fastening; what it adds there at the
iterate is taken off here (``add_smeared``).
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array, Ints1, Ints3, Reals1, Reals2, Reals3, Reals4


@ti.func
def modulate(b: int, n: int, lateral: int, V: float, s0: float, length: float, u: Array, modal_out: Array):
    """Fill the modal vectors whose products with the seat tables are the seats' motion.

    ``modal_out[b, 6 rail + quantity, :]`` has 2 n entries: those for cos(k j d), then those for sin(k j d).
    """
    for i in range(n):
        k = (i + 1) * ti.math.pi / length
        s = ti.sin(k * s0)
        c = ti.cos(k * s0)
        for rail in range(2):
            w = (b * 2 + rail) * 2 * n + i
            v = lateral + (b * 2 + rail) * 3 * n + i
            for field in ti.static(range(3)):
                q = w
                if ti.static(field == 1):
                    q = v
                elif ti.static(field == 2):
                    q = v + 2 * n
                value = u[at.U, q]
                rate = u[at.V, q]
                row = rail * 6 + 2 * field
                modal_out[b, row, i] = value * s
                modal_out[b, row, n + i] = value * c
                modal_out[b, row + 1, i] = rate * s - V * k * value * c
                modal_out[b, row + 1, n + i] = rate * c + V * k * value * s


@ti.func
def gather(b: int, n: int, seats: int, table: Array, modal: Array, seat_out: Array):
    """Seats' motion ``seat_out[b, 6 rail + quantity, seat]`` by row-dot products of length 2 n."""
    for seat in range(seats):
        for rail in range(2):
            row = rail * 6
            w, dw, v, dv, roll, droll = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for i in range(2 * n):
                phi = table[seat, i]
                w += phi * modal[b, row, i]
                dw += phi * modal[b, row + 1, i]
                v += phi * modal[b, row + 2, i]
                dv += phi * modal[b, row + 3, i]
                roll += phi * modal[b, row + 4, i]
                droll += phi * modal[b, row + 5, i]
            seat_out[b, row, seat] = w
            seat_out[b, row + 1, seat] = dw
            seat_out[b, row + 2, seat] = v
            seat_out[b, row + 3, seat] = dv
            seat_out[b, row + 4, seat] = roll
            seat_out[b, row + 5, seat] = droll


@ti.func
def slab_motion(
    base: int, dofs: int, seat: int, side: int, u: Array, index: Array, shape: Array, x: Array, row_u: int, row_v: int
):
    """Slab motion under a seat: w, dw/dy, y and their rates, from rows ``row_u`` and ``row_v`` of the motion."""
    w, dw, slope, dslope = 0.0, 0.0, 0.0, 0.0
    for m in range(12):
        q = base + index[seat, side, m]
        w += shape[0, seat, side, m] * u[row_u, q]
        dw += shape[0, seat, side, m] * u[row_v, q]
        slope += shape[1, seat, side, m] * u[row_u, q]
        dslope += shape[1, seat, side, m] * u[row_v, q]
    q = base + dofs - 2
    y = u[row_u, q] + x[seat] * u[row_u, q + 1]
    dy = u[row_v, q] + x[seat] * u[row_v, q + 1]
    return ti.Vector([w, dw, y, dy, slope, dslope])


@ti.func
def seat_force(rail: Array, slab: Array, scale: float, constants: Array):
    """(F_V, F_L, M_b) of one fastening from the motions of rail and slab (displacement and rate of w, v, roll)."""
    kv, cv = constants[at.K_VERTICAL], constants[at.C_VERTICAL]
    kl, cl = constants[at.K_LATERAL], constants[at.C_LATERAL]
    a, b = constants[at.ARM_FASTENING], constants[at.HALF_BASE]
    F_V = kv * (rail[0] - slab[0]) + cv * (rail[1] - slab[1])
    F_L = kl * (rail[2] - a * rail[4] - slab[2]) + cl * (rail[3] - a * rail[5] - slab[3])
    M_b = b * b * (kv * (rail[4] - slab[4]) + cv * (rail[5] - slab[5]))
    return scale * ti.Vector([F_V, F_L, M_b])


@ti.func
def absorbing_force(rail: Array, s: float, constants: Array):
    """(F_V, F_L, M_b) on the ground of the dampers that swallow waves near the window's ends.

    As strong as the fastening's own damper at the very end, falling with the square of the depth in the zone to none.
    """
    zone, a, b = constants[at.ABSORBING_ZONE], constants[at.ARM_FASTENING], constants[at.HALF_BASE]
    depth = ti.max(0.0, zone - ti.min(s, constants[at.LENGTH] - s)) / ti.max(zone, 1e-9)  # no zone: no depth
    cv, cl = depth * depth * constants[at.C_VERTICAL], depth * depth * constants[at.C_LATERAL]
    return ti.Vector([cv * rail[1], cl * (rail[3] - a * rail[5]), b * b * cv * rail[5]])


@ti.func
def seat_forces(
    b: int,
    first_seat: int,
    first_slab: int,
    s0: float,
    dims: Array,
    constants: Array,
    motion: Array,
    seat_motion: Array,
    scale: Array,
    index: Array,
    shape: Array,
    x: Array,
    force_out: Array,
):
    """Force of every fastening; adds it to the slabs' right-hand sides and leaves that on the rails in ``force_out``.

    ``force_out[b, 3 rail + component, seat]`` holds F_V, F_L and the roll moment M_b - a F_L.
    """
    per_slab = dims[at.SEATS_PER_SLAB]
    dofs = dims[at.SLAB_DOFS]
    slots = dims[at.SLOTS]
    a = constants[at.ARM_FASTENING]
    for j in range(dims[at.SEATS]):
        s = s0 + j * constants[at.SPACING]
        inside = s < constants[at.LENGTH]
        slab = (first_seat + j) // per_slab
        seat = (first_seat + j) % per_slab
        base = dims[at.SLABS] + (b * slots + slab % slots) * dofs
        for rail in range(2):
            if inside:
                r = ti.Vector([0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
                for m in ti.static(range(6)):
                    r[m] = seat_motion[b, rail * 6 + m, j]
                now = ti.Vector([0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
                if slab < first_slab + slots:  # beyond the modelled slabs the ground is rigid
                    before = slab_motion(
                        base, dofs, seat, rail, motion, index, shape, x, at.U_PREDICTED, at.V_PREDICTED
                    )
                    load = seat_force(r, before, scale[b, j, rail], constants)
                    for m in range(12):
                        q = base + index[seat, rail, m]
                        motion[at.F, q] = (
                            motion[at.F, q] + shape[0, seat, rail, m] * load[0] + shape[1, seat, rail, m] * load[2]
                        )
                    q = base + dofs - 2
                    motion[at.F, q] = motion[at.F, q] + load[1]
                    motion[at.F, q + 1] = motion[at.F, q + 1] + x[seat] * load[1]
                    now = slab_motion(base, dofs, seat, rail, motion, index, shape, x, at.U, at.V)
                force = seat_force(r, now, scale[b, j, rail], constants) + absorbing_force(r, s, constants)
                force_out[b, 3 * rail, j] = force[0]
                force_out[b, 3 * rail + 1, j] = force[1]
                force_out[b, 3 * rail + 2, j] = force[2] - a * force[1]
            else:
                for m in ti.static(range(3)):
                    force_out[b, 3 * rail + m, j] = 0.0


@ti.func
def scatter(
    b: int, n: int, seats: int, lateral: int, s0: float, length: float, table: Array, force: Array, motion: Array
):
    """Subtract the seat forces from the rails' right-hand sides: row-dot products of length ``seats``."""
    for i in range(n):
        k = (i + 1) * ti.math.pi / length
        s = ti.sin(k * s0)
        c = ti.cos(k * s0)
        for rail in range(2):
            row = 3 * rail
            wc, ws, vc, vs, tc, ts = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(seats):
                wc += table[i, j] * force[b, row, j]
                ws += table[n + i, j] * force[b, row, j]
                vc += table[i, j] * force[b, row + 1, j]
                vs += table[n + i, j] * force[b, row + 1, j]
                tc += table[i, j] * force[b, row + 2, j]
                ts += table[n + i, j] * force[b, row + 2, j]
            w = (b * 2 + rail) * 2 * n + i
            v = lateral + (b * 2 + rail) * 3 * n + i
            motion[at.F, w] = motion[at.F, w] - s * wc - c * ws
            motion[at.F, v] = motion[at.F, v] - s * vc - c * vs
            motion[at.F, v + 2 * n] = motion[at.F, v + 2 * n] - s * tc - c * ts


@ti.func
def add_smeared(b: int, n: int, lateral: int, constants: Array, motion: Array):
    """Add (beta dt^2 K_s + gamma dt C_s) a of the smeared fastenings that stand in the rails' implicit blocks."""
    per_mode = constants[at.SMEARING] * constants[at.LENGTH] / (2.0 * constants[at.SPACING])
    kv = per_mode * (
        constants[at.BETA_DT2] * constants[at.K_VERTICAL] + constants[at.GAMMA_DT] * constants[at.C_VERTICAL]
    )
    kl = per_mode * (
        constants[at.BETA_DT2] * constants[at.K_LATERAL] + constants[at.GAMMA_DT] * constants[at.C_LATERAL]
    )
    a, half = constants[at.ARM_FASTENING], constants[at.HALF_BASE]
    for rail in range(2):
        for i in range(n):
            w = (b * 2 + rail) * 2 * n + i
            v = lateral + (b * 2 + rail) * 3 * n + i
            foot = motion[at.A, v] - a * motion[at.A, v + 2 * n]
            motion[at.F, w] = motion[at.F, w] + kv * motion[at.A, w]
            motion[at.F, v] = motion[at.F, v] + kl * foot
            motion[at.F, v + 2 * n] = (
                motion[at.F, v + 2 * n] - a * kl * foot + half * half * kv * motion[at.A, v + 2 * n]
            )


@ti.func
def add_fastening_forces(
    b: int,
    step: int,
    dims: Array,
    constants: Array,
    clock: Array,
    gather_table: Array,
    scatter_table: Array,
    scale: Array,
    index: Array,
    shape: Array,
    x: Array,
    motion: Array,
    modal: Array,
    seat_motion: Array,
    force: Array,
):
    """Gather, evaluate and scatter the fastenings of train ``b`` at the window position of ``step``."""
    n, seats, lateral = dims[at.MODES], dims[at.SEATS], dims[at.LATERAL]
    s0, length = clock[step, at.FIRST_SEAT_S], constants[at.LENGTH]
    modulate(b, n, lateral, clock[step, at.SPEED], s0, length, motion, modal)
    gather(b, n, seats, gather_table, modal, seat_motion)
    seat_forces(
        b,
        ti.cast(clock[step, at.FIRST_SEAT], ti.i32),
        ti.cast(clock[step, at.FIRST_SLAB], ti.i32),
        s0,
        dims,
        constants,
        motion,
        seat_motion,
        scale,
        index,
        shape,
        x,
        force,
    )
    scatter(b, n, seats, lateral, s0, length, scatter_table, force, motion)


@ti.kernel
def fastening_forces(
    step: int,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    gather_table: Reals2,
    scatter_table: Reals2,
    scale: Reals3,
    index: Ints3,
    shape: Reals4,
    x: Reals1,
    motion: Reals2,
    modal: Reals3,
    seat_motion: Reals3,
    force_out: Reals3,
):
    """Add the fastening forces of all trains to ``motion[F]`` (serial; the step fuses this stage).

    Args:
        step: Row of ``clock``.
        dims: Sizes and offsets, see ``layout``.
        constants: Numbers, see ``layout``.
        clock: Window positions, shape (steps, N_CLOCK).
        gather_table: cos and sin of k_i j d, shape (seats, 2 modes).
        scatter_table: Its transpose, shape (2 modes, seats).
        scale: 1 for a sound fastening, 0 for a failed one, shape (trains, seats, 2).
        index: Slab DOFs under a seat, shape (seats per slab, 2, 12).
        shape: Slab shape functions and their y-slope at a seat, shape (2, seats per slab, 2, 12).
        x: Seats from the slab's centre [m], shape (seats per slab,).
        motion: Rows of motion, see ``layout``; ``F`` is added to.
        modal: Scratch, shape (trains, 12, 2 modes).
        seat_motion: Rails' motion at the seats, shape (trains, 12, seats).
        force_out: F_V, F_L, M_b - a F_L on the rails [N, N, N m], shape (trains, 6, seats).
    """
    ti.loop_config(serialize=True)
    for b in range(dims[at.TRAINS]):
        add_fastening_forces(
            b,
            step,
            dims,
            constants,
            clock,
            gather_table,
            scatter_table,
            scale,
            index,
            shape,
            x,
            motion,
            modal,
            seat_motion,
            force_out,
        )
