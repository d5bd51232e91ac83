"""Alignment of a line: curvature, cant and gradient over chainage (MODEL §12).

Between given points all three are linear: a clothoid with its cant ramp, a circular arc, a vertical curve (a parabola).
A corner of such a line would be an impulse of roll acceleration; every corner is therefore rounded over a length, by
the convolution of the corner with the bell (1 - xi^2)^2, so that second derivatives are continuous.

Signs: curvature is positive where the track bends to the right, cant is positive where the left rail is raised (roll
about the forward axis; a right-hand curve has positive curvature and cant), gradient is positive uphill.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PPoly

from tiengine.parameters.arrays import Reals

__all__ = ["BEFORE", "CANT_BASE", "Alignment", "Line"]

CANT_BASE = 1.5
"""Distance over which the cant is measured, 2 b_i [m]."""

BEFORE = 1e4
"""How far before its first point an alignment is defined [m]; it goes on as long beyond 1000 km."""

_AFTER = 1e6

# rho(xi), xi = eta - 1: the rounded corner of unit slope and half length, by powers of eta in [0, 2], highest first;
# rho'' = 15/16 (1 - xi^2)^2, rho(-1) = rho'(-1) = 0, rho(1) = rho'(1) = 1.
_CORNER = np.array([1.0 / 32.0, -3.0 / 16.0, 5.0 / 16.0, 0.0, 0.0, 0.0, 0.0])


class Line:
    """Piecewise linear function with rounded corners, constant outside its points.

    Attributes:
        value: The function, a piecewise polynomial of degree six.
        integral: Its integral.
        twice: The integral of that.
    """

    def __init__(self, x: Reals, f: Reals, half_length: float) -> None:
        """Round the corners.

        Args:
            x: Increasing points, shape (n,), n >= 1.
            f: Values, shape (n,).
            half_length: Half of the length of a rounded corner; shorter where points are closer than twice that.
        """
        x = np.concatenate([[x[0] - BEFORE], x, [x[-1] + _AFTER]])
        f = np.concatenate([f[:1], f, f[-1:]])
        slope = np.diff(f) / np.diff(x)
        change = np.diff(slope)
        gap = np.diff(x)
        half = np.minimum(half_length, 0.5 * np.minimum(gap[:-1], gap[1:]))
        ends = np.stack([x[1:-1] - half, x[1:-1] + half], axis=1).ravel()
        breaks = np.concatenate([x[:1], ends, x[-1:]])
        coefficients = np.zeros((7, len(breaks) - 1))
        coefficients[6, 0::2] = f[:-1] + slope * (breaks[0:-1:2] - x[:-1])
        coefficients[5, 0::2] = slope
        coefficients[:, 1::2] = _CORNER[:, None] * change * half / half ** np.arange(6, -1, -1)[:, None]
        coefficients[6, 1::2] += f[1:-1] - slope[:-1] * half
        coefficients[5, 1::2] += slope[:-1]
        kept = np.append(np.diff(breaks) > 0.0, True)
        self.value = PPoly(coefficients[:, kept[:-1]], breaks[kept], extrapolate=True)
        self.integral = self.value.antiderivative()
        self.twice = self.integral.antiderivative()

    def __call__(self, x: Reals, derivative: int = 0) -> Reals:
        """Values or derivatives at places, any shape."""
        return np.asarray(self.value(x, derivative), np.float64)


@dataclass(frozen=True, eq=False)
class Alignment:
    """Curvature, roll of the track frame and gradient over chainage.

    Attributes:
        x: Chainage of the points [m], increasing, shape (n,).
        curvature: At the points [1/m], shape (n,).
        roll: [rad], sin(roll) = cant / CANT_BASE.
        gradient: [-].
        rounding: Length of a rounded corner [m].
    """

    x: Reals
    curvature: Reals
    roll: Reals
    gradient: Reals
    rounding: float

    @cached_property
    def lines(self) -> tuple[Line, Line, Line]:
        """Curvature, roll and gradient with rounded corners."""
        kappa, phi, grade = (
            Line(self.x, values, 0.5 * self.rounding) for values in (self.curvature, self.roll, self.gradient)
        )
        return kappa, phi, grade

    def cant(self, x: Reals) -> Reals:
        """Cant at places [m]."""
        return np.asarray(CANT_BASE * np.sin(self.lines[1](x)), np.float64)

    def lateral_acceleration(self, x: Reals, V: Reals, gravity: float) -> Reals:
        """Unbalanced lateral acceleration in the plane of the track a_q [m/s^2], positive outward of a right curve."""
        kappa, phi, _ = (line(x) for line in self.lines)
        return np.asarray(V**2 * kappa * np.cos(phi) - gravity * np.sin(phi), np.float64)
