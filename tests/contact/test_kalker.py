"""Kalker's coefficients: the printed table, the limits of slender ellipses and what lies between."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.contact.kalker import asymptote_mismatch, kalker

EXACT = 1e-12  # interpolation at its own nodes


@pytest.mark.parametrize(
    ("ratio", "nu", "printed"),
    [
        (0.1, 0.25, (3.31, 2.52, 0.473, 8.28)),
        (0.5, 0.0, (2.88, 2.88, 0.827, 1.74)),
        (0.8, 0.5, (5.05, 3.65, 1.40, 1.42)),
        (1.0, 0.0, (3.40, 3.40, 1.33, 1.21)),
        (1.0, 0.25, (4.12, 3.67, 1.47, 1.19)),
        (1.0, 0.5, (5.20, 3.98, 1.63, 1.16)),
        (1.0 / 0.6, 0.25, (4.78, 4.50, 2.23, 0.892)),
        (1.0 / 0.3, 0.5, (7.34, 7.51, 5.01, 0.446)),
        (10.0, 0.25, (11.7, 12.8, 14.6, 0.526)),
    ],
)
def test_entries_of_table_e3(ratio: float, nu: float, printed: tuple[float, ...]) -> None:
    """Entries come back unchanged."""
    np.testing.assert_allclose(kalker(ratio, nu), printed, rtol=EXACT)


def test_isotropy_without_poisson_effect() -> None:
    """At nu = 0 there is no coupling of the directions: C11 = C22 over the whole table."""
    C = kalker(np.geomspace(0.1, 10.0, 41), 0.0)
    np.testing.assert_allclose(C[:, 0], C[:, 1], rtol=EXACT)


def test_steel() -> None:
    """nu = 0.3 at a/b = 1: 1/C from the quadratic through 3.40, 4.12, 5.20 (and so on), by hand."""
    weights = np.array([-0.08, 0.96, 0.12])  # Lagrange's polynomials through 0, 0.25, 0.5 at 0.3
    columns = [(3.40, 4.12, 5.20), (3.40, 3.67, 3.98), (1.33, 1.47, 1.63), (1.21, 1.19, 1.16)]
    by_hand = [1.0 / (weights @ (1.0 / np.array(column))) for column in columns]
    np.testing.assert_allclose(kalker(1.0, 0.3), by_hand, rtol=EXACT)
    # linear interpolation to 0.3, hard-coded in a public code, differs by the rule only
    np.testing.assert_allclose(kalker(1.0, 0.3), (4.336, 3.732, 1.502, 1.184), rtol=1e-2)


def test_asymptotes_against_the_table() -> None:
    """How far the limits for g -> 0 miss the table at g = 0.1: they are limits, not fits."""
    for nu in (0.0, 0.25, 0.5):
        missed = np.abs(asymptote_mismatch(nu) - 1.0)
        assert missed[:, :3].max() < 0.07  # largest: C23, a < b, nu = 0.5: 6.4 %
        assert missed[:, 3].max() < 0.08  # C33, a > b, nu = 0.5: 7.1 %
    assert np.abs(asymptote_mismatch(0.3)[1, 3] - 1.0) < 0.11  # C33 at 0.3: interpolation in 1/C adds to it


def test_slender_limits() -> None:
    """At g = 1e-6 the coefficients are the asymptotes: (table/asymptote)^(g/0.1) is 1 to 1e-6."""
    g, nu = 1e-6, 0.25
    C = kalker(g, nu)
    assert C[0] == pytest.approx(np.pi**2 / (4.0 * (1.0 - nu)), rel=2e-6)
    assert C[1] == pytest.approx(np.pi**2 / 4.0, rel=2e-6)
    assert C[3] == pytest.approx(np.pi**2 / (16.0 * (1.0 - nu) * g), rel=2e-6)
    L = np.log(16.0 / g**2)
    C23 = 2.0 * np.pi / (3.0 * g**1.5 * ((1.0 - nu) * L - 2.0 + 4.0 * nu))
    assert kalker(1.0 / g, nu)[2] == pytest.approx(C23, rel=2e-6)


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.28, 0.3, 0.5])
def test_continuous_and_positive(nu: float) -> None:
    """No jump anywhere: steps of 0.5 % in a/b change no coefficient by more than C ~ (a/b)^1.6 would."""
    C = kalker(np.geomspace(0.02, 50.0, 1566), nu)
    assert (C > 0.0).all()
    assert np.abs(np.diff(np.log(C), axis=0)).max() < 1.6 * 0.005
