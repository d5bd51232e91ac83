"""Comfort: percentiles and sums by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.indices.comfort import mean_comfort, total_rms
from tiengine.indices.filters import block_rms, weighted


def test_mean_comfort_takes_the_95th_percentile():
    """Blocks 0 ... 100 in units of 1e-3 and 2e-3: percentiles 0.095 and 0.19; 6 * 0.095 * sqrt(5)."""
    blocks = np.arange(101.0) * 1e-3
    assert mean_comfort(blocks, 2.0 * blocks) == pytest.approx(6 * 0.095 * np.sqrt(5.0), rel=1e-12)


def test_mean_comfort_of_a_sine():
    """0.5 m/s^2 at 8 Hz vertical: 6 * 1.0559 * 0.5/sqrt(2) = 2.2399, Wb to its four digits; run-in of 5 s cut."""
    z = 0.5 * np.sin(2.0 * np.pi * 8.0 * np.arange(0.0, 30.0, 1e-3))
    blocks = block_rms(weighted(z, 1e-3, "Wb")[5000:-5000], 1e-3, 5.0)
    assert len(blocks) == 4
    assert mean_comfort(0.0 * blocks, blocks) == pytest.approx(6.0 * 1.0559 * 0.5 / np.sqrt(2.0), rel=1e-4)


def test_total_rms():
    """Pythagoras of 3 and 4."""
    assert total_rms(np.full(5, 3.0), np.full(5, -4.0)) == pytest.approx(5.0, rel=1e-15)
