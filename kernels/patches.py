"""Contact of a wheelset whose wheels have one patch each or two, chosen when the kernel is compiled.

With one patch this is ``contact``. With two, patch c = 0..3 is (left, right) of the first slot of the contact table, then
of the second; both patches of a wheel press on the same rail, so that every patch feels every other through the
wheelset's compliance and the two of a wheel also through their rail's. Newton's method is that of ``contact`` for up to
twelve forces. Where no patch of the second slot touches, the system keeps its first six equations.
"""

import taichi as ti

from tiengine.kernels import contact as ct
from tiengine.kernels import layout as at
from tiengine.kernels import under_wheels as uw
from tiengine.kernels import wheel_rail as wr
from tiengine.kernels.types import Array, Reals1, Reals2, Reals3, Reals4, Template

PATCHES = 4  # of a wheelset
UNKNOWNS = 3 * PATCHES


@ti.func
def solve_leading(matrix_out: Template, x_out: Template, size: int):
    """Solve the first ``size`` equations of a system by elimination with pivots on the diagonal; see ``contact``."""
    for k in range(size):
        inverse = 1.0 / matrix_out[k, k]
        for i in range(k + 1, size):
            factor = matrix_out[i, k] * inverse
            for j in range(k + 1, size):
                matrix_out[i, j] -= factor * matrix_out[k, j]
            x_out[i] -= factor * x_out[k]
    for m in range(size):
        k = size - 1 - m
        for j in range(k + 1, size):
            x_out[k] -= matrix_out[k, j] * x_out[j]
        x_out[k] /= matrix_out[k, k]


@ti.func
def patch_state(
    c: Template, V: float, r0: float, b0: float, x: Template, dx: Template, rail: Template, irregularity: Template,
    rolls: int, table: Array, constants: Array,
):  # fmt: skip
    """Contact state of patch c; interpolation between an empty slot and one in use may leave a stiffness below zero."""
    state = ct.state_of(
        ti.static(c % 2), V, r0, b0, x, dx, rail, irregularity, rolls, table, constants, ti.static(c // 2)
    )
    state[wr.KH] = ti.max(state[wr.KH], 1.0)
    state[wr.K11], state[wr.K22] = ti.max(state[wr.K11], 0.0), ti.max(state[wr.K22], 0.0)
    return state


@ti.func
def store_wheels(b: int, wheelset: int, states: Template, f: Template, R: Template, contact_out: Array,
    force_out: Array, rail_force_out: Array,
):  # fmt: skip
    """Store the states and forces of all patches, and those of both wheels."""
    for c in ti.static(range(PATCHES)):
        ct.store_state(b, wheelset, 2 + c, states[c], contact_out)
        for m in ti.static(range(4)):
            force_out[b, wheelset, 2 + c, m] = f[c][m]
    for side in ti.static(range(2)):
        one, two = states[side], states[side + 2]
        swap = f[side + 2][0] > f[side][0] or (
            f[side][0] == 0.0 and f[side + 2][0] == 0.0 and two[wr.DELTA] > one[wr.DELTA]
        )
        for m in ti.static(range(wr.N_CONTACT)):
            contact_out[b, wheelset, side, m] = ti.select(swap, two[m], one[m])
        for m in ti.static(range(4)):
            force_out[b, wheelset, side, m] = f[side][m] + f[side + 2][m]
        on_rail = R[side] @ f[side] + R[side + 2] @ f[side + 2]
        for m in ti.static(range(3)):
            rail_force_out[b, wheelset, side, m] = on_rail[m]


@ti.func
def solve_two(
    b: int, wheelset: int, V: float, x_free: Template, dx_free: Template, free_l: Template, free_r: Template,
    irregularity: Template, dims: Array, constants: Array, wheel: Array, table: Array, wheelset_compliance: Array,
    rail_coupling: Array, contact: Array, force: Array, wheelset_force: Array, rail_force: Array, tolerance: float,
):  # fmt: skip
    """Newton's method for the local forces of all patches of a wheelset; see ``contact.solve_wheelset``."""
    free = [free_l, free_r]
    before_rail = [
        ct.stored_force(b, wheelset, 0, 3, rail_force), ct.stored_force(b, wheelset, 1, 3, rail_force)
    ]  # fmt: skip
    before = ti.Vector.zero(ti.f64, 5)
    for m in ti.static(range(5)):
        before[m] = wheelset_force[b, wheelset, m]
    f = [ct.stored_force(b, wheelset, 2 + c, 4, force) for c in range(PATCHES)]
    place = [ct.stored_place(b, wheelset, 2 + c, contact) for c in range(PATCHES)]
    states = [ti.Vector.zero(ti.f64, wr.N_CONTACT) for c in range(PATCHES)]
    base = [ct.stored_force(b, wheelset, 2 + c, 4, force) for c in range(PATCHES)]
    r0, b0, h_r = wheel[wheelset, 0], wheel[wheelset, 1], constants[at.ARM_HEAD]
    rolls = dims[at.CROSS_LEVEL_ROLLS]
    iterations = 0
    remains, change = 2.0 * tolerance, 0.0
    share, best = 1.0, 1e300
    step = ti.Vector.zero(ti.f64, UNKNOWNS)
    while remains > tolerance and iterations < ct.ITERATIONS:
        on_wheelset = [ti.Matrix.zero(ti.f64, 5, 4) for c in range(PATCHES)]
        on_rail = [ti.Matrix.zero(ti.f64, 3, 4) for c in range(PATCHES)]
        increment = -before
        total = [ti.Vector.zero(ti.f64, 3) for side in range(2)]
        for c in ti.static(range(PATCHES)):
            B, R = wr.force_directions(ti.static(2.0 * (c % 2) - 1.0), r0, b0, h_r, place[c])
            on_wheelset[c], on_rail[c] = B, R
            increment = increment + B @ f[c]
            total[c % 2] = total[c % 2] + R @ f[c]
        a = ti.Vector.zero(ti.f64, 5)
        for m in ti.static(range(5)):
            for k in ti.static(range(5)):
                a[m] += wheelset_compliance[wheelset, m, k] * increment[k]
        x = x_free + constants[at.BETA_DT2] * a
        dx = dx_free + constants[at.GAMMA_DT] * a
        law = [ti.Vector.zero(ti.f64, 4) for c in range(PATCHES)]
        D = [ti.Matrix.zero(ti.f64, 4, 4) for c in range(PATCHES)]
        rails = [
            ct.rail_at_end(wheelset, free[side], total[side], before_rail[side], constants, rail_coupling)
            for side in range(2)
        ]
        residual = ti.Vector.zero(ti.f64, UNKNOWNS)
        size = 6
        for c in ti.static(range(PATCHES)):
            states[c] = patch_state(c, V, r0, b0, x, dx, rails[c % 2], irregularity, rolls, table, constants)
            place[c] = wr.placing(states[c])
            forces, slopes = wr.contact_law(states[c], constants[at.FRICTION])
            law[c], D[c] = forces, slopes
            for m in ti.static(range(3)):
                residual[3 * c + m] = forces[m] - f[c][m]
            if ti.static(c >= 2):
                if forces[0] > 0.0 or f[c][0] != 0.0:
                    size = UNKNOWNS
        length = residual.norm()
        if length > (1.0 - 0.1 * share) * best and length > tolerance and share > ct.SMALLEST_SHARE:
            share *= 0.5  # the step did not bring the forces nearer to the law: go half of it
        else:
            J = ti.Matrix.identity(ti.f64, UNKNOWNS)
            for c in ti.static(range(PATCHES)):
                for d in ti.static(range(PATCHES)):
                    if size > ti.static(3 * max(c, d)):
                        block = ct.feedback(
                            ti.static(int(c % 2 == d % 2)), wheelset, V, constants, D[c], on_wheelset[c], on_rail[c],
                            on_wheelset[d], on_rail[d], states[c][wr.COS], wheelset_compliance, rail_coupling,
                        )  # fmt: skip
                        for m in ti.static(range(3)):
                            for n in ti.static(range(3)):
                                J[3 * c + m, 3 * d + n] -= block[m, n]
            step = residual
            solve_leading(J, step, size)
            share, best = 1.0, length
            last, change = change, 0.0
            for m in ti.static(range(UNKNOWNS)):
                change = ti.max(change, ti.abs(step[m]))
            remains = change
            if change < last:
                remains = change * (change / last)
            for c in ti.static(range(PATCHES)):
                base[c] = f[c]
        for c in ti.static(range(PATCHES)):
            for m in ti.static(range(3)):
                f[c][m] = base[c][m] + share * step[3 * c + m]
            f[c][3] = law[c][3]
        iterations += 1
    q = ti.Vector.zero(ti.f64, 5)
    directions = [ti.Matrix.zero(ti.f64, 3, 4) for c in range(PATCHES)]
    for c in ti.static(range(PATCHES)):
        B, R = wr.force_directions(ti.static(2.0 * (c % 2) - 1.0), r0, b0, h_r, place[c])
        q = q + B @ f[c]
        directions[c] = R
    for m in ti.static(range(5)):
        wheelset_force[b, wheelset, m] = q[m]
    store_wheels(b, wheelset, states, f, directions, contact, force, rail_force)
    return iterations


@ti.func
def solve_wheelset(
    b: int, wheelset: int, V: float, x_free: Template, dx_free: Template, free_l: Template, free_r: Template,
    irregularity: Template, dims: Array, constants: Array, wheel: Array, table: Array, wheelset_compliance: Array,
    rail_coupling: Array, contact: Array, force: Array, wheelset_force: Array, rail_force: Array, tolerance: float,
    patches: Template,
):  # fmt: skip
    """Solve one wheelset with so many patches a wheel; returns the number of iterations."""
    count = 0
    if ti.static(patches == 1):
        count = ct.solve_wheelset(
            b, wheelset, V, x_free, dx_free, free_l, free_r, irregularity, dims, constants, wheel, table,
            wheelset_compliance, rail_coupling, contact, force, wheelset_force, rail_force, tolerance,
        )  # fmt: skip
    else:
        count = solve_two(
            b, wheelset, V, x_free, dx_free, free_l, free_r, irregularity, dims, constants, wheel, table,
            wheelset_compliance, rail_coupling, contact, force, wheelset_force, rail_force, tolerance,
        )  # fmt: skip
    return count


@ti.func
def record_wheels(
    b: int, wheelset: int, row: int, contact: Array, force: Array, rail_force: Array, wheel_out: Array,
    patches: Template,
):  # fmt: skip
    """Record the output of both wheels of a wheelset and of their patches, see ``layout``."""
    ct.record_wheels(b, wheelset, row, contact, force, rail_force, wheel_out)
    if ti.static(patches == 2):
        for c in range(PATCHES):
            side, first = c % 2, at.N_WHEEL + (c // 2) * at.N_PATCH
            wheel_out[b, row, wheelset, side, first + at.PATCH_NORMAL_FORCE] = force[b, wheelset, 2 + c, 0]
            wheel_out[b, row, wheelset, side, first + at.PATCH_POSITION_WHEEL] = contact[b, wheelset, 2 + c, wr.S_W]
            wheel_out[b, row, wheelset, side, first + at.PATCH_POSITION_RAIL] = contact[b, wheelset, 2 + c, wr.S_R]
            wheel_out[b, row, wheelset, side, first + at.PATCH_ANGLE] = ti.atan2(
                contact[b, wheelset, 2 + c, wr.SIN], contact[b, wheelset, 2 + c, wr.COS]
            )
            for m in ti.static(range(3)):
                at_creepage = first + at.PATCH_LONGITUDINAL_CREEPAGE + m
                at_force = first + at.PATCH_LONGITUDINAL_CREEP_FORCE + m
                wheel_out[b, row, wheelset, side, at_creepage] = contact[b, wheelset, 2 + c, wr.XI_X + m]
                wheel_out[b, row, wheelset, side, at_force] = force[b, wheelset, 2 + c, 1 + m]


@ti.func
def given_motion(
    b: int, wheelset: int, V: float, rolls: int, x: Template, dx: Template, left: Template, right: Template,
    irregularity: Template, constants: Array, table: Array, wheel: Array, contact_out: Array, force_out: Array,
    wheelset_force_out: Array, rail_force_out: Array, patches: Template,
):  # fmt: skip
    """Contact states and forces of a wheelset at given motions of it and its rails."""
    r0, b0, h_r = wheel[wheelset, 0], wheel[wheelset, 1], constants[at.ARM_HEAD]
    rails = [left, right]
    states = [ti.Vector.zero(ti.f64, wr.N_CONTACT) for c in range(2 * patches)]
    f = [ti.Vector.zero(ti.f64, 4) for c in range(2 * patches)]
    R = [ti.Matrix.zero(ti.f64, 3, 4) for c in range(2 * patches)]
    q = ti.Vector.zero(ti.f64, 5)
    for c in ti.static(range(2 * patches)):
        if ti.static(patches == 1):
            states[c] = ct.state_of(c, V, r0, b0, x, dx, rails[c], irregularity, rolls, table, constants, 0)
        else:
            states[c] = patch_state(c, V, r0, b0, x, dx, rails[c % 2], irregularity, rolls, table, constants)
        forces, _ = wr.contact_law(states[c], constants[at.FRICTION])
        on_wheelset, on_rail = wr.force_directions(
            ti.static(2.0 * (c % 2) - 1.0), r0, b0, h_r, wr.placing(states[c])
        )
        f[c], R[c] = forces, on_rail
        q = q + on_wheelset @ forces
    for m in ti.static(range(5)):
        wheelset_force_out[b, wheelset, m] = q[m]
    if ti.static(patches == 1):
        for c in ti.static(range(2)):
            ct.store_state(b, wheelset, c, states[c], contact_out)
            ct.store_force(b, wheelset, c, f[c], R[c] @ f[c], force_out, rail_force_out)
    else:
        store_wheels(b, wheelset, states, f, R, contact_out, force_out, rail_force_out)


@ti.kernel
def wheel_forces(
    patches: Template,
    V: float,
    rolls: int,
    constants: Reals1,
    table: Reals3,
    wheel: Reals2,
    irregularity: Reals3,
    wheelset_u: Reals3,
    wheelset_v: Reals3,
    rail_motion: Reals4,
    contact_out: Reals4,
    force_out: Reals4,
    wheelset_force_out: Reals3,
    rail_force_out: Reals4,
):
    """Contact forces at given motions of wheels and rails, without any time step (start, references, tests).

    Args:
        patches: Patches a wheel can have, 1 or 2.
        V: Speed [m/s].
        rolls: 1 if a cross level turns the railheads.
        constants: Numbers, see ``layout``.
        table: Contact geometry, shape (n_u, n_alpha, N_TABLE patches).
        wheel: r0, b0, spin inertia of each wheelset, shape (wheelsets, 3).
        irregularity: Track channels, shape (trains, wheelsets, N_IRREGULARITY).
        wheelset_u: y, z, roll, pitch, yaw, shape (trains, wheelsets, 5).
        wheelset_v: Their rates.
        rail_motion: w, v, theta_x, their slopes, their rates at constant s, shape (trains, wheelsets, 2, 9).
        contact_out: Contact states, see ``wheel_rail``, shape (trains, wheelsets, CONTACT_ROWS, N_CONTACT).
        force_out: N, Fx, Fy, Mz on the wheels, shape (trains, wheelsets, CONTACT_ROWS, 4).
        wheelset_force_out: Generalised forces on y, z, roll, pitch, yaw, shape (trains, wheelsets, 5).
        rail_force_out: Generalised forces on w, v, theta_x, shape (trains, wheelsets, 2, 3).
    """
    ti.loop_config(serialize=True)
    for b in range(wheelset_u.shape[0]):
        for w in range(wheelset_u.shape[1]):
            channels = ti.Vector.zero(ti.f64, at.N_IRREGULARITY)
            for m in ti.static(range(at.N_IRREGULARITY)):
                channels[m] = irregularity[b, w, m]
            x, dx = ti.Vector.zero(ti.f64, 5), ti.Vector.zero(ti.f64, 5)
            for m in ti.static(range(5)):
                x[m] = wheelset_u[b, w, m]
                dx[m] = wheelset_v[b, w, m]
            given_motion(
                b, w, V, rolls, x, dx, uw.stored_rail(b, w, 0, rail_motion), uw.stored_rail(b, w, 1, rail_motion),
                channels, constants, table, wheel, contact_out, force_out, wheelset_force_out, rail_force_out, patches,
            )  # fmt: skip
