"""Track through a measured series (:mod:`tiengine.irregularity.measured_files`)."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from tiengine.parameters.arrays import Reals

__all__ = ["MeasuredTrack", "smooth_step"]


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
