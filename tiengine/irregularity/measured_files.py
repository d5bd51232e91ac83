"""Measured irregularity from a CSV file.

The first line that is neither blank nor a comment (``#``) names the columns, in any order, each optionally with its
unit in brackets: ``distance [km], vertical_left [mm], vertical_right [mm], cross_level [mm]``.

| columns | meaning |
|---|---|
| ``x``, ``distance``, ``chainage``, ``mileage`` | along the track [m]; rising or falling throughout; exactly one |
| ``z_v`` or ``vertical``; ``vertical_left`` and ``vertical_right`` | height of the rails, down positive |
| ``theta`` [rad] or ``cross_level`` | left rail above right; as a height over 1.5 m |
| ``y_a`` or ``alignment``; ``alignment_left`` and ``alignment_right`` | position of the rails, right positive |
| ``gauge`` | deviation from the nominal gauge |

Left and right refer to the order of the rows. With both verticals the cross level follows from them, and the gauge from
both alignments, unless they have columns of their own. Absent channels are zero.

For a train that passes the rows against their order (``reverse``) left and right are exchanged: alignment and cross
level change sign. Chainage always rises; it is zero at the mileage ``start``.
"""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import LARGEST_TRACK, numbers_of, read_text_file

__all__ = ["LEVEL_BASE", "band_passed", "read_series"]

LEVEL_BASE = 1.5
"""Distance over which a cross level is a height [m]: 2 b_i."""
LARGEST_GAP = 3.0  # times the median step
LARGEST_DEVIATION = 0.5  # m: a larger value is the gauge itself, not its deviation
LARGEST_CHAINAGE = 1e7  # m
LARGEST_HEIGHT = 1e4  # m or rad; absolute levels are allowed, since a band-pass removes them
FILTER_ORDER = 4

_ALONG = ("x", "distance", "chainage", "mileage")
_SAME = {"vertical": "z_v", "alignment": "y_a", **dict.fromkeys(_ALONG, "x")}
_NAMES = (
    *("x", "z_v", "y_a", "theta", "gauge", "distance", "chainage", "mileage", "vertical", "vertical_left"),
    *("vertical_right", "cross_level", "alignment", "alignment_left", "alignment_right"),
)
_UNITS = {"m": 1.0, "mm": 1e-3, "km": 1e3, "rad": 1.0, "mrad": 1e-3}
_CHANNELS: dict[str, Callable[[dict[str, Reals]], Reals]] = {
    "z_v": lambda c: c["z_v"],
    "vertical": lambda c: 0.5 * (c["vertical_left"] + c["vertical_right"]),
    "y_a": lambda c: c["y_a"],
    "alignment": lambda c: 0.5 * (c["alignment_left"] + c["alignment_right"]),
    "theta": lambda c: c["theta"],
    "cross_level": lambda c: c["cross_level"] / LEVEL_BASE,
    "twist": lambda c: (c["vertical_right"] - c["vertical_left"]) / LEVEL_BASE,
    "gauge": lambda c: c["gauge"],
    "widening": lambda c: c["alignment_right"] - c["alignment_left"],
}
"""Formulas of the channels from columns; KeyError where a column is absent."""
_SOURCES = (("z_v", "vertical"), ("y_a", "alignment"), ("theta", "cross_level", "twist"), ("gauge", "widening"))
"""Formulas of each channel; the first whose columns are present is used."""


def read_series(
    path: str | Path,
    *,
    unit: str = "m",
    start: float | None = None,
    reverse: bool = False,
    vertical_up: bool = False,
) -> Reals:
    """Read a measured series.

    Args:
        path: CSV file.
        unit: Unit of heights, positions and gauge whose column names none: ``"m"`` or ``"mm"``.
        start: Mileage [m] at chainage zero; None for 0 m where the train runs towards higher mileage, else for the
            mileage at which it enters the file.
        reverse: The train passes the rows from the last to the first.
        vertical_up: Vertical columns are positive upwards.

    Returns:
        Chainage, vertical, alignment, cross level, gauge [m, m, m, rad, m], shape (n, 5), n >= 4; chainage rises.

    Raises:
        InputError: The file breaks a rule; the message names file, line and rule.
    """
    text = read_text_file(path, f"irregularity.file = {str(path)!r}", LARGEST_TRACK)
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise InputError(f"{path}, line 1: must name the columns x, z_v, y_a, theta, gauge or others")
    names, units = _header(path, lines[0][0], _cells(lines[0][1]), unit)
    if len(lines) < 5:
        raise InputError(f"{path}, line {lines[-1][0]}: {len(lines) - 1} points; a spline needs at least 4")
    values = array("d")
    for number, line in lines[1:]:
        values.extend(_row(path, number, _cells(line), names))
    rows = np.frombuffer(values).reshape(-1, len(names)) * units
    columns = dict(zip(names, rows.T, strict=True))
    numbers = [number for number, _ in lines[1:]]
    _check_distance(path, columns["x"], numbers)
    _check_gauge(path, columns.get("gauge"), numbers)
    _check_size(path, names, rows, numbers)
    for name in names:
        if vertical_up and name in ("z_v", "vertical_left", "vertical_right"):
            columns[name] = -columns[name]
    channels = [_channel(columns, sources, path, lines[0][0]) for sources in _SOURCES]
    return _along_the_run(np.stack([columns["x"], *channels], axis=1), start, reverse)


def _cells(line: str) -> list[str]:
    """Split a line at its commas."""
    cells = next(csv.reader([line])) if '"' in line else line.split(",")
    return [cell.strip() for cell in cells]


def _header(path: str | Path, number: int, cells: list[str], unit: str) -> tuple[list[str], Reals]:
    """Read the names of the columns and their factors to SI units."""
    names, factors = [], []
    for cell in cells:
        found = re.fullmatch(r"([^\[(]*?)\s*(?:[\[(]\s*(\w*)\s*[\])])?", cell)
        label, name_unit = (found[1], found[2]) if found else (cell, None)
        if label not in _NAMES:
            raise InputError(f"{path}, line {number}: column {cell!r}: unknown{nearest(label, _NAMES)}")
        name = _SAME.get(label, label)
        allowed = ("m", "km") if name == "x" else ("rad", "mrad") if name == "theta" else ("m", "mm")
        if name_unit is not None and name_unit not in allowed:
            raise InputError(f"{path}, line {number}: column {cell!r}: its unit must be {' or '.join(allowed)}")
        names.append(name)
        factors.append(_UNITS[name_unit or (allowed[0] if name in ("x", "theta") else unit)])
    if len(set(names)) < len(names):
        raise InputError(f"{path}, line {number}: a column is named twice")
    if "x" not in names or len(names) < 2:
        raise InputError(
            f"{path}, line {number}: needs column 'x' and one of z_v, y_a, theta, gauge or their equivalents"
        )
    return names, np.array(factors)


def _row(path: str | Path, number: int, cells: list[str], names: list[str]) -> list[float]:
    """Convert a line to finite numbers."""
    if len(cells) != len(names):
        raise InputError(f"{path}, line {number}: {len(cells)} values; the header names {len(names)} columns")
    values = numbers_of(cells)
    if values is None or not all(map(math.isfinite, values)):
        bad = [not (value := numbers_of([cell])) or not math.isfinite(value[0]) for cell in cells].index(True)
        raise InputError(f"{path}, line {number}: {names[bad]} = {cells[bad]!r}: must be a finite number")
    return values


def _check_distance(path: str | Path, x: Reals, numbers: Sequence[int]) -> None:
    """Refuse repeated, turning and missing distances."""
    sign, relation = (1.0, ">") if np.median(np.diff(x)) >= 0.0 else (-1.0, "<")
    step = sign * np.diff(x)
    back = np.flatnonzero(step <= 0.0)
    if back.size:
        i = int(back[0]) + 1
        raise InputError(f"{path}, line {numbers[i]}: x = {x[i]:g}: must be {relation} the x before it")
    gaps = np.flatnonzero(step > LARGEST_GAP * np.median(step))
    if gaps.size:
        i = int(gaps[0]) + 1
        raise InputError(
            f"{path}, line {numbers[i]}: x = {x[i]:g}: a gap of {step[i - 1]:g} m; the usual step is"
            f" {np.median(step):g} m; fill the gap or cut the file there"
        )


def _check_gauge(path: str | Path, gauge: Reals | None, numbers: Sequence[int]) -> None:
    """Refuse the full gauge where its deviation is expected."""
    large = np.flatnonzero(np.abs(gauge) > LARGEST_DEVIATION) if gauge is not None else np.empty(0, np.intp)
    if gauge is not None and large.size:
        line = f"{path}, line {numbers[large[0]]}"
        raise InputError(f"{line}: gauge = {gauge[large[0]]:g} m: must be the deviation from the nominal gauge")


def _check_size(path: str | Path, names: Sequence[str], rows: Reals, numbers: Sequence[int]) -> None:
    """Refuse values outside the range of any track."""
    most = np.array([LARGEST_CHAINAGE if name == "x" else LARGEST_HEIGHT for name in names])
    large = np.argwhere(np.abs(rows) > most)
    if large.size:
        i, j = large[0]
        line = f"{path}, line {numbers[i]}: {names[j]} = {rows[i, j]:g}"
        raise InputError(f"{line}: must be at most {most[j]:g} in magnitude: are its units right?")


def _channel(columns: dict[str, Reals], sources: Sequence[str], path: str | Path, number: int) -> Reals:
    """Compute one channel from the available columns; zero where there are none."""
    for source in sources:
        try:
            return _CHANNELS[source](columns)
        except KeyError:
            continue
    for side in ("left", "right"):
        for direction in ("vertical", "alignment"):
            if f"{direction}_{side}" in columns and direction in sources:
                raise InputError(f"{path}, line {number}: column '{direction}_{side}' needs that of the other rail")
    return np.zeros_like(columns["x"])


def _along_the_run(series: Reals, start: float | None, reverse: bool) -> Reals:
    """Order the series by the chainage of the train."""
    if reverse:
        series = series[::-1] * [1.0, 1.0, -1.0, -1.0, 1.0]  # y_a = mean of the rails' y; right is left now
    sign = 1.0 if series[-1, 0] > series[0, 0] else -1.0
    if start is None:
        start = 0.0 if sign > 0.0 else float(series[0, 0])
    along: Reals = np.column_stack([sign * (series[:, 0] - start), series[:, 1:]]) + 0.0  # no -0.0
    return along


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
    n = round((x[-1] - x[0]) / step) + 1
    even = np.linspace(x[0], x[-1], n)
    values = series[:, 1:]
    if n != x.size or np.abs(even - x).max() > 0.01 * step:
        values = CubicSpline(x, values, bc_type="natural")(even)
    sections = butter(
        FILTER_ORDER, [1.0 / longest, 1.0 / shortest], "bandpass", fs=(n - 1) / (x[-1] - x[0]), output="sos"
    )
    passed = sosfiltfilt(sections, values, axis=0, padlen=min(n - 1, int(longest / step)))
    return np.column_stack([even, passed])
