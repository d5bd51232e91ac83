"""Wave content of a measured series: its band-pass, and its shortest wavelength that matters."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["NEGLIGIBLE_SHARE", "band_passed", "shortest_content"]

FILTER_ORDER = 4
NEGLIGIBLE_SHARE = 1e-3
"""Share of the variance of slope that waves may hold which the time step does not resolve: 3 % of its rms."""
STRETCH = 20.0  # m over which the content is judged: long against short waves, short enough to see one bad weld


def shortest_content(series: Reals, scales: Reals) -> float:
    """Wavelength below which a series holds a negligible share of the variance of its slope.

    Slope, since the wheel is excited by V times it. Judged over stretches of 20 m, each against the larger of its own
    variance and the mean of the file: a single weld in a long file counts, the rounding of the numbers where the track
    is smooth does not. The result is the shortest over all stretches, and at least two steps of the file.

    Args:
        series: Chainage and channels, shape (n, 1 + channels).
        scales: Factor of each channel to the displacement of a rail, shape (channels,).

    Returns:
        Wavelength [m].
    """
    x = series[:, 0]
    step = float(np.diff(x).min())
    even = _even(series, step if np.ptp(np.diff(x)) < 0.5 * step else float(np.median(np.diff(x))))
    spacing = float(even[1, 0] - even[0, 0])
    slope = np.diff(even[:, 1:] * scales, axis=0) / spacing
    slope -= slope.mean(axis=0)
    size = int(min(max(round(STRETCH / spacing), 8), len(slope)))
    starts = np.unique(np.append(np.arange(0, len(slope) - size + 1, max(size // 2, 1)), len(slope) - size))
    window = np.hanning(size + 2)[1:-1]
    mean_variance = float((slope**2).mean(axis=0).sum()) * float((window**2).sum()) * size / 2.0
    shortest = np.inf
    for start in starts:
        piece = slope[start : start + size]
        power = (np.abs(np.fft.rfft((piece - piece.mean(axis=0)) * window[:, None], axis=0)) ** 2).sum(axis=1)
        beyond = np.cumsum(power[::-1])[::-1]  # from each wave number on
        kept = np.flatnonzero(beyond > NEGLIGIBLE_SHARE * max(beyond[0], mean_variance))
        if kept.size and kept[-1] > 0:
            shortest = min(shortest, size * spacing / kept[-1])
    return max(shortest, 2.0 * step)


def _even(series: Reals, step: float) -> Reals:
    """The series at equal steps, by a spline where they differ by more than a hundredth."""
    x = series[:, 0]
    n = max(round((x[-1] - x[0]) / step), 3) + 1
    even = np.linspace(x[0], x[-1], n)
    values = series[:, 1:]
    if n != x.size or np.abs(even - x).max() > 0.01 * step:
        values = CubicSpline(x, values, bc_type="natural")(even)
    return np.column_stack([even, values])


def band_passed(series: Reals, shortest: float, longest: float) -> Reals:
    """Band-pass a series between two wavelengths.

    A Butterworth band-pass of order 4 runs over the series forwards and backwards: no phase, half the amplitude at
    both limits. Unequal steps are first resampled by a spline.

    Args:
        series: Chainage and channels, shape (n, 1 + channels).
        shortest: Shortest wave [m].
        longest: Longest wave [m].

    Returns:
        Equal steps in chainage and the filtered channels, of the same number of columns.

    Raises:
        InputError: The steps are too long for the shortest wave, the series too short for the longest.
    """
    x = series[:, 0]
    step = float(np.median(np.diff(x)))
    if shortest <= 2.0 * step:
        raise InputError(f"irregularity.wavelength_min = {shortest:g}: must be > 2 steps of the file = {2 * step:g} m")
    if longest > x[-1] - x[0]:
        raise InputError(f"irregularity.wavelength_max = {longest:g}: must be <= the file's length = {np.ptp(x):g} m")
    resampled = _even(series, step)
    even, values = resampled[:, 0], resampled[:, 1:]
    n = len(even)
    from scipy.signal import butter, sosfiltfilt  # takes half a second, and few runs filter a measured track

    sections = butter(
        FILTER_ORDER, [1.0 / longest, 1.0 / shortest], "bandpass", fs=(n - 1) / (x[-1] - x[0]), output="sos"
    )
    passed = sosfiltfilt(sections, values, axis=0, padlen=min(n - 1, int(longest / step)))
    return np.column_stack([even, passed])
