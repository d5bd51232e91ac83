"""States of rest on springs that only push."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import minimize

from tiengine.parameters.errors import InputError
from tiengine.track.unilateral import PushingSprings, at_rest


def test_a_block_that_tilts_until_its_corner_lifts() -> None:
    """A block on two springs, 1 m apart, its load at x: k (x0, x1) = F (1 - x, x) while both push, then one alone."""
    K = sp.csc_array(np.diag([0.0, 1.0]))  # a trace that keeps the block from tumbling
    rows = sp.csr_array(np.array([[1.0, -0.5], [1.0, 0.5]]))
    springs = PushingSprings(rows, np.full(2, 1e6), np.zeros(2))
    for x in (0.5, 0.8, 1.0):
        q = at_rest(K, 1e3 * np.array([1.0, x - 0.5]), springs)
        np.testing.assert_allclose(1e6 * np.maximum(rows @ q, 0.0), 1e3 * np.array([1.0 - x, x]), atol=1e-3)
    tumbled = at_rest(K, 1e3 * np.array([1.0, 0.6]), springs)  # beyond the edge: the trace holds what is left
    np.testing.assert_allclose(1e6 * np.maximum(rows @ tumbled, 0.0), [0.0, 1e3], rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_the_energy_is_least(seed: int) -> None:
    """Against a general minimiser, some gaps open and some closed."""
    random = np.random.default_rng(seed)
    n, m = 6, 15
    half = random.standard_normal((n, n))
    K, R = half @ half.T + 0.1 * np.eye(n), random.standard_normal((m, n))
    k, gap, load = 10.0 ** random.uniform(0, 2, m), random.uniform(-0.5, 0.5, m), 5.0 * random.standard_normal(n)

    def energy(q):
        return 0.5 * q @ K @ q - load @ q + 0.5 * np.sum(k * np.maximum(R @ q - gap, 0.0) ** 2)

    q = at_rest(sp.csc_array(K), load, PushingSprings(sp.csr_array(R), k, gap))
    best = minimize(energy, q + 0.1 * random.standard_normal(n), method="BFGS", options={"gtol": 1e-10})
    assert energy(q) <= best.fun + 1e-9
    np.testing.assert_allclose(q, best.x, atol=1e-5)  # the minimiser's own
    assert 0 < np.count_nonzero(R @ q > gap) < m


def test_what_rests_on_nothing_is_refused() -> None:
    springs = PushingSprings(sp.csr_array((0, 2)), np.zeros(0), np.zeros(0))
    with pytest.raises(InputError, match="rests on nothing"):
        at_rest(sp.csc_array((2, 2)), np.ones(2), springs)
