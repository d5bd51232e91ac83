"""Nonlinear suspension elements: dampers and stops by odd piecewise-linear tables.

Element e lengthens by d = sum_k row[e, k] u[base + index[e, k]]. Its force is a table of the rate (kind 0) or
of the elongation (kind 1). The slope ``linear[e]`` of that table is already contained in the train's C or K, so
only the deviation

    F(q) - linear q,   q = d or its rate,

is added here, as -row deviation on the coordinates. Unused entries have index 0 and row 0.
"""

import taichi as ti

from tiengine.kernels.types import Array, Ints1, Ints2, Reals1, Reals2, Reals3


@ti.func
def table_force(e: int, q: float, table: Array):
    """Odd force of element e at abscissa q; the last slope continues beyond the last point."""
    x = ti.abs(q)
    force = 0.0
    for j in range(table.shape[1] - 1):
        if j == 0 or x > table[e, j, 0]:
            slope = (table[e, j + 1, 1] - table[e, j, 1]) / (table[e, j + 1, 0] - table[e, j, 0])
            force = table[e, j, 1] + slope * (x - table[e, j, 0])
    if q < 0.0:
        force = -force
    return force


@ti.func
def add_suspension_forces(
    base: int,
    index: Array,
    row: Array,
    kind: Array,
    linear: Array,
    table: Array,
    motion: Array,
    row_u: int,
    row_v: int,
    row_f: int,
    load: Array,
    elongation: int,
):
    """Add the deviations of one train's elements to ``f``.

    Args:
        base: Column of the train's first coordinate.
        index: Coordinates of each element, shape (n_e, 12).
        row: Elongation per coordinate, shape (n_e, 12).
        kind: 0 force of the rate, 1 force of the elongation, shape (n_e,).
        linear: Slope contained in C or K [N s/m, N/m], shape (n_e,).
        table: Points (abscissa, force), shape (n_e, points, 2).
        motion: State, one column a coordinate.
        row_u: Row of the displacements [m, rad].
        row_v: Row of the velocities [m/s, rad/s].
        row_f: Row of the generalised forces [N, N m], added to.
        load: Rows of loads (``tiengine.engine.load_rows``).
        elongation: Place in it of the elongations that the frames of the bodies make [m, m/s].
    """
    for e in range(kind.shape[0]):
        q = load[elongation + e]
        for k in range(row.shape[1]):
            i = base + index[e, k]
            q += row[e, k] * (motion[row_v, i] if kind[e] == 0 else motion[row_u, i])
        deviation = table_force(e, q, table) - linear[e] * q
        for k in range(row.shape[1]):
            i = base + index[e, k]
            motion[row_f, i] = motion[row_f, i] - row[e, k] * deviation


@ti.kernel
def suspension_forces(
    # Model:
    n: ti.i32,
    index: Ints2,
    row: Reals2,
    kind: Ints1,
    linear: Reals1,
    table: Reals3,
    elongation: Reals1,
    # State:
    motion_out: Reals2,
):
    """Add the deviations of every train's elements; rows of the motion are displacement, velocity, force.

    Train b has the columns b n to (b + 1) n.
    """
    for b in range(motion_out.shape[1] // n):
        add_suspension_forces(b * n, index, row, kind, linear, table, motion_out, 0, 1, 2, elongation, 0)
