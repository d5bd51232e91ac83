"""Prescribed track: a measured series (:mod:`tiengine.irregularity.measured_files`) or a function of chainage."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from tiengine.irregularity.random_track import BlockSpline, sampled_spline
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = [
    "FunctionTrack",
    "MeasuredTrack",
    "UserFunction",
    "function_spline",
    "smooth_step",
]

UserFunction = Callable[[Reals], tuple[Reals | float, Reals | float, Reals | float, Reals | float]]
"""Chainages (n,) to z_v, y_a, theta, gauge [m, m, rad, m], each (n,) or a number."""

CHANNELS = 4
"""Vertical, alignment, cross level, gauge."""


class MeasuredTrack:
    """Natural cubic splines through a series, tapered at both ends, zero outside."""

    def __init__(self, series: Reals, taper: float) -> None:
        """Fit the splines.

        Args:
            series: Chainage and four channels as ``read_series`` returns them, shape (n, 5).
            taper: Length of the taper at either end [m]; at most half of the series.
        """
        x = series[:, 0]
        self.start, self.end = float(x[0]), float(x[-1])
        self.taper = min(taper, 0.5 * (self.end - self.start))
        self.shortest = 2.0 * float(np.diff(x).min())
        self._value = CubicSpline(x, series[:, 1:], bc_type="natural")
        self._slope = self._value.derivative()

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Values and slopes of the four channels at chainages x [m], shape (n,); each of shape (n, 4)."""
        clipped = np.clip(x, self.start, self.end)
        value, slope = self._value(clipped), self._slope(clipped)
        up, up_slope = smooth_step((x - self.start) / self.taper)
        down, down_slope = smooth_step((self.end - x) / self.taper)
        T, T_slope = up * down, (up_slope * down - up * down_slope) / self.taper
        return value * T[:, None], slope * T[:, None] + value * T_slope[:, None]


def smooth_step(t: Reals) -> tuple[Reals, Reals]:
    """Evaluate the C2 step 6 t^5 - 15 t^4 + 10 t^3 from 0 at t <= 0 to 1 at t >= 1, and its derivative by t."""
    s = np.clip(t, 0.0, 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s)


class FunctionTrack:
    """Track given by a user's function and its derivative."""

    def __init__(self, f: UserFunction, slopes: UserFunction) -> None:
        """Store the function and its derivative."""
        self._value, self._slope = _columns(f, "function"), _columns(slopes, "slopes")

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Values and slopes of the four channels at chainages x [m], shape (n,); each of shape (n, 4)."""
        return self._value(x), self._slope(x)


def function_spline(f: UserFunction, spacing: float) -> BlockSpline:
    """Build the C2 spline through a user's function at all multiples of ``spacing`` [m]."""
    return sampled_spline(_columns(f, "function"), spacing, CHANNELS)


def _columns(f: UserFunction, name: str) -> Callable[[Reals], Reals]:
    """Wrap the function: check its four series and stack them, (n,) to (n, 4)."""

    def stacked(x: Reals) -> Reals:
        results = f(x)
        if len(results) != CHANNELS:
            raise InputError(f"irregularity.{name}: returns {len(results)} series; must return {CHANNELS}")
        try:
            columns = [np.broadcast_to(np.asarray(r, np.float64), x.shape) for r in results]
        except ValueError:
            raise InputError(f"irregularity.{name}: every series must have the shape of x") from None
        if not np.isfinite(columns).all():
            raise InputError(f"irregularity.{name}: must be finite everywhere")
        return np.stack(columns, axis=-1)

    return stacked
