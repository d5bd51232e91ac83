"""Cars by the columns of their inverse operators, eight coordinates at once (``spline_layout``).

Cars are independent in the implicit part. The acceleration is made before contact, with the wheels' forces as they
stand; contact then adds A^-1's columns times the changes it makes, so that nothing has to be solved again. Elements
between cars belong to the explicit forces, as the nonlinear suspension does.
"""

import taichi as ti

from tiengine.kernels import layout, suspension
from tiengine.kernels import spline_layout as at
from tiengine.kernels.types import Array, Template

STIFFNESS_COLUMNS, DAMPING_COLUMNS, INVERSE_COLUMNS, N_TABLES = range(4)  # of -A^-1 K, -A^-1 C, A^-1


@ti.func
def predict(car: Array, base: int, constants: Array, blocks: Template):
    """Newmark's predictors of one car; ``base`` is its first vector."""
    dt, beta_dt2, gamma_dt = constants[layout.DT], constants[layout.BETA_DT2], constants[layout.GAMMA_DT]
    half, rest = 0.5 * dt * dt - beta_dt2, dt - gamma_dt
    for m in ti.static(range(blocks)):
        v, a = car[base + at.V * blocks + m], car[base + at.A * blocks + m]
        car[base + at.U_PREDICTED * blocks + m] = car[base + at.U * blocks + m] + dt * v + half * a
        car[base + at.V_PREDICTED * blocks + m] = v + rest * a


@ti.func
def add_columns(car: Array, total: Template, row: int, dofs: int, columns: Array, start: int, blocks: Template):
    """Add a table's columns times the coordinates in a car's row, whose first vector is ``row``."""
    for j in range(dofs):
        x = car[row + j // 8][j % 8]
        for m in ti.static(range(blocks)):
            total[m] = total[m] + columns[start + j * blocks + m] * x


@ti.func
def linear_acceleration(car: Array, base: int, dofs: int, columns: Array, start: int, blocks: Template):
    """-A^-1 (C v~ + K u~) of one car into LINEAR; ``start`` is the first vector of its tables in ``columns``."""
    total = [ti.Vector.zero(ti.f64, 8) for _ in range(blocks)]
    size = 8 * blocks * blocks
    add_columns(car, total, base + at.U_PREDICTED * blocks, dofs, columns, start + STIFFNESS_COLUMNS * size, blocks)
    add_columns(car, total, base + at.V_PREDICTED * blocks, dofs, columns, start + DAMPING_COLUMNS * size, blocks)
    for m in ti.static(range(blocks)):
        car[base + at.LINEAR * blocks + m] = total[m]


@ti.func
def acceleration(car: Array, base: int, dofs: int, columns: Array, start: int, blocks: Template):
    """LINEAR + A^-1 CAR_LOAD of one car into A."""
    total = [ti.Vector.zero(ti.f64, 8) for _ in range(blocks)]
    for m in ti.static(range(blocks)):
        total[m] = car[base + at.LINEAR * blocks + m]
    tables = start + INVERSE_COLUMNS * 8 * blocks * blocks
    add_columns(car, total, base + at.CAR_LOAD * blocks, dofs, columns, tables, blocks)
    for m in ti.static(range(blocks)):
        car[base + at.A * blocks + m] = total[m]


@ti.func
def correct(car: Array, base: int, beta_dt2: float, gamma_dt: float, blocks: Template):
    """Newmark's correctors of one car."""
    for m in ti.static(range(blocks)):
        a = car[base + at.A * blocks + m]
        car[base + at.U * blocks + m] = car[base + at.U_PREDICTED * blocks + m] + beta_dt2 * a
        car[base + at.V * blocks + m] = car[base + at.V_PREDICTED * blocks + m] + gamma_dt * a


@ti.func
def number(car: Array, place: int):
    """One coordinate by its place among the numbers of ``car``."""
    return car[place // 8][place % 8]


@ti.func
def add_number(car: Array, place: int, x: float):
    """Add to one number of ``car``."""
    car[place // 8][place % 8] = car[place // 8][place % 8] + x


@ti.func
def record_bodies(b: int, row: int, start: int, place: Array, car: Array, body_record_out: Array, blocks: Template):
    """Motion of a train's bodies: rows U, V, A. ``start`` is the train's first number, ``place`` by coordinate."""
    for kind in range(3):
        for i in range(body_record_out.shape[3]):
            body_record_out[b, row, kind, i] = number(car, start + kind * blocks * 8 + place[i])


@ti.func
def load_row(b: int, step: int, size: Array, blocks: Template):
    """First vector of a train's row of loads in a step."""
    return size[at.CARS] * blocks + b * size[at.LOAD_TRAIN] + step * size[at.LOAD_STEP]


@ti.func
def loads(
    b: int, row_u: int, row_v: int, V_rate: float, given: int, size: Array, dims: Array, load: Array,
    wheelset_place: Array, wheel: Array, wheelset_force: Array, element_place: Array, element_row: Array,
    element_kind: Array, element_linear: Array, element_table: Array, car: Array, blocks: Template,
):  # fmt: skip
    """CAR_LOAD of one train: gravity, braking, gyroscopic pair, suspension, the wheels' forces as they stand.

    Args:
        b: Train.
        row_u: Row of the displacements.
        row_v: Row of the velocities.
        V_rate: dV/dt [m/s^2].
        given: First vector of the step's row in ``load``.
        size: Sizes, see ``spline_layout``.
        dims: Sizes, see ``layout``.
        load: Force per unit rate of speed, then rows of loads (``tiengine.engine.load_rows``), vectors.
        wheelset_place: Places of y, z, roll, pitch, yaw of each wheelset in row 0 of a train, shape (W, 5).
        wheel: r0, b0, spin inertia, shape (W, 3).
        wheelset_force: Generalised forces on y, z, roll, pitch, yaw, shape (trains, W, 5).
        element_place: Places of each element's coordinates in row 0 of a train, shape (n_e, 12).
        element_row: Elongation by coordinate, shape (n_e, 12).
        element_kind: 0 force of the rate, 1 of the elongation, shape (n_e,).
        element_linear: Slope that stands in C or K, shape (n_e,).
        element_table: Points (abscissa, force), shape (n_e, points, 2).
        car: State of the cars.
        blocks: Vectors a row of a car.
    """
    cars = size[at.CARS]
    for i in range(cars):
        base = (b * cars + i) * at.CAR_ROWS * blocks + at.CAR_LOAD * blocks
        for m in ti.static(range(blocks)):
            car[base + m] = load[given + i * blocks + m] + V_rate * load[i * blocks + m]
    elongation = (given + cars * blocks) * 8
    yaw_rate = elongation + size[at.ELEMENTS]
    roll_rate = yaw_rate + dims[layout.WHEELSETS]
    start = b * cars * at.CAR_ROWS * blocks * 8
    u, v, f = start + row_u * blocks * 8, start + row_v * blocks * 8, start + at.CAR_LOAD * blocks * 8
    for w in range(dims[layout.WHEELSETS]):
        roll, pitch, yaw = wheelset_place[w, 2], wheelset_place[w, 3], wheelset_place[w, 4]
        spin = wheel[w, 2] * number(car, v + pitch)
        add_number(car, f + roll, spin * (number(car, v + yaw) + number(load, yaw_rate + w)))
        add_number(car, f + yaw, -(spin * (number(car, v + roll) + number(load, roll_rate + w))))
        for m in range(5):
            add_number(car, f + wheelset_place[w, m], wheelset_force[b, w, m])
    for e in range(size[at.ELEMENTS]):
        row = v if element_kind[e] == 0 else u
        q = number(load, elongation + e)
        for k in range(element_row.shape[1]):
            q += element_row[e, k] * number(car, row + element_place[e, k])
        deviation = suspension.table_force(e, q, element_table) - element_linear[e] * q
        for k in range(element_row.shape[1]):
            add_number(car, f + element_place[e, k], -(element_row[e, k] * deviation))
