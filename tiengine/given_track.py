"""Tracks that are given: a measured series from a CSV file, or a user's function of chainage."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tiengine.presets import nearest
from tiengine.quantity import InputError
from tiengine.realisation import BlockSpline, sampled_spline

__all__ = [
    "COLUMNS",
    "FunctionTrack",
    "MeasuredTrack",
    "UserFunction",
    "function_spline",
    "read_series",
    "smooth_step",
]

Reals = NDArray[np.float64]
UserFunction = Callable[[Reals], tuple[Reals | float, Reals | float, Reals | float, Reals | float]]
"""Chainages (n,) to z_v, y_a, theta, gauge [m, m, rad, m], each (n,) or a number."""

COLUMNS = ("x", "z_v", "y_a", "theta", "gauge")
"""Columns a file may have: chainage [m], vertical [m], alignment [m], cross level [rad], gauge [m]."""


def read_series(path: str | Path) -> Reals:
    """Read a measured series.

    The first line that is neither blank nor a comment (``#``) names the columns, in any order; ``x`` is
    required, a channel that is absent is zero. Chainage increases strictly.

    Args:
        path: CSV file.

    Returns:
        Chainage, vertical, alignment, cross level, gauge [m, m, m, rad, m], shape (n, 5), n >= 4.

    Raises:
        InputError: The file breaks a rule; the message names file, line and rule.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"irregularity.file = {str(path)!r}: cannot be read ({error.strerror or error})") from None
    except UnicodeDecodeError:
        raise InputError(f"irregularity.file = {str(path)!r}: not a UTF-8 text file") from None
    lines = [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise InputError(f"{path}, line 1: must name the columns {', '.join(COLUMNS)}")
    header = _header(path, *lines[0])
    if len(lines) < 5:
        raise InputError(f"{path}, line {lines[-1][0]}: {len(lines) - 1} points; a spline needs at least 4")
    rows = np.array([_row(path, number, cells, header) for number, cells in lines[1:]])
    series = np.zeros((len(rows), len(COLUMNS)))
    series[:, [COLUMNS.index(name) for name in header]] = rows
    back = np.flatnonzero(np.diff(series[:, 0]) <= 0.0)
    if back.size:
        number = lines[int(back[0]) + 2][0]
        raise InputError(f"{path}, line {number}: x = {series[back[0] + 1, 0]:g}: must be > the x before it")
    return series


def _header(path: str | Path, number: int, names: list[str]) -> list[str]:
    """The names of the columns, checked."""
    for name in names:
        if name not in COLUMNS:
            raise InputError(f"{path}, line {number}: column {name!r}: unknown{nearest(name, COLUMNS)}")
    if len(set(names)) < len(names):
        raise InputError(f"{path}, line {number}: a column is named twice")
    if "x" not in names or len(names) < 2:
        raise InputError(f"{path}, line {number}: needs column 'x' and one of {', '.join(COLUMNS[1:])}")
    return names


def _row(path: str | Path, number: int, cells: list[str], header: list[str]) -> list[float]:
    """The numbers of a line, checked."""
    if len(cells) != len(header):
        raise InputError(f"{path}, line {number}: {len(cells)} values; the header names {len(header)} columns")
    values = []
    for name, cell in zip(header, cells, strict=True):
        try:
            value = float(cell)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            raise InputError(f"{path}, line {number}: {name} = {cell!r}: must be a finite number")
        values.append(value)
    return values


class MeasuredTrack:
    """Natural cubic splines through a series, faded in and out at its ends, zero outside."""

    def __init__(self, series: Reals, taper: float) -> None:
        """Join the points.

        Args:
            series: Chainage and four channels as :func:`read_series` returns them, shape (n, 5).
            taper: Length of the fade at either end [m]; at most half the series is used for each.
        """
        x = series[:, 0]
        self.start, self.end = float(x[0]), float(x[-1])
        self.taper = min(taper, 0.5 * (self.end - self.start))
        self.shortest = 2.0 * float(np.diff(x).min())
        self._value = CubicSpline(x, series[:, 1:], bc_type="natural")
        self._slope = self._value.derivative()

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Values and slopes of the four channels at chainages x [m], shape (n,); each of shape (n, 4)."""
        held = np.clip(x, self.start, self.end)
        value, slope = self._value(held), self._slope(held)
        up, up_slope = smooth_step((x - self.start) / self.taper)
        down, down_slope = smooth_step((self.end - x) / self.taper)
        T, T_slope = up * down, (up_slope * down - up * down_slope) / self.taper
        return value * T[:, None], slope * T[:, None] + value * T_slope[:, None]


def smooth_step(t: Reals) -> tuple[Reals, Reals]:
    """The C2 step 6 t^5 - 15 t^4 + 10 t^3 from 0 at t <= 0 to 1 at t >= 1, and its derivative by t."""
    s = np.clip(t, 0.0, 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s)


class FunctionTrack:
    """A user's function with the user's own slopes."""

    def __init__(self, f: UserFunction, slopes: UserFunction) -> None:
        """Keep the function of values and that of slopes."""
        self._value, self._slope = _columns(f, "function"), _columns(slopes, "slopes")

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Values and slopes of the four channels at chainages x [m], shape (n,); each of shape (n, 4)."""
        return self._value(x), self._slope(x)


def function_spline(f: UserFunction, spacing: float) -> BlockSpline:
    """The C2 spline through a user's function at all multiples of ``spacing`` [m]."""
    return sampled_spline(_columns(f, "function"), spacing, len(COLUMNS) - 1)


def _columns(f: UserFunction, name: str) -> Callable[[Reals], Reals]:
    """The function with its four results checked and stacked, (n,) to (n, 4)."""
    wanted = len(COLUMNS) - 1

    def stacked(x: Reals) -> Reals:
        results = f(x)
        if len(results) != wanted:
            raise InputError(f"irregularity.{name}: gives {len(results)} series; must be {wanted}")
        try:
            columns = [np.broadcast_to(np.asarray(r, np.float64), x.shape) for r in results]
        except ValueError:
            raise InputError(f"irregularity.{name}: every series must have the shape of x") from None
        if not np.isfinite(columns).all():
            raise InputError(f"irregularity.{name}: must be finite everywhere")
        return np.stack(columns, axis=-1)

    return stacked
