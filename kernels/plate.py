"""Rectangular ACM (Adini-Clough-Melosh) plate element: shapes, matrices, assembly.

Four nodes, three DOFs a node (w, dw/dx, dw/dy), the 12-term polynomial of Kirchhoff-Love theory: all cubics,
x^3 y and x y^3. w is C0 across elements, its normal slope is not: the element does not conform, passes the
patch test for constant curvature and its eigenvalues converge as h^2 (Zienkiewicz and Taylor, The Finite
Element Method, vol. 2, plate bending chapter).

Local node 2 jx + jy sits at (xi, eta) = (2 jx - 1, 2 jy - 1); local DOF i is component i % 3 of node i // 3.
Node (ix, iy) of the mesh is number ix (n_y + 1) + iy, element (ex, ey) is number ex n_y + ey.
x forward, y right, w down; a, b are the element's half lengths along x and y [m].
"""

import taichi as ti

from tiengine.kernels.types import Real, Reals1, Reals2, Reals3, Reals4


@ti.func
def corner_shape(s, t):
    """Deflection shape of the node at s = t = 1 and its derivatives (value, s, t, ss, tt, st)."""
    return ti.Vector(
        [
            (1.0 + s) * (1.0 + t) * (2.0 + s + t - s * s - t * t) / 8.0,
            (1.0 + t) * (3.0 + t - t * t - 3.0 * s * s) / 8.0,
            (1.0 + s) * (3.0 + s - s * s - 3.0 * t * t) / 8.0,
            -0.75 * s * (1.0 + t),
            -0.75 * t * (1.0 + s),
            (4.0 - 3.0 * s * s - 3.0 * t * t) / 8.0,
        ]
    )


@ti.func
def slope_shape(s, t):
    """Shape of unit slope d/ds at s = t = 1 and its derivatives (value, s, t, ss, tt, st)."""
    cubic = (1.0 + s) * (s * s - 1.0) / 8.0
    cubic_s = (3.0 * s * s + 2.0 * s - 1.0) / 8.0
    return ti.Vector(
        [cubic * (1.0 + t), cubic_s * (1.0 + t), cubic, (3.0 * s + 1.0) / 4.0 * (1.0 + t), 0.0 * t, cubic_s]
    )


@ti.func
def acm_shape(i, xi, eta, a, b):
    """Shape function of local DOF i and its derivatives at (xi, eta).

    Args:
        i: Local DOF, 0...11.
        xi: Local coordinate x/a, -1...1.
        eta: Local coordinate y/b, -1...1.
        a: Half length along x [m].
        b: Half length along y [m].

    Returns:
        Vector (w, dw/dx, dw/dy, d2w/dx2, d2w/dy2, d2w/dxdy).
    """
    node = i // 3
    sx = 2.0 * (node // 2) - 1.0
    sy = 2.0 * (node % 2) - 1.0
    s = sx * xi
    t = sy * eta
    P = corner_shape(s, t)
    if i % 3 == 1:
        P = sx * a * slope_shape(s, t)
    if i % 3 == 2:
        R = sy * b * slope_shape(t, s)
        P = ti.Vector([R[0], R[2], R[1], R[4], R[3], R[5]])
    return ti.Vector([P[0], sx * P[1] / a, sy * P[2] / b, P[3] / (a * a), P[4] / (b * b), sx * sy * P[5] / (a * b)])


@ti.kernel
def tabulate_shapes(
    # Model:
    a: Real,
    b: Real,
    points: Reals2,
    # Out:
    table_out: Reals3,
):
    """Evaluate the twelve shape functions at points of one element.

    Args:
        a: Half length along x [m].
        b: Half length along y [m].
        points: Local coordinates (xi, eta), shape (n, 2).
        table_out: w, dw/dx, dw/dy, d2w/dx2, d2w/dy2, d2w/dxdy of each shape, shape (n, 6, 12).
    """
    ti.loop_config(serialize=True)  # set-up of a few elements is not worth a thread pool
    for q, i in ti.ndrange(points.shape[0], 12):
        P = acm_shape(i, points[q, 0], points[q, 1], a, b)
        for m in ti.static(range(6)):
            table_out[q, m, i] = P[m]


@ti.kernel
def element_matrices(
    # Model:
    table: Reals3,
    weight: Reals1,
    plate: Reals2,
    factor: Reals3,
    # Out:
    stiffness_out: Reals4,
    mass_out: Reals4,
    bed_out: Reals4,
):
    """Stiffness, mass and bed matrix of every element of every design, by Gauss quadrature.

    Energies as in the source paper: bending, Eqs (11)-(13); translation and rotary inertia, Eq. (10). The bed
    matrix is the integral of factor N^T N. Each item writes its own entries, so the result does not depend on
    the threads; one triangle is computed and mirrored, so the matrices are symmetric to the last bit.

    Args:
        table: Shapes at the quadrature points (see :func:`tabulate_shapes`), shape (n_q, 6, 12).
        weight: Areas of the quadrature points [m^2], shape (n_q,).
        plate: Rigidity D_0 [N m], Poisson's ratio, rho h [kg/m^2], rho h^3/12 [kg], shape (n_design, 4).
        factor: Bed factor at every quadrature point, shape (n_design, n_el, n_q).
        stiffness_out: Shape (n_design, n_el, 12, 12) [N/m, N, N m].
        mass_out: Shape (n_design, n_el, 12, 12) [kg, kg m, kg m^2].
        bed_out: Shape (n_design, n_el, 12, 12) [m^2, m^3, m^4].
    """
    ti.loop_config(serialize=True)  # set-up of a few elements is not worth a thread pool
    for d, e, i in ti.ndrange(factor.shape[0], factor.shape[1], 12):
        for j in range(i + 1):
            K = 0.0
            M = 0.0
            B = 0.0
            nu = plate[d, 1]
            for q in range(weight.shape[0]):
                ww = table[q, 0, i] * table[q, 0, j]
                slopes = table[q, 1, i] * table[q, 1, j] + table[q, 2, i] * table[q, 2, j]
                direct = table[q, 3, i] * table[q, 3, j] + table[q, 4, i] * table[q, 4, j]
                cross = table[q, 3, i] * table[q, 4, j] + table[q, 4, i] * table[q, 3, j]
                twist = table[q, 5, i] * table[q, 5, j]
                K += weight[q] * (direct + nu * cross + 2.0 * (1.0 - nu) * twist)
                M += weight[q] * (plate[d, 2] * ww + plate[d, 3] * slopes)
                B += weight[q] * factor[d, e, q] * ww
            stiffness_out[d, e, i, j] = plate[d, 0] * K
            stiffness_out[d, e, j, i] = plate[d, 0] * K
            mass_out[d, e, i, j] = M
            mass_out[d, e, j, i] = M
            bed_out[d, e, i, j] = B
            bed_out[d, e, j, i] = B


@ti.kernel
def assemble_plates(
    # Model:
    n_x: int,
    n_y: int,
    element: Reals4,
    # Out:
    matrix_out: Reals3,
):
    """Assemble all elements of all designs, gathering by node.

    One loop item owns the three rows of one node and adds its (at most four) elements in a fixed order: no
    atomics, and the same sum for entry (i, j) as for (j, i).

    Args:
        n_x: Elements along x.
        n_y: Elements along y.
        element: Element matrices, shape (n_design, n_x n_y, 12, 12).
        matrix_out: Assembled matrices, shape (n_design, n, n) with n >= 3 (n_x + 1)(n_y + 1), added to.
    """
    ti.loop_config(serialize=True)  # set-up of a few elements is not worth a thread pool
    for d, node in ti.ndrange(element.shape[0], (n_x + 1) * (n_y + 1)):
        ix = node // (n_y + 1)
        iy = node % (n_y + 1)
        for jx, jy in ti.ndrange(2, 2):
            ex = ix - 1 + jx
            ey = iy - 1 + jy
            if 0 <= ex < n_x and 0 <= ey < n_y:
                own = 2 * (1 - jx) + (1 - jy)  # this node's number in element (ex, ey)
                for r in range(3):
                    for other in range(4):
                        column = 3 * ((ex + other // 2) * (n_y + 1) + ey + other % 2)
                        for c in range(3):
                            # "+=" in a parallel loop would be an atomic
                            matrix_out[d, 3 * node + r, column + c] = (
                                matrix_out[d, 3 * node + r, column + c]
                                + element[d, ex * n_y + ey, 3 * own + r, 3 * other + c]
                            )
