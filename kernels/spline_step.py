# mypy: disable-error-code="valid-type, index"
"""Whole time steps of the spline engine in one launch (``spline_layout`` has the arrays).

A step t_n -> t_{n+1} of a chunk of trains, which stays in the cache meanwhile; a is the iterate of the acceleration:

    predictors u~, v~ of rails, slabs, cars; rails under the wheels at the predictors
    each pass:
      slabs' motion at the seats into the rails' lanes; seat forces at the iterate; loads of the seats
      -(C v~ + K u~) of the rails in the first pass, A_s a later; forward sweep y = L^-1 F
      cars: A^-1 F with the wheels' forces as they stand
      contact of all wheels against one-sided rows of y and the cars' columns
      wheels' forces by one-sided columns into y; backward sweep a = U^-1 y; u = u~ + beta dt^2 a, v = v~ + gamma dt a
      slabs: loads of the seats, bed where it is explicit, banded solve, correctors; cars' correctors

Between launches rows U, V, A of all arrays hold the state at the last step's end, for reading and writing. A launch of
several steps that looks at the state (``spline_squares``) leaves out those after one at which a guard must check it.
"""

from typing import Any

import taichi as ti

from tiengine.kernels import banded_slab as slabs
from tiengine.kernels import contact as ct
from tiengine.kernels import layout, spline_rail
from tiengine.kernels import spline_layout as at
from tiengine.kernels import spline_seats as seats
from tiengine.kernels import spline_squares as squares
from tiengine.kernels import spline_wheels as wheels
from tiengine.kernels import vehicle_columns as cars
from tiengine.kernels.types import Array, Ints1, Ints2, Ints3, Reals1, Reals2, Reals3, Reals4, Reals5, Template


@ti.func
def sweep_slabs(
    b: int, dofs: int, stage: Template, size: Array, constants: Array, designs: Array, slab: Array, coefficient: Array,
    K: Template,
):  # fmt: skip
    """A stage of a train's slabs, a group at a time: 0 linear forces, 1 solve. A mixed group once for every design."""
    matrices = dofs * (2 * K + 1)
    for g in range(size[at.GROUPS]):
        p = b * size[at.GROUPS] + g
        base = p * (dofs + 2 * K) + K
        mixed = 0
        for lane in range(1, 8):
            if designs[p][lane] != designs[p][0]:
                mixed = 1
        if mixed == 0:
            d = designs[p][0]
            start = ti.cast(d, ti.i32) * 3 * matrices
            if ti.static(stage == 0):
                slabs.linear_forces(slab, base, dofs, start, coefficient, 0, designs[p], d, K)
            else:
                slabs.solve(slab, base, dofs, start + 2 * matrices, coefficient, 0, designs[p], d, constants, K)
        else:
            for design in range(coefficient.shape[0] // (3 * matrices)):
                here = 0
                for lane in range(8):
                    if designs[p][lane] == design:
                        here = 1
                if here == 1:
                    d, start = ti.cast(design, ti.f64), design * 3 * matrices
                    if ti.static(stage == 0):
                        slabs.linear_forces(slab, base, dofs, start, coefficient, 1, designs[p], d, K)
                    else:
                        slabs.solve(slab, base, dofs, start + 2 * matrices, coefficient, 1, designs[p], d, constants, K)
        if ti.static(stage == 1):
            slabs.clear_loads(slab, base, dofs)


def step_kernel(lanes: int, K: int, blocks: int, patches: int, shaped: int, moving: int, own: int, hanging: int) -> Any:
    """Make the kernel.

    Args:
        lanes: Lanes of the rails' vectors.
        K: Half width of the slabs' band.
        blocks: Vectors in a row of a car.
        patches: Patches a wheel.
        shaped: 1 if rails have shapes or wheels are out of round.
        moving: 1 if the ground moves in time.
        own: 1 if wheels have radii and contact tables of their own.
        hanging: 1 if some seats hang.
    """
    lane_vectors = ti.types.ndarray(dtype=ti.types.vector(lanes, ti.f64), ndim=1)
    eights = ti.types.ndarray(dtype=ti.types.vector(8, ti.f64), ndim=1)
    trains_a_chunk = lanes // 2

    @ti.kernel
    def spline_steps(
        job: Ints1,
        limits: Reals1,
        stopped_out: Ints1,
        record: Ints1,
        size: Ints1,
        dims: Ints1,
        constants: Reals1,
        clock: Reals2,
        # rails
        rail: lane_vectors,
        coefficient: Reals1,
        # seats
        seat: lane_vectors,
        seat_play: lane_vectors,
        seat_point: Reals2,
        span: Reals2,
        seat_place: Ints2,
        seat_shape: Reals1,
        # slabs
        slab: eights,
        slab_seat: eights,
        slab_design: eights,
        slab_record: eights,
        slab_coefficient: Reals1,
        slab_seat_index: Ints3,
        slab_seat_shape: Reals4,
        slab_seat_x: Reals1,
        # cars
        car: eights,
        car_columns: eights,
        car_load: eights,
        car_columns_start: Ints1,
        vehicle_place: Ints1,
        wheelset_place: Ints2,
        element_place: Ints2,
        element_row: Reals2,
        element_kind: Ints1,
        element_linear: Reals1,
        element_table: Reals3,
        # wheels
        under: lane_vectors,
        wheel_place: Ints2,
        wheel_shape: Reals3,
        wheel_rows: Reals1,
        wheel: Reals2,
        table: Reals3,
        irregularity: Reals4,
        wheelset_compliance: Reals3,
        coupling: Reals5,
        contact: Reals4,
        force: Reals4,
        wheelset_force: Reals3,
        rail_force: Reals4,
        iterations: Ints2,
        wheel_record: Reals5,
        body_record: Reals4,
        # bed, where it is not wholly implicit
        bed_index: Ints2,
        bed_shape: Reals2,
        bed_weight: Reals1,
        bed_factor: Reals3,
        bed_rest: Reals3,
        bed_lateral_K: Reals3,
        bed_lateral_C: Reals3,
        bed_numbers: Reals1,
        slab_rows: Reals2,  # u, v, F of a copy of a slab; its inertia force by unit acceleration of the ground
        pressure: Reals3,
    ):
        """Steps of all chunks, chunk by chunk. Arrays as in ``tiengine.engine.spline_step``."""
        ti.loop_config(serialize=True)
        for chunk_step in range(size[at.CHUNKS] * job[at.STEPS]):
            c = chunk_step // job[at.STEPS]
            step = job[at.FIRST_STEP] + chunk_step % job[at.STEPS]
            n, dofs, stages = size[at.FUNCTIONS], size[at.SLAB_DOFS], job[at.STAGES]
            if stopped_out[0] >= 0:
                stages = 0
            V, V_rate, s0 = clock[step, layout.SPEED], clock[step, layout.SPEED_RATE], clock[step, layout.FIRST_SEAT_S]
            dt, beta_dt2, gamma_dt = constants[layout.DT], constants[layout.BETA_DT2], constants[layout.GAMMA_DT]
            base2 = constants[layout.HALF_BASE] * constants[layout.HALF_BASE]
            first = c * (n + 2 * at.REACH) + at.REACH
            per_slab, groups = dims[layout.SEATS_PER_SLAB], size[at.GROUPS]
            train_car = size[at.CARS] * at.CAR_ROWS * blocks  # vectors a train
            b0 = c * trains_a_chunk
            b_end = ti.min(b0 + trains_a_chunk, dims[layout.TRAINS])
            last_step = job[at.FIRST_STEP] + job[at.STEPS] - 1

            if stages & at.SEATS_STAGE and (c == 0 or job[at.STEPS] > 1):
                seats.seat_shapes(
                    s0, ti.cast(clock[step, layout.FIRST_SEAT], ti.i32),
                    ti.cast(clock[step, layout.FIRST_SLAB], ti.i32), dims[layout.SLOTS], V, size, dims, constants,
                    seat_point, span, seat_place, seat_shape,
                )  # fmt: skip
            if stages & at.PREDICT_STAGE and step == job[at.FIRST_STEP]:  # later ones come with the correctors
                spline_rail.predict(rail, first, n, dt, beta_dt2, gamma_dt)
                for g in range(b0 * groups, (b0 + trains_a_chunk) * groups):
                    slabs.predict(slab, g * (dofs + 2 * K) + K, dofs, constants)
                for i in range(b0 * size[at.CARS], (b0 + trains_a_chunk) * size[at.CARS]):
                    cars.predict(car, i * at.CAR_ROWS * blocks, constants, blocks)
            if stages & at.CONTACT_STAGE:
                wheels.rail_predicted(c, first, dims, wheel_place, wheel_shape, rail, under, lanes)

            for p in range(size[at.PASSES]):
                row_u, row_v, last_pass = at.U, at.V, ti.cast(p == size[at.PASSES] - 1, ti.i32)
                ahead = ti.cast(last_pass == 1 and step < last_step, ti.i32)
                if p == 0:
                    row_u, row_v = at.U_PREDICTED, at.V_PREDICTED
                initial = ti.cast(p == 0, ti.i32)
                if stages & at.PULL_STAGE:
                    for g in range(b0 * groups, (b0 + trains_a_chunk) * groups):
                        slabs.pull_at_seats(
                            slab, g * (dofs + 2 * K) + K, dofs, g * at.SLAB_SEAT_ROWS * per_slab, per_slab,
                            slab_seat_index, slab_seat_shape, slab_seat_x, slab_seat,
                        )  # fmt: skip
                if stages & at.EXCHANGE_STAGE:
                    seats.pulls_of_slabs(
                        c, trains_a_chunk, initial, size, dims, base2, seat_place, slab_seat, seat, lanes
                    )
                if stages & at.SEAT_FORCE_STAGE:
                    seats.seat_forces(
                        c, first, row_u, row_v, s0, last_pass, size, constants, seat_place, seat_shape, rail, seat,
                        seat_play, hanging, lanes,
                    )  # fmt: skip
                if stages & at.FORWARD_STAGE:
                    if ti.static(moving == 1):
                        spline_rail.add_ground_loads(rail, first, n, step, clock, lanes)
                    if p == 0:
                        spline_rail.forward(rail, first, n, coefficient, 1, lanes)
                    else:
                        spline_rail.forward(rail, first, n, coefficient, 0, lanes)
                if stages & at.CAR_STAGE:
                    for b in range(b0, b_end):
                        cars.loads(
                            b, row_u, row_v, V_rate, cars.load_row(b, step, size, blocks), size, dims, car_load,
                            wheelset_place, wheel, wheelset_force, element_place, element_row, element_kind,
                            element_linear, element_table, car, blocks,
                        )  # fmt: skip
                        for i in range(size[at.CARS]):
                            base = b * train_car + i * at.CAR_ROWS * blocks
                            if p == 0:
                                cars.linear_acceleration(
                                    car, base, size[at.CAR_DOFS], car_columns, car_columns_start[i], blocks
                                )
                            cars.acceleration(car, base, size[at.CAR_DOFS], car_columns, car_columns_start[i], blocks)
                if stages & at.CONTACT_STAGE:
                    wheels.rail_without_wheels(
                        c, first, beta_dt2, gamma_dt, dims, wheel_place, wheel_rows, rail, under, lanes
                    )
                    tolerance, row = ct.ITERATE_TOLERANCE * constants[layout.STATIC_LOAD], -1
                    if last_pass == 1:
                        tolerance = constants[layout.CONTACT_TOLERANCE] * constants[layout.STATIC_LOAD]
                        row = step
                    for b in range(b0, b_end):
                        wheels.contact_of_train(
                            b, c, 2 * (b - b0), step, V, tolerance, row, dims, constants, wheel_place,
                            wheelset_place, car_columns_start, car_columns, wheel, table, irregularity,
                            wheelset_compliance, coupling, contact, force, wheelset_force, rail_force, iterations,
                            wheel_record, car, under, car_load, size, blocks, patches, shaped, own,
                        )  # fmt: skip
                    wheels.add_wheel_columns(c, first, dims, wheel_place, wheel_rows, rail, under)
                if stages & at.BACKWARD_STAGE:
                    spline_rail.backward(rail, first, n, coefficient, dt, beta_dt2, gamma_dt, ahead, lanes)
                if stages & at.CAR_STAGE:
                    for i in range(b0 * size[at.CARS], (b0 + trains_a_chunk) * size[at.CARS]):
                        cars.correct(car, i * at.CAR_ROWS * blocks, beta_dt2, gamma_dt, blocks)
                        if ahead == 1:
                            cars.predict(car, i * at.CAR_ROWS * blocks, constants, blocks)
                    if last_pass == 1 and record[step] >= 0:
                        for b in range(b0, b_end):
                            cars.record_bodies(
                                b, record[step], b * train_car * 8, vehicle_place, car, body_record, blocks
                            )
                if stages & at.EXCHANGE_STAGE:
                    seats.loads_on_slabs(c, trains_a_chunk, size, dims, seat_place, seat, slab_seat)
                if stages & at.SLAB_STAGE:
                    for g in range(b0 * groups, (b0 + trains_a_chunk) * groups):
                        slabs.push_at_seats(
                            slab, g * (dofs + 2 * K) + K, dofs, g * at.SLAB_SEAT_ROWS * per_slab, per_slab,
                            slab_seat_index, slab_seat_shape, slab_seat_x, slab_seat,
                        )  # fmt: skip
                    if ti.static(moving == 1):
                        for b in range(b0, b_end):
                            row = cars.load_row(b, step, size, blocks) + size[at.LOAD_GROUND]
                            for g in range(groups):
                                slabs.add_ground_loads(
                                    slab, (b * groups + g) * (dofs + 2 * K) + K, dofs, car_load[row + g],
                                    car_load[row + groups + g], 3, slab_rows,
                                )  # fmt: skip
                    if dims[layout.MORTAR_MODE] > 0:
                        for b in range(b0, b_end):
                            for slot in range(dims[layout.SLOTS]):
                                group = b * groups + slot // 8
                                slabs.bed_forces(
                                    b, slot, group * (dofs + 2 * K) + K, row_u, row_v, dofs,
                                    ti.cast(slab_design[group][slot % 8], ti.i32), bed_index, bed_shape, bed_weight,
                                    bed_factor, bed_rest, bed_lateral_K, bed_lateral_C, bed_numbers, slab, slab_rows,
                                    pressure,
                                )  # fmt: skip
                    for b in range(b0, b0 + trains_a_chunk):
                        if p == 0:
                            sweep_slabs(b, dofs, 0, size, constants, slab_design, slab, slab_coefficient, K)
                        sweep_slabs(b, dofs, 1, size, constants, slab_design, slab, slab_coefficient, K)
                    if last_pass == 1 and record[step] >= 0:
                        for b in range(b0, b_end):
                            for g in range(groups):
                                row = (b * body_record.shape[1] + record[step]) * groups + g
                                slabs.record_motion(
                                    slab, (b * groups + g) * (dofs + 2 * K) + K, dofs, row * 3 * dofs, slab_record
                                )
                    if ahead == 1:
                        for g in range(b0 * groups, (b0 + trains_a_chunk) * groups):
                            slabs.predict(slab, g * (dofs + 2 * K) + K, dofs, constants)
            if stages != 0 and job[at.LOOK_EVERY] > 0:
                if (job[at.STEPS_BEFORE] + step + 1) % job[at.LOOK_EVERY] == 0:
                    found = job[at.LOOK_ALWAYS]
                    if found == 0:
                        found = squares.needs_check(limits, dims, rail, slab, car, contact, force, lanes, blocks)
                    if found == 1:
                        stopped_out[0] = step

    return spline_steps
