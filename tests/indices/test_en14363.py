"""EN 14363: percentiles, zones and limits on known series."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.indices.en14363 import extreme, section_length, shortfall, wheel_force_limit

KMH = 1.0 / 3.6


def test_percentiles_of_a_ramp():
    """0 ... 10000: the percentile p is 100 p; of a series about zero the greater side counts, of Q the upper."""
    ramp = np.arange(10_001.0)
    x = np.linspace(0.0, 500.0, 10_001)
    assert extreme(x, ramp, 97.0, 3.0) == pytest.approx(9985.0, rel=1e-12)
    assert extreme(x, ramp - 9000.0, 97.0, 3.0) == pytest.approx(8985.0, rel=1e-12)  # 0.15 %: 15 - 9000
    assert extreme(x, ramp - 9000.0, 97.0, 3.0, signed=True) == pytest.approx(985.0, rel=1e-12)


@pytest.mark.parametrize("k", [3.0, 2.2])
def test_a_zone_of_sections(k):
    """25 sections of 500 m, constant each, 1 ... 25: mean 13, standard deviation sqrt(25 26/12)."""
    x = np.arange(0.0, 12_500.0 + 0.5, 1.0)
    series = np.minimum(x // 500.0, 24.0) + 1.0
    assert shortfall(x[-1] - x[0], 350.0 * KMH) == ""
    assert extreme(x, series, 350.0 * KMH, k) == pytest.approx(13.0 + k * np.sqrt(25.0 * 26.0 / 12.0), rel=1e-12)


@pytest.mark.parametrize(("kmh", "length", "zone"), [(220.0, 250.0, 10_000.0), (221.0, 500.0, 12_500.0)])
def test_what_a_zone_needs(kmh, length, zone):
    """25 sections and 10 km, one metre less is an index and says so."""
    assert section_length(kmh * KMH) == length
    assert shortfall(zone, kmh * KMH) == ""
    assert f"the run covers only {zone - 1:.0f} m" in shortfall(zone - 1.0, kmh * KMH)


@pytest.mark.parametrize(
    ("static", "kmh", "limit"), [(60.0, 120.0, 150.0), (60.0, 300.0, 150.0), (75.0, 300.0, 165.0), (75.0, 301.0, 160.0),
                                 (95.0, 250.0, 180.0), (112.0, 160.0, 200.0), (112.0, 161.0, 190.0)],
)  # fmt: skip
def test_limit_of_wheel_force(static, kmh, limit):
    """90 kN + Q0 up to what the track bears at the speed."""
    assert wheel_force_limit(static, kmh * KMH) == pytest.approx(limit, rel=1e-12)
