"""Contact of all wheels of all trains, solved against its end-of-step compliance.

At the end of a step the coordinates of a wheel and its rail are x = x_free + S q with q the contact's generalised
forces, because the other parts of the step are linear: S = beta dt^2 A^-1 for displacements, gamma dt A^-1 for rates.
Wheels stand still in the window, so S is constant. The wheels of one wheelset are solved together; all the others enter
x_free with their latest forces. Newton's method finds the forces f = (N, Fx, Fy) of both wheels of a wheelset with

    f = law(e),  e = (delta, creepages)(x_free + S B f)

The Jacobian is I - D W with D = d law / d e and W = H S B; it neglects the change of the geometry along the step, which
the residual includes. A step that does not bring the forces nearer to the law is halved: at low speed saturating
creepage would otherwise make the iterates oscillate. The steps shrink by a nearly constant factor, so that the last
one times the last factor estimates the remaining error, and the iteration ends when that is small enough.
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.kernels.types import Array, Template

ITERATIONS = 50
SMALLEST_SHARE = 1.0 / 128.0  # of a Newton step: it is not halved further
ITERATE_TOLERANCE = 0.02
"""Tolerance over the static load, in all passes but the last: a Newton step of this size leaves about a hundredth of
itself, and a pass reduces that tenfold. One iteration per wheelset is then usually enough."""


@ti.func
def solve6(matrix_out: Template, x_out: Template):
    """Gaussian elimination with the pivots on the diagonal: the matrix is the identity plus a dissipative part.

    ``x_out`` holds the right-hand side before and the solution after; the matrix is overwritten.
    """
    inverse = ti.Vector.zero(ti.f64, 6)
    for k in ti.static(range(6)):
        inverse[k] = 1.0 / matrix_out[k, k]
        for i in ti.static(range(k + 1, 6)):
            factor = matrix_out[i, k] * inverse[k]
            for j in ti.static(range(k + 1, 6)):
                matrix_out[i, j] -= factor * matrix_out[k, j]
            x_out[i] -= factor * x_out[k]
    for m in ti.static(range(6)):
        k = ti.static(5 - m)
        for j in ti.static(range(k + 1, 6)):
            x_out[k] -= matrix_out[k, j] * x_out[j]
        x_out[k] *= inverse[k]


@ti.func
def stored_place(b: int, wheelset: int, side: Template, contact: Array):
    """Contact geometry of a wheel from the last evaluation."""
    place = ti.Vector.zero(ti.f64, 5)
    for m in ti.static(range(5)):
        place[m] = contact[b, wheelset, side, wr.SIN + m]
    return place


@ti.func
def stored_force(b: int, wheelset: int, side: Template, count: Template, force: Array):
    """The first ``count`` force components of a wheel."""
    f = ti.Vector.zero(ti.f64, count)
    for m in ti.static(range(count)):
        f[m] = force[b, wheelset, side, m]
    return f


@ti.func
def store_state(b: int, wheelset: int, side: Template, state: Template, contact_out: Array):
    """Store a wheel's contact state."""
    for m in ti.static(range(wr.N_CONTACT)):
        contact_out[b, wheelset, side, m] = state[m]


@ti.func
def store_force(
    b: int, wheelset: int, side: Template, f: Template, r: Template, force_out: Array, rail_force_out: Array
):
    """Store a wheel's local forces and its forces on the rail."""
    for m in ti.static(range(4)):
        force_out[b, wheelset, side, m] = f[m]
    for m in ti.static(range(3)):
        rail_force_out[b, wheelset, side, m] = r[m]


@ti.func
def rail_at_end(wheelset: int, free: Template, force: Template, before: Template, constants: Array, coupling: Array):
    """Rail motion under a wheel at the end of the step, from that without the change of the wheel's force.

    The truncated modes respond to the whole force at once, without inertia; their rates are neglected.
    """
    increment = force - before
    r = free
    for m in ti.static(range(3)):
        value, slope = 0.0, 0.0
        for k in ti.static(range(3)):
            value += coupling[wheelset, 0, wheelset, m, k] * increment[k]
            slope += coupling[wheelset, 1, wheelset, m, k] * increment[k]
        r[m] += constants[at.BETA_DT2] * value
        r[3 + m] += constants[at.BETA_DT2] * slope
        r[6 + m] += constants[at.GAMMA_DT] * value
        r[m] += constants[at.RESIDUAL_VERTICAL + m] * force[m]
    return r


@ti.func
def state_of(
    side: Template, V: float, size: Template, x: Template, dx: Template, rail: Template,
    irregularity: Template, rolls: int, table: Array, constants: Array, patch: Template,
):  # fmt: skip
    """Contact state of a patch of the left (0) or right (1) wheel."""
    return wr.contact_state(
        ti.static(2.0 * side - 1.0),
        V,
        size,
        x,
        dx,
        ti.Vector([rail[0], rail[1], rail[2]]),
        ti.Vector([rail[3], rail[4], rail[5]]),
        ti.Vector([rail[6], rail[7], rail[8]]),
        irregularity,
        rolls,
        table,
        constants,
        patch,
    )


@ti.func
def feedback(
    same: Template, wheelset: int, V: float, constants: Array, D: Template, B: Template, R: Template,
    other: Template, cos: float, wheelset_compliance: Array, rail_coupling: Array,
):  # fmt: skip
    """D W for (N, Fx, Fy): response of the law of one wheel to unit forces of itself (``same``) or of the other wheel.

    W is the change of (delta, xi_x, xi_y). N and Fy move y, z and roll; Fx moves pitch and yaw, and yaw steers:
    -psi / cos gamma. The diagonal of the wheelset's compliance is enough, inertia dominates it.
    """
    W = ti.Matrix.zero(ti.f64, 2, 2)  # (delta, xi_y) by (N, Fy)
    for m in ti.static(range(2)):
        for n in ti.static(range(2)):
            total = 0.0
            for k in ti.static(range(3)):
                total += B[k, 2 * m] * wheelset_compliance[wheelset, k, k] * other[k, 2 * n]
            if ti.static(same == 1):
                total += R[0, 2 * m] * rail_coupling[wheelset, 0, wheelset, 0, 0] * R[0, 2 * n]
                for k in ti.static(range(1, 3)):
                    for l in ti.static(range(1, 3)):
                        total += R[k, 2 * m] * rail_coupling[wheelset, 0, wheelset, k, l] * R[l, 2 * n]
            if ti.static(m == 0):
                W[m, n] = -constants[at.BETA_DT2] * total  # a wheel pushed up penetrates less
                if ti.static(same == 1):
                    for k in ti.static(range(3)):
                        W[m, n] -= R[k, 0] * constants[at.RESIDUAL_VERTICAL + k] * R[k, 2 * n]
            else:
                W[m, n] = constants[at.GAMMA_DT] / V * total
    pitch = B[3, 1] * wheelset_compliance[wheelset, 3, 3] * other[3, 1]
    yaw = wheelset_compliance[wheelset, 4, 4] * other[4, 1]
    x = constants[at.GAMMA_DT] / V * (pitch + B[4, 1] * yaw)  # xi_x by Fx
    y = -constants[at.BETA_DT2] * yaw / cos  # xi_y by Fx
    return ti.Matrix(
        [
            [D[0, 0] * W[0, 0], 0.0, D[0, 0] * W[0, 1]],
            [D[1, 0] * W[0, 0] + D[1, 2] * W[1, 0], D[1, 1] * x + D[1, 2] * y, D[1, 0] * W[0, 1] + D[1, 2] * W[1, 1]],
            [D[2, 0] * W[0, 0] + D[2, 2] * W[1, 0], D[2, 1] * x + D[2, 2] * y, D[2, 0] * W[0, 1] + D[2, 2] * W[1, 1]],
        ]
    )


@ti.func
def newton_step(
    wheelset: int, V: float, constants: Array, residual: Template, D_l: Template, D_r: Template, B_l: Template,
    B_r: Template, R_l: Template, R_r: Template, cos_l: float, cos_r: float, wheelset_compliance: Array,
    rail_coupling: Array,
):  # fmt: skip
    """Solve (I - D W) step = residual for (N, Fx, Fy) of the left, then of the right wheel."""
    ll = feedback(1, wheelset, V, constants, D_l, B_l, R_l, B_l, cos_l, wheelset_compliance, rail_coupling)
    lr = feedback(0, wheelset, V, constants, D_l, B_l, R_l, B_r, cos_l, wheelset_compliance, rail_coupling)
    rl = feedback(0, wheelset, V, constants, D_r, B_r, R_r, B_l, cos_r, wheelset_compliance, rail_coupling)
    rr = feedback(1, wheelset, V, constants, D_r, B_r, R_r, B_r, cos_r, wheelset_compliance, rail_coupling)
    J = ti.Matrix.identity(ti.f64, 6)
    for m in ti.static(range(3)):
        for n in ti.static(range(3)):
            J[m, n] -= ll[m, n]
            J[m, 3 + n] -= lr[m, n]
            J[3 + m, n] -= rl[m, n]
            J[3 + m, 3 + n] -= rr[m, n]
    step = residual
    solve6(J, step)
    return step


@ti.func
def channels_at(b: int, step: int, wheelset: int, irregularity: Array):
    """Track channels under a wheelset in a step."""
    channels = ti.Vector.zero(ti.f64, at.N_IRREGULARITY)
    for m in ti.static(range(at.N_IRREGULARITY)):
        channels[m] = irregularity[b, step, wheelset, m]
    return channels


@ti.func
def solve_wheelset(
    b: int, wheelset: int, V: float, x_free: Template, dx_free: Template, free_l: Template, free_r: Template,
    irregularity: Template, dims: Array, constants: Array, wheel: Array, table: Array, wheelset_compliance: Array,
    rail_coupling: Array, contact: Array, force: Array, wheelset_force: Array, rail_force: Array, tolerance: float,
    own: Template,
):  # fmt: skip
    """Newton's method for the local forces of one wheelset, to a tolerance [N]; returns the number of iterations.

    Unknowns are N, Fx, Fy of both wheels; the small spin moments follow the law from one iteration to the next. The
    free motions of wheelset and rails (left, right) include the response to the forces stored before. With ``own`` = 1
    wheels have radii and contact tables of their own.

    Everything that changes from one iteration to the next is local: Taichi 1.7.4 treats a load with a literal index
    and a store with a loop index as different places and moves the load out of the loop.
    """
    before_l, before_r = stored_force(b, wheelset, 0, 3, rail_force), stored_force(b, wheelset, 1, 3, rail_force)
    before = ti.Vector.zero(ti.f64, 5)
    for m in ti.static(range(5)):
        before[m] = wheelset_force[b, wheelset, m]
    f_l, f_r = stored_force(b, wheelset, 0, 4, force), stored_force(b, wheelset, 1, 4, force)
    place_l, place_r = stored_place(b, wheelset, 0, contact), stored_place(b, wheelset, 1, contact)
    size_l, size_r = wr.size_of(wheelset, 0, wheel, own), wr.size_of(wheelset, 1, wheel, own)
    h_r = constants[at.ARM_HEAD]
    rolls = dims[at.CROSS_LEVEL_ROLLS]
    iterations = 0
    remains, change = 2.0 * tolerance, 0.0
    share, best = 1.0, 1e300
    base_l, base_r, step = f_l, f_r, ti.Vector.zero(ti.f64, 6)
    while remains > tolerance and iterations < ITERATIONS:
        B_l, R_l = wr.force_directions(-1.0, size_l, h_r, place_l)
        B_r, R_r = wr.force_directions(1.0, size_r, h_r, place_r)
        increment = B_l @ f_l + B_r @ f_r - before
        a = ti.Vector.zero(ti.f64, 5)
        for m in ti.static(range(5)):
            for k in ti.static(range(5)):
                a[m] += wheelset_compliance[wheelset, m, k] * increment[k]
        x = x_free + constants[at.BETA_DT2] * a
        dx = dx_free + constants[at.GAMMA_DT] * a
        rail_l = rail_at_end(wheelset, free_l, R_l @ f_l, before_l, constants, rail_coupling)
        rail_r = rail_at_end(wheelset, free_r, R_r @ f_r, before_r, constants, rail_coupling)
        left = state_of(0, V, size_l, x, dx, rail_l, irregularity, rolls, table, constants, 0)
        right = state_of(1, V, size_r, x, dx, rail_r, irregularity, rolls, table, constants, 0)
        store_state(b, wheelset, 0, left, contact)
        store_state(b, wheelset, 1, right, contact)
        place_l, place_r = wr.placing(left), wr.placing(right)
        law_l, D_l = wr.contact_law(left, constants[at.FRICTION])
        law_r, D_r = wr.contact_law(right, constants[at.FRICTION])
        residual = ti.Vector.zero(ti.f64, 6)
        for m in ti.static(range(3)):
            residual[m] = law_l[m] - f_l[m]
            residual[3 + m] = law_r[m] - f_r[m]
        size = residual.norm()
        if size > (1.0 - 0.1 * share) * best and size > tolerance and share > SMALLEST_SHARE:
            share *= 0.5  # the step did not bring the forces nearer to the law: go half of it
        else:
            step = newton_step(
                wheelset, V, constants, residual, D_l, D_r, B_l, B_r, R_l, R_r, left[wr.COS], right[wr.COS],
                wheelset_compliance, rail_coupling,
            )  # fmt: skip
            share, best = 1.0, size
            base_l, base_r = f_l, f_r
            last, change = change, 0.0
            for m in ti.static(range(6)):  # entry by entry: vector mode has no absolute value of a vector
                change = ti.max(change, ti.abs(step[m]))
            remains = change
            if change < last:
                remains = change * (change / last)
        for m in ti.static(range(3)):
            f_l[m] = base_l[m] + share * step[m]
            f_r[m] = base_r[m] + share * step[3 + m]
        f_l[3], f_r[3] = law_l[3], law_r[3]
        iterations += 1
    B_l, R_l = wr.force_directions(-1.0, size_l, h_r, place_l)
    B_r, R_r = wr.force_directions(1.0, size_r, h_r, place_r)
    q = B_l @ f_l + B_r @ f_r
    for m in ti.static(range(5)):
        wheelset_force[b, wheelset, m] = q[m]
    store_force(b, wheelset, 0, f_l, R_l @ f_l, force, rail_force)
    store_force(b, wheelset, 1, f_r, R_r @ f_r, force, rail_force)
    return iterations


@ti.func
def record_wheels(b: int, wheelset: int, row: int, contact: Array, force: Array, rail_force: Array, wheel_out: Array):
    """Record the output of both wheels of a wheelset, see ``layout``."""
    for side in range(2):
        for m in ti.static(range(3)):
            wheel_out[b, row, wheelset, side, at.LONGITUDINAL_CREEPAGE + m] = contact[b, wheelset, side, wr.XI_X + m]
            wheel_out[b, row, wheelset, side, at.LONGITUDINAL_CREEP_FORCE + m] = force[b, wheelset, side, 1 + m]
        wheel_out[b, row, wheelset, side, at.NORMAL_FORCE] = force[b, wheelset, side, 0]
        wheel_out[b, row, wheelset, side, at.VERTICAL_FORCE] = rail_force[b, wheelset, side, 0]
        wheel_out[b, row, wheelset, side, at.LATERAL_FORCE] = rail_force[b, wheelset, side, 1]
        wheel_out[b, row, wheelset, side, at.PENETRATION] = contact[b, wheelset, side, wr.DELTA]
        wheel_out[b, row, wheelset, side, at.POSITION_WHEEL] = contact[b, wheelset, side, wr.S_W]
        wheel_out[b, row, wheelset, side, at.POSITION_RAIL] = contact[b, wheelset, side, wr.S_R]
        wheel_out[b, row, wheelset, side, at.ROLLING_RADIUS] = contact[b, wheelset, side, wr.R_C]
        wheel_out[b, row, wheelset, side, at.RAIL_DEFLECTION] = contact[b, wheelset, side, wr.RAIL_W]
        wheel_out[b, row, wheelset, side, at.IRREGULARITY_VERTICAL] = contact[b, wheelset, side, wr.Z_IRR]
        wheel_out[b, row, wheelset, side, at.IRREGULARITY_LATERAL] = contact[b, wheelset, side, wr.Y_IRR]
        wheel_out[b, row, wheelset, side, at.RELATIVE_SHIFT] = contact[b, wheelset, side, wr.SHIFT]
