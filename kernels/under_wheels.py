"""Wheels and the linear part of a step: motion under a wheel without its force, and its forces in F.

Wheels stand still in the window, so that their places in A^-1 are constant: ``answer`` are its rows there, and
``coupling`` the values of the rows at all wheels of a rail. The motion at the step's end is x = x~ + S (rows of A^-1) F
with S = beta dt^2 for displacements and gamma dt for rates.
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array, Template


@ti.func
def stored_rail(b: int, wheelset: int, side: Template, rail: Array):
    """Rail motion under a wheel: w, v, theta_x, slopes, rates at constant s."""
    r = ti.Vector.zero(ti.f64, 9)
    for m in ti.static(range(9)):
        r[m] = rail[b, wheelset, side, m]
    return r


@ti.func
def field_base(b: int, rail: int, field: Template, dims: Array):
    """First column of w, v or theta_x of a rail."""
    base = (b * 2 + rail) * 2 * dims[at.MODES]
    if ti.static(field > 0):
        base = dims[at.LATERAL] + (b * 2 + rail) * 3 * dims[at.MODES]
    if ti.static(field == 2):
        base += 2 * dims[at.MODES]
    return base


@ti.func
def rail_predicted(b: int, wheelset: int, rail: int, dims: Array, shape: Array, motion: Array, predicted_out: Array):
    """Rail under a wheel at the predictors, ``[b, wheelset, rail]``: w, v, theta_x, slopes, rates at constant s."""
    for field in ti.static(range(3)):
        base = field_base(b, rail, field, dims)
        value, slope, rate = 0.0, 0.0, 0.0
        for i in range(dims[at.MODES]):
            value += shape[0, wheelset, i] * motion[at.U_PREDICTED, base + i]
            slope += shape[1, wheelset, i] * motion[at.U_PREDICTED, base + i]
            rate += shape[0, wheelset, i] * motion[at.V_PREDICTED, base + i]
        predicted_out[b, wheelset, rail, field] = value
        predicted_out[b, wheelset, rail, 3 + field] = slope
        predicted_out[b, wheelset, rail, 6 + field] = rate


@ti.func
def rail_without_change(
    b: int, wheelset: int, rail: int, dims: Array, constants: Array, answer: Array, coupling: Array, motion: Array,
    predicted: Array, rail_force: Array,
):  # fmt: skip
    """Rail under a wheel at the step's end if no wheel changed the force it has now.

    ``answer[w, 0 or 1, :]`` are the rows of A^-1, and of its slope, under wheelset w: 2 n for w, 3 n for v, 3 n for
    theta_x. ``coupling[w, 0 or 1, k]`` is the response there to forces on w, v, theta_x under wheelset k.
    """
    n = dims[at.MODES]
    free = stored_rail(b, wheelset, rail, predicted)
    for field in ti.static(range(3)):
        base, count, first = (b * 2 + rail) * 2 * n, 2 * n, 0
        if ti.static(field > 0):
            base, count, first = dims[at.LATERAL] + (b * 2 + rail) * 3 * n, 3 * n, (3 * field - 1) * n
        value, slope = 0.0, 0.0
        for i in range(count):
            value += answer[wheelset, 0, first + i] * motion[at.F, base + i]
            slope += answer[wheelset, 1, first + i] * motion[at.F, base + i]
        for k in range(dims[at.WHEELSETS]):
            for m in ti.static(range(3)):
                value += coupling[wheelset, 0, k, field, m] * rail_force[b, k, rail, m]
                slope += coupling[wheelset, 1, k, field, m] * rail_force[b, k, rail, m]
        free[field] += constants[at.BETA_DT2] * value
        free[3 + field] += constants[at.BETA_DT2] * slope
        free[6 + field] += constants[at.GAMMA_DT] * value
    return free


@ti.func
def wheelset_without_change(
    b: int, wheelset: int, dims: Array, constants: Array, dof: Array, answer: Array, motion: Array
):
    """Wheelset y, z, roll, pitch, yaw and their rates at the step's end if no wheel changed the force it has now.

    Row F of the motion holds the wheels' present forces; ``answer`` are the rows of A^-1 of the wheelsets' coordinates.
    """
    n = dims[at.VEHICLE_DOFS]
    base = dims[at.VEHICLES] + b * n
    x, dx = ti.Vector.zero(ti.f64, 5), ti.Vector.zero(ti.f64, 5)
    for m in ti.static(range(5)):
        q = base + dof[wheelset, m]
        a = motion[at.LINEAR, q]
        for i in range(n):
            a += answer[5 * wheelset + m, i] * motion[at.F, base + i]
        x[m] = motion[at.U_PREDICTED, q] + constants[at.BETA_DT2] * a
        dx[m] = motion[at.V_PREDICTED, q] + constants[at.GAMMA_DT] * a
    return x, dx


@ti.func
def add_wheelset_force(b: int, wheelset: int, sign: float, dims: Array, dof: Array, force: Array, motion: Array):
    """Add the contact forces on a wheelset to F, or subtract them."""
    base = dims[at.VEHICLES] + b * dims[at.VEHICLE_DOFS]
    for m in ti.static(range(5)):
        q = base + dof[wheelset, m]
        motion[at.F, q] = motion[at.F, q] + sign * force[b, wheelset, m]


@ti.func
def add_rail_forces(b: int, dims: Array, shape: Array, rail_force: Array, motion: Array):
    """Add the contact forces on both rails to F."""
    n = dims[at.MODES]
    for rail in range(2):
        w = (b * 2 + rail) * 2 * n
        v = dims[at.LATERAL] + (b * 2 + rail) * 3 * n
        for i in range(n):
            vertical, lateral, turning = 0.0, 0.0, 0.0
            for k in range(dims[at.WHEELSETS]):
                phi = shape[0, k, i]
                vertical += phi * rail_force[b, k, rail, 0]
                lateral += phi * rail_force[b, k, rail, 1]
                turning += phi * rail_force[b, k, rail, 2]
            motion[at.F, w + i] = motion[at.F, w + i] + vertical
            motion[at.F, v + i] = motion[at.F, v + i] + lateral
            motion[at.F, v + 2 * n + i] = motion[at.F, v + 2 * n + i] + turning
