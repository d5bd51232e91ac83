"""What passes through the window's ends: rail enters at rest, and no vibration of the rail grows."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as sl

from tiengine.track.knots import Grading, graded_knots
from tiengine.track.rail_operators import RailOperators
from tiengine.track.splines import Splines

from .rails import LENGTH, WHEELS, chn60

SPACING, SEAT = 0.63, 0.15  # m
STIFFNESS, LATERAL_STIFFNESS = 4e7, 1.5e7


def fastest_growth(operators: RailOperators, V: float, c: float, lateral: bool) -> float:
    """Largest real part of the eigenvalues of a rail on seats that stand still in the window [1/s]."""
    M, C, K = (A.toarray() for A in (operators.lateral(V) if lateral else operators.vertical(V)))
    s, rail = np.arange(0.3, LENGTH, SPACING), operators.rail
    rows, slopes = (operators.under(s, order, SEAT) for order in (0, 1))
    w, v, x = (row.toarray() for row in rows)
    dw, dv, dx = (row.toarray() for row in slopes)
    a, b = rail.arm_fastening, rail.half_base
    springs = [(v - a * x, dv - a * dx, LATERAL_STIFFNESS), (b * x, b * dx, STIFFNESS)]
    for B, dB, k in springs if lateral else [(w, dw, STIFFNESS)]:
        K, C = K + B.T @ (k * B - V * c * dB), C + c * B.T @ B
    root = np.linalg.cholesky(M)
    C, K = (sl.solve_triangular(root, sl.solve_triangular(root, A, lower=True).T, lower=True).T for A in (C, K))
    n, scale = len(M), 1e4  # 1/s, for the balance of u and its rate
    companion = np.block([[np.zeros((n, n)), scale * np.eye(n)], [-K / scale, -C]])
    return float(np.linalg.eigvals(companion).real.max())


@pytest.mark.parametrize("lateral", [False, True])
@pytest.mark.parametrize("finest", [0.15, 0.05])
def test_no_vibration_grows(finest, lateral):
    """With seats that damp, everything decays; free entry at the front let it grow by 6 to 54 1/s."""
    grading = Grading(finest=finest, coarsest=finest / 0.15)
    operators = RailOperators(chn60(), Splines(graded_knots(LENGTH, WHEELS, grading)))
    for kmh in (50.0, 350.0, 600.0):
        assert fastest_growth(operators, kmh / 3.6, 5e4, lateral) < 0.0


def test_without_damping_nothing_is_fed_in():
    """Rails without any damping keep their vibration to rounding of eigenvalues that reach 3e5 1/s."""
    operators = RailOperators(chn60(), Splines(graded_knots(LENGTH, WHEELS)))
    for lateral in (False, True):
        assert abs(fastest_growth(operators, 350.0 / 3.6, 0.0, lateral)) < 1e-6


def test_rail_enters_at_rest():
    """The front's share of the flux of momentum, mu V psi psi, and nothing else."""
    operators = RailOperators(chn60(), Splines(graded_knots(LENGTH, WHEELS)))
    V, n = 100.0, operators.functions.count
    slope = operators.functions.products.slope
    expected = operators.rail.densities[1] * V * (-2.0 * slope.flow.toarray() + np.diag(np.arange(n) == n - 1.0))
    np.testing.assert_allclose(operators.vertical(V)[1].toarray()[1::2, 1::2], expected, atol=1e-12)
