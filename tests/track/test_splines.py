"""Splines: against SciPy, polynomials, sums, smoothness, integrals, the mean over a seat, the lookup."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from tiengine.parameters.errors import InputError
from tiengine.track.knots import graded_knots, uniform_knots
from tiengine.track.seat_points import seat_points
from tiengine.track.splines import Splines

from .rails import LENGTH, WHEELS

KNOTS = {
    "graded": graded_knots(LENGTH, WHEELS),
    "uneven": np.array([0.0, 0.3, 0.35, 1.0, 2.0, 2.2, 3.7]),
    "least": np.array([0.0, 0.4, 1.0, 1.3]),
}
ROUNDING = 1e-12  # products of numbers of about 1 to 300 (third derivatives on short spans)


@pytest.fixture(params=KNOTS)
def splines(request):
    return Splines(KNOTS[request.param])


def inner(splines, count=401):
    return np.linspace(0.0, splines.length, count)


def basis(splines):
    k = splines.knots
    t = np.concatenate([np.repeat(k[0], 3), k, np.repeat(k[-1], 3)])
    return BSpline(t, np.eye(len(k) + 2), 3)


@pytest.mark.parametrize("derivative", [0, 1])
def test_scipy_has_the_same(splines, derivative):
    """All but the end functions of SciPy's basis; the slopes' end functions are sums of two."""
    s, B = inner(splines), basis(splines)(inner(splines), derivative)
    scale = np.abs(B).max()
    np.testing.assert_allclose(splines.shape(s, derivative), B[:, 1:-1], atol=ROUNDING * scale)
    psi = B[:, 1:-1].copy()
    psi[:, 0] += B[:, 0]
    psi[:, -1] += B[:, -1]
    np.testing.assert_allclose(splines.slope_shape(s, derivative), psi, atol=ROUNDING * scale)


def test_ends(splines):
    """Displacements are zero there, slopes have no derivative."""
    ends = np.array([0.0, splines.length])
    assert np.abs(splines.shape(ends)).max() < ROUNDING
    assert np.abs(splines.slope_shape(ends, 1)).max() < ROUNDING / np.diff(splines.knots).min()


def test_sum_is_one(splines):
    """Slopes everywhere; displacements but for the end spans, where one function is left out."""
    s = inner(splines)
    np.testing.assert_allclose(splines.slope_shape(s).sum(axis=1), 1.0, atol=ROUNDING)
    away = s[(s >= splines.knots[1]) & (s <= splines.knots[-2])]
    np.testing.assert_allclose(splines.shape(away).sum(axis=1), 1.0, atol=ROUNDING)
    assert np.all(splines.shape(s) > -ROUNDING)


@pytest.mark.parametrize("kind", ["displacement", "slope"])
def test_cubics_are_reproduced(splines, kind):
    """Every cubic that meets the end conditions: s (l - s) (a + b s) and what has no slope at the ends."""
    s, l = inner(splines), splines.length
    if kind == "displacement":
        cubics = [s * (l - s), s * (l - s) * (s - 0.3 * l)]
        phi = splines.shape(s)
    else:
        cubics = [np.ones_like(s), s**2 * (1.5 * l - s)]
        phi = splines.slope_shape(s)
    for cubic in cubics:
        q = np.linalg.lstsq(phi, cubic, rcond=None)[0]
        np.testing.assert_allclose(phi @ q, cubic, atol=1e-11 * np.abs(cubic).max())  # conditioned as the basis: 100
    outside = np.linalg.lstsq(phi, s.copy(), rcond=None)[0]
    assert np.abs(phi @ outside - s).max() > 1e-3  # one that does not


def test_twice_differentiable(splines):
    """Value, slope and curvature agree on both sides of every inner knot; the third derivative does not."""
    for pieces in (splines.displacement, splines.slope):
        h = np.diff(splines.knots)
        jumps = np.zeros(4)
        for p in range(len(h) - 1):
            for order in range(4):
                left, right = np.zeros(splines.count), np.zeros(splines.count)
                index = np.arange(4)
                c, d = pieces.coefficients[p], pieces.coefficients[p + 1]
                factor = [np.prod(np.arange(k - order + 1, k + 1), initial=1.0) for k in range(4)]
                powers = [factor[k] * h[p] ** (k - order) if k >= order else 0.0 for k in range(4)]
                left[pieces.first[p] + index] = c @ powers
                right[pieces.first[p + 1] + index] = d[:, order] * factor[order]
                jumps[order] = max(jumps[order], np.abs(left - right).max() * h.min() ** order)
        assert np.all(jumps[:3] < ROUNDING)
        assert jumps[3] > 0.1


def test_products_by_quadrature(splines):
    """Five of the integrals by twelve Gauss points a span."""
    x, w = np.polynomial.legendre.leggauss(12)
    h = np.diff(splines.knots)[:, None]
    s, weight = (splines.knots[:-1, None] + h * (x + 1.0) / 2.0).ravel(), (h * w / 2.0).ravel()
    p = splines.products
    phi, phi1 = splines.shape(s), splines.shape(s, 1)
    psi, psi1 = splines.slope_shape(s), splines.slope_shape(s, 1)
    for found, a, b in (
        (p.displacement.values, phi, phi), (p.displacement.flow, phi, phi1), (p.displacement.slopes, phi1, phi1),
        (p.slope.values, psi, psi), (p.slope.flow, psi, psi1), (p.slope.slopes, psi1, psi1), (p.shear, phi1, psi),
    ):  # fmt: skip
        expected = (a.T * weight) @ b
        np.testing.assert_allclose(found.toarray(), expected, atol=ROUNDING * np.abs(expected).max())


def test_flow_is_skew_but_for_the_flux(splines):
    """Int f f' is skew for displacements; for slopes its symmetric part is half the values at the ends."""
    flow = splines.products.displacement.flow.toarray()
    np.testing.assert_allclose(flow, -flow.T, atol=1e-14)
    flow = splines.products.slope.flow.toarray()
    flux = np.zeros_like(flow)
    flux[0, 0], flux[-1, -1] = -1.0, 1.0
    np.testing.assert_allclose(flow + flow.T, flux, atol=1e-14)


@pytest.mark.parametrize("length", [0.05, 0.15, 0.4])
@pytest.mark.parametrize("derivative", [0, 1])
def test_mean_over_a_seat(splines, length, derivative):
    """The table of means against five evaluations; what lies beyond the ends counts as zero."""
    s, (offset, weight) = np.linspace(-0.1, splines.length + 0.1, 441), seat_points(length)
    expected = np.zeros((len(s), splines.count))
    for x, a in zip(offset, weight, strict=True):
        inside = (s + x >= 0.0) & (s + x <= splines.length)
        expected[inside] += a * splines.shape(s[inside] + x, derivative)
    found = splines.shape(s, derivative, length)
    # where a point passes an end the slope jumps
    ends = np.array([0.0, splines.length])[:, None, None]
    clear = np.abs(s[:, None] + offset - ends).min(axis=(0, 2)) > 1e-9
    np.testing.assert_allclose(found[clear], expected[clear], atol=1e-10 * np.abs(expected).max())


def test_weights_of_a_seat_sum_to_one():
    """In the interior a seat's force goes to the rail whole, and a rigid rail moves the seat as a point."""
    splines = Splines(KNOTS["graded"])
    s = np.linspace(1.1, LENGTH - 1.1, 777)
    first, weights = splines.seats(0.15).weights(s)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=ROUNDING)
    _, slopes = splines.seats(0.15).weights(s, 1)
    np.testing.assert_allclose(slopes.sum(axis=1), 0.0, atol=1e-11)
    assert np.all((first >= 0) & (first + splines.seats(0.15).width <= splines.count))


def test_width_of_the_tables():
    """A point touches four functions, a seat of 0.15 m five as the default spaces its knots, six at 0.1 m."""
    graded = Splines(KNOTS["graded"])
    assert (graded.seats(0.0).width, graded.seats(0.15).width) == (4, 5)
    assert Splines(uniform_knots(10.0, 0.1)).seats(0.15).width == 6


@pytest.mark.parametrize("length", [0.0, 0.15])
def test_lookup(length):
    """Start and at most so many steps on lead to the piece, also at the breaks and at the cells' edges."""
    pieces = Splines(KNOTS["graded"]).seats(length)
    lookup = pieces.lookup(0.05)
    rng = np.random.default_rng(1)
    rear = pieces.breaks[0]
    cells = rear + lookup.cell * np.arange(len(lookup.start))
    inside = rng.uniform(rear, pieces.breaks[-1], 4000)
    places = np.concatenate([inside, pieces.breaks[:-1], cells, np.nextafter(cells[1:], -1.0)])
    most = 0
    for s in places:
        p, steps = lookup.start[min(int((s - rear) / lookup.cell), len(lookup.start) - 1)], 0
        while p + 1 < len(pieces.first) and s >= pieces.breaks[p + 1]:
            p, steps = p + 1, steps + 1
        assert p == pieces.locate(np.array([s]))[0]
        most = max(most, steps)
    assert most <= lookup.advances
    assert length or lookup.advances == 1


@pytest.mark.parametrize("knots", [[0.0, 1.0, 2.0], [0.1, 1.0, 2.0, 3.0], [0.0, 1.0, 1.0, 2.0]])
def test_bad_knots(knots):
    with pytest.raises(InputError, match="must ascend from 0 m"):
        Splines(np.array(knots))
