"""Slabs by their bands, eight slots of a train at once (``spline_layout``).

A slab's coordinates are its plate's, node after node, column after column, then lateral displacement and yaw: A's half
width K is 14 for three nodes across. A slab's own design (void, failed fastenings) has its own coefficients: a group of
slots is swept once for every design in it, and only the lanes of that design keep what comes out.
"""

import taichi as ti

from tiengine.kernels import layout, mortar
from tiengine.kernels import spline_layout as at
from tiengine.kernels.types import Array, Template


@ti.func
def felt(i: int, dofs: int, u: Template, v: Template, constants: Array):
    """K u + c v of one coordinate as its fastenings feel it; the last two coordinates are lateral."""
    k, c = constants[layout.K_VERTICAL], constants[layout.C_VERTICAL]
    if i >= dofs - 2:
        k, c = constants[layout.K_LATERAL], constants[layout.C_LATERAL]
    return k * u + c * v


@ti.func
def predict(slab: Array, base: int, dofs: int, constants: Array):
    """Newmark's predictors of a group, and its k u + c v in SLAB_PULL; ``base`` is its first coordinate's place."""
    dt, beta_dt2, gamma_dt = constants[layout.DT], constants[layout.BETA_DT2], constants[layout.GAMMA_DT]
    half, rest = 0.5 * dt * dt - beta_dt2, dt - gamma_dt
    for i in range(dofs):
        k = (base + i) * at.SLAB_ROWS
        v, a = slab[k + at.V], slab[k + at.A]
        u = slab[k + at.U] + dt * v + half * a
        v = v + rest * a
        slab[k + at.U_PREDICTED], slab[k + at.V_PREDICTED] = u, v
        slab[k + at.SLAB_PULL] = felt(i, dofs, u, v, constants)


@ti.func
def pull_at_seats(
    slab: Array, base: int, dofs: int, out: int, per_slab: int, index: Array, shape: Array, seat_x: Array,
    slab_seat: Array,
):  # fmt: skip
    """Subtract a group's motion at its seats: five rows per seat (``spline_layout``), moments per b^2.

    Args:
        slab: State of the slabs.
        base: Place of the group's first coordinate.
        dofs: N; the last two are lateral displacement and yaw.
        out: The group's first row in ``slab_seat``.
        per_slab: Seats a slab.
        index: Coordinates under each seat, shape (2, seats a slab, touched).
        shape: Their shapes for w, then for dw/dy, shape (2, 2, seats a slab, touched).
        seat_x: Seats from the slab's centre [m], shape (seats a slab,).
        slab_seat: Rows of the seats, shape (trains groups 5 per_slab,).
    """
    lateral = (base + dofs - 2) * at.SLAB_ROWS + at.SLAB_PULL
    y, yaw = slab[lateral], slab[lateral + at.SLAB_ROWS]
    for j in range(per_slab):
        for r in ti.static(range(2)):
            w, slope = ti.Vector.zero(ti.f64, 8), ti.Vector.zero(ti.f64, 8)
            for q in range(index.shape[2]):
                g = slab[(base + index[r, j, q]) * at.SLAB_ROWS + at.SLAB_PULL]
                w = w + shape[0, r, j, q] * g
                slope = slope + shape[1, r, j, q] * g
            slab_seat[out + r * per_slab + j] = w
            slab_seat[out + (2 + r) * per_slab + j] = slope
        slab_seat[out + 4 * per_slab + j] = y + seat_x[j] * yaw


@ti.func
def push_at_seats(
    slab: Array, base: int, dofs: int, out: int, per_slab: int, index: Array, shape: Array, seat_x: Array,
    slab_seat: Array,
):  # fmt: skip
    """Add the seats' forces to a group's SLAB_LOAD; arguments as in :func:`pull_at_seats`."""
    lateral = (base + dofs - 2) * at.SLAB_ROWS + at.SLAB_LOAD
    y, yaw = slab[lateral], slab[lateral + at.SLAB_ROWS]
    for j in range(per_slab):
        for r in ti.static(range(2)):
            force, couple = slab_seat[out + r * per_slab + j], slab_seat[out + (2 + r) * per_slab + j]
            for q in range(index.shape[2]):
                k = (base + index[r, j, q]) * at.SLAB_ROWS + at.SLAB_LOAD
                slab[k] = slab[k] + shape[0, r, j, q] * force + shape[1, r, j, q] * couple
        side = slab_seat[out + 4 * per_slab + j]
        y = y + side
        yaw = yaw + seat_x[j] * side
    slab[lateral], slab[lateral + at.SLAB_ROWS] = y, yaw


@ti.func
def add_ground_loads(slab: Array, base: int, dofs: int, down: Template, aside: Template, row: int, table: Array):
    """Add the inertia forces of a group of slabs on moving ground to SLAB_LOAD.

    Args:
        slab: State of the slabs.
        base: Place of the group's first coordinate.
        dofs: N; the last two are lateral displacement and yaw.
        down: Acceleration of the ground under the slots, downwards [m/s^2].
        aside: The same to the right.
        row: Row of the table.
        table: Inertia force of each coordinate by unit acceleration [kg, kg m].
    """
    for i in range(dofs):
        k = (base + i) * at.SLAB_ROWS + at.SLAB_LOAD
        a = down
        if i >= dofs - 2:
            a = aside
        slab[k] = slab[k] - table[row, i] * a


@ti.func
def shift(near: Template, newest: Template, K: Template):
    """Put the newest result before the K ones a row couples with."""
    for q in ti.static(range(K - 1)):
        near[K - 1 - q] = near[K - 2 - q]
    near[0] = newest


@ti.func
def coupled(coefficient: Array, k: int, near: Template, K: Template):
    """Entries that a row couples with: the farthest first, the nearest last."""
    total = coefficient[k + K - 1] * near[K - 1]
    for q in ti.static(range(1, K)):
        total = total + coefficient[k + K - 1 - q] * near[K - 1 - q]
    return total


@ti.func
def linear_forces(
    slab: Array, base: int, dofs: int, start: int, coefficient: Array, mixed: Template, designs: Template,
    design: float, K: Template,
):  # fmt: skip
    """-(C v~ + K u~) of a group into LINEAR, by the rows of K and C from ``start`` on, shape (N, 2, 2K + 1).

    Other arguments as in :func:`solve`.
    """
    for i in range(dofs):
        a, b = ti.Vector.zero(ti.f64, 8), ti.Vector.zero(ti.f64, 8)
        k = start + i * 2 * (2 * K + 1)
        s = (base + i - K) * at.SLAB_ROWS
        for q in range(2 * K + 1):
            a = a - coefficient[k + q] * slab[s + q * at.SLAB_ROWS + at.U_PREDICTED]
            b = b - coefficient[k + 2 * K + 1 + q] * slab[s + q * at.SLAB_ROWS + at.V_PREDICTED]
        keep(slab, (base + i) * at.SLAB_ROWS + at.LINEAR, a + b, mixed, designs, design)


@ti.func
def keep(slab: Array, place: int, x: Template, mixed: Template, designs: Template, design: float):
    """Store a vector, in a mixed group only the lanes of one design."""
    if ti.static(mixed == 1):
        slab[place] = ti.select(designs == design, x, slab[place])
    else:
        slab[place] = x


@ti.func
def solve(
    slab: Array, base: int, dofs: int, start: int, coefficient: Array, mixed: Template, designs: Template,
    design: float, constants: Array, K: Template,
):  # fmt: skip
    """A^-1 (LINEAR + SLAB_LOAD) of a group, and Newmark's correctors.

    Args:
        slab: State of the slabs.
        base: Place of the group's first coordinate.
        dofs: N.
        start: The design's L by rows, nearest first, 1/diagonal, U / diagonal; shape (N, 2K + 1) from here on.
        coefficient: Coefficients of all designs.
        mixed: 1 if the group holds slabs of several designs.
        designs: Design in each lane, vector.
        design: The one whose lanes are filled.
        constants: Numbers, see ``layout``.
        K: Half width of the band.
    """
    beta_dt2, gamma_dt = constants[layout.BETA_DT2], constants[layout.GAMMA_DT]
    near = [ti.Vector.zero(ti.f64, 8) for _ in range(K)]
    for i in range(dofs):
        s = (base + i) * at.SLAB_ROWS
        f = slab[s + at.LINEAR] + slab[s + at.SLAB_LOAD] - coupled(coefficient, start + i * (2 * K + 1), near, K)
        shift(near, f, K)
        slab[s + at.SLAB_FORWARD] = f
    for q in ti.static(range(K)):
        near[q] = ti.Vector.zero(ti.f64, 8)
    for m in range(dofs):
        i = dofs - 1 - m
        s = (base + i) * at.SLAB_ROWS
        k = start + i * (2 * K + 1) + K
        a = slab[s + at.SLAB_FORWARD] * coefficient[k] - coupled(coefficient, k + 1, near, K)
        shift(near, a, K)
        u = slab[s + at.U_PREDICTED] + beta_dt2 * a
        v = slab[s + at.V_PREDICTED] + gamma_dt * a
        keep(slab, s + at.A, a, mixed, designs, design)
        keep(slab, s + at.U, u, mixed, designs, design)
        keep(slab, s + at.V, v, mixed, designs, design)
        keep(slab, s + at.SLAB_PULL, felt(i, dofs, u, v, constants), mixed, designs, design)


@ti.func
def clear_loads(slab: Array, base: int, dofs: int):
    """Zero a group's SLAB_LOAD."""
    for i in range(dofs):
        slab[(base + i) * at.SLAB_ROWS + at.SLAB_LOAD] = ti.Vector.zero(ti.f64, 8)


@ti.func
def record_motion(slab: Array, base: int, dofs: int, out: int, record_out: Array):
    """Copy a group's displacements, rates and accelerations to ``record_out``, in turn, from row ``out`` on."""
    for i in range(dofs):
        s = (base + i) * at.SLAB_ROWS
        for m in ti.static(range(3)):
            record_out[out + 3 * i + m] = slab[s + at.U + m]


@ti.func
def bed_forces(
    b: int, slot: int, base: int, row_u: int, row_v: int, dofs: int, design: int, index: Array, shape: Array,
    weight: Array, factor: Array, rest: Array, lateral_K: Array, lateral_C: Array, numbers: Array, slab: Array,
    motion: Array, pressure_out: Array,
):  # fmt: skip
    """Add what of one slab's bed is not in its implicit block to SLAB_LOAD, by way of a copy of its coordinates.

    ``base`` is the place of the first coordinate of the slot's group, ``rest`` is by slot, ``motion`` has rows u, v, F,
    shape (3, N); the other arguments are those of :func:`tiengine.kernels.mortar.bed_force_and_pressure`.
    """
    lane = slot % 8
    for i in range(dofs):
        s = (base + i) * at.SLAB_ROWS
        motion[0, i], motion[1, i], motion[2, i] = slab[s + row_u][lane], slab[s + row_v][lane], 0.0
    pressure = mortar.bed_force_and_pressure(
        design, slot, index, shape, weight, factor, rest, lateral_K, lateral_C, numbers[0], numbers[1],
        ti.cast(numbers[2], ti.i32), ti.cast(numbers[3], ti.i32), 0, dofs, motion, 0, 1, 2,
    )  # fmt: skip
    for i in range(dofs):
        s = (base + i) * at.SLAB_ROWS + at.SLAB_LOAD
        slab[s][lane] = slab[s][lane] + motion[2, i]
    for m in ti.static(range(2)):
        pressure_out[b, slot, m] = pressure[m]
