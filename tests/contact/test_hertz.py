"""Hertz contact against tabulated coefficients and the closed forms for a circle."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.contact.hertz import hertz, zhai_G

E, NU = 2.06e11, 0.3
NEWTON = 70e3

# cos(beta) = |B - A|/(A + B); a = m [3(1-nu^2)N / (2E(A+B))]^(1/3), b with n,
# delta = r [(1.5 (1-nu^2) N/E)^2 (A+B)]^(1/3): the classical table of Hertz's coefficients
TABLE = [
    (1, 36.932, 0.13129, 0.12111),
    (2, 22.243, 0.16919, 0.17931),
    (5, 11.238, 0.23814, 0.29689),
    (10, 6.6115, 0.31098, 0.42801),
    (15, 4.8077, 0.36571, 0.52526),
    (20, 3.8160, 0.41215, 0.60384),
    (25, 3.1788, 0.45397, 0.66981),
    (30, 2.7307, 0.49306, 0.72631),
    (35, 2.3961, 0.53057, 0.77521),
    (40, 2.1357, 0.56729, 0.81774),
    (45, 1.9265, 0.60383, 0.85471),
    (50, 1.7542, 0.64069, 0.88674),
    (55, 1.6094, 0.67830, 0.91426),
    (60, 1.4858, 0.71710, 0.93759),
    (65, 1.3788, 0.75749, 0.95699),
    (70, 1.2851, 0.79990, 0.97264),
    (75, 1.2020, 0.84481, 0.98468),
    (80, 1.1278, 0.89272, 0.99321),
    (85, 1.0609, 0.94422, 0.99831),
    (90, 1.0, 1.0, 1.0),
]


@pytest.mark.parametrize(("beta", "m", "n", "r"), TABLE)
def test_coefficients_of_the_ellipse(beta: float, m: float, n: float, r: float) -> None:
    """Every row of the table, the ellipse lying along x and across it."""
    total = 2.0
    difference = total * np.cos(np.radians(beta))
    small, large = 0.5 * (total - difference), 0.5 * (total + difference)
    a, b, G = hertz([small, large], [large, small], E, NU)
    unit = (3.0 * (1.0 - NU**2) / (2.0 * E * total)) ** (1.0 / 3.0)
    approach = ((1.5 * (1.0 - NU**2) / E) ** 2 * total) ** (1.0 / 3.0)
    rounding = 5e-6 / 0.12  # half a unit of the last digit of the smallest entry, the coarsest relative rounding
    np.testing.assert_allclose(a / unit, [m, n], rtol=rounding)
    np.testing.assert_allclose(b / unit, [n, m], rtol=rounding)
    np.testing.assert_allclose(G / approach, r, rtol=rounding)


@pytest.mark.parametrize(
    ("wheel", "rail", "a_mm", "b_mm", "G_e8", "delta_um", "stiffness"),
    [
        (np.inf, 0.3, 6.19, 4.87, 4.954, 84.2, 1.25e9),
        (-0.45, 0.3, 5.13, 8.39, 4.102, 69.7, 1.51e9),
        (np.inf, 0.08, 7.41, 2.45, 5.956, 101.0, 1.04e9),
    ],
)
def test_wheels_on_rails(wheel, rail, a_mm, b_mm, G_e8, delta_um, stiffness) -> None:
    """A 0.43 m wheel under 70 kN: cone and hollow tread on R300, cone on R80."""
    a, b, G = hertz(0.5 / 0.43, 0.5 * (1.0 / wheel + 1.0 / rail), E, NU)
    third = NEWTON ** (1.0 / 3.0)
    delta = G * third**2
    found = [a * third * 1e3, b * third * 1e3, G * 1e8, delta * 1e6, 1.5 * NEWTON / delta]
    printed = [a_mm, b_mm, G_e8, delta_um, stiffness]
    np.testing.assert_allclose(found, printed, rtol=5e-3)  # three printed digits


def test_sphere_on_plane() -> None:
    """A = B = 1/2R: a = (3 N R / 4 E*)^(1/3), delta = a^2/R."""
    R, stiffness = 0.4, E / (2.0 * (1.0 - NU**2))
    a, b, G = hertz(0.5 / R, 0.5 / R, E, NU)
    radius = (0.75 * R / stiffness) ** (1.0 / 3.0)
    np.testing.assert_allclose([a, b, G], [radius, radius, radius**2 / R], rtol=1e-14)


def test_continuous_through_the_circle() -> None:
    """Passing A = B swaps the axes without a jump in any result."""
    B = 1.0 + np.linspace(-1e-6, 1e-6, 21)
    for result in hertz(1.0, B, E, NU):
        assert np.abs(np.diff(result, 2)).max() < 1e-12 * np.abs(result).max()  # rounding of 26 iterations


def test_curvatures_must_be_positive() -> None:
    """A flat gap has no contact ellipse."""
    with pytest.raises(ValueError, match="must be positive"):
        hertz(1.0, [1.0, 0.0], E, NU)


def test_zhai_laws() -> None:
    """The values for R = 0.43 m to their four printed digits."""
    assert zhai_G("zhai_cone", 0.43) == pytest.approx(5.182e-8, rel=1e-4)
    assert zhai_G("zhai_worn", 0.43) == pytest.approx(4.253e-8, rel=1e-4)
