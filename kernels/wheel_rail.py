"""One wheel on one rail: geometry table, kinematics, normal force and creep forces (MODEL §5).

Everything here is a pure function of one wheel's motion. Conventions: sigma = -1 left, +1 right; z_c, y_c, x are the
contact frame's axes, y_c = (cos gamma_t, -sigma sin gamma_t), z_c = (sigma sin gamma_t, cos gamma_t) in (y, z). On the
wheel: N along -z_c, Fx along x, Fy along y_c, Mz about z_c.

Symbols: p vertical penetration, delta = p cos gamma, u relative outward shift, alpha relative outward tilt, theta the
cross level at the wheel, D the material rate d/dt - V d/ds of the rail.
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array, Template

# Contact state of a wheel: results of geometry and kinematics for the law and the force directions.
(
    DELTA, XI_X, XI_Y, XI_S, SIN, COS, S_W, S_R, R_C, KH, K11, K22, K23, K33, SHIFT, Z_IRR, Y_IRR, RAIL_W, TILT,
    N_CONTACT,
) = range(20)  # fmt: skip

# Size of a wheel: r0 and b0 of its wheelset; where wheels or rails differ also its own radius, how much larger that is
# than its table's, the crown offset of its rail, the first row of its table.
OF_WHEELSET, WHEEL_RADIUS, LARGER, CROWN, FIRST_ROW, OF_WHEEL = 2, 2, 3, 4, 5, 6

THIRD_OF_EXPONENTS = 715094163 << 32
"""Two thirds of the bias of a double's exponent, less what makes the first cube root's error least."""


SMALL_ANGLE = 0.1
"""rad, up to which the series below leave less than 2e-23 of sine and 3e-21 of cosine."""

S3, S5, S7, S9, S11 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362880.0, -1.0 / 39916800.0
C2, C4, C6, C8, C10 = -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0, -1.0 / 3628800.0


@ti.func
def catmull_rom(f: float):
    """Weights of the four taps around a cell at fraction f in [0, 1]: C1 in the argument."""
    return 0.5 * ti.Vector(
        [
            f * (f * (2.0 - f) - 1.0),
            f * f * (3.0 * f - 5.0) + 2.0,
            f * (f * (4.0 - 3.0 * f) + 1.0),
            f * f * (f - 1.0),
        ]
    )


@ti.func
def size_of(wheelset: int, side: int, wheel: Array, own: Template):
    """Size of a wheel; the longer vector, which the functions below recognise, if ``own`` = 1."""
    if ti.static(own == 1):
        return ti.Vector(
            [
                wheel[wheelset, at.NOMINAL_RADIUS],
                wheel[wheelset, at.HALF_SPACING],
                wheel[wheelset, at.RADIUS_LEFT + side],
                wheel[wheelset, at.LARGER_LEFT + side],
                wheel[wheelset, at.CROWN_LEFT + side],
                wheel[wheelset, at.ROW_LEFT + side],
            ]
        )
    else:
        return ti.Vector([wheel[wheelset, at.NOMINAL_RADIUS], wheel[wheelset, at.HALF_SPACING]])


@ti.func
def lookup(u: float, alpha: float, table: Array, constants: Array, patch: Template, size: Template):
    """All columns of a patch of a wheel's contact table at (u, alpha); outside the table its edge values are kept."""
    first, rows = 0, table.shape[0]
    if ti.static(size.get_shape()[0] == OF_WHEEL):
        first, rows = ti.cast(size[FIRST_ROW], ti.i32), ti.cast(constants[at.TABLE_ROWS], ti.i32)
    x = (u - constants[at.TABLE_U0]) / constants[at.TABLE_DU]
    y = (alpha - constants[at.TABLE_ALPHA0]) / constants[at.TABLE_DALPHA]
    i = ti.min(ti.max(ti.cast(ti.floor(x), ti.i32), 1), rows - 3)
    j = ti.min(ti.max(ti.cast(ti.floor(y), ti.i32), 1), table.shape[1] - 3)
    wx = catmull_rom(ti.min(ti.max(x - i, 0.0), 1.0))
    wy = catmull_rom(ti.min(ti.max(y - j, 0.0), 1.0))
    value = ti.Vector.zero(ti.f64, at.N_TABLE)
    for m in range(4):
        for n in range(4):
            weight = wx[m] * wy[n]
            for column in ti.static(range(at.N_TABLE)):
                value[column] += weight * table[first + i + m - 1, j + n - 1, patch * at.N_TABLE + column]
    return value


@ti.func
def sine_and_cosine(x: float):
    """Sine and cosine; of small angles by their series, to rounding, in a quarter of the time."""
    s, c = 0.0, 0.0
    if ti.abs(x) < SMALL_ANGLE:
        y = x * x
        s = x * (1.0 + y * (S3 + y * (S5 + y * (S7 + y * (S9 + y * S11)))))
        c = 1.0 + y * (C2 + y * (C4 + y * (C6 + y * (C8 + y * C10))))
    else:
        s, c = ti.sin(x), ti.cos(x)
    return s, c


@ti.func
def contact_state(
    sigma: float,
    V: float,
    size: Template,
    x: Template,
    dx: Template,
    rail: Template,
    rail_slope: Template,
    rail_rate: Template,
    irregularity: Template,
    rolls: int,
    table: Array,
    constants: Array,
    patch: Template,
):
    """Penetration, creepages and geometry of one wheel.

    Args:
        sigma: Side.
        V: Speed [m/s].
        size: Of the wheel, see :func:`size_of`.
        x: Wheelset y, z, roll, pitch, yaw [m, rad].
        dx: Its rates.
        rail: w, v, theta_x of the rail under the wheel [m, m, rad].
        rail_slope: Their d/ds.
        rail_rate: Their rates at constant s.
        irregularity: Track channels at the wheelset, N_IRREGULARITY of them or, with shapes, N_FELT, see ``layout``.
        rolls: 1 if a cross level turns the railheads.
        table: Contact geometry, shape (tables n_u, n_alpha, N_TABLE patches).
        constants: Numbers, see ``layout``.
        patch: Slot of the table, 0 or 1.
    """
    h_r, b_i, y_r = constants[at.ARM_HEAD], constants[at.IRREGULARITY_HALF_BASE], constants[at.CROWN_OFFSET]
    r0, b0 = size[0], size[1]
    radius = r0  # of the wheel itself; r0 belongs to the wheelset's spin
    if ti.static(size.get_shape()[0] == OF_WHEEL):
        radius, y_r = size[WHEEL_RADIUS], size[CROWN]
    w, v, theta_x = rail[0], rail[1], rail[2]
    turn = irregularity[at.CROSS_LEVEL] * rolls
    turn_slope = irregularity[at.CROSS_LEVEL_SLOPE] * rolls
    z_irr = irregularity[at.Z_V] + sigma * b_i * irregularity[at.CROSS_LEVEL]
    z_slope = irregularity[at.Z_V_SLOPE] + sigma * b_i * irregularity[at.CROSS_LEVEL_SLOPE]
    y_irr = irregularity[at.Y_A] + sigma * 0.5 * irregularity[at.GAUGE]
    y_slope = irregularity[at.Y_A_SLOPE] + sigma * 0.5 * irregularity[at.GAUGE_SLOPE]
    of_left, of_right = 0.5 - 0.5 * sigma, 0.5 + 0.5 * sigma
    if ti.static(irregularity.get_shape()[0] > at.N_IRREGULARITY):
        z_irr += of_left * irregularity[at.RAIL_LEFT] + of_right * irregularity[at.RAIL_RIGHT]
        z_slope += of_left * irregularity[at.RAIL_LEFT_SLOPE] + of_right * irregularity[at.RAIL_RIGHT_SLOPE]
        z_slope -= of_left * irregularity[at.WHEEL_LEFT_SLOPE] + of_right * irregularity[at.WHEEL_RIGHT_SLOPE]

    u = sigma * ((x[0] - radius * x[2]) - (v + h_r * theta_x + y_irr))
    alpha = sigma * (x[2] - theta_x - turn)
    g = lookup(u, alpha, table, constants, patch, size)
    cos_gamma = 1.0 / ti.sqrt(1.0 + g[at.TAN_GAMMA] * g[at.TAN_GAMMA])
    sin_gamma = g[at.TAN_GAMMA] * cos_gamma
    sin_turn, cos_turn = sine_and_cosine(sigma * (theta_x + turn))
    sin_alpha, cos_alpha = sine_and_cosine(alpha)
    c, s = cos_gamma * cos_turn + sin_gamma * sin_turn, sin_gamma * cos_turn - cos_gamma * sin_turn
    s_w, s_r, r_c = g[at.S_WHEEL], g[at.S_RAIL], g[at.RADIUS]
    if ti.static(size.get_shape()[0] == OF_WHEEL):
        r_c += size[LARGER]
    h_c = h_r - (r_c - radius)
    p = (
        x[1]
        + sigma * b0 * x[2]
        - (w + z_irr + sigma * (b0 - y_r + u) * theta_x + sigma * (b0 - b_i + u) * turn)
        - g[at.GAP]
    )
    if ti.static(irregularity.get_shape()[0] > at.N_IRREGULARITY):
        p += of_left * irregularity[at.WHEEL_LEFT] + of_right * irregularity[at.WHEEL_RIGHT]
    if ti.static(size.get_shape()[0] == OF_WHEEL):
        p += radius - r0

    # Lateral: the material velocity of the rail head. Vertical: a wheel that follows the rail's shape rolls on it.
    inverse_V = 1.0 / V
    across = (
        dx[0] - V * x[4] - dx[2] * r_c - (rail_rate[1] - V * rail_slope[1]) - h_c * (rail_rate[2] - V * rail_slope[2])
    )
    advance = V * (s / c) * (x[4] - rail_slope[1] - h_c * rail_slope[2] - (radius - r_c) * turn_slope - y_slope)
    down = (
        dx[1]
        + sigma * (b0 + s_w) * dx[2]
        - (rail_rate[0] + sigma * s_r * rail_rate[2])
        - V * (z_slope + sigma * (y_r + s_r - b_i) * turn_slope)
        + sigma * advance
    )
    xi_x = (V * (1.0 - r_c / r0) + dx[3] * r_c - sigma * (b0 + s_w) * dx[4]) * inverse_V
    xi_y = (across * c - sigma * down * s) * inverse_V
    xi_s = (-sigma * (V / r0) * (sin_gamma * cos_alpha + cos_gamma * sin_alpha) + dx[4] * c) * inverse_V
    return ti.Vector(
        [
            p * cos_gamma,
            xi_x,
            xi_y,
            xi_s,
            s,
            c,
            s_w,
            s_r,
            r_c,
            g[at.HERTZ],
            g[at.C11],
            g[at.C22],
            g[at.C23],
            g[at.C33],
            u,
            z_irr,
            y_irr,
            w,
            alpha,
        ]
    )


@ti.func
def saturation(tau: float):
    """Shen-Hedrick-Elkins: (T'/T, d(T'/T)/dtau) at tau = T / (mu N); C1 at tau = 3."""
    factor = 1.0 - tau * (1.0 / 3.0 - tau * (1.0 / 27.0))
    slope = -1.0 / 3.0 + tau * (2.0 / 27.0)
    if tau > 3.0:
        factor = 1.0 / tau
        slope = -factor * factor
    return ti.Vector([factor, slope])


@ti.func
def cube_root(x: float):
    """Cube root of a positive number: a third of its exponent, within 4 %, then Halley's steps (4 % -> 5e-5 -> 1e-13).

    A general power takes five times as long.
    """
    y = ti.bit_cast(ti.bit_cast(ti.cast(x, ti.f64), ti.i64) // ti.i64(3) + ti.i64(THIRD_OF_EXPONENTS), ti.f64)
    for _ in ti.static(range(3)):
        cube = y * y * y
        y = y * (cube + 2.0 * x) / (2.0 * cube + x)
    return y


@ti.func
def contact_law(state: Template, friction: float):
    """Forces (N, Fx, Fy, Mz) on the wheel in the contact frame, and their derivatives by (delta, xi_x, xi_y, xi_s).

    Hertz N = K delta^1.5 (wheel lift: zero); linear creep forces f11 = c11 N^(2/3), f22 = c22 N^(2/3), f23 = c23 N,
    f33 = c33 N^(4/3); Shen-Hedrick-Elkins saturation; the spin moment scales with T'/T.
    """
    force = ti.Vector([0.0, 0.0, 0.0, 0.0])
    D = ti.Matrix.zero(ti.f64, 4, 4)
    delta = state[DELTA]
    if delta > 0.0:
        root = ti.sqrt(delta)
        third = cube_root(state[KH]) * root  # N^(1/3)
        N = state[KH] * delta * root
        f11, f22 = state[K11] * third * third, state[K22] * third * third
        f23, f33 = state[K23] * N, state[K33] * N * third
        xi_x, xi_y, xi_s = state[XI_X], state[XI_Y], state[XI_S]
        Tx, Ty, Mz = -f11 * xi_x, -f22 * xi_y - f23 * xi_s, f23 * xi_y - f33 * xi_s
        T = ti.sqrt(Tx * Tx + Ty * Ty) + 1e-12 * N  # keeps d tau finite at rest
        limit = 1.0 / (friction * N)
        tau = T * limit
        e = saturation(tau)
        force = ti.Vector([N, e[0] * Tx, e[0] * Ty, e[0] * Mz])

        # Columns: derivatives of the linear forces by N (through delta) and by the three creepages.
        relative = 1.5 / delta  # dN / N by delta
        dTx = ti.Vector([2.0 / 3.0 * Tx * relative, -f11, 0.0, 0.0])
        dTy = ti.Vector([(-2.0 / 3.0 * f22 * xi_y - f23 * xi_s) * relative, 0.0, -f22, -f23])
        dMz = ti.Vector([(f23 * xi_y - 4.0 / 3.0 * f33 * xi_s) * relative, 0.0, f23, -f33])
        along = limit / T
        for m in ti.static(range(4)):
            dtau = (Tx * dTx[m] + Ty * dTy[m]) * along
            if ti.static(m == 0):
                dtau -= tau * relative
                D[0, 0] = N * relative
            D[1, m] = e[0] * dTx[m] + Tx * e[1] * dtau
            D[2, m] = e[0] * dTy[m] + Ty * e[1] * dtau
            D[3, m] = e[0] * dMz[m] + Mz * e[1] * dtau
    return force, D


@ti.func
def placing(state: Template):
    """Quantities that the directions of a wheel's forces depend on: sin and cos of gamma_t, s_w, s_r, r_c."""
    return ti.Vector([state[SIN], state[COS], state[S_W], state[S_R], state[R_C]])


@ti.func
def force_directions(sigma: float, size: Template, h_r: float, place: Template):
    """Generalised forces of unit (N, Fx, Fy, Mz): on the wheelset (5, 4) and on the rail's w, v, theta_x (3, 4).

    The arms are those of the contact point: (sigma (b0 + s_w), r_c) on the wheelset, (sigma s_r, -h_c) on the rail.
    """
    s, c = place[0], place[1]
    arm, r, s_r = size[1] + place[2], place[4], place[3]
    radius = size[0]
    if ti.static(size.get_shape()[0] == OF_WHEEL):
        radius = size[WHEEL_RADIUS]
    h_c = h_r - (r - radius)
    wheelset = ti.Matrix(
        [
            [-sigma * s, 0.0, c, 0.0],
            [-c, 0.0, -sigma * s, 0.0],
            [-sigma * (arm * c - r * s), 0.0, -arm * s - r * c, 0.0],
            [0.0, r, 0.0, sigma * s],
            [0.0, -sigma * arm, 0.0, c],
        ]
    )
    rail = ti.Matrix(
        [
            [c, 0.0, sigma * s, 0.0],
            [sigma * s, 0.0, -c, 0.0],
            [sigma * (s_r * c + h_c * s), 0.0, s_r * s - h_c * c, 0.0],
        ]
    )
    return wheelset, rail
