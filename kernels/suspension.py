"""Nonlinear suspension elements: dampers and stops by odd piecewise-linear tables.

Element e lengthens by d = sum_k row[e, k] u[base + index[e, k]]. Its force is a table of the rate (kind 0) or
of the elongation (kind 1). The slope ``linear[e]`` of that table already stands in the train's C or K, so
only the deviation

    F(q) - linear q,   q = d or its rate,

is added here, as -row deviation on the coordinates. Unused entries have index 0 and row 0.
"""

import taichi as ti

from tiengine.kernels.types import Array, Ints1, Ints2, Reals1, Reals2, Reals3


@ti.func
def table_force(e: int, q: float, table: Array):
    """Odd force of element e at abscissa q; the last slope goes on beyond the last point."""
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
    u: Array,
    v: Array,
    f: Array,
    base: int,
    index: Array,
    row: Array,
    kind: Array,
    linear: Array,
    table: Array,
):
    """Add the deviations of one train's elements to ``f``.

    Args:
        u: Displacements [m, rad], flat; the train's coordinates start at ``base``.
        v: Velocities [m/s, rad/s], likewise.
        f: Generalised forces [N, N m], likewise, added to.
        base: First coordinate of the train.
        index: Coordinates of each element, shape (n_e, 12).
        row: Elongation per coordinate, shape (n_e, 12).
        kind: 0 force of the rate, 1 force of the elongation, shape (n_e,).
        linear: Slope that stands in C or K [N s/m, N/m], shape (n_e,).
        table: Points (abscissa, force), shape (n_e, points, 2).
    """
    for e in range(kind.shape[0]):
        q = 0.0
        for k in range(row.shape[1]):
            i = base + index[e, k]
            q += row[e, k] * (v[i] if kind[e] == 0 else u[i])
        deviation = table_force(e, q, table) - linear[e] * q
        for k in range(row.shape[1]):
            f[base + index[e, k]] -= row[e, k] * deviation


@ti.kernel
def suspension_forces(
    # Model:
    n: ti.i32,
    index: Ints2,
    row: Reals2,
    kind: Ints1,
    linear: Reals1,
    table: Reals3,
    # State in:
    u_in: Reals1,
    v_in: Reals1,
    # State out:
    f_out: Reals1,
):
    """Add the deviations of every train's elements; train b has the coordinates b n to (b + 1) n."""
    for b in range(u_in.shape[0] // n):
        add_suspension_forces(u_in, v_in, f_out, b * n, index, row, kind, linear, table)
