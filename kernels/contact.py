"""Contact of all wheels of all trains, solved against its end-of-step compliance.

At the end of a step the coordinates a wheel feels are x = x_free + S q with q the contact's generalised forces, because
the rest of the step is linear: S = beta dt^2 A^-1 for displacements, gamma dt A^-1 for rates. Wheels stand still in
the window, so S is constant. The wheels of one wheelset are solved together; all the others enter x_free with their
forces of the pass before. Newton's method finds the forces f = (N, Fx, Fy, Mz) of both wheels of a wheelset with

    f = law(e),  e = (delta, creepages)(x_free + S B f)

The Jacobian is I - D W with D = d law / d e and W = H S B; it leaves out how the geometry changes along the step, which
the residual does not.
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.kernels.types import Array, Reals1, Reals2, Reals3, Reals4

ITERATIONS = 25


@ti.func
def solve8(matrix: ti.template(), rhs: ti.template()):
    """Gaussian elimination with the pivots on the diagonal: the matrix is the identity plus a dissipative part."""
    for k in ti.static(range(8)):
        for i in ti.static(range(k + 1, 8)):
            factor = matrix[i, k] / matrix[k, k]
            for j in ti.static(range(k + 1, 8)):
                matrix[i, j] -= factor * matrix[k, j]
            rhs[i] -= factor * rhs[k]
    for k in ti.static(range(7, -1, -1)):
        for j in ti.static(range(k + 1, 8)):
            rhs[k] -= matrix[k, j] * rhs[j]
        rhs[k] /= matrix[k, k]
    return rhs


@ti.func
def wheelset_coordinates(b: int, wheelset: int, dims: Array, dof: Array, row: int, motion: Array):
    """Wheelset y, z, roll, pitch, yaw from a row of the motion."""
    base = dims[at.VEHICLES] + b * dims[at.VEHICLE_DOFS]
    x = ti.Vector.zero(ti.f64, 5)
    for m in ti.static(range(5)):
        x[m] = motion[row, base + dof[wheelset, m]]
    return x


@ti.func
def rail_coordinates(b: int, wheelset: int, rail: int, dims: Array, shape: Array, motion: Array, rail_out: Array):
    """Rail under a wheel: w, v, theta_x, their slopes and their rates at constant s, into ``rail_out[b, wheelset, rail]``."""
    n = dims[at.MODES]
    w = (b * 2 + rail) * 2 * n
    v = dims[at.LATERAL] + (b * 2 + rail) * 3 * n
    for field in ti.static(range(3)):
        base = w
        if ti.static(field == 1):
            base = v
        elif ti.static(field == 2):
            base = v + 2 * n
        value, slope, rate = 0.0, 0.0, 0.0
        for i in range(n):
            value += shape[0, wheelset, i] * motion[at.U, base + i]
            slope += shape[1, wheelset, i] * motion[at.U, base + i]
            rate += shape[0, wheelset, i] * motion[at.V, base + i]
        rail_out[b, wheelset, rail, field] = value
        rail_out[b, wheelset, rail, 3 + field] = slope
        rail_out[b, wheelset, rail, 6 + field] = rate


@ti.func
def stored_state(b: int, wheelset: int, side: int, contact: Array):
    """Contact state of a wheel as the last evaluation left it."""
    state = ti.Vector.zero(ti.f64, wr.N_CONTACT)
    for m in ti.static(range(wr.N_CONTACT)):
        state[m] = contact[b, wheelset, side, m]
    return state


@ti.func
def add_generalised(
    b: int, wheelset: int, constants: Array, wheel: Array, contact: Array, force: Array, wheelset_force: Array,
    rail_force: Array,
):  # fmt: skip
    """Generalised forces on wheelset and rails of the wheels' local forces."""
    for m in ti.static(range(5)):
        wheelset_force[b, wheelset, m] = 0.0
    for side in range(2):
        sigma = 2.0 * side - 1.0
        state = stored_state(b, wheelset, side, contact)
        on_wheelset, on_rail = wr.force_directions(
            sigma, wheel[wheelset, 0], wheel[wheelset, 1], constants[at.ARM_HEAD], state
        )
        f = ti.Vector.zero(ti.f64, 4)
        for m in ti.static(range(4)):
            f[m] = force[b, wheelset, side, m]
        q = on_wheelset @ f
        r = on_rail @ f
        for m in ti.static(range(5)):
            wheelset_force[b, wheelset, m] = wheelset_force[b, wheelset, m] + q[m]
        for m in ti.static(range(3)):
            rail_force[b, wheelset, side, m] = r[m]


@ti.func
def evaluate(
    b: int, wheelset: int, side: int, V: float, irregularity: ti.template(), constants: Array, wheel: Array, dims: Array,
    table: Array, x: ti.template(), dx: ti.template(), rail_compliance: Array, rail_free: Array, rail_force: Array, rail_before: Array,
    contact_out: Array,
):  # fmt: skip
    """Contact state of one wheel at the end-of-step coordinates, stored and returned."""
    r = ti.Vector.zero(ti.f64, 9)
    for m in ti.static(range(9)):
        r[m] = rail_free[b, wheelset, side, m]
    for m in ti.static(range(3)):
        for k in ti.static(range(3)):
            q = rail_force[b, wheelset, side, k] - rail_before[b, wheelset, side, k]
            r[m] += constants[at.BETA_DT2] * rail_compliance[wheelset, 0, m, k] * q
            r[3 + m] += constants[at.BETA_DT2] * rail_compliance[wheelset, 1, m, k] * q
            r[6 + m] += constants[at.GAMMA_DT] * rail_compliance[wheelset, 0, m, k] * q
    state = wr.contact_state(
        2.0 * side - 1.0,
        V,
        wheel[wheelset, 0],
        wheel[wheelset, 1],
        x,
        dx,
        ti.Vector([r[0], r[1], r[2]]),
        ti.Vector([r[3], r[4], r[5]]),
        ti.Vector([r[6], r[7], r[8]]),
        irregularity,
        dims[at.CROSS_LEVEL_ROLLS],
        table,
        constants,
    )
    for m in ti.static(range(wr.N_CONTACT)):
        contact_out[b, wheelset, side, m] = state[m]
    return state


@ti.func
def response(
    row_side: int, column_side: int, wheelset: int, V: float, constants: Array, on_wheelset: ti.template(),
    on_rail: ti.template(), column_wheelset: ti.template(), column_rail: ti.template(), cos_row: float,
    wheelset_compliance: Array, rail_compliance: Array,
):  # fmt: skip
    """W: change of (delta, xi_x, xi_y, xi_s) of one wheel by unit (N, Fx, Fy, Mz) of another of the wheelset.

    For the Jacobian the diagonal of the wheelset's compliance is enough: the inertia dominates it.
    """
    W = ti.Matrix.zero(ti.f64, 4, 4)
    for m in ti.static(range(4)):
        for n in ti.static(range(4)):
            total = 0.0
            for k in ti.static(range(5)):
                total += on_wheelset[k, m] * wheelset_compliance[wheelset, k, k] * column_wheelset[k, n]
            if row_side == column_side:
                total += on_rail[0, m] * rail_compliance[wheelset, 0, 0, 0] * column_rail[0, n]
                for k in ti.static(range(1, 3)):
                    for l in ti.static(range(1, 3)):
                        total += on_rail[k, m] * rail_compliance[wheelset, 0, k, l] * column_rail[l, n]
            if ti.static(m == 0):
                W[m, n] = -constants[at.BETA_DT2] * total  # a wheel pushed up penetrates less
            else:
                W[m, n] = constants[at.GAMMA_DT] * total / V
    for n in ti.static(range(4)):  # yaw steers: -psi / cos gamma
        W[2, n] -= constants[at.BETA_DT2] * wheelset_compliance[wheelset, 4, 4] * column_wheelset[4, n] / cos_row
    return W


@ti.func
def solve_wheelset(
    b: int, wheelset: int, V: float, irregularity: ti.template(), dims: Array, constants: Array, wheel: Array, dof: Array,
    table: Array, wheelset_compliance: Array, rail_compliance: Array, motion: Array, rail_free: Array, contact: Array,
    force: Array, wheelset_force: Array, rail_force: Array, wheelset_before: Array, rail_before: Array,
):  # fmt: skip
    """Newton's method for the eight local forces of one wheelset; returns the number of iterations."""
    x_free = wheelset_coordinates(b, wheelset, dims, dof, at.U, motion)
    dx_free = wheelset_coordinates(b, wheelset, dims, dof, at.V, motion)
    r0, b0, h_r = wheel[wheelset, 0], wheel[wheelset, 1], constants[at.ARM_HEAD]
    tolerance = constants[at.CONTACT_TOLERANCE] * constants[at.STATIC_LOAD]
    iterations = 0
    change = 2.0 * tolerance
    while change > tolerance and iterations < ITERATIONS:
        add_generalised(b, wheelset, constants, wheel, contact, force, wheelset_force, rail_force)
        a = ti.Vector.zero(ti.f64, 5)
        for m in ti.static(range(5)):
            for k in ti.static(range(5)):
                increment = wheelset_force[b, wheelset, k] - wheelset_before[b, wheelset, k]
                a[m] += wheelset_compliance[wheelset, m, k] * increment
        x = x_free + constants[at.BETA_DT2] * a
        dx = dx_free + constants[at.GAMMA_DT] * a
        left = evaluate(b, wheelset, 0, V, irregularity, constants, wheel, dims, table, x, dx, rail_compliance, rail_free,
                        rail_force, rail_before, contact)  # fmt: skip
        right = evaluate(b, wheelset, 1, V, irregularity, constants, wheel, dims, table, x, dx, rail_compliance, rail_free,
                         rail_force, rail_before, contact)  # fmt: skip
        f_l, D_l = wr.contact_law(left, constants[at.FRICTION])
        f_r, D_r = wr.contact_law(right, constants[at.FRICTION])
        B_l, R_l = wr.force_directions(-1.0, r0, b0, h_r, left)
        B_r, R_r = wr.force_directions(1.0, r0, b0, h_r, right)
        ll = D_l @ response(0, 0, wheelset, V, constants, B_l, R_l, B_l, R_l, left[wr.COS], wheelset_compliance, rail_compliance)  # fmt: skip
        lr = D_l @ response(0, 1, wheelset, V, constants, B_l, R_l, B_r, R_r, left[wr.COS], wheelset_compliance, rail_compliance)  # fmt: skip
        rl = D_r @ response(1, 0, wheelset, V, constants, B_r, R_r, B_l, R_l, right[wr.COS], wheelset_compliance, rail_compliance)  # fmt: skip
        rr = D_r @ response(1, 1, wheelset, V, constants, B_r, R_r, B_r, R_r, right[wr.COS], wheelset_compliance, rail_compliance)  # fmt: skip
        J = ti.Matrix.identity(ti.f64, 8)
        residual = ti.Vector.zero(ti.f64, 8)
        for m in ti.static(range(4)):
            residual[m] = f_l[m] - force[b, wheelset, 0, m]
            residual[4 + m] = f_r[m] - force[b, wheelset, 1, m]
            for n in ti.static(range(4)):
                J[m, n] -= ll[m, n]
                J[m, 4 + n] -= lr[m, n]
                J[4 + m, n] -= rl[m, n]
                J[4 + m, 4 + n] -= rr[m, n]
        step = solve8(J, residual)
        change = 0.0
        for m in ti.static(range(4)):
            force[b, wheelset, 0, m] = force[b, wheelset, 0, m] + step[m]
            force[b, wheelset, 1, m] = force[b, wheelset, 1, m] + step[4 + m]
            if ti.static(m < 3):
                change = ti.max(change, ti.max(ti.abs(step[m]), ti.abs(step[4 + m])))
        iterations += 1
    add_generalised(b, wheelset, constants, wheel, contact, force, wheelset_force, rail_force)
    return iterations


@ti.func
def wheel_output(b: int, wheelset: int, contact: Array, force: Array, rail_force: Array, wheel_out: Array):
    """Everything a wheel reports, see ``layout``."""
    for side in range(2):
        for m in ti.static(range(3)):
            wheel_out[b, wheelset, side, at.LONGITUDINAL_CREEPAGE + m] = contact[b, wheelset, side, wr.XI_X + m]
            wheel_out[b, wheelset, side, at.LONGITUDINAL_CREEP_FORCE + m] = force[b, wheelset, side, 1 + m]
        wheel_out[b, wheelset, side, at.NORMAL_FORCE] = force[b, wheelset, side, 0]
        wheel_out[b, wheelset, side, at.VERTICAL_FORCE] = rail_force[b, wheelset, side, 0]
        wheel_out[b, wheelset, side, at.LATERAL_FORCE] = rail_force[b, wheelset, side, 1]
        wheel_out[b, wheelset, side, at.PENETRATION] = contact[b, wheelset, side, wr.DELTA]
        wheel_out[b, wheelset, side, at.POSITION_WHEEL] = contact[b, wheelset, side, wr.S_W]
        wheel_out[b, wheelset, side, at.POSITION_RAIL] = contact[b, wheelset, side, wr.S_R]
        wheel_out[b, wheelset, side, at.ROLLING_RADIUS] = contact[b, wheelset, side, wr.R_C]
        wheel_out[b, wheelset, side, at.RAIL_DEFLECTION] = contact[b, wheelset, side, wr.RAIL_W]
        wheel_out[b, wheelset, side, at.IRREGULARITY_VERTICAL] = contact[b, wheelset, side, wr.Z_IRR]
        wheel_out[b, wheelset, side, at.IRREGULARITY_LATERAL] = contact[b, wheelset, side, wr.Y_IRR]
        wheel_out[b, wheelset, side, at.RELATIVE_SHIFT] = contact[b, wheelset, side, wr.SHIFT]


@ti.kernel
def wheel_forces(
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
        V: Speed [m/s].
        rolls: 1 if a cross level turns the railheads.
        constants: Numbers, see ``layout``.
        table: Contact geometry, shape (n_u, n_alpha, N_TABLE).
        wheel: r0, b0, spin inertia of each wheelset, shape (wheelsets, 3).
        irregularity: Track channels, shape (trains, wheelsets, N_IRREGULARITY).
        wheelset_u: y, z, roll, pitch, yaw, shape (trains, wheelsets, 5).
        wheelset_v: Their rates.
        rail_motion: w, v, theta_x, their slopes, their rates at constant s, shape (trains, wheelsets, 2, 9).
        contact_out: Contact states, see ``wheel_rail``, shape (trains, wheelsets, 2, N_CONTACT).
        force_out: N, Fx, Fy, Mz on the wheels, shape (trains, wheelsets, 2, 4).
        wheelset_force_out: Generalised forces on y, z, roll, pitch, yaw, shape (trains, wheelsets, 5).
        rail_force_out: Generalised forces on w, v, theta_x, shape (trains, wheelsets, 2, 3).
    """
    ti.loop_config(serialize=True)
    for b in range(wheelset_u.shape[0]):
        for w in range(wheelset_u.shape[1]):
            felt = ti.Vector.zero(ti.f64, at.N_IRREGULARITY)
            for m in ti.static(range(at.N_IRREGULARITY)):
                felt[m] = irregularity[b, w, m]
            x, dx = ti.Vector.zero(ti.f64, 5), ti.Vector.zero(ti.f64, 5)
            for m in ti.static(range(5)):
                x[m] = wheelset_u[b, w, m]
                dx[m] = wheelset_v[b, w, m]
            for side in range(2):
                r = ti.Vector.zero(ti.f64, 9)
                for m in ti.static(range(9)):
                    r[m] = rail_motion[b, w, side, m]
                state = wr.contact_state(
                    2.0 * side - 1.0,
                    V,
                    wheel[w, 0],
                    wheel[w, 1],
                    x,
                    dx,
                    ti.Vector([r[0], r[1], r[2]]),
                    ti.Vector([r[3], r[4], r[5]]),
                    ti.Vector([r[6], r[7], r[8]]),
                    felt,
                    rolls,
                    table,
                    constants,
                )
                for m in ti.static(range(wr.N_CONTACT)):
                    contact_out[b, w, side, m] = state[m]
                f, _ = wr.contact_law(state, constants[at.FRICTION])
                for m in ti.static(range(4)):
                    force_out[b, w, side, m] = f[m]
            add_generalised(b, w, constants, wheel, contact_out, force_out, wheelset_force_out, rail_force_out)
