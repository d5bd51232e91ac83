"""Factors without pivoting, one-sided rows and columns, and the knots' spans, against dense algebra and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.interpolate import BSpline

from tiengine.engine.banded import Factors, wheel_rows
from tiengine.engine.spline_tables import SeatTables, spans_of
from tiengine.kernels import spline_layout as at

RNG = np.random.default_rng(0)


def banded_matrix(N: int, k: int) -> np.ndarray:
    i = np.arange(N)
    A = np.where(np.abs(i[:, None] - i) <= k, RNG.standard_normal((N, N)), 0.0)
    return A + 3.0 * k * np.eye(N)


@pytest.mark.parametrize(("N", "k"), [(40, 7), (60, 11), (9, 11)])
def test_factors_multiply_to_the_matrix(N: int, k: int) -> None:
    A = banded_matrix(N, k)
    factors = Factors.of(sp.csr_array(A), k)
    L, U = np.eye(N), np.diag(1.0 / factors.inverse_diagonal)
    for q in range(min(k, N - 1)):
        L[np.arange(q + 1, N), np.arange(N - q - 1)] = factors.lower[q + 1 :, q]
        U[np.arange(N - q - 1), np.arange(q + 1, N)] = (
            factors.upper[: N - q - 1, q] / factors.inverse_diagonal[: N - q - 1]
        )
    np.testing.assert_allclose(L @ U, A, atol=1e-12 * np.abs(A).max())


def test_one_sided_rows_and_columns() -> None:
    """(U^-T w) . (L^-1 F) = w . A^-1 F, with coordinates held at zero left out."""
    A, held = banded_matrix(60, 11), np.array([0, 2, 57, 59])
    factors = Factors.of(sp.csr_array(A), 11, held)
    free = np.setdiff1d(np.arange(60), held)
    inverse = np.zeros((60, 60))
    inverse[np.ix_(free, free)] = np.linalg.inv(A[np.ix_(free, free)])
    w, F = RNG.standard_normal((2, 60, 3))
    np.testing.assert_allclose(factors.row(w).T @ factors.column(F), w.T @ inverse @ F, atol=1e-13)


def test_entries_outside_the_band_are_refused() -> None:
    A = banded_matrix(20, 3)
    A[0, 15] = 1.0
    with pytest.raises(ValueError, match="15 off, the band has 7"):
        Factors.of(sp.csr_array(A), 7)


def test_wheels_feel_each_other_as_the_whole_inverse_says() -> None:
    n = 30
    vertical, lateral = banded_matrix(2 * n, 7), banded_matrix(3 * n, 11)
    factors = Factors.of(sp.csr_array(vertical), 7), Factors.of(sp.csr_array(lateral), 11)
    first, shape = np.array([20, 5]), RNG.standard_normal((2, 4, 2))
    coupling = wheel_rows(factors, first, shape).coupling
    for fields, A, given in ((2, vertical, {0: 0}), (3, lateral, {1: 0, 2: 2})):
        inverse = np.linalg.inv(A)
        for w in range(2):
            for k in range(2):
                for f, a in given.items():
                    for g, b in given.items():
                        rows, force = np.zeros((2, len(A))), np.zeros(len(A))
                        rows[:, fields * first[w] + a + fields * np.arange(4)] = shape[w].T
                        force[fields * first[k] + b + fields * np.arange(4)] = shape[k, :, 0]
                        np.testing.assert_allclose(coupling[w, :, k, f, g], rows @ inverse @ force, atol=1e-13)


def test_spans_hold_the_splines() -> None:
    inner = np.cumsum(np.concatenate([[0.0], RNG.uniform(0.15, 1.0, 30)]))
    knots = np.concatenate([[0.0] * 3, inner, [inner[-1]] * 3])
    spans = spans_of(knots)
    spline = BSpline(knots, np.eye(len(knots) - 4), 3)
    s = np.concatenate([RNG.uniform(0.0, inner[-1], 200), inner])
    first, values = spans.at(s)
    for kind, exact in enumerate((spline(s), spline.derivative()(s))):
        got = np.zeros_like(exact)
        for i in range(len(s)):
            got[i, first[i] : first[i] + 4] = values[i, :, kind]
        np.testing.assert_allclose(got, exact, atol=1e-12 * np.abs(exact).max())


def test_a_seat_longer_than_its_room_is_refused() -> None:
    inner = np.arange(0.0, 3.0, 0.05)
    spans = spans_of(np.concatenate([[0.0] * 3, inner, [inner[-1]] * 3]))
    assert len(SeatTables.of(4, 0.1, spans).shape) == 4 * at.TOUCHED * at.N_SEAT_SHAPE
    with pytest.raises(ValueError, match="touches up to"):
        SeatTables.of(4, 0.3, spans)
