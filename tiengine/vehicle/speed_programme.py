"""The speed programme V(t): constant, or a table of chainage and speed (MODEL §1, §4).

Between the points of a table the kinetic energy T = V^2/2 is a C1 function of chainage (monotone cubic
Hermite, Fritsch and Carlson 1980, the slope zero at both ends), so that the acceleration dV/dt = dT/dx is
continuous; before the first and beyond the last point V is constant.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from math import sqrt

import numpy as np
from scipy.interpolate import PchipInterpolator

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["SpeedProfile"]

_LATTICE = 2**20  # lattice points per step; at constant speed positions lie on the lattice


class SpeedProfile:
    """Speed as a function of chainage, and its integration in time."""

    def __init__(self, chainage: Sequence[float], speed: Sequence[float]) -> None:
        """Build the profile from a table; a single row is a constant speed.

        Args:
            chainage: Chainages [m], increasing, shape (n,).
            speed: Speeds [m/s], > 0, shape (n,).

        Raises:
            InputError: A speed is not positive or a chainage not greater than the one before it.
        """
        x, V = np.asarray(chainage, np.float64), np.asarray(speed, np.float64)
        if x.ndim != 1 or x.shape != V.shape or not x.size:
            raise InputError("train.speed_kmh: must be a number or rows of chainage and speed")
        for i, value in enumerate(V):
            if not (np.isfinite(value) and value > 0.0):
                where = f"[{i}]" if V.size > 1 else ""
                raise InputError(f"train.speed_kmh{where} = {_number(3.6 * value)}: must be > 0")
        for i, value in enumerate(x):
            if not np.isfinite(value) or (i and value <= x[i - 1]):
                raise InputError(f"train.speed_kmh[{i}]: chainage = {value:g}: must be finite and increase")
        self.chainage, self.speed = x, V
        self._nodes: list[float] = x.tolist()
        self._pieces = _energy_pieces(x, 0.5 * V * V)

    @classmethod
    def constant(cls, V: float) -> SpeedProfile:
        """Profile of constant speed V [m/s]."""
        return cls([0.0], [V])

    @classmethod
    def table(cls, chainage: Sequence[float], speed: Sequence[float]) -> SpeedProfile:
        """Profile through speeds [m/s] at chainages [m]; see the constructor."""
        return cls(chainage, speed)

    @property
    def is_constant(self) -> bool:
        """Whether the speed is the same everywhere."""
        return bool((self.speed == self.speed[0]).all())

    @property
    def fastest(self) -> float:
        """Highest speed [m/s]; the curve between two points stays between their speeds."""
        return float(self.speed.max())

    def largest_acceleration(self, first: float, last: float) -> float:
        """Largest magnitude of dV/dt [m/s^2] between two chainages [m]: of dT/dx, a parabola between two points."""
        largest = 0.0
        for (start, _, c1, c2, c3), end in zip(self._pieces[1:], self._nodes[1:], strict=False):
            low, high = max(first, start) - start, min(last, end) - start
            if low > high:
                continue
            vertex = -c2 / (3.0 * c3) if c3 else 0.0
            for s in (low, min(max(vertex, low), high), high):
                largest = max(largest, abs(c1 + s * (2.0 * c2 + s * 3.0 * c3)))
        return largest

    def at(self, x: float) -> tuple[float, float]:
        """Speed [m/s] and acceleration [m/s^2] at chainage x [m]."""
        start, c0, c1, c2, c3 = self._pieces[bisect_right(self._nodes, x)]
        s = x - start
        return sqrt(2.0 * (c0 + s * (c1 + s * (c2 + s * c3)))), c1 + s * (2.0 * c2 + s * 3.0 * c3)

    def advance(self, x0: float, dt: float, n: int) -> tuple[Reals, Reals, Reals]:
        """Integrate n steps; ``advance(2 n)`` equals ``advance(n)`` twice, bit for bit.

        Constant speed: x0 + V t. A table: the classical Runge-Kutta rule for dx/dt = V(x).

        Args:
            x0: Chainage at the beginning [m].
            dt: Time step [s].
            n: Steps.

        Returns:
            Chainage [m], speed [m/s] and acceleration [m/s^2] at the n+1 instants, each of shape (n+1,).
        """
        if self.is_constant:
            x = _lattice(float(x0), float(self.speed[0]) * dt, n)
            return x, np.full(n + 1, self.speed[0]), np.zeros(n + 1)
        x, V, Vdot = np.empty(n + 1), np.empty(n + 1), np.empty(n + 1)
        at, position, half, sixth = self.at, float(x0), 0.5 * dt, dt / 6.0
        for i in range(n + 1):
            k1, a = at(position)
            x[i], V[i], Vdot[i] = position, k1, a
            k2 = at(position + half * k1)[0]
            k3 = at(position + half * k2)[0]
            k4 = at(position + dt * k3)[0]
            position += sixth * (k1 + 2.0 * (k2 + k3) + k4)
        return x, V, Vdot


def _energy_pieces(x: Reals, T: Reals) -> list[tuple[float, float, float, float, float]]:
    """Start and coefficients c0...c3 of T = Sum c_i (x - start)^i before, between and beyond the points."""
    before, beyond = (float(x[0]), float(T[0]), 0.0, 0.0, 0.0), (float(x[-1]), float(T[-1]), 0.0, 0.0, 0.0)
    if x.size == 1:
        return [before, beyond]
    slope = PchipInterpolator(x, T).derivative()(x)
    slope[[0, -1]] = 0.0
    h, rise = np.diff(x), np.diff(T) / np.diff(x)
    c2 = (3.0 * rise - 2.0 * slope[:-1] - slope[1:]) / h
    c3 = (slope[:-1] + slope[1:] - 2.0 * rise) / (h * h)
    table = np.stack([x[:-1], T[:-1], slope[:-1], c2, c3], axis=-1).tolist()
    return [before, *(tuple(row) for row in table), beyond]


def _lattice(x0: float, step: float, n: int) -> Reals:
    """x0 + i step, i = 0...n, on the multiples of step/2^20.

    Plain sums x0 + i step would depend on where a chunk begins. These do not, since the multiple of a lattice point
    is recovered exactly; a start off the lattice is moved onto it after the first instant, by less than
    step/2^21 (5e-9 m for steps of 1 cm). Exact up to 2^50 multiples, 1e7 m for such steps.
    """
    unit = step / _LATTICE
    x: Reals = (round(x0 / unit) + _LATTICE * np.arange(n + 1)).astype(np.float64) * unit
    x[0] = x0
    return x


def _number(value: float) -> str:
    """Format a number that was converted to another unit, without rounding noise."""
    return f"{value:.12g}"
