"""The ACM plate element and its assembly."""

from __future__ import annotations

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from tiengine.kernels import plate

ROUNDING = np.finfo(float).eps

A, B = 0.31, 0.625  # half lengths of the element of the tests [m], as in the default mesh
ACM_TERMS = [(i, j) for i in range(4) for j in range(4) if i + j <= 3 or (i, j) in {(3, 1), (1, 3)}]
"""Powers (x, y) of the element's twelve monomials."""


def monomials(x: NDArray[np.float64], y: NDArray[np.float64], dx: int = 0, dy: int = 0) -> NDArray[np.float64]:
    """Derivatives of the twelve monomials, shape (points, 12)."""

    def power(z: NDArray[np.float64], p: int, order: int) -> NDArray[np.float64]:
        factor = np.prod(np.arange(p - order + 1, p + 1)) if order else 1.0
        return factor * z ** (p - order) if p >= order else np.zeros_like(z)

    return np.stack([power(x, i, dx) * power(y, j, dy) for i, j in ACM_TERMS], axis=-1)


def corner_dofs() -> NDArray[np.float64]:
    """(w, w_x, w_y) of every monomial at the element's nodes in the element's order, shape (12, 12)."""
    x, y = np.array([-A, -A, A, A]), np.array([-B, B, -B, B])
    return np.stack([monomials(x, y), monomials(x, y, 1), monomials(x, y, 0, 1)], axis=1).reshape(12, 12)


def tabulate(points: NDArray[np.float64]) -> NDArray[np.float64]:
    table = np.zeros((len(points), 6, 12))
    plate.tabulate_shapes(A, B, points, table)
    return table


def gauss(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, w = np.polynomial.legendre.leggauss(n)
    return np.stack(np.meshgrid(x, x, indexing="ij"), -1).reshape(-1, 2), np.outer(w, w).ravel() * A * B


def test_shapes_are_one_at_their_own_dof() -> None:
    """At a node the rows w, dw/dx, dw/dy pick that node's DOFs: a partition of the element's DOFs."""
    corners = np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])
    table = tabulate(corners)[:, :3].reshape(12, 12)
    np.testing.assert_allclose(table, np.eye(12), atol=10 * ROUNDING)  # a dozen operations on numbers near 1


def test_shapes_reproduce_the_acm_polynomial() -> None:
    """w and its five derivatives of each of the twelve monomials come out of their nodal values."""
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 2))
    x, y = A * points[:, 0], B * points[:, 1]
    orders = [(0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1)]
    exact = np.stack([monomials(x, y, dx, dy) for dx, dy in orders], axis=1)
    # entries of the table reach 1/A^2 = 10, twelve terms are summed
    np.testing.assert_allclose(tabulate(points) @ corner_dofs(), exact, atol=1000 * ROUNDING)


def test_element_matrices_are_the_exact_integrals() -> None:
    """Against the polynomial's coefficients and closed integrals of monomials (no quadrature there)."""
    D, nu, mass, rotary = 2.5e7, 0.2, 500.0, 1.7
    points, weight = gauss(4)
    K, M, bed = np.zeros((3, 2, 1, 12, 12))
    factor = np.stack([np.ones((1, 16)), np.full((1, 16), 0.25)])
    plate.element_matrices(tabulate(points), weight, np.tile([D, nu, mass, rotary], (2, 1)), factor, K, M, bed)

    def integral(p: int, half: float) -> float:
        return 0.0 if p % 2 else 2.0 * half ** (p + 1) / (p + 1)

    def product(left: tuple[int, int], right: tuple[int, int]) -> NDArray[np.float64]:
        """Integral of (d^left m_a)(d^right m_b) over the element."""
        out = np.zeros((12, 12))
        for a, (i, j) in enumerate(ACM_TERMS):
            for b, (k, m) in enumerate(ACM_TERMS):
                powers = [i - left[0], k - right[0], j - left[1], m - right[1]]
                if min(powers) >= 0:
                    falls = [(i, left[0]), (k, right[0]), (j, left[1]), (m, right[1])]
                    factor = np.prod([np.prod(np.arange(p - o + 1, p + 1)) for p, o in falls if o])
                    out[a, b] = factor * integral(powers[0] + powers[1], A) * integral(powers[2] + powers[3], B)
        return out

    inverse = np.linalg.inv(corner_dofs())
    xx, yy, cross = product((2, 0), (2, 0)), product((0, 2), (0, 2)), product((2, 0), (0, 2))
    bending = D * (xx + yy + nu * (cross + cross.T) + 2.0 * (1.0 - nu) * product((1, 1), (1, 1)))
    area = product((0, 0), (0, 0))
    inertia = mass * area + rotary * (product((1, 0), (1, 0)) + product((0, 1), (0, 1)))
    for design, share in enumerate((1.0, 0.25)):
        for ours, reference in ((K, bending), (M, inertia), (bed, share * area)):
            exact = inverse.T @ reference @ inverse
            # the inverse of the corner matrix has a condition number of about 1e3
            tolerance = 1e4 * ROUNDING * np.abs(exact).max()
            np.testing.assert_allclose(ours[design, 0], exact, atol=tolerance)


def test_four_points_are_needed_and_enough() -> None:
    """N^T N by 4 x 4 points equals 8 x 8 points; 3 x 3 points miss the terms of degree six."""

    def bed(n: int) -> NDArray[np.float64]:
        points, weight = gauss(n)
        N = tabulate(points)[:, 0]
        return np.einsum("q,qi,qj->ij", weight, N, N)

    scale = np.abs(bed(8)).max()
    assert np.abs(bed(4) - bed(8)).max() < 50 * ROUNDING * scale  # 64 terms summed
    assert np.abs(bed(3) - bed(8)).max() > 1e-4 * scale


def test_assembly_of_several_designs_equals_scipy_sparse() -> None:
    """Random element matrices, three designs of a 4 x 3 mesh: same entries as the sum of a COO matrix."""
    n_x, n_y, designs = 4, 3, 3
    element = np.random.default_rng(2).normal(size=(designs, n_x * n_y, 12, 12))
    n = 3 * (n_x + 1) * (n_y + 1)
    ours = np.zeros((designs, n + 2, n + 2))
    plate.assemble_plates(n_x, n_y, element, ours)
    for d in range(designs):
        rows, columns, values = [], [], []
        for ex in range(n_x):
            for ey in range(n_y):
                nodes = [(ex + jx) * (n_y + 1) + ey + jy for jx in (0, 1) for jy in (0, 1)]
                dofs = np.concatenate([[3 * node, 3 * node + 1, 3 * node + 2] for node in nodes])
                rows.append(np.repeat(dofs, 12))
                columns.append(np.tile(dofs, 12))
                values.append(element[d, ex * n_y + ey].ravel())
        place = (np.concatenate(rows), np.concatenate(columns))
        reference = scipy.sparse.coo_array((np.concatenate(values), place), shape=(n + 2, n + 2)).toarray()
        np.testing.assert_allclose(ours[d], reference, atol=8 * ROUNDING * 4.0)  # four numbers near 1 summed
