"""Kernels of a step: factors of the host's products, forces, contact.

A step t_n -> t_{n+1}, with a the iterate of the acceleration:

    (host)              predictors u~, v~
    prepare             shapes of the seats where they stand at t_{n+1}; factors of the products; rails under the wheels
    (host)              products of the convective flow, of the slabs' and the train's own motion
    each pass:
      (host)            forces that the motion of rails and slabs exerts at the seats
      mortar_forces     F of the slabs where the bed is not wholly implicit
      forces_and_contact  F of rails and train: linear forces, fastenings at the iterate, smeared part of a, suspension,
                        gravity; then contact against compliance, which is added to F last
      (host)            a = A^-1 F, block by block; u = u~ + beta dt^2 a, v = v~ + gamma dt a
      factors           of the next pass's products

The wheels' motion at the step's end is the product of rows of A^-1 with F, so contact needs no solve before it. In the
first pass the iterate is the predictor, that is a = 0 (Hughes and Liu).

Serial over trains by default; ``parallel`` gives each train a block of 512 iterations, the least that Taichi's thread
pool assigns to a thread.
"""

import taichi as ti

from tiengine.kernels import contact as ct
from tiengine.kernels import fastening as fs
from tiengine.kernels import layout as at
from tiengine.kernels import mortar, rail, suspension
from tiengine.kernels import patches as pt
from tiengine.kernels import under_wheels as uw
from tiengine.kernels.types import Array, Ints1, Ints2, Reals1, Reals2, Reals3, Reals4, Reals5, Template


@ti.func
def vehicle_forces(
    b: int, V_rate: float, row_v: int, given: int, elements: int, dims: Array, load: Array, dof: Array, wheel: Array,
    motion: Array,
):  # fmt: skip
    """F of the train: given loads, inertia of braking, gyroscopic pair of the wheelsets' pitch rates.

    Their mean spin is linear; velocities are in row ``row_v``, the loads of the step from ``given`` on in ``load``
    (``tiengine.engine.load_rows``).
    """
    n = dims[at.VEHICLE_DOFS]
    base = dims[at.VEHICLES] + b * n
    for i in range(n):
        motion[at.F, base + i] = load[given + i] + V_rate * load[i]
    yaw_rate = given + n + elements
    roll_rate = yaw_rate + dims[at.WHEELSETS]
    for w in range(dims[at.WHEELSETS]):
        J = wheel[w, 2]
        roll, pitch, yaw = base + dof[w, 2], base + dof[w, 3], base + dof[w, 4]
        motion[at.F, roll] = motion[at.F, roll] + J * motion[row_v, pitch] * (motion[row_v, yaw] + load[yaw_rate + w])
        motion[at.F, yaw] = motion[at.F, yaw] - J * motion[row_v, pitch] * (motion[row_v, roll] + load[roll_rate + w])


@ti.kernel
def prepare(
    parallel: Template,
    tick: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    seat_table: Reals2,
    wheel_shape: Reals3,
    motion: Reals2,
    seat_shape_out: Reals2,
    flow_out: Reals4,
    rail_factor_out: Reals4,
    slab_factor_out: Reals3,
    rail_predicted_out: Reals4,
):
    """Shapes, factors and rail motion from the predictors; see the module. Shapes of the arrays as in ``scratch``."""
    ti.loop_config(serialize=True)
    for _ in range(1):  # one set of seat shapes for all trains
        fs.seat_shapes(
            dims[at.MODES], dims[at.SEATS], clock[tick[at.STEP], at.FIRST_SEAT_S], constants[at.LENGTH], seat_table,
            seat_shape_out,
        )  # fmt: skip
    ti.loop_config(serialize=not parallel)
    for z in range(dims[at.TRAINS] * ti.static(512 if parallel else 1)):
        if z % ti.static(512 if parallel else 1) == 0:
            b = z // ti.static(512 if parallel else 1)
            V, V_rate = clock[tick[at.STEP], at.SPEED], clock[tick[at.STEP], at.SPEED_RATE]
            rail.convective_flow(b, dims[at.MODES], dims[at.LATERAL], V, V_rate, motion, flow_out)
            fs.pull_factors(b, dims, V, constants, at.U_PREDICTED, at.V_PREDICTED, motion, rail_factor_out)
            fs.slab_pull_factors(b, dims, constants, at.U_PREDICTED, at.V_PREDICTED, motion, slab_factor_out)
            for w in range(dims[at.WHEELSETS]):
                for side in range(2):
                    uw.rail_predicted(b, w, side, dims, wheel_shape, motion, rail_predicted_out)


@ti.kernel
def factors(
    parallel: Template,
    tick: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    motion: Reals2,
    rail_factor_out: Reals4,
    slab_factor_out: Reals3,
):
    """Factors of the forces at the seats at the iterate."""
    ti.loop_config(serialize=not parallel)
    for z in range(dims[at.TRAINS] * ti.static(512 if parallel else 1)):
        if z % ti.static(512 if parallel else 1) == 0:
            b = z // ti.static(512 if parallel else 1)
            fs.pull_factors(b, dims, clock[tick[at.STEP], at.SPEED], constants, at.U, at.V, motion, rail_factor_out)
            fs.slab_pull_factors(b, dims, constants, at.U, at.V, motion, slab_factor_out)


@ti.kernel
def mortar_forces(
    parallel: Template,
    rows: Ints1,
    dims: Ints1,
    design: Ints2,
    index: Ints2,
    shape: Reals2,
    weight: Reals1,
    factor: Reals3,
    at_rest: Reals3,
    lateral_K: Reals3,
    lateral_C: Reals3,
    numbers: Reals1,
    motion: Reals2,
    pressure_out: Reals3,
):
    """F of the slabs: the part of the bed that is not implicit (nothing in mode 0); its extreme pressures.

    ``rows`` are the rows of displacement and velocity.
    """
    ti.loop_config(serialize=not parallel)
    for z in range(dims[at.TRAINS] * ti.static(512 if parallel else 1)):
        if z % ti.static(512 if parallel else 1) == 0:
            b = z // ti.static(512 if parallel else 1)
            n = dims[at.SLAB_DOFS]
            explicit, no_tension = ti.cast(numbers[2], ti.i32), ti.cast(numbers[3], ti.i32)
            for slot in range(dims[at.SLOTS]):
                base = dims[at.SLABS] + (b * dims[at.SLOTS] + slot) * n
                for i in range(base, base + n):
                    motion[at.F, i] = 0.0
                pressure = mortar.bed_force_and_pressure(
                    design[b, slot], design[b, slot], index, shape, weight, factor, at_rest, lateral_K, lateral_C,
                    numbers[0], numbers[1], explicit, no_tension, base, n, motion, rows[0], rows[1], at.F,
                )  # fmt: skip
                for m in ti.static(range(2)):
                    pressure_out[b, slot, m] = pressure[m]


@ti.kernel
def forces_and_contact(
    parallel: Template,
    patches: Template,
    own: Template,
    tick: Ints1,
    rows: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    # rails and fastenings
    stiffness: Reals2,
    drift: Reals4,
    scale: Reals3,
    seat_shape: Reals2,
    rail_pull: Reals4,
    slab_pull: Reals5,
    # vehicles
    vehicle_load: Reals1,
    wheelset_dof: Ints2,
    wheel: Reals2,
    element_index: Ints2,
    element_row: Reals2,
    element_kind: Ints1,
    element_linear: Reals1,
    element_table: Reals3,
    # contact
    table: Reals3,
    irregularity: Reals4,
    wheel_shape: Reals3,
    wheelset_compliance: Reals3,
    rail_coupling: Reals5,
    rail_answer: Reals3,
    vehicle_answer: Reals2,
    # state
    motion: Reals2,
    seat_force_out: Reals4,
    slab_force_out: Reals4,
    rail_predicted: Reals4,
    contact: Reals4,
    force: Reals4,
    wheelset_force: Reals3,
    rail_force: Reals4,
    iterations_out: Ints2,
    wheel_record_out: Reals5,
):
    """All explicit forces but the mortar's; see the module. Array shapes as in ``tiengine.model.model`` and others.

    ``rows`` are the rows of displacement and velocity of the train in this pass.
    """
    ti.loop_config(serialize=not parallel)
    for z in range(dims[at.TRAINS] * ti.static(512 if parallel else 1)):
        if z % ti.static(512 if parallel else 1) == 0:
            b = z // ti.static(512 if parallel else 1)
            step, iterate, wheelsets = tick[at.STEP], ti.min(tick[at.PASS], 1), dims[at.WHEELSETS]
            V, V_rate = clock[step, at.SPEED], clock[step, at.SPEED_RATE]
            if iterate == 0:
                rail.rail_linear_forces(b, dims, V, constants, stiffness, drift, motion)
            fs.seat_forces(
                b, ti.cast(clock[step, at.FIRST_SEAT], ti.i32), ti.cast(clock[step, at.FIRST_SLAB], ti.i32),
                clock[step, at.FIRST_SEAT_S], iterate, dims, constants, scale, rail_pull, slab_pull, seat_force_out,
                slab_force_out,
            )  # fmt: skip
            fs.rail_forces(b, iterate, dims, constants, seat_shape, seat_force_out, motion)
            n, elements = dims[at.VEHICLE_DOFS], element_kind.shape[0]
            given = n + b * tick[at.LOAD_TRAIN] + step * tick[at.LOAD_STEP]
            vehicle_forces(
                b, V_rate, rows[1], given, elements, dims, vehicle_load, wheelset_dof, wheel, motion
            )  # fmt: skip
            suspension.add_suspension_forces(
                dims[at.VEHICLES] + b * dims[at.VEHICLE_DOFS], element_index, element_row, element_kind,
                element_linear, element_table, motion, rows[0], rows[1], at.F, vehicle_load, given + n,
            )  # fmt: skip

            tolerance = constants[at.CONTACT_TOLERANCE] * constants[at.STATIC_LOAD]
            if tick[at.LAST_PASS] == 0:
                tolerance = ct.ITERATE_TOLERANCE * constants[at.STATIC_LOAD]
            for w in range(wheelsets):
                uw.add_wheelset_force(b, w, 1.0, dims, wheelset_dof, wheelset_force, motion)
            for w in range(wheelsets):
                channels = ct.channels_at(b, step, w, irregularity)
                x, dx = uw.wheelset_without_change(b, w, dims, constants, wheelset_dof, vehicle_answer, motion)
                dx[4] += vehicle_load[given + n + elements + w]  # the track frame yaws too
                left = uw.rail_without_change(
                    b, w, 0, dims, constants, rail_answer, rail_coupling, motion, rail_predicted, rail_force
                )
                right = uw.rail_without_change(
                    b, w, 1, dims, constants, rail_answer, rail_coupling, motion, rail_predicted, rail_force
                )
                uw.add_wheelset_force(b, w, -1.0, dims, wheelset_dof, wheelset_force, motion)
                count = pt.solve_wheelset(
                    b, w, V, x, dx, left, right, channels, dims, constants, wheel, table, wheelset_compliance,
                    rail_coupling, contact, force, wheelset_force, rail_force, tolerance,
                    patches, own,
                )  # fmt: skip
                uw.add_wheelset_force(b, w, 1.0, dims, wheelset_dof, wheelset_force, motion)
                iterations_out[b, w] = ti.max(iterations_out[b, w], count)
                if tick[at.LAST_PASS] == 1:
                    pt.record_wheels(b, w, tick[at.STEP], contact, force, rail_force, wheel_record_out, patches)
            uw.add_rail_forces(b, dims, wheel_shape, rail_force, motion)
