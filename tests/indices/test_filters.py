"""Filters against closed forms on sines, and against the tables of the standards."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from tiengine.indices.filters import (
    WEIGHTINGS,
    band_pass,
    band_pass_settling,
    block_rms,
    low_pass,
    low_pass_settling,
    sliding_mean,
    weighted,
)

THIRDS = np.array(
    [0.1, 0.125, 0.16, 0.2, 0.25, 0.315, 0.4, 0.5, 0.63, 0.8, 1, 1.25, 1.6, 2, 2.5, 3.15, 4, 5, 6.3, 8, 10, 12.5, 16,
     20, 25, 31.5, 40, 50, 63, 80, 100, 125, 160, 200, 250, 315, 400]
)  # fmt: skip
"""Nominal frequencies [Hz] of ISO 2631-1, table 3."""

WK = np.array(
    [31.2, 48.6, 79.0, 121, 182, 263, 352, 418, 459, 477, 482, 484, 494, 531, 631, 804, 967, 1039, 1054, 1036, 988, 902,
     768, 636, 513, 405, 314, 246, 186, 132, 88.7, 54.0, 28.5, 15.2, 7.90, 3.98, 1.95]
)  # fmt: skip
WD = np.array(
    [62.4, 97.3, 158, 243, 365, 530, 713, 853, 944, 992, 1011, 1008, 968, 890, 776, 642, 512, 409, 323, 253, 212, 161,
     125, 100, 80.0, 63.2, 49.4, 38.8, 29.5, 21.1, 14.1, 8.63, 4.55, 2.43, 1.26, 0.64, 0.31]
)  # fmt: skip
"""Factors times 1000 of ISO 2631-1, table 3."""

MISPRINT = 10.0  # Hz: the table's 212 for Wd; its own decibels, -13.91, and the formula say 201.7


def sine(f: float, interval: float = 1e-3, duration: float = 40.0) -> np.ndarray:
    return np.sin(2.0 * np.pi * f * np.arange(0.0, duration, interval))


def gain(filtered: np.ndarray, series: np.ndarray) -> float:
    """Ratio of rms values in the middle half, away from the ends."""
    middle = slice(len(series) // 4, 3 * len(series) // 4)
    return float(np.sqrt(np.mean(filtered[middle] ** 2) / np.mean(series[middle] ** 2)))


@pytest.mark.parametrize(("name", "table"), [("Wk", WK), ("Wd", WD)])
def test_weightings_agree_with_the_table(name, table):
    """Within half a unit of the third digit (or of the last printed one), 0.5 % at the most, and 0.3 % of computing."""
    printed = (THIRDS != MISPRINT) | (name == "Wk")
    got = 1e3 * np.abs(WEIGHTINGS[name].response(THIRDS))
    rounding = 0.5 * np.where(table >= 100, 1.0, np.where(table >= 10, 0.1, 0.01))
    np.testing.assert_array_less(np.abs(got - table)[printed], (rounding + 0.003 * table)[printed])


def test_wd_at_ten_hertz_is_its_formula():
    """Where the printed table is wrong: (1 + i u)/(1 + i u/Q - u^2) with u = 5, and band limits."""
    u, Q = 5.0, 0.63
    middle = np.sqrt(1 + u**2) / np.hypot(1 - u**2, u / Q)
    limits = 1 / np.sqrt(1 + 0.04**4) / np.sqrt(1 + 0.1**4)
    assert abs(WEIGHTINGS["Wd"].response(np.array([10.0]))[0]) == pytest.approx(middle * limits, rel=1e-12)


@pytest.mark.parametrize(
    ("f", "expected"),
    [
        (1.0, 391.1),
        (2.0, 436.7),
        (4.0, 821.8),
        (5.0, 957.0),
        (8.0, 1055.9),
        (16.0, 918.3),
        (40.0, 414.2),
        (80.0, 174.0),
    ],
)
def test_wb_from_its_factors(f, expected):
    """Wb of EN 12299 from the moduli of its factors, by hand, to the four digits given."""

    def second(f0: float, Q: float) -> float:
        u = f / f0
        return np.hypot(1 - u**2, u / Q)

    limits = 1 / np.sqrt((1 + (0.4 / f) ** 4) * (1 + (f / 100.0) ** 4))
    by_hand = 0.4 * limits * np.hypot(1, f / 16) / second(16, 0.63) * second(2.5, 0.8) / second(4, 0.8)
    assert 1e3 * by_hand == pytest.approx(expected, abs=0.051)
    assert abs(WEIGHTINGS["Wb"].response(np.array([f]))[0]) == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize("name", ["Wb", "Wd", "Wk"])
@pytest.mark.parametrize(("f", "interval"), [(1.0, 1e-3), (8.0, 1e-3), (80.0, 1e-3), (80.0, 5e-3)])
def test_weighted_sine_has_the_weight(name, f, interval):
    """Close to Nyquist as well; what is left, 1e-4, is the transient of the sine's beginning and end."""
    series = sine(f, interval)
    expected = abs(WEIGHTINGS[name].response(np.array([f]))[0])
    assert gain(weighted(series, interval, name), series) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("f", [5.0, 20.0, 40.0, 80.0])
def test_low_pass_on_sines(f):
    """Two passes of second order, 1/(1 + (sqrt(2) - 1) r^4), r = tan(pi f h)/tan(pi f0 h) for samples every h."""
    series = sine(f)
    expected = 1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * (np.tan(np.pi * f * 1e-3) / np.tan(np.pi * 20e-3)) ** 4)
    filtered = low_pass(series, 1e-3, 20.0)
    assert gain(filtered, series) == pytest.approx(expected, rel=1e-6)
    middle = slice(10_000, 30_000)
    np.testing.assert_allclose(filtered[middle], expected * series[middle], atol=1e-6)  # no delay


@pytest.mark.parametrize(("f", "expected"), [(0.4, 0.7071), (2.0, 1.0), (10.0, 0.7071), (0.2, 0.1311), (20.0, 0.1311)])
def test_band_pass_on_sines(f, expected):
    """-3 dB at the ends; an octave beyond 1/(1 + 16 (sqrt(2) - 1)); 0.6 % for the warping of 20 Hz."""
    series = sine(f)
    assert gain(band_pass(series, 1e-3, 0.4, 10.0), series) == pytest.approx(expected, rel=6e-3)


def test_band_pass_removes_the_mean():
    """A constant 1 leaves nothing but rounding."""
    assert np.abs(band_pass(np.ones(5000), 1e-3, 0.4, 10.0)).max() < 1e-9


def test_sliding_mean_of_a_sine():
    """sin(k x) by sin(k L/2)/(k L/2); the trapezoidal rule and the interpolation err by (k h)^2/4 at the most."""
    h, k = 0.02, 2.0 * np.pi / 5.0
    x = 100.0 + h * np.arange(5001)
    middle, mean = sliding_mean(x, np.sin(k * x))
    assert (len(middle), middle[0], middle[1] - middle[0]) == (197, 101.0, 0.5)  # (100 - 2)/0.5 + 1
    np.testing.assert_allclose(mean, np.sin(k * middle) * np.sin(k) / k, atol=(k * h) ** 2 / 4)


def test_sliding_mean_of_a_line_and_of_too_little():
    """A straight line keeps its values, whatever the spacing; less than 2 m give nothing."""
    x = np.array([0.0, 0.3, 0.31, 1.0, 2.2, 3.0])
    middle, mean = sliding_mean(x, np.full(6, 7.0))
    np.testing.assert_allclose((middle, mean), ([1.0, 1.5, 2.0], [7.0, 7.0, 7.0]), rtol=1e-14)
    assert len(sliding_mean(x[:4], x[:4])[1]) == 0


def test_block_rms_leaves_the_rest_out():
    """Two whole blocks of five samples of twelve."""
    series = np.array([3.0] * 5 + [1.0, -1.0, 1.0, -1.0, 1.0] + [99.0] * 2)
    np.testing.assert_allclose(block_rms(series, 0.2, 1.0), [3.0, 1.0], rtol=1e-15)


PHASES = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)


@pytest.mark.parametrize("f", [0.5, 0.7, 1.0, 2.0, 5.0, 9.0])
@pytest.mark.parametrize("phase", PHASES)
def test_band_pass_of_a_sine_whatever_its_phase(f, phase):
    """Six seconds that end anywhere: the steady response to 1 % of the amplitude but for the settling at the ends."""
    h, time = 1e-3, 1e-3 * np.arange(6000)
    low, high = (np.tan(np.pi * cut_off * h) / np.tan(np.pi * f * h) for cut_off in (0.4, 10.0))
    gain = 1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * low**4) / (1.0 + (np.sqrt(2.0) - 1.0) / high**4)
    series = np.sin(2.0 * np.pi * f * time + phase)
    margin = round(band_pass_settling(0.4, 10.0) / h)
    error = (band_pass(series, h, 0.4, 10.0) - gain * series)[margin:-margin]
    assert np.abs(error).max() < 0.01


@pytest.mark.parametrize("phase", PHASES)
def test_low_pass_of_a_sine_whatever_its_phase(phase):
    """At the cut-off, the worst case."""
    series = 70.0 + np.sin(40.0 * np.pi * 1e-3 * np.arange(1000) + phase)
    margin = round(low_pass_settling(20.0) / 1e-3)
    error = low_pass(series, 1e-3, 20.0) - 70.0 - np.sqrt(0.5) * (series - 70.0)
    assert np.abs(error[margin:-margin]).max() < 0.01


@pytest.mark.parametrize("name", ["Wb", "Wd", "Wk"])
@pytest.mark.parametrize("f", [0.5, 1.0, 2.0, 8.0])
@pytest.mark.parametrize("phase", PHASES)
def test_weighted_rms_of_a_sine_whatever_its_phase(name, f, phase):
    """The very first block of 5 s has the weight: the weighting finds no beginning of the sine; 1 %."""
    series = np.sin(2.0 * np.pi * f * 1e-3 * np.arange(6000) + phase)
    expected = abs(WEIGHTINGS[name].response(np.array([f]))[0]) * np.sqrt(0.5)
    assert block_rms(weighted(series, 1e-3, name), 1e-3, 5.0)[0] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("begin", [15.0, 20.0, 25.0, 30.0])
def test_cutting_a_record_changes_little(begin):
    """Six of sixty seconds of noise at 0.3 to 3 Hz: 5 % of the standard deviation at the worst sample."""
    h = 2e-3
    sections = signal.butter(2, [0.3, 3.0], "band", fs=1.0 / h, output="sos")
    series = signal.sosfiltfilt(sections, np.random.default_rng(7).standard_normal(round(60.0 / h)))
    part = slice(round(begin / h), round((begin + 6.0) / h))
    margin = round(band_pass_settling(0.4, 10.0) / h)
    whole, cut = band_pass(series, h, 0.4, 10.0)[part], band_pass(series[part], h, 0.4, 10.0)
    assert np.abs(cut - whole)[margin:-margin].max() < 0.05 * whole.std()
