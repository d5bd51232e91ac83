"""Continuation of a recorded series beyond its ends, for filters that need samples there.

A filter without delay needs samples on both sides, a causal one those before the start. Mirroring the series puts a
step or a kink at the end, depending on the phase there. Here the series is continued as an autoregressive process

    x_k = -sum_m a_m x_(k-m),

whose coefficients a come from Burg's recursion (J. P. Burg, Maximum entropy spectral analysis, Stanford 1975): it is
stable, continues sines as sines of their phase, and lets everything that cannot be predicted decay to the mean. The
prediction works on samples thinned to :data:`RATE`, hence on frequencies below some 10 Hz; slow filters need no others.
"""

from __future__ import annotations

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline

from tiengine.parameters.arrays import Reals

__all__ = ["burg", "continued"]

RATE = 50.0  # Hz, of the thinned series
LARGEST_ORDER = 64  # more than a second of memory
LEAST_SAMPLES = 16  # of the thinned series; shorter ones are continued by their mean


def continued(series: Reals, interval: float, duration: float) -> tuple[Reals, int]:
    """Continue a series at both ends.

    Args:
        series: Samples, shape (n,).
        interval: Time between samples [s].
        duration: Length of either continuation [s].

    Returns:
        The longer series, shape (n + 2 k,), and k.
    """
    count = round(duration / interval)
    thinning = max(round(1.0 / (RATE * interval)), 1)
    mean = float(series.mean())
    after = _after(series - mean, thinning, count)
    before = _after(series[::-1] - mean, thinning, count)[::-1]
    return np.concatenate([mean + before, series, mean + after]), count


def burg(series: Reals, order: int) -> Reals:
    """Estimate the prediction error filter of a series by Burg's recursion.

    Args:
        series: Samples, shape (n,).
        order: Number of coefficients.

    Returns:
        1 and the coefficients a, shape (order + 1,); zeros after the first ones once the error vanishes.
    """
    a = np.ones(1)
    forward, backward = series[1:], series[:-1]
    floor = 1e-12 * float(series @ series)
    for _ in range(order):
        power = float(forward @ forward + backward @ backward)
        if power <= floor:
            break
        reflection = -2.0 * float(forward @ backward) / power
        a = np.append(a, 0.0)
        a = a + reflection * a[::-1]
        forward, backward = (forward + reflection * backward)[1:], (backward + reflection * forward)[:-1]
    return np.pad(a, (0, order + 1 - len(a)))


def _after(series: Reals, thinning: int, count: int) -> Reals:
    """Continue a series without mean by ``count`` samples."""
    known = _thinned(series, thinning)
    if len(known) < LEAST_SAMPLES or not known.any():
        return np.zeros(count)
    order = min(len(known) // 3, LARGEST_ORDER)
    a = burg(known, order)
    state = signal.lfiltic([1.0], a, known[::-1][:order])
    steps = count // thinning + 2
    predicted, _ = signal.lfilter([1.0], a, np.zeros(steps), zi=state)
    time = thinning * np.arange(-order, steps + 1)  # samples after the last one
    curve = CubicSpline(time, np.concatenate([known[-order - 1 :], predicted]))
    return np.asarray(curve(np.arange(1.0, count + 1.0)), np.float64)


def _thinned(series: Reals, thinning: int) -> Reals:
    """Every so manyth sample of a series, counted from the last one, without frequencies that would alias."""
    if thinning == 1:
        return series
    sections = signal.butter(4, 0.4 / thinning, fs=1.0, output="sos")
    smooth = signal.sosfiltfilt(sections, series, padlen=min(len(series) - 1, 20 * thinning))
    return np.asarray(smooth[::-1][::thinning][::-1], np.float64)
