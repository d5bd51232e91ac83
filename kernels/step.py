"""The two launches of a pass: explicit forces before the implicit solve, contact and update after it.

A pass of the step t_n -> t_{n+1}, with a the iterate of the acceleration:

    explicit_forces:   [first pass] predictors u~, v~ and the linear forces at them
                       F = linear + fastenings(iterate) + suspension + mortar + gravity + smeared part of a
    (host)             X = A^-1 F, block by block
    contact_and_update: f = contact against compliance; a = X + A^-1 f; u = u~ + beta dt^2 a; v = v~ + gamma dt a

Serial over trains by default; ``parallel`` gives each train a block of 512 iterations, which is what Taichi's
thread pool hands out at least.
"""

import taichi as ti

from tiengine.kernels import contact as ct
from tiengine.kernels import fastening as fs
from tiengine.kernels import layout as at
from tiengine.kernels import linear, mortar, rail, suspension
from tiengine.kernels.types import Array, Ints1, Ints2, Ints3, Reals1, Reals2, Reals3, Reals4, Reals5, Template


@ti.func
def segment(b: int, part: Template, dims: Array):
    """First column and length of train ``b`` in a block: 0 vertical, 1 lateral, 2 slabs, 3 vehicles."""
    count = 4 * dims[at.MODES]
    start = b * count
    if ti.static(part == 1):
        count = 6 * dims[at.MODES]
        start = dims[at.LATERAL] + b * count
    elif ti.static(part == 2):
        count = dims[at.SLOTS] * dims[at.SLAB_DOFS]
        start = dims[at.SLABS] + b * count
    elif ti.static(part == 3):
        count = dims[at.VEHICLE_DOFS]
        start = dims[at.VEHICLES] + b * count
    return start, count


@ti.func
def predict(b: int, dims: Array, constants: Array, motion: Array):
    """Newmark predictors; the iterate starts from them, that is from a = 0 (Hughes and Liu)."""
    dt, half_beta, half_gamma = constants[at.DT], constants[at.HALF_BETA_DT2], constants[at.HALF_GAMMA_DT]
    for part in ti.static(range(4)):
        start, count = segment(b, part, dims)
        for i in range(start, start + count):
            u, v, a = motion[at.U, i], motion[at.V, i], motion[at.A, i]
            motion[at.U_PREDICTED, i] = u + dt * v + half_beta * a
            motion[at.V_PREDICTED, i] = v + half_gamma * a
            motion[at.U, i] = motion[at.U_PREDICTED, i]
            motion[at.V, i] = motion[at.V_PREDICTED, i]
            motion[at.A, i] = 0.0


@ti.func
def start_from_linear(b: int, dims: Array, motion: Array):
    """F = linear forces at the predictors."""
    for part in ti.static(range(4)):
        start, count = segment(b, part, dims)
        for i in range(start, start + count):
            motion[at.F, i] = motion[at.LINEAR, i]


@ti.func
def add_vehicle_forces(b: int, V_rate: float, dims: Array, load: Array, dof: Array, wheel: Array, motion: Array):
    """Gravity, inertia of braking, gyroscopic pair of the wheelsets' pitch rates (their mean spin is linear)."""
    n = dims[at.VEHICLE_DOFS]
    base = dims[at.VEHICLES] + b * n
    for i in range(n):
        motion[at.F, base + i] = motion[at.F, base + i] + load[0, i] + V_rate * load[1, i]
    for w in range(dims[at.WHEELSETS]):
        J = wheel[w, 2]
        roll, pitch, yaw = base + dof[w, 2], base + dof[w, 3], base + dof[w, 4]
        motion[at.F, roll] = motion[at.F, roll] + J * motion[at.V, pitch] * motion[at.V, yaw]
        motion[at.F, yaw] = motion[at.F, yaw] - J * motion[at.V, pitch] * motion[at.V, roll]


@ti.func
def add_mortar_forces(
    b: int, dims: Array, design: Array, index: Array, shape: Array, weight: Array, factor: Array, rest: Array,
    lateral_K: Array, lateral_C: Array, numbers: Array, motion: Array, pressure_out: Array,
):  # fmt: skip
    """Force of every slab's bed that is not in the implicit part (none in mode 0), and its extreme pressures."""
    n = dims[at.SLAB_DOFS]
    explicit, no_tension = ti.cast(numbers[2], ti.i32), ti.cast(numbers[3], ti.i32)
    for slot in range(dims[at.SLOTS]):
        base = dims[at.SLABS] + (b * dims[at.SLOTS] + slot) * n
        pressure = mortar.bed_force_and_pressure(
            design[b, slot], index, shape, weight, factor, rest, lateral_K, lateral_C, numbers[0], numbers[1],
            explicit, no_tension, base, n, motion, at.U, at.V, at.F,
        )  # fmt: skip
        for m in ti.static(range(2)):
            pressure_out[b, slot, m] = pressure[m]


@ti.func
def accept(b: int, dims: Array, motion: Array):
    """Take the solution without contact as the iterate's acceleration."""
    for part in ti.static(range(4)):
        start, count = segment(b, part, dims)
        for i in range(start, start + count):
            motion[at.A, i] = motion[at.X, i]


@ti.func
def update(b: int, dims: Array, constants: Array, motion: Array):
    """Newmark correctors from the acceleration in row A."""
    for part in ti.static(range(4)):
        start, count = segment(b, part, dims)
        for i in range(start, start + count):
            motion[at.U, i] = motion[at.U_PREDICTED, i] + constants[at.BETA_DT2] * motion[at.A, i]
            motion[at.V, i] = motion[at.V_PREDICTED, i] + constants[at.GAMMA_DT] * motion[at.A, i]


@ti.func
def add_contact_response(
    b: int,
    dims: Array,
    vertical: Array,
    lateral: Array,
    vehicle: Array,
    wheelset_force: Array,
    rail_force: Array,
    motion: Array,
):
    """Add A^-1 times contact forces to a; the columns of A^-1 at the wheels are constant."""
    n, wheelsets = dims[at.MODES], dims[at.WHEELSETS]
    for side in range(2):
        w = (b * 2 + side) * 2 * n
        v = dims[at.LATERAL] + (b * 2 + side) * 3 * n
        for i in range(2 * n):
            total = 0.0
            for k in range(wheelsets):
                total += vertical[i, k] * rail_force[b, k, side, 0]
            motion[at.A, w + i] = motion[at.A, w + i] + total
        for i in range(3 * n):
            total = 0.0
            for k in range(wheelsets):
                total += (
                    lateral[i, 2 * k] * rail_force[b, k, side, 1] + lateral[i, 2 * k + 1] * rail_force[b, k, side, 2]
                )
            motion[at.A, v + i] = motion[at.A, v + i] + total
    base = dims[at.VEHICLES] + b * dims[at.VEHICLE_DOFS]
    for i in range(dims[at.VEHICLE_DOFS]):
        total = 0.0
        for k in range(wheelsets):
            for m in ti.static(range(5)):
                total += vehicle[i, 5 * k + m] * wheelset_force[b, k, m]
        motion[at.A, base + i] = motion[at.A, base + i] + total


@ti.func
def keep_increments(b: int, dims: Array, force: Array, rail: Array, force_before: Array, rail_before: Array):
    """Replace the contact forces of the pass before by the change since."""
    for w in range(dims[at.WHEELSETS]):
        for m in ti.static(range(5)):
            force_before[b, w, m] = force[b, w, m] - force_before[b, w, m]
        for side in range(2):
            for m in ti.static(range(3)):
                rail_before[b, w, side, m] = rail[b, w, side, m] - rail_before[b, w, side, m]


@ti.func
def keep_forces(b: int, dims: Array, force: Array, rail: Array, force_before: Array, rail_before: Array):
    """Remember the contact forces for the next pass."""
    for w in range(dims[at.WHEELSETS]):
        for m in ti.static(range(5)):
            force_before[b, w, m] = force[b, w, m]
        for side in range(2):
            for m in ti.static(range(3)):
                rail_before[b, w, side, m] = rail[b, w, side, m]


@ti.func
def record(
    b: int, tick: Array, dims: Array, contact: Array, force: Array, rail_force: Array, motion: Array, pressure: Array,
    wheel_record: Array, body_record: Array, mortar_record: Array,
):  # fmt: skip
    """Copy the wheels' output and the bodies' motion into the rows of the buffers that this step is to fill."""
    if tick[at.WHEEL_RECORD] >= 0:
        for w in range(dims[at.WHEELSETS]):
            ct.record_wheels(b, w, tick[at.WHEEL_RECORD], contact, force, rail_force, wheel_record)
    if tick[at.BODY_RECORD] >= 0:
        base = dims[at.VEHICLES] + b * dims[at.VEHICLE_DOFS]
        for i in range(5 * dims[at.BODIES]):
            for row in ti.static(range(3)):
                body_record[b, tick[at.BODY_RECORD], row, i] = motion[row, base + i]
        for slot in range(dims[at.SLOTS]):
            for m in range(2):
                mortar_record[b, tick[at.BODY_RECORD], slot, m] = pressure[b, slot, m]


@ti.kernel
def explicit_forces(
    parallel: Template,
    tick: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    # rails and fastenings
    stiffness: Reals2,
    mass: Reals1,
    G: Reals3,
    gather_table: Reals2,
    scatter_table: Reals2,
    scale: Reals3,
    seat_index: Ints3,
    seat_shape: Reals4,
    seat_x: Reals1,
    # slabs and mortar
    design: Ints2,
    band: Reals4,
    bed_index: Ints2,
    bed_shape: Reals2,
    bed_weight: Reals1,
    bed_factor: Reals3,
    bed_rest: Reals3,
    bed_lateral_K: Reals3,
    bed_lateral_C: Reals3,
    bed_numbers: Reals1,
    # vehicles
    K: Reals2,
    C: Reals2,
    C_speed: Reals2,
    vehicle_load: Reals2,
    wheelset_dof: Ints2,
    wheel: Reals2,
    element_index: Ints2,
    element_row: Reals2,
    element_kind: Ints1,
    element_linear: Reals1,
    element_table: Reals3,
    # state
    motion: Reals2,
    modal: Reals3,
    seat_motion: Reals3,
    seat_force_out: Reals3,
    pressure_out: Reals3,
):
    """First half of a pass; see the module. Array shapes as in ``tiengine.model`` and the stages' own kernels.

    ``pressure_out`` is written where the mortar is evaluated: in mortar modes 1 and 2, and when bodies are recorded.
    """
    ti.loop_config(serialize=not parallel)
    for z in range(dims[at.TRAINS] * ti.static(512 if parallel else 1)):
        if z % ti.static(512 if parallel else 1) == 0:
            b = z // ti.static(512 if parallel else 1)
            step = tick[at.STEP]
            V, V_rate = clock[step, at.SPEED], clock[step, at.SPEED_RATE]
            if tick[at.PASS] == 0:
                predict(b, dims, constants, motion)
                rail.rail_linear_forces(
                    b, dims[at.MODES], dims[at.LATERAL], V, V_rate, constants[at.LENGTH], stiffness, mass, G, motion
                )
                linear.slab_linear_forces(b, dims, design, band, motion)
                linear.vehicle_linear_forces(b, V, dims, K, C, C_speed, motion)
            start_from_linear(b, dims, motion)
            if tick[at.PASS] > 0:
                fs.add_smeared(b, dims[at.MODES], dims[at.LATERAL], constants, motion)
            fs.add_fastening_forces(
                b, step, dims, constants, clock, gather_table, scatter_table, scale, seat_index, seat_shape, seat_x,
                motion, modal, seat_motion, seat_force_out,
            )  # fmt: skip
            if dims[at.MORTAR_MODE] > 0 or (tick[at.LAST_PASS] == 1 and tick[at.BODY_RECORD] >= 0):
                add_mortar_forces(
                    b, dims, design, bed_index, bed_shape, bed_weight, bed_factor, bed_rest, bed_lateral_K,
                    bed_lateral_C, bed_numbers, motion, pressure_out,
                )  # fmt: skip
            base = dims[at.VEHICLES] + b * dims[at.VEHICLE_DOFS]
            suspension.add_suspension_forces(
                base, element_index, element_row, element_kind, element_linear, element_table, motion, at.U, at.V, at.F
            )
            add_vehicle_forces(b, V_rate, dims, vehicle_load, wheelset_dof, wheel, motion)


@ti.kernel
def contact_and_update(
    parallel: Template,
    tick: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    # contact
    table: Reals3,
    irregularity: Reals4,
    wheel: Reals2,
    wheelset_dof: Ints2,
    wheel_shape: Reals3,
    wheelset_compliance: Reals3,
    rail_compliance: Reals4,
    vertical_response: Reals2,
    lateral_response: Reals2,
    vehicle_response: Reals2,
    # state
    motion: Reals2,
    rail_free: Reals4,
    contact: Reals4,
    force: Reals4,
    wheelset_force: Reals3,
    rail_force: Reals4,
    wheelset_before: Reals3,
    rail_before: Reals4,
    iterations_out: Ints2,
    pressure: Reals3,
    wheel_record: Reals5,
    body_record: Reals4,
    mortar_record: Reals4,
):
    """Second half of a pass; see the module. Array shapes as in ``tiengine.model``."""
    ti.loop_config(serialize=not parallel)
    for z in range(dims[at.TRAINS] * ti.static(512 if parallel else 1)):
        if z % ti.static(512 if parallel else 1) == 0:
            b = z // ti.static(512 if parallel else 1)
            V = clock[tick[at.STEP], at.SPEED]
            accept(b, dims, motion)
            keep_forces(b, dims, wheelset_force, rail_force, wheelset_before, rail_before)
            add_contact_response(
                b, dims, vertical_response, lateral_response, vehicle_response, wheelset_before, rail_before, motion
            )
            update(b, dims, constants, motion)
            for w in range(dims[at.WHEELSETS]):
                for side in range(2):
                    ct.rail_coordinates(b, w, side, dims, wheel_shape, motion, rail_free)
                felt = ti.Vector.zero(ti.f64, at.N_IRREGULARITY)
                for m in ti.static(range(at.N_IRREGULARITY)):
                    felt[m] = irregularity[b, tick[at.STEP], w, m]
                count = ct.solve_wheelset(
                    b, w, V, felt, dims, constants, wheel, wheelset_dof, table, wheelset_compliance, rail_compliance,
                    motion, rail_free, contact, force, wheelset_force, rail_force, wheelset_before, rail_before,
                )  # fmt: skip
                iterations_out[b, w] = ti.max(iterations_out[b, w], count)
            keep_increments(b, dims, wheelset_force, rail_force, wheelset_before, rail_before)
            add_contact_response(
                b, dims, vertical_response, lateral_response, vehicle_response, wheelset_before, rail_before, motion
            )
            update(b, dims, constants, motion)
            if tick[at.LAST_PASS] == 1:
                record(
                    b, tick, dims, contact, force, rail_force, motion, pressure, wheel_record, body_record,
                    mortar_record,
                )  # fmt: skip
