"""The two launches of a pass of the full-length model; between them the host computes seats and slabs.

``rails[row, 5 rail + field, i]`` holds the modal coordinates (rows as in the engine's ``layout``; fields w, theta_y, v,
theta_z, theta_x). ``motion`` holds only the vehicle, so that the engine's vehicle and contact functions can be used
unchanged. Everything that couples a rail's modes is a loop over seats (host) or over wheels (here).
"""

import taichi as ti

from tiengine.kernels import contact as ct
from tiengine.kernels import layout as at
from tiengine.kernels import patches as pt
from tiengine.kernels import step as engine
from tiengine.kernels import suspension
from tiengine.kernels import under_wheels as uw
from tiengine.kernels.types import (
    Array,
    Ints1,
    Ints2,
    Reals1,
    Reals2,
    Reals3,
    Reals4,
    Reals5,
    Template,
)
from validation.msm import model as m

FIELDS = 5
W, THETA_Y, V, THETA_Z, THETA_X = range(FIELDS)


@ti.func
def predict_rails(constants: Array, numbers: Array, stiffness: Array, rails: Array):
    """Compute the Newmark predictors, and -K u at them in row LINEAR."""
    dt, half_beta, half_gamma = constants[at.DT], numbers[m.HALF_BETA_DT2], numbers[m.HALF_GAMMA_DT]
    for f in ti.static(range(2 * FIELDS)):
        for i in range(rails.shape[2]):
            u, v, a = rails[at.U, f, i], rails[at.V, f, i], rails[at.A, f, i]
            rails[at.U_PREDICTED, f, i] = u + dt * v + half_beta * a
            rails[at.V_PREDICTED, f, i] = v + half_gamma * a
            rails[at.U, f, i] = u + dt * v + half_beta * a
            rails[at.V, f, i] = v + half_gamma * a
            rails[at.A, f, i] = 0.0
    for rail in ti.static(range(2)):
        for i in range(rails.shape[2]):
            for p, k in ti.static(((5 * rail + W, m.WW), (5 * rail + V, m.VV))):
                x, y = rails[at.U_PREDICTED, p, i], rails[at.U_PREDICTED, p + 1, i]
                rails[at.LINEAR, p, i] = -(stiffness[k, i] * x + stiffness[k + 1, i] * y)
                rails[at.LINEAR, p + 1, i] = -(stiffness[k + 1, i] * x + stiffness[k + 2, i] * y)
            torsion = rails[at.U_PREDICTED, 5 * rail + THETA_X, i]
            rails[at.LINEAR, 5 * rail + THETA_X, i] = -stiffness[m.TORSION, i] * torsion


@ti.func
def fold(numbers: Array, target: Array, sign: Array, rails: Array, folded: Array):
    """Rails' forces at the seats, folded for the sine transform: rows vertical, moment, lateral, each by rail."""
    kv, cv, kl, cl = numbers[m.KV], numbers[m.CV], numbers[m.KL], numbers[m.CL]
    a, base2 = numbers[m.ARM], numbers[m.BASE2]
    for row in ti.static(range(6)):
        for j in range(folded.shape[1]):
            folded[row, j] = 0.0
    for rail in ti.static(range(2)):
        for i in range(rails.shape[2]):
            j, s = target[i], sign[i]
            theta, rate = rails[at.U, 5 * rail + THETA_X, i], rails[at.V, 5 * rail + THETA_X, i]
            across, speed = rails[at.U, 5 * rail + V, i] - a * theta, rails[at.V, 5 * rail + V, i] - a * rate
            folded[rail, j] = folded[rail, j] + s * (
                kv * rails[at.U, 5 * rail + W, i] + cv * rails[at.V, 5 * rail + W, i]
            )
            folded[2 + rail, j] = folded[2 + rail, j] + s * base2 * (kv * theta + cv * rate)
            folded[4 + rail, j] = folded[4 + rail, j] + s * (kl * across + cl * speed)


@ti.func
def wheel_shapes(position: float, numbers: Array, wheelset_x: Array, shape: Array):
    """Compute sin(k_i x) and k_i cos(k_i x) under every wheelset, by rotation from each mode to the next."""
    for w in range(wheelset_x.shape[0]):
        k = ti.math.pi / numbers[m.RAIL_LENGTH]
        angle = k * (position + wheelset_x[w] - numbers[m.X_REAR])
        c1, s1 = ti.cos(angle), ti.sin(angle)
        c, s = c1, s1
        for i in range(shape.shape[2]):
            shape[0, w, i] = s
            shape[1, w, i] = (i + 1) * k * c
            turned = s * c1 + c * s1
            c = c * c1 - s * s1
            s = turned


@ti.func
def compliances(inverse: Array, shape: Array, compliance: Array):
    """Value and slope of w, v, theta_x under a wheelset by unit forces there, shape (W, 2, W, 3, 3)."""
    for w in range(shape.shape[1]):
        for kind in ti.static(range(2)):
            total = ti.Vector.zero(ti.f64, 4)
            for i in range(shape.shape[2]):
                both = shape[0, w, i] * shape[kind, w, i]
                for n, row in ti.static(enumerate((m.INV_WW, m.INV_VV, m.INV_VX, m.INV_XX))):
                    total[n] += both * inverse[row, i]
            compliance[w, kind, w, 0, 0] = total[0]
            compliance[w, kind, w, 1, 1] = total[1]
            compliance[w, kind, w, 1, 2] = total[2]
            compliance[w, kind, w, 2, 1] = total[2]
            compliance[w, kind, w, 2, 2] = total[3]


@ti.func
def wheel_load(rail: Template, i: int, shape: Array, force: Array):
    """Generalised forces of the wheels of one rail on mode i of w, v, theta_x."""
    g = ti.Vector.zero(ti.f64, 3)
    for w in range(shape.shape[1]):
        for k in ti.static(range(3)):
            g[k] += shape[0, w, i] * force[0, w, rail, k]
    return g


@ti.func
def respond(i: int, inverse: Array, r: Template):
    """A^-1 r of one mode; r and the result are w, theta_y, v, theta_z, theta_x."""
    x = ti.Vector.zero(ti.f64, FIELDS)
    x[0] = inverse[m.INV_WW, i] * r[0] + inverse[m.INV_WT, i] * r[1]
    x[1] = inverse[m.INV_WT, i] * r[0] + inverse[m.INV_TT, i] * r[1]
    x[2] = inverse[m.INV_VV, i] * r[2] + inverse[m.INV_VZ, i] * r[3] + inverse[m.INV_VX, i] * r[4]
    x[3] = inverse[m.INV_VZ, i] * r[2] + inverse[m.INV_ZZ, i] * r[3] + inverse[m.INV_ZX, i] * r[4]
    x[4] = inverse[m.INV_VX, i] * r[2] + inverse[m.INV_ZX, i] * r[3] + inverse[m.INV_XX, i] * r[4]
    return x


@ti.func
def solve_rails(
    numbers: Array, constants: Array, inverse: Array, target: Array, sign: Array, folded: Array,
    shape: Array, force: Array, rails: Array,
):  # fmt: skip
    """Compute the accelerations of all modes from linear forces, seats and the wheels' forces known so far."""
    a, base2, sv, sl = numbers[m.ARM], numbers[m.BASE2], numbers[m.SMEAR_V], numbers[m.SMEAR_L]
    for rail in ti.static(range(2)):
        for i in range(rails.shape[2]):
            g = wheel_load(rail, i, shape, force)
            j, s = target[i], sign[i]
            vertical, moment, lateral = s * folded[rail, j], s * folded[2 + rail, j], s * folded[4 + rail, j]
            r, before = ti.Vector.zero(ti.f64, FIELDS), ti.Vector.zero(ti.f64, FIELDS)
            for f in ti.static(range(FIELDS)):
                r[f] = rails[at.LINEAR, 5 * rail + f, i]
                before[f] = rails[at.A, 5 * rail + f, i]  # zero in the first pass
            smeared = sl * (before[V] - a * before[THETA_X])
            r[W] += g[0] - vertical + sv * before[W]
            r[V] += g[1] - lateral + smeared
            r[THETA_X] += g[2] - moment + a * lateral + base2 * sv * before[THETA_X] - a * smeared
            x = respond(i, inverse, r)
            for f in ti.static(range(FIELDS)):
                rails[at.A, 5 * rail + f, i] = x[f]
    update_rails(constants, rails)


@ti.func
def add_wheels(constants: Array, inverse: Array, shape: Array, increment: Array, rails: Array):
    """Add the rails' response to a change of the wheels' forces."""
    for rail in ti.static(range(2)):
        for i in range(rails.shape[2]):
            g = wheel_load(rail, i, shape, increment)
            x = respond(i, inverse, ti.Vector([g[0], 0.0, g[1], 0.0, g[2]]))
            for f in ti.static(range(FIELDS)):
                rails[at.A, 5 * rail + f, i] = rails[at.A, 5 * rail + f, i] + x[f]
    update_rails(constants, rails)


@ti.func
def update_rails(constants: Array, rails: Array):
    """Apply the Newmark correctors."""
    for f in ti.static(range(2 * FIELDS)):
        for i in range(rails.shape[2]):
            rails[at.U, f, i] = rails[at.U_PREDICTED, f, i] + constants[at.BETA_DT2] * rails[at.A, f, i]
            rails[at.V, f, i] = rails[at.V_PREDICTED, f, i] + constants[at.GAMMA_DT] * rails[at.A, f, i]


@ti.func
def rail_under_wheel(wheelset: int, rail: Template, speed: float, shape: Array, rails: Array, rail_out: Array):
    """w, v, theta_x, their slopes, and their rates in the frame of the wheel (material rate and V times slope)."""
    for n, f in ti.static(enumerate((5 * rail + W, 5 * rail + V, 5 * rail + THETA_X))):
        value, slope, rate = 0.0, 0.0, 0.0
        for i in range(rails.shape[2]):
            value += shape[0, wheelset, i] * rails[at.U, f, i]
            slope += shape[1, wheelset, i] * rails[at.U, f, i]
            rate += shape[0, wheelset, i] * rails[at.V, f, i]
        rail_out[0, wheelset, rail, n] = value
        rail_out[0, wheelset, rail, 3 + n] = slope
        rail_out[0, wheelset, rail, 6 + n] = rate + speed * slope


@ti.func
def predict_vehicle(constants: Array, numbers: Array, speed: float, K: Array, C: Array, C_speed: Array, motion: Array):
    """Compute the predictors of the vehicle, set the iterate to them, and compute -(C v + K u) there."""
    n, dt = motion.shape[1], constants[at.DT]
    for i in range(n):
        u, v, a = motion[at.U, i], motion[at.V, i], motion[at.A, i]
        motion[at.U_PREDICTED, i] = u + dt * v + numbers[m.HALF_BETA_DT2] * a
        motion[at.V_PREDICTED, i] = v + numbers[m.HALF_GAMMA_DT] * a
    for i in range(n):
        motion[at.U, i] = motion[at.U_PREDICTED, i]
        motion[at.V, i] = motion[at.V_PREDICTED, i]
        total = 0.0
        for j in range(n):
            total += K[i, j] * motion[at.U_PREDICTED, j]
            total += (C[i, j] + speed * C_speed[i, j]) * motion[at.V_PREDICTED, j]
        motion[at.LINEAR, i] = -total


@ti.func
def update_vehicle(constants: Array, motion: Array):
    """Apply the Newmark correctors."""
    for i in range(motion.shape[1]):
        motion[at.U, i] = motion[at.U_PREDICTED, i] + constants[at.BETA_DT2] * motion[at.A, i]
        motion[at.V, i] = motion[at.V_PREDICTED, i] + constants[at.GAMMA_DT] * motion[at.A, i]


@ti.func
def wheelset_now(wheelset: int, row: Template, dof: Array, motion: Array):
    """Wheelset y, z, roll, pitch, yaw from a row of the motion."""
    x = ti.Vector.zero(ti.f64, 5)
    for k in ti.static(range(5)):
        x[k] = motion[row, dof[wheelset, k]]
    return x


@ti.func
def keep_forces(force: Array, rail: Array, force_before: Array, rail_before: Array):
    """Keep the contact forces of the previous pass."""
    for w in range(force.shape[1]):
        for k in ti.static(range(5)):
            force_before[0, w, k] = force[0, w, k]
        for side in range(2):
            for k in ti.static(range(3)):
                rail_before[0, w, side, k] = rail[0, w, side, k]


@ti.func
def keep_increments(force: Array, rail: Array, force_before: Array, rail_before: Array):
    """Replace the contact forces of the previous pass by the change since then."""
    for w in range(force.shape[1]):
        for k in ti.static(range(5)):
            force_before[0, w, k] = force[0, w, k] - force_before[0, w, k]
        for side in range(2):
            for k in ti.static(range(3)):
                rail_before[0, w, side, k] = rail[0, w, side, k] - rail_before[0, w, side, k]


@ti.func
def add_vehicle_response(response: Array, force: Array, motion: Array):
    """Add A^-1 times forces on the wheelsets to the vehicle's acceleration."""
    for i in range(motion.shape[1]):
        total = 0.0
        for w in range(force.shape[1]):
            for k in ti.static(range(5)):
                total += response[i, 5 * w + k] * force[0, w, k]
        motion[at.A, i] = motion[at.A, i] + total


@ti.kernel
def explicit_forces(
    tick: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    numbers: Reals1,
    stiffness: Reals2,
    target: Ints1,
    sign: Reals1,
    K: Reals2,
    C: Reals2,
    C_speed: Reals2,
    vehicle_load: Reals1,
    wheelset_dof: Ints2,
    wheel: Reals2,
    element_index: Ints2,
    element_row: Reals2,
    element_kind: Ints1,
    element_linear: Reals1,
    element_table: Reals3,
    rails: Reals3,
    folded_out: Reals2,
    motion: Reals2,
):
    """Compute predictors (first pass), rails' forces at the seats, vehicle's forces; shapes as in the host modules."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        step = tick[at.STEP]
        speed = clock[step, at.SPEED]
        if tick[at.PASS] == 0:
            predict_rails(constants, numbers, stiffness, rails)
            predict_vehicle(constants, numbers, speed, K, C, C_speed, motion)
        fold(numbers, target, sign, rails, folded_out)
        n = motion.shape[1]
        engine.vehicle_forces(
            0, clock[step, at.SPEED_RATE], at.V, n, element_kind.shape[0], dims, vehicle_load, wheelset_dof, wheel,
            motion,
        )  # fmt: skip
        for i in range(motion.shape[1]):
            motion[at.F, i] = motion[at.F, i] + motion[at.LINEAR, i]
        suspension.add_suspension_forces(
            0, element_index, element_row, element_kind, element_linear, element_table, motion, at.U, at.V, at.F,
            vehicle_load, 2 * n,
        )  # fmt: skip


@ti.kernel
def implicit_and_contact(
    patches: Template,
    own: Template,
    tick: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    numbers: Reals1,
    inverse: Reals2,
    target: Ints1,
    sign: Reals1,
    folded: Reals2,
    table: Reals3,
    irregularity: Reals4,
    wheel: Reals2,
    wheelset_x: Reals1,
    wheelset_dof: Ints2,
    vehicle_response: Reals2,
    wheelset_compliance: Reals3,
    rails: Reals3,
    shape_out: Reals3,
    rail_compliance_out: Reals5,
    motion: Reals2,
    rail_free_out: Reals4,
    contact_out: Reals4,
    force_out: Reals4,
    wheelset_force_out: Reals3,
    rail_force_out: Reals4,
    wheelset_before_out: Reals3,
    rail_before_out: Reals4,
    wheel_record_out: Reals5,
):
    """Solve the rails mode by mode, then contact against the compliance of rail and wheelset at the wheels."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        step = tick[at.STEP]
        speed = clock[step, at.SPEED]
        if tick[at.PASS] == 0:
            wheel_shapes(clock[step, at.POSITION], numbers, wheelset_x, shape_out)
            compliances(inverse, shape_out, rail_compliance_out)
        keep_forces(wheelset_force_out, rail_force_out, wheelset_before_out, rail_before_out)
        solve_rails(numbers, constants, inverse, target, sign, folded, shape_out, rail_before_out, rails)
        add_vehicle_response(vehicle_response, wheelset_before_out, motion)
        update_vehicle(constants, motion)
        for w in range(dims[at.WHEELSETS]):
            for side in ti.static(range(2)):
                rail_under_wheel(w, side, speed, shape_out, rails, rail_free_out)
        for w in range(dims[at.WHEELSETS]):
            channels = ct.channels_at(0, step, w, irregularity)
            pt.solve_wheelset(
                0, w, speed, wheelset_now(w, at.U, wheelset_dof, motion), wheelset_now(w, at.V, wheelset_dof, motion),
                uw.stored_rail(0, w, 0, rail_free_out), uw.stored_rail(0, w, 1, rail_free_out), channels, dims,
                constants, wheel, table, wheelset_compliance, rail_compliance_out, contact_out, force_out,
                wheelset_force_out, rail_force_out, constants[at.CONTACT_TOLERANCE] * constants[at.STATIC_LOAD],
                patches, own,
            )  # fmt: skip
        keep_increments(wheelset_force_out, rail_force_out, wheelset_before_out, rail_before_out)
        add_wheels(constants, inverse, shape_out, rail_before_out, rails)
        add_vehicle_response(vehicle_response, wheelset_before_out, motion)
        update_vehicle(constants, motion)
        if tick[at.LAST_PASS] == 1:
            for w in range(dims[at.WHEELSETS]):
                pt.record_wheels(0, w, tick[at.STEP], contact_out, force_out, rail_force_out, wheel_record_out, patches)
