"""Contact of a wheelset whose wheels may have two patches each.

Patch c = 0..3 is (left, right) of the first slot of the contact table, then of the second; both patches of a wheel
press on the same rail, so that every patch feels every other through the wheelset's compliance and the two of a wheel
also through their rail's. Newton's method is that of ``contact`` for up to twelve forces. Where no patch of the second
slot touches, the system keeps its first six equations. Patches are loops, not copies of the code: compiling would take
three times as long.
"""

import taichi as ti

from tiengine.kernels import contact as ct
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.kernels.types import Array, Template

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
def stored_rows(b: int, wheelset: int, count: Template, columns: Template, array: Array):
    """The first ``columns`` numbers of the last ``count`` rows of a wheelset."""
    rows = ti.Matrix.zero(ti.f64, count, columns)
    for c in range(count):
        for m in ti.static(range(columns)):
            rows[c, m] = array[b, wheelset, 2 + c, m]
    return rows


@ti.func
def patch_state(
    c: int, V: float, size: Template, x: Template, dx: Template, rails: Template, irregularity: Template,
    rolls: int, table: Array, constants: Array,
):  # fmt: skip
    """Contact state of patch c; ``rails`` has the motion of either rail in a row.

    Interpolation between an empty slot and one in use may leave a stiffness below zero.
    """
    side = c % 2
    state = wr.contact_state(
        2.0 * side - 1.0, V, size, x, dx,
        ti.Vector([rails[side, 0], rails[side, 1], rails[side, 2]]),
        ti.Vector([rails[side, 3], rails[side, 4], rails[side, 5]]),
        ti.Vector([rails[side, 6], rails[side, 7], rails[side, 8]]),
        irregularity, rolls, table, constants, c // 2,
    )  # fmt: skip
    state[wr.KH] = ti.max(state[wr.KH], 1.0)
    state[wr.K11] = ti.max(state[wr.K11], 0.0)
    state[wr.K22] = ti.max(state[wr.K22], 0.0)
    return state


@ti.func
def directions_of(c: int, size: Template, h_r: float, states: Template):
    """Generalised forces of unit (N, Fx, Fy, Mz) of patch c, from its contact state."""
    place = ti.Vector([states[c, wr.SIN], states[c, wr.COS], states[c, wr.S_W], states[c, wr.S_R], states[c, wr.R_C]])
    return wr.force_directions(2.0 * (c % 2) - 1.0, size, h_r, place)


@ti.func
def store_wheels(
    b: int, wheelset: int, h_r: float, states: Template, f: Template, wheel: Array, contact_out: Array,
    force_out: Array, wheelset_force_out: Array, rail_force_out: Array, own: Template,
):  # fmt: skip
    """Store the states and forces of all patches, those of both wheels, and the forces on wheelset and rails."""
    total = ti.Matrix.zero(ti.f64, 2, 4)
    on_rail = ti.Matrix.zero(ti.f64, 2, 3)
    on_wheelset = ti.Vector.zero(ti.f64, 5)
    for c in range(PATCHES):
        local = ti.Vector([f[c, 0], f[c, 1], f[c, 2], f[c, 3]])
        B, R = directions_of(c, wr.size_of(wheelset, c % 2, wheel, own), h_r, states)
        q, r = B @ local, R @ local
        on_wheelset = on_wheelset + q
        for m in ti.static(range(3)):
            on_rail[c % 2, m] += r[m]
        for m in ti.static(range(4)):
            total[c % 2, m] += local[m]
            force_out[b, wheelset, 2 + c, m] = local[m]
        for m in ti.static(range(wr.N_CONTACT)):
            contact_out[b, wheelset, 2 + c, m] = states[c, m]
    for side in range(2):
        other = side + 2
        leads = side  # the patch with the larger normal force; off the rail the nearer one
        if f[other, 0] > f[side, 0]:
            leads = other
        if total[side, 0] == 0.0:
            if states[other, wr.DELTA] > states[side, wr.DELTA]:
                leads = other
        for m in ti.static(range(wr.N_CONTACT)):
            contact_out[b, wheelset, side, m] = states[leads, m]
        for m in ti.static(range(4)):
            force_out[b, wheelset, side, m] = total[side, m]
        for m in ti.static(range(3)):
            rail_force_out[b, wheelset, side, m] = on_rail[side, m]
    for m in ti.static(range(5)):
        wheelset_force_out[b, wheelset, m] = on_wheelset[m]


@ti.func
def newton_step_two(
    size: int, wheelset: int, V: float, constants: Array, residual: Template, D: Template, B: Template, R: Template,
    states: Template, wheelset_compliance: Array, rail_coupling: Array,
):  # fmt: skip
    """Solve (I - D W) step = residual for (N, Fx, Fy) of the patches, of the first slot's only if ``size`` is 6.

    W is the change of (delta, xi_x, xi_y) of patch c by unit forces of patch d, as in ``contact.feedback``.

    Args:
        size: Unknowns, 6 or 12.
        wheelset: Its number.
        V: Speed [m/s].
        constants: Numbers, see ``layout``.
        residual: Forces by the law less those of the iterate, shape (12,).
        D: Derivatives of the law, patch by patch, shape (12, 3).
        B: Directions of the forces on the wheelset, patch by patch, shape (20, 3).
        R: The same on the rail, shape (12, 3).
        states: Contact states, shape (4, N_CONTACT).
        wheelset_compliance: Shape (W, 5, 5).
        rail_coupling: Shape (W, 2, W, 3, 3).
    """
    beta_dt2, rate = constants[at.BETA_DT2], constants[at.GAMMA_DT] / V
    J = ti.Matrix.identity(ti.f64, UNKNOWNS)
    for c in range(size // 3):
        for d in range(size // 3):
            W = ti.Matrix.zero(ti.f64, 3, 3)
            for n in range(3):
                if n != 1:
                    across = ti.Vector.zero(ti.f64, 2)
                    for m in ti.static(range(2)):
                        for k in range(3):
                            own = B[5 * c + k, 2 * m] * wheelset_compliance[wheelset, k, k]
                            across[m] += own * B[5 * d + k, n]
                        if c % 2 == d % 2:
                            across[m] += R[3 * c, 2 * m] * rail_coupling[wheelset, 0, wheelset, 0, 0] * R[3 * d, n]
                            for k in range(1, 3):
                                for l in range(1, 3):
                                    own = R[3 * c + k, 2 * m] * rail_coupling[wheelset, 0, wheelset, k, l]
                                    across[m] += own * R[3 * d + l, n]
                    W[0, n] = -beta_dt2 * across[0]  # a wheel pushed up penetrates less
                    W[2, n] = rate * across[1]
                    if c % 2 == d % 2:
                        for k in range(3):
                            W[0, n] -= R[3 * c + k, 0] * constants[at.RESIDUAL_VERTICAL + k] * R[3 * d + k, n]
            yaw = wheelset_compliance[wheelset, 4, 4] * B[5 * d + 4, 1]
            pitch = B[5 * c + 3, 1] * wheelset_compliance[wheelset, 3, 3] * B[5 * d + 3, 1]
            W[1, 1] = rate * (pitch + B[5 * c + 4, 1] * yaw)
            W[2, 1] = -beta_dt2 * yaw / states[c, wr.COS]
            for m in range(3):
                for n in range(3):
                    for k in range(3):
                        J[3 * c + m, 3 * d + n] -= D[3 * c + m, k] * W[k, n]
    step = residual
    solve_leading(J, step, size)
    return step


@ti.func
def solve_two(
    b: int, wheelset: int, V: float, x_free: Template, dx_free: Template, free_l: Template, free_r: Template,
    irregularity: Template, dims: Array, constants: Array, wheel: Array, table: Array, wheelset_compliance: Array,
    rail_coupling: Array, contact: Array, force: Array, wheelset_force: Array, rail_force: Array, tolerance: float,
    own: Template,
):  # fmt: skip
    """Newton's method for the local forces of all patches of a wheelset; see ``contact.solve_wheelset``."""
    before = ti.Vector.zero(ti.f64, 5)
    for m in ti.static(range(5)):
        before[m] = wheelset_force[b, wheelset, m]
    before_l, before_r = ct.stored_force(b, wheelset, 0, 3, rail_force), ct.stored_force(b, wheelset, 1, 3, rail_force)
    f = stored_rows(b, wheelset, PATCHES, 4, force)
    base = f
    states = stored_rows(b, wheelset, PATCHES, wr.N_CONTACT, contact)
    h_r = constants[at.ARM_HEAD]
    rolls = dims[at.CROSS_LEVEL_ROLLS]
    iterations = 0
    remains, change = 2.0 * tolerance, 0.0
    share, best = 1.0, 1e300
    step = ti.Vector.zero(ti.f64, UNKNOWNS)
    while remains > tolerance and iterations < ct.ITERATIONS:
        B, R = ti.Matrix.zero(ti.f64, 5 * PATCHES, 3), ti.Matrix.zero(ti.f64, UNKNOWNS, 3)
        increment, pressed = ti.Vector.zero(ti.f64, 5), ti.Matrix.zero(ti.f64, 2, 3)
        for c in range(PATCHES):
            local = ti.Vector([f[c, 0], f[c, 1], f[c, 2], f[c, 3]])
            on_wheelset, on_rail = directions_of(c, wr.size_of(wheelset, c % 2, wheel, own), h_r, states)
            increment = increment + on_wheelset @ local
            pushed = on_rail @ local
            for n in ti.static(range(3)):
                pressed[c % 2, n] += pushed[n]
                for m in ti.static(range(5)):
                    B[5 * c + m, n] = on_wheelset[m, n]
                for m in ti.static(range(3)):
                    R[3 * c + m, n] = on_rail[m, n]
        increment = increment - before
        a = ti.Vector.zero(ti.f64, 5)
        for m in ti.static(range(5)):
            for k in ti.static(range(5)):
                a[m] += wheelset_compliance[wheelset, m, k] * increment[k]
        x = x_free + constants[at.BETA_DT2] * a
        dx = dx_free + constants[at.GAMMA_DT] * a
        pressed_l = ti.Vector([pressed[0, 0], pressed[0, 1], pressed[0, 2]])
        pressed_r = ti.Vector([pressed[1, 0], pressed[1, 1], pressed[1, 2]])
        rail_l = ct.rail_at_end(wheelset, free_l, pressed_l, before_l, constants, rail_coupling)
        rail_r = ct.rail_at_end(wheelset, free_r, pressed_r, before_r, constants, rail_coupling)
        rails = ti.Matrix.zero(ti.f64, 2, 9)
        for m in ti.static(range(9)):
            rails[0, m], rails[1, m] = rail_l[m], rail_r[m]
        residual, spin = ti.Vector.zero(ti.f64, UNKNOWNS), ti.Vector.zero(ti.f64, PATCHES)
        D = ti.Matrix.zero(ti.f64, UNKNOWNS, 3)
        size = 6
        for c in range(PATCHES):
            size_c = wr.size_of(wheelset, c % 2, wheel, own)
            state = patch_state(c, V, size_c, x, dx, rails, irregularity, rolls, table, constants)
            law, slopes = wr.contact_law(state, constants[at.FRICTION])
            for m in ti.static(range(wr.N_CONTACT)):
                states[c, m] = state[m]
            for m in ti.static(range(3)):
                residual[3 * c + m] = law[m] - f[c, m]
                for n in ti.static(range(3)):
                    D[3 * c + m, n] = slopes[m, n]
            spin[c] = law[3]
            if c >= 2:
                if law[0] > 0.0 or f[c, 0] != 0.0:
                    size = UNKNOWNS
        length = residual.norm()
        if length > (1.0 - 0.1 * share) * best and length > tolerance and share > ct.SMALLEST_SHARE:
            share *= 0.5  # the step did not bring the forces nearer to the law: go half of it
        else:
            step = newton_step_two(
                size, wheelset, V, constants, residual, D, B, R, states, wheelset_compliance, rail_coupling
            )
            share, best = 1.0, length
            base = f
            last, change = change, 0.0
            for m in range(UNKNOWNS):
                change = ti.max(change, ti.abs(step[m]))
            remains = change
            if change < last:
                remains = change * (change / last)
        for c in range(PATCHES):
            for m in ti.static(range(3)):
                f[c, m] = base[c, m] + share * step[3 * c + m]
            f[c, 3] = spin[c]
        iterations += 1
    store_wheels(b, wheelset, h_r, states, f, wheel, contact, force, wheelset_force, rail_force, own)
    return iterations


@ti.func
def two_at_given_motion(
    b: int, wheelset: int, V: float, rolls: int, x: Template, dx: Template, left: Template, right: Template,
    irregularity: Template, constants: Array, table: Array, wheel: Array, contact_out: Array, force_out: Array,
    wheelset_force_out: Array, rail_force_out: Array, own: Template,
):  # fmt: skip
    """The same with two patches a wheel."""
    h_r = constants[at.ARM_HEAD]
    rails = ti.Matrix.zero(ti.f64, 2, 9)
    for m in ti.static(range(9)):
        rails[0, m], rails[1, m] = left[m], right[m]
    states, f = ti.Matrix.zero(ti.f64, PATCHES, wr.N_CONTACT), ti.Matrix.zero(ti.f64, PATCHES, 4)
    for c in range(PATCHES):
        size = wr.size_of(wheelset, c % 2, wheel, own)
        state = patch_state(c, V, size, x, dx, rails, irregularity, rolls, table, constants)
        law, _ = wr.contact_law(state, constants[at.FRICTION])
        for m in ti.static(range(wr.N_CONTACT)):
            states[c, m] = state[m]
        for m in ti.static(range(4)):
            f[c, m] = law[m]
    store_wheels(b, wheelset, h_r, states, f, wheel, contact_out, force_out, wheelset_force_out, rail_force_out, own)
