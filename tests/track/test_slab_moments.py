"""Bending moments of a slab: exact where the element is, and against a deflection that leaves free edges free."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from tiengine.track.mortar import Mortar
from tiengine.track.plate_shapes import W, element_dofs, shapes_at, tabulate_shapes
from tiengine.track.slab import Slab, load_slab
from tiengine.track.slab_matrices import slab_matrices
from tiengine.track.slab_moments import GAUSS_POINTS, moment_operator

CORNERS = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])


@pytest.fixture(scope="module")
def given() -> tuple[Slab, Mortar]:
    return load_slab("CRTS_III")


def nodal(slab: Slab, x_part: Polynomial, y_part: Polynomial) -> NDArray[np.float64]:
    """Slab coordinates of w = f(x) g(y), from the slab's centre, shape (dofs,)."""
    x = np.linspace(-slab.length / 2, slab.length / 2, slab.elements_x + 1)
    y = np.linspace(-slab.width / 2, slab.width / 2, slab.elements_y + 1)
    x, y = (z.ravel() for z in np.meshgrid(x, y, indexing="ij"))
    rows = [x_part(x) * y_part(y), x_part.deriv()(x) * y_part(y), x_part(x) * y_part.deriv()(y)]
    return np.append(np.stack(rows, axis=1).ravel(), [0.0, 0.0])


def places(slab: Slab, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coordinates of the points of all elements, from the slab's centre [m], shape (elements points,) each."""
    ex, ey = np.divmod(np.arange(slab.elements_x * slab.elements_y)[:, None], slab.elements_y)
    x = (ex + (points[:, 0] + 1.0) / 2.0) * slab.length / slab.elements_x - slab.length / 2.0
    y = (ey + (points[:, 1] + 1.0) / 2.0) * slab.width / slab.elements_y - slab.width / 2.0
    return x.ravel(), y.ravel()


ONE, LINE = Polynomial([1.0]), Polynomial([0.0, 1.0])


@pytest.mark.parametrize(
    ("f", "g", "w_xx", "w_yy"),
    [
        (LINE**2, ONE, lambda x, y: 2.0 + 0.0 * x, lambda x, y: 0.0 * x),
        (ONE, LINE**2, lambda x, y: 0.0 * x, lambda x, y: 2.0 + 0.0 * x),
        (LINE, LINE, lambda x, y: 0.0 * x, lambda x, y: 0.0 * x),
        (LINE**3, ONE, lambda x, y: 6.0 * x, lambda x, y: 0.0 * x),
        (LINE, LINE**2, lambda x, y: 0.0 * x, lambda x, y: 2.0 * x),
    ],
    ids=["x2", "y2", "xy", "x3", "xy2"],
)
def test_moments_of_polynomials(given, f, g, w_xx, w_yy):
    """The element holds all cubics: M_x = -D (w,xx + nu w,yy), M_y = -D (w,yy + nu w,xx), to rounding."""
    slab, _ = given
    D, nu = slab.rigidity, slab.nu
    x, y = places(slab, GAUSS_POINTS)
    found = np.tensordot(nodal(slab, f, g), moment_operator(slab), 1)
    expected = -D * np.stack([w_xx(x, y) + nu * w_yy(x, y), w_yy(x, y) + nu * w_xx(x, y)])
    np.testing.assert_allclose(found, expected, atol=1e-10 * D)  # 1/h^2 = 3 / m^2 times rounding of 3 m


def quartic(size: float) -> Polynomial:
    """Zero with its first three derivatives at +- size / 2, one in the middle."""
    return (Polynomial([1.0, 0.0, -4.0 / size**2])) ** 4


def static_errors(slab: Slab, mortar: Mortar) -> tuple[float, float]:
    """Errors of the moments under a load whose deflection is known, over their root mean square.

    w = f(x) g(y) of quartic zeros at the edges leaves no moment, no shear there and no force at the corners, so that it
    is the deflection of a free slab on its bed under q = D (w,xxxx + 2 w,xxyy + w,yyyy) + k w.

    Returns:
        Root mean square of the error at the Gauss points, and at the nodes, the elements there averaged.
    """
    f, g, D = quartic(slab.length), quartic(slab.width), slab.rigidity

    def w(x: NDArray[np.float64], y: NDArray[np.float64], i: int = 0, j: int = 0) -> NDArray[np.float64]:
        return (f.deriv(i) if i else f)(x) * (g.deriv(j) if j else g)(y)

    def load(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        return D * (w(x, y, 4, 0) + 2.0 * w(x, y, 2, 2) + w(x, y, 0, 4)) + mortar.stiffness * w(x, y)

    gauss, weight = np.polynomial.legendre.leggauss(8)
    points = np.array([[a, b] for a in gauss for b in gauss])
    area = np.outer(weight, weight).ravel() * slab.length * slab.width / (4.0 * slab.elements_x * slab.elements_y)
    q = load(*places(slab, points)).reshape(-1, len(points))
    index, shape = element_dofs(slab), tabulate_shapes(slab, points)[:, W]
    m = slab_matrices(slab, mortar)
    F = np.bincount(index.ravel(), ((q * area) @ shape).ravel(), slab.plate_dofs)
    u = np.append(np.linalg.solve((m.K_plate + m.K_bed)[:-2, :-2], F), [0.0, 0.0])

    def moments(which: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        x, y = places(slab, which)
        exact = -D * np.stack([w(x, y, 2, 0) + slab.nu * w(x, y, 0, 2), w(x, y, 0, 2) + slab.nu * w(x, y, 2, 0)])
        return np.tensordot(u, moment_operator(slab, which), 1), exact

    found, exact = moments(GAUSS_POINTS)
    at_gauss = np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2))
    found, exact = moments(CORNERS)
    node = index[:, ::3].ravel() // 3
    count = np.bincount(node)
    miss = np.stack([np.bincount(node, row) / count for row in found - exact])
    truth = np.stack([np.bincount(node, row) / count for row in exact])
    return float(at_gauss), float(np.sqrt(np.mean(miss**2) / np.mean(truth**2)))


def test_moments_of_a_slab_on_its_bed_converge(given):
    """At the Gauss points at least with the square of the element's size; errors at the nodes are four times as large.

    Meshes of 12, 18 and 27 elements: order 2 to 3 means a ratio of 2.25 to 3.4. Measured: 2.6, 0.9 and 0.3 % at the
    Gauss points, 12, 6.5 and 3.2 % at the nodes.
    """
    slab, mortar = given
    errors = np.array(
        [
            static_errors(slab.model_copy(update={"elements_x": nx, "elements_y": ny}), mortar)
            for nx, ny in ((12, 8), (18, 12), (27, 18))
        ]
    )
    ratio = errors[:-1, 0] / errors[1:, 0]
    assert np.all((1.5**2 < ratio) & (ratio < 1.5**3))
    assert np.all(errors[:, 0] < errors[:, 1] / 4.0)


def test_a_load_in_the_middle_stretches_the_underside(given):
    """Sign: the slab sags under a force down, on both axes."""
    slab, mortar = given
    m = slab_matrices(slab, mortar)
    index, table = shapes_at(slab, np.zeros(1), np.zeros(1))
    force = np.zeros(m.n)
    force[index[0]] = 1e5 * table[0, W]
    u = np.append(np.linalg.solve((m.K_plate + m.K_bed)[:-2, :-2], force[:-2]), [0.0, 0.0])
    x, y = places(slab, GAUSS_POINTS)
    nearest = np.argmin(np.hypot(x, y))
    assert np.all(np.tensordot(u, moment_operator(slab), 1)[:, nearest] > 0.0)
