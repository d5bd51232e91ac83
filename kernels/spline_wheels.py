"""Contact between the two sweeps of the rails.

With A = L U and y = L^-1 F the acceleration under a wheel is w.A^-1 F = (U^-T w).y: a one-sided row times the forward
result. The wheels' force enters the same way, y + (L^-1 w) f, before the backward sweep. Both decay away from the
wheel towards the front, and are cut where they have fallen to rounding.
"""

import taichi as ti

from tiengine.kernels import contact as ct
from tiengine.kernels import layout
from tiengine.kernels import out_of_round as oor
from tiengine.kernels import patches as pt
from tiengine.kernels import spline_layout as at
from tiengine.kernels.types import Array, Template
from tiengine.kernels.vehicle_columns import INVERSE_COLUMNS, load_row, number

# Vectors of a wheelset in ``under``: both rails under it at the predictors, at the step's end without a change of the
# wheels' forces (w, v, theta_x, slopes, rates at constant s), then the wheels' forces on w, v, theta_x.
PREDICTED, FREE, LOAD, N_UNDER = 0, 9, 18, 21

ROWS_OF = ((0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1))  # (w, v, theta_x) by (value, slope)


@ti.func
def rail_predicted(
    c: int, first: int, dims: Array, place: Array, wheel_shape: Array, rail: Array, under: Array, lanes: Template
):
    """Rails under the wheels at the predictors; ``wheel_shape`` holds four functions' (value, slope), (W, 4, 2)."""
    for w in range(dims[layout.WHEELSETS]):
        o = (c * dims[layout.WHEELSETS] + w) * N_UNDER + PREDICTED
        start = (first + place[w, at.WHEEL_FIRST]) * at.RAIL_ROWS
        for f in ti.static(range(3)):
            field = ti.static((at.W, at.V_LATERAL, at.THETA_X)[f])
            value, slope, rate = (
                ti.Vector.zero(ti.f64, lanes),
                ti.Vector.zero(ti.f64, lanes),
                ti.Vector.zero(ti.f64, lanes),
            )
            for q in ti.static(range(4)):
                u = rail[start + q * at.RAIL_ROWS + 5 * at.U_PREDICTED + field]
                v = rail[start + q * at.RAIL_ROWS + 5 * at.V_PREDICTED + field]
                value = value + wheel_shape[w, q, 0] * u
                slope = slope + wheel_shape[w, q, 1] * u
                rate = rate + wheel_shape[w, q, 0] * v
            under[o + f], under[o + 3 + f], under[o + 6 + f] = value, slope, rate


@ti.func
def rail_without_wheels(
    c: int, first: int, beta_dt2: float, gamma_dt: float, dims: Array, place: Array, rows: Array, rail: Array,
    under: Array, lanes: Template,
):  # fmt: skip
    """Rails under the wheels at the step's end without any wheel's force.

    Args:
        c: Chunk.
        first: Place of its first function in ``rail``.
        beta_dt2: beta dt^2 [s^2].
        gamma_dt: gamma dt [s].
        dims: Sizes, see ``layout``.
        place: See ``spline_layout``, shape (W, N_WHEEL_PLACE).
        rows: One-sided rows and columns, shape (W longest N_WHEEL_FUNCTION,).
        rail: State of the rails.
        under: See this module, shape (chunks W N_UNDER,).
        lanes: Lanes of a vector.
    """
    zero = ti.Vector.zero(ti.f64, lanes)
    W = dims[layout.WHEELSETS]
    longest = rows.shape[0] // (W * at.N_WHEEL_FUNCTION)
    for w in range(W):
        a = [zero, zero, zero, zero, zero, zero]
        start = first + place[w, at.ROWS_FIRST]
        for i in range(place[w, at.ROWS_COUNT]):
            k = (start + i) * at.RAIL_ROWS + 5 * at.FORWARD_RESULT
            m = (w * longest + i) * at.N_WHEEL_FUNCTION + at.WHEEL_ROWS
            for n in ti.static(range(2)):
                a[n] = a[n] + rows[m + 2 * n] * rail[k] + rows[m + 2 * n + 1] * rail[k + 1]
            for n in ti.static(range(4)):
                r = m + 4 + 3 * n
                a[2 + n] = a[2 + n] + rows[r] * rail[k + 2] + rows[r + 1] * rail[k + 3] + rows[r + 2] * rail[k + 4]
        o = (c * W + w) * N_UNDER
        for f in ti.static(range(3)):
            under[o + FREE + f] = under[o + PREDICTED + f] + beta_dt2 * a[2 * f]
            under[o + FREE + 3 + f] = under[o + PREDICTED + 3 + f] + beta_dt2 * a[2 * f + 1]
            under[o + FREE + 6 + f] = under[o + PREDICTED + 6 + f] + gamma_dt * a[2 * f]


@ti.func
def rail_without_change(
    b: int, w: int, side: Template, p: int, lane: int, dims: Array, constants: Array, place: Array, coupling: Array,
    rail_force: Array, under: Array,
):  # fmt: skip
    """Rail under a wheel at the step's end if no wheel changed the force it has now; ``p`` is its first vector."""
    free = ti.Vector.zero(ti.f64, 9)
    for m in ti.static(range(9)):
        free[m] = under[p + FREE + m][lane]
    for k in range(place[w, at.COUPLED_FIRST], place[w, at.COUPLED_END]):
        vertical, lateral, turning = rail_force[b, k, side, 0], rail_force[b, k, side, 1], rail_force[b, k, side, 2]
        for kind in ti.static(range(2)):
            a = coupling[w, kind, k, 0, 0] * vertical
            free[3 * kind] += constants[layout.BETA_DT2] * a
            if ti.static(kind == 0):
                free[6] += constants[layout.GAMMA_DT] * a
            for f in ti.static(range(1, 3)):
                a = coupling[w, kind, k, f, 1] * lateral + coupling[w, kind, k, f, 2] * turning
                free[3 * kind + f] += constants[layout.BETA_DT2] * a
                if ti.static(kind == 0):
                    free[6 + f] += constants[layout.GAMMA_DT] * a
    return free


@ti.func
def wheelset_without_change(
    b: int, w: int, start: int, constants: Array, wheelset_place: Array, car: Array, blocks: Template
):
    """Wheelset's coordinates and rates at the step's end if no wheel changed the force it has now."""
    x, dx = ti.Vector.zero(ti.f64, 5), ti.Vector.zero(ti.f64, 5)
    for m in ti.static(range(5)):
        q = start + wheelset_place[w, m]
        a = number(car, q + at.A * blocks * 8)
        x[m] = number(car, q + at.U_PREDICTED * blocks * 8) + constants[layout.BETA_DT2] * a
        dx[m] = number(car, q + at.V_PREDICTED * blocks * 8) + constants[layout.GAMMA_DT] * a
    return x, dx


@ti.func
def add_wheelset_change(
    b: int, w: int, start: int, before: Template, wheelset_place: Array, wheelset_force: Array,
    car_columns_start: Array, columns: Array, car: Array, blocks: Template,
):  # fmt: skip
    """Add A^-1 times the change of a wheelset's contact forces to its car's acceleration."""
    per_car = at.CAR_ROWS * blocks * 8
    i = wheelset_place[w, 0] // per_car
    out = start // 8 + i * at.CAR_ROWS * blocks + at.A * blocks
    tables = car_columns_start[i] + INVERSE_COLUMNS * 8 * blocks * blocks
    for m in ti.static(range(5)):
        change = wheelset_force[b, w, m] - before[m]
        k = tables + (wheelset_place[w, m] % per_car) * blocks
        for n in ti.static(range(blocks)):
            car[out + n] = car[out + n] + columns[k + n] * change


@ti.func
def felt_channels(
    b: int, step: int, w: int, pitch: float, irregularity: Array, wheel: Array, constants: Array, shaped: Template
):
    """Track channels under a wheelset in a step, with the shapes of rails and wheels if ``shaped`` = 1."""
    if ti.static(shaped == 1):
        return oor.shaped_channels_at(b, step, w, pitch, irregularity, wheel, constants)
    else:
        return ct.channels_at(b, step, w, irregularity)


@ti.func
def contact_of_train(
    b: int, c: int, lane: int, step: int, V: float, tolerance: float, record: int, dims: Array, constants: Array,
    place: Array, wheelset_place: Array, car_columns_start: Array, columns: Array, wheel: Array, table: Array,
    irregularity: Array, wheelset_compliance: Array, coupling: Array, contact: Array, force: Array,
    wheelset_force: Array, rail_force: Array, iterations_out: Array, wheel_record_out: Array, car: Array,
    under: Array, load: Array, size: Array, blocks: Template, patches: Template, shaped: Template,
    own: Template,
):  # fmt: skip
    """Solve the contact of all wheelsets of a train, one after another, and leave the rails' loads in ``under``.

    A wheelset yaws against the rails with its own rate and that of the track frame. ``lane`` is the train's left rail;
    ``record`` is the row of the wheels' record to fill, -1 for none; with ``shaped`` = 1 rails have shapes or wheels
    are out of round (``out_of_round``), with ``own`` = 1 wheels have radii and contact tables of their own; other
    arguments as in ``contact``, ``vehicle_columns`` and this module.
    """
    start = b * size[at.CARS] * at.CAR_ROWS * blocks * 8
    yaw_rate = (load_row(b, step, size, blocks) + size[at.CARS] * blocks) * 8 + size[at.ELEMENTS]
    for w in range(dims[layout.WHEELSETS]):
        p = (c * dims[layout.WHEELSETS] + w) * N_UNDER
        x, dx = wheelset_without_change(b, w, start, constants, wheelset_place, car, blocks)
        channels = felt_channels(b, step, w, x[3], irregularity, wheel, constants, shaped)
        dx[4] += number(load, yaw_rate + w)
        left = rail_without_change(b, w, 0, p, lane, dims, constants, place, coupling, rail_force, under)
        right = rail_without_change(b, w, 1, p, lane + 1, dims, constants, place, coupling, rail_force, under)
        before = ti.Vector.zero(ti.f64, 5)
        for m in ti.static(range(5)):
            before[m] = wheelset_force[b, w, m]
        count = pt.solve_wheelset(
            b, w, V, x, dx, left, right, channels, dims, constants, wheel, table, wheelset_compliance, coupling,
            contact, force, wheelset_force, rail_force, tolerance, patches, own,
        )  # fmt: skip
        add_wheelset_change(
            b, w, start, before, wheelset_place, wheelset_force, car_columns_start, columns, car, blocks
        )
        iterations_out[b, w] = ti.max(iterations_out[b, w], count)
        if record >= 0:
            pt.record_wheels(b, w, record, contact, force, rail_force, wheel_record_out, patches)
    for w in range(dims[layout.WHEELSETS]):
        p = (c * dims[layout.WHEELSETS] + w) * N_UNDER + LOAD
        for side in ti.static(range(2)):
            for m in ti.static(range(3)):
                under[p + m][lane + side] = rail_force[b, w, side, m]


@ti.func
def add_wheel_columns(c: int, first: int, dims: Array, place: Array, rows: Array, rail: Array, under: Array):
    """Add the wheels' one-sided columns to the forward result; arguments as in :func:`rail_without_wheels`."""
    W = dims[layout.WHEELSETS]
    longest = rows.shape[0] // (W * at.N_WHEEL_FUNCTION)
    for w in range(W):
        o = (c * W + w) * N_UNDER + LOAD
        vertical, lateral, turning = under[o], under[o + 1], under[o + 2]
        start = first + place[w, at.ROWS_FIRST]
        for i in range(place[w, at.ROWS_COUNT]):
            k = (start + i) * at.RAIL_ROWS + 5 * at.FORWARD_RESULT
            m = (w * longest + i) * at.N_WHEEL_FUNCTION + at.WHEEL_COLUMNS
            for f in ti.static(range(2)):
                rail[k + f] = rail[k + f] + rows[m + f] * vertical
            for f in ti.static(range(3)):
                rail[k + 2 + f] = rail[k + 2 + f] + rows[m + 2 + f] * lateral + rows[m + 5 + f] * turning
