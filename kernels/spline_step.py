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

Between launches rows U, V, A of all arrays hold the state at the last step's end, for reading and writing.
"""

from typing import Any

import taichi as ti

from tiengine.kernels import banded_slab as slabs
from tiengine.kernels import contact as ct
from tiengine.kernels import layout, spline_rail
from tiengine.kernels import spline_layout as at
from tiengine.kernels import spline_seats as seats
from tiengine.kernels import spline_wheels as wheels
from tiengine.kernels import vehicle_columns as cars
from tiengine.kernels.types import Array, Ints1, Ints2, Ints3, Reals1, Reals2, Reals3, Reals4, Reals5, Template


@ti.func
def sweep_slabs(
    b: int, dofs: int, stage: Template, dims: Array, size: Array, constants: Array, designs: Array, slab: Array,
    slab_coefficient: Array, slab_numbers: Array, K: Template,
):  # fmt: skip
    """A stage of a train's slabs for every design in every group: 0 linear forces, 1 solve."""
    count = slab_coefficient.shape[0] // (3 * dofs * (2 * K + 1))
    for g in range(size[at.GROUPS]):
        p = b * size[at.GROUPS] + g
        base = p * (dofs + 2 * K) + K
        for d in range(count):
            here = 0
            for lane in range(8):
                if designs[p][lane] == d:
                    here = 1
            if here == 1:
                start = d * 3 * dofs * (2 * K + 1)
                if ti.static(stage == 0):
                    slabs.linear_forces(slab, base, dofs, start, slab_coefficient, designs[p], d, K)
                else:
                    slabs.solve(
                        slab, base, dofs, start + 2 * dofs * (2 * K + 1), slab_coefficient, designs[p], d,
                        slab_numbers, constants[layout.BETA_DT2], constants[layout.GAMMA_DT], K,
                    )  # fmt: skip
        if ti.static(stage == 1):
            slabs.clear_loads(slab, base, dofs)


def step_kernel(lanes: int, K: int, blocks: int) -> Any:
    """Make the kernel for a number of lanes of the rails, half width of the slabs' band, vectors a row of a car."""
    lane_vectors = ti.types.ndarray(dtype=ti.types.vector(lanes, ti.f64), ndim=1)
    eights = ti.types.ndarray(dtype=ti.types.vector(8, ti.f64), ndim=1)
    trains_a_chunk = lanes // 2

    @ti.kernel
    def spline_steps(
        job: Ints1,
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
        seat_point: Reals2,
        span: Reals2,
        span_first: Ints1,
        span_of_cell: Ints1,
        seat_place: Ints2,
        seat_shape: Reals1,
        # slabs
        slab: eights,
        slab_seat: eights,
        slab_design: eights,
        slab_coefficient: Reals1,
        slab_numbers: Reals1,
        slab_seat_index: Ints3,
        slab_seat_shape: Reals4,
        slab_seat_x: Reals1,
        # cars
        car: eights,
        car_columns: eights,
        car_load: eights,
        car_columns_start: Ints1,
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
    ):
        """Steps of all chunks, chunk by chunk. Arrays as in ``tiengine.engine.spline_arrays``."""
        ti.loop_config(serialize=True)
        for chunk_step in range(size[at.CHUNKS] * job[at.STEPS]):
            c = chunk_step // job[at.STEPS]
            step = job[at.FIRST_STEP] + chunk_step % job[at.STEPS]
            n, dofs, stages = size[at.FUNCTIONS], size[at.SLAB_DOFS], job[at.STAGES]
            V, V_rate, s0 = clock[step, layout.SPEED], clock[step, layout.SPEED_RATE], clock[step, layout.FIRST_SEAT_S]
            dt, beta_dt2, gamma_dt = constants[layout.DT], constants[layout.BETA_DT2], constants[layout.GAMMA_DT]
            base2 = constants[layout.HALF_BASE] * constants[layout.HALF_BASE]
            first = c * (n + 2 * at.REACH) + at.REACH
            per_slab, groups = dims[layout.SEATS_PER_SLAB], size[at.GROUPS]
            train_slab = groups * (dofs + 2 * K)  # places a train
            train_car = size[at.CARS] * at.CAR_ROWS * blocks  # vectors a train
            b0 = c * trains_a_chunk

            if stages & at.SEATS_STAGE and (c == 0 or job[at.STEPS] > 1):
                seats.seat_shapes(
                    s0, ti.cast(clock[step, layout.FIRST_SEAT], ti.i32),
                    ti.cast(clock[step, layout.FIRST_SLAB], ti.i32), dims[layout.SLOTS], V, size, dims, constants,
                    seat_point, span, span_first, span_of_cell, seat_place, seat_shape,
                )  # fmt: skip
            if stages & at.PREDICT_STAGE:
                spline_rail.predict(rail, first, n, dt, beta_dt2, gamma_dt)
                for g in range(b0 * groups, (b0 + trains_a_chunk) * groups):
                    slabs.predict(slab, g * (dofs + 2 * K) + K, dofs, slab_numbers, constants)
                for i in range(b0 * size[at.CARS], (b0 + trains_a_chunk) * size[at.CARS]):
                    cars.predict(car, i * at.CAR_ROWS * blocks, constants, blocks)
                wheels.rail_predicted(c, first, dims, wheel_place, wheel_shape, rail, under, lanes)

            for p in range(size[at.PASSES]):
                row_u, row_v = at.U, at.V
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
                        c, first, row_u, row_v, s0, size, constants, seat_place, seat_shape, rail, seat, lanes
                    )
                if stages & at.FORWARD_STAGE:
                    if p == 0:
                        spline_rail.forward(rail, first, n, coefficient, 1, lanes)
                    else:
                        spline_rail.forward(rail, first, n, coefficient, 0, lanes)
                if stages & at.CAR_STAGE:
                    for b in range(b0, ti.min(b0 + trains_a_chunk, dims[layout.TRAINS])):
                        cars.loads(
                            b, row_u, row_v, V_rate, size, dims, car_load, wheelset_place, wheel, wheelset_force,
                            element_place, element_row, element_kind, element_linear, element_table, car, blocks,
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
                    if p == size[at.PASSES] - 1:
                        tolerance = constants[layout.CONTACT_TOLERANCE] * constants[layout.STATIC_LOAD]
                        row = record[step]
                    for b in range(b0, ti.min(b0 + trains_a_chunk, dims[layout.TRAINS])):
                        wheels.contact_of_train(
                            b, c, 2 * (b - b0), step, V, tolerance, row, dims, constants, wheel_place,
                            wheelset_place, car_columns_start, car_columns, wheel, table, irregularity,
                            wheelset_compliance, coupling, contact, force, wheelset_force, rail_force, iterations,
                            wheel_record, car, under, size[at.CARS], blocks,
                        )  # fmt: skip
                    wheels.add_wheel_columns(c, first, dims, wheel_place, wheel_rows, rail, under)
                if stages & at.BACKWARD_STAGE:
                    spline_rail.backward(rail, first, n, coefficient, beta_dt2, gamma_dt, lanes)
                if stages & at.CAR_STAGE:
                    for i in range(b0 * size[at.CARS], (b0 + trains_a_chunk) * size[at.CARS]):
                        cars.correct(car, i * at.CAR_ROWS * blocks, beta_dt2, gamma_dt, blocks)
                if stages & at.EXCHANGE_STAGE:
                    seats.loads_on_slabs(c, trains_a_chunk, size, dims, seat_place, seat, slab_seat)
                if stages & at.SLAB_STAGE:
                    for g in range(b0 * groups, (b0 + trains_a_chunk) * groups):
                        slabs.push_at_seats(
                            slab, g * (dofs + 2 * K) + K, dofs, g * at.SLAB_SEAT_ROWS * per_slab, per_slab,
                            slab_seat_index, slab_seat_shape, slab_seat_x, slab_seat,
                        )  # fmt: skip
                    for b in range(b0, b0 + trains_a_chunk):
                        if p == 0:
                            sweep_slabs(
                                b, dofs, 0, dims, size, constants, slab_design, slab, slab_coefficient, slab_numbers, K
                            )
                        sweep_slabs(
                            b, dofs, 1, dims, size, constants, slab_design, slab, slab_coefficient, slab_numbers, K
                        )

    return spline_steps
