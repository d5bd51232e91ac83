"""GB/T 5599: the Sperling index and the indices of wheel forces against numbers computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.indices.gb5599 import sperling, sperling_weight, unloading

TIME = np.arange(0.0, 5.0, 1e-3)


@pytest.mark.parametrize(
    ("direction", "f", "expected"),
    [
        ("vertical", 1.0, 2.59148), ("vertical", 2.0, 2.77748), ("vertical", 5.0, 3.04400), ("vertical", 10.0, 2.64585),
        ("lateral", 1.0, 2.83575), ("lateral", 2.0, 3.03928), ("lateral", 5.0, 3.33093), ("lateral", 10.0, 2.77748),
    ],
)  # fmt: skip
def test_sperling_of_a_sine(direction, f, expected):
    """0.5 m/s^2: 3.57 (0.125 F/f)^(1/10), F by hand; the numbers have six digits."""
    series = 0.5 * np.sin(2.0 * np.pi * f * TIME)
    assert sperling(series, 1e-3, direction) == pytest.approx(expected, abs=6e-6)


def test_sperling_adds_tenth_powers():
    """Two sines: (W1^10 + W2^10)^(1/10); what lies outside 0.5 to 40 Hz, and the mean, does not count."""
    parts = [0.5 * np.sin(2.0 * np.pi * f * TIME) for f in (2.0, 10.0)]
    outside = 3.0 + np.sin(2.0 * np.pi * 0.2 * TIME) + np.sin(2.0 * np.pi * 60.0 * TIME)
    expected = (2.77748**10 + 2.64585**10) ** 0.1
    assert sperling(sum(parts) + outside, 1e-3, "vertical") == pytest.approx(expected, abs=1e-5)


def test_sperling_takes_the_worst_block():
    """A quiet block before, a rest of less than a block behind."""
    loud = 0.5 * np.sin(2.0 * np.pi * TIME)
    series = np.concatenate([0.1 * loud, loud, 9.0 * loud[:4000]])
    assert sperling(series, 1e-3, "vertical") == pytest.approx(2.59148, abs=6e-6)
    assert sperling(series[:4999], 1e-3, "vertical") is None


@pytest.mark.parametrize(
    ("direction", "f", "F"),
    [("vertical", 5.0, 8.125), ("vertical", 5.9, 400 / 5.9**2), ("vertical", 20.0, 1.0), ("vertical", 30.0, 1.0),
     ("lateral", 5.0, 20.0), ("lateral", 20.0, 1.625), ("lateral", 26.0, 1.0)],
)  # fmt: skip
def test_weights(direction, f, F):
    """Each piece of F, by hand."""
    assert sperling_weight(np.array([f]), direction)[0] == pytest.approx(F, rel=1e-12)


def test_unloading():
    """60 kN at rest, 45 kN least: a quarter is lost; a constant load of 60 kN loses nothing; a wheel in the air all."""
    assert unloading(np.array([60.0, 45.0, 80.0]), 60.0) == pytest.approx(0.25, rel=1e-15)
    assert unloading(np.full(9, 60.0), 60.0) == 0.0
    assert unloading(np.array([60.0, 0.0]), 60.0) == 1.0
