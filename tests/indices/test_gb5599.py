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
    """0.5 m/s^2: 3.57 (0.125 F/f)^(1/10), F by hand; 1e-4: the weight changes over the width of the window."""
    series = 0.5 * np.sin(2.0 * np.pi * f * TIME)
    assert sperling(series, 1e-3, direction) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
@pytest.mark.parametrize("f", [0.8, 0.9, 1.03, 1.1, 1.15, 2.7, 5.05, 15.07, 30.1])
def test_sperling_of_a_tone_between_lines(f, phase):
    """The closed form wherever the tone lies between multiples of 0.2 Hz, 2.62 at 1.1 Hz; 5e-4: the window's tails."""
    rise = 0.325 * f**2 if f < 5.9 else 400.0 / f**2 if f < 20.0 else 1.0
    expected = 3.57 * (0.125 * rise / f) ** 0.1
    series = 0.5 * np.sin(2.0 * np.pi * f * TIME + phase)
    assert sperling(series, 1e-3, "vertical") == pytest.approx(expected, rel=5e-4)
    if f == 1.1:
        assert round(expected, 2) == 2.62


def test_sperling_adds_tenth_powers():
    """Two sines: (W1^10 + W2^10)^(1/10); mean and tones beyond 0.5 to 40 Hz add less than 2e-4 through the window."""
    parts = [0.5 * np.sin(2.0 * np.pi * f * TIME) for f in (2.0, 10.0)]
    outside = 3.0 + np.sin(2.0 * np.pi * 0.2 * TIME) + np.sin(2.0 * np.pi * 60.0 * TIME)
    expected = (2.77748**10 + 2.64585**10) ** 0.1
    assert sperling(sum(parts) + outside, 1e-3, "vertical") == pytest.approx(expected, rel=2e-4)


def test_sperling_takes_the_worst_block():
    """A quiet block before; blocks begin every 2.5 s, so that a rest of less than that is left out."""
    loud = 0.5 * np.sin(2.0 * np.pi * TIME)
    series = np.concatenate([0.1 * loud, loud, 9.0 * loud[:2400]])
    assert sperling(series, 1e-3, "vertical") == pytest.approx(2.59148, rel=1e-4)
    assert sperling(series[:4999], 1e-3, "vertical") is None


def test_sperling_sees_a_burst_at_the_seam():
    """One second about the end of the first block counts as it does in the middle of one."""
    burst = np.zeros(15_000)
    burst[4500:5500] = np.sin(20.0 * np.pi * 1e-3 * np.arange(1000))
    middle = np.roll(burst, -2500)
    assert sperling(burst, 1e-3, "vertical") == pytest.approx(sperling(middle, 1e-3, "vertical"), rel=1e-9)


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
