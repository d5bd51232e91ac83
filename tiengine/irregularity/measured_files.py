"""Measured irregularity from a text file.

One line names the columns, in any order, each optionally with its unit in brackets:
``distance [km], vertical_left [mm], vertical_right [mm], cross_level [mm]``; or the scenario names those that are read
(:mod:`tiengine.irregularity.track_columns`). Encoding, separator and decimal mark are detected
(:mod:`tiengine.irregularity.track_text`).

| columns | meaning |
|---|---|
| ``x``, ``distance``, ``chainage``, ``mileage`` | along the track [m]; rising or falling throughout; exactly one |
| ``km``, ``m`` | the same as kilometres, or as kilometres and the metres beyond |
| ``z_v`` or ``vertical``; ``vertical_left`` and ``vertical_right`` | height of the rails, down positive |
| ``theta`` [rad] or ``cross_level`` | left rail above right; as a height over 1.5 m |
| ``y_a`` or ``alignment``; ``alignment_left`` and ``alignment_right`` | position of the rails, right positive |
| ``gauge`` | deviation from the nominal gauge |

Left and right refer to the order of the rows. With both verticals the cross level follows from them, and the gauge from
both alignments, unless they have columns of their own. Absent channels are zero.

For a train that passes the rows against their order (``reverse``) left and right are exchanged: alignment and cross
level change sign. Chainage always rises; it is zero at the mileage ``start``.

Gaps, cells without a value or rows that are missing, are refused unless ``bridge`` allows stretches of their length:
they are then filled by a monotone cubic through the points on either side (Fritsch and Carlson).
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from tiengine.irregularity.track_columns import Column, FileColumns, find_columns
from tiengine.irregularity.track_text import MILEAGE, Encoding, TrackText, read_track_text
from tiengine.parameters.arrays import Reals

__all__ = ["LEVEL_BASE", "MeasuredSeries", "read_series"]

LEVEL_BASE = 1.5
"""Distance over which a cross level is a height [m]: 2 b_i."""
LARGEST_GAP = 3.0  # times the median step
STEEPEST = 0.1  # m of height or position within a metre; worn joints and switches reach 0.02
LARGEST_DEVIATION = 0.5  # m: a larger value is the gauge itself, not its deviation
LARGEST_CHAINAGE = 1e7  # m
LARGEST_HEIGHT = 1e4  # m or rad; absolute levels are allowed, since a band-pass removes them

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


@dataclass(frozen=True, eq=False)
class MeasuredSeries:
    """A measured series in the direction of travel.

    Attributes:
        values: Chainage, vertical, alignment, cross level, gauge [m, m, m, rad, m], shape (n, 5), n >= 4; chainage
            rises.
        description: How the file was read, in words.
    """

    values: Reals
    description: str


def read_series(
    path: str | Path,
    *,
    unit: str = "m",
    start: float | None = None,
    reverse: bool = False,
    vertical_up: bool = False,
    columns: FileColumns | None = None,
    encoding: Encoding = "auto",
    bridge: float = 0.0,
    key: str = "irregularity.file",
) -> MeasuredSeries:
    """Read a measured series.

    Args:
        path: Text file.
        unit: Unit of heights, positions and gauge whose column names none: ``"m"`` or ``"mm"``.
        start: Mileage [m] at chainage zero; None for 0 m where the train runs towards higher mileage, else for the
            mileage at which it enters the file.
        reverse: The train passes the rows from the last to the first.
        vertical_up: Vertical columns are positive upwards.
        columns: Columns that are read, if not all by their heads.
        encoding: Encoding of the file.
        bridge: Longest stretch without values that is filled [m].
        key: Key of the scenario that names the file.

    Raises:
        InputError: The file breaks a rule; the message names file, line and rule, encoding and separator.
    """
    text = read_track_text(path, encoding, key)
    found, width, first = find_columns(text, columns or FileColumns(), unit)
    rows = text.lines[first:]
    if len(rows) < 4:
        line = text.lines[-1][0]
        raise text.error(line, f"{len(rows)} points; must have at least 4 for a spline")
    values = array("d")
    for number, line_text in rows:
        values.extend(_row(text, number, text.cells(line_text), found, width))
    table = np.frombuffer(values).reshape(-1, len(found)) * [column.factor for column in found]
    numbers = [number for number, _ in rows]
    names, table = _with_distance([column.name for column in found], table)
    _check_size(text, names, table, numbers)
    _check_distance(text, table[:, 0], numbers)
    table, filled = _bridged(text, names, table, numbers, bridge)
    by_name = dict(zip(names, table.T, strict=True))
    _check_gauge(text, by_name.get("gauge"), numbers)
    for name in {"z_v", "vertical_left", "vertical_right"} & set(names) if vertical_up else ():
        by_name[name] = -by_name[name]
    _check_steepness(text, by_name, numbers)
    channels = [_channel(by_name, sources, text, text.lines[max(first - 1, 0)][0]) for sources in _SOURCES]
    series = _along_the_run(np.stack([by_name["x"], *channels], axis=1), start, reverse)
    words = f"read as {text.description}; {len(found)} of {width} columns used"
    return MeasuredSeries(series, words + (f"; {filled} points filled in gaps" if filled else ""))


def _row(text: TrackText, number: int, cells: list[str], columns: Sequence[Column], width: int) -> list[float]:
    """Convert the cells of a line that are read; NaN where there is no value."""
    if len(cells) > width and not any(cells[width:]):
        cells = cells[:width]  # separators at the end of a line
    if len(cells) != width:
        commas = "; decimal commas need semicolons or tabs between columns" if len(cells) == 2 * width else ""
        raise text.error(number, f"{len(cells)} values; the header names {width} columns{commas}")
    values = []
    for column in columns:
        cell = cells[column.index]
        value = text.number(cell, column.name == "x")
        if value is None:
            mixed = {".": ",", ",": "."}.get(text.decimal_mark, " ") in cell
            rule = f"must be a finite number{' with the decimal mark of the lines before' if mixed else ''}"
            if MILEAGE.fullmatch(cell):
                rule = "must be the column 'x', since it holds kilometres and metres"
            raise text.error(number, f"{column.name} = {cell!r}: {rule}")
        values.append(value)
    return values


def _with_distance(names: list[str], table: Reals) -> tuple[list[str], Reals]:
    """Join kilometres and metres to one distance, and put it first."""
    along = [i for i, name in enumerate(names) if name in ("x", "km", "m")]
    others = [i for i in range(len(names)) if i not in along]
    x = table[:, along].sum(axis=1)
    return ["x", *(names[i] for i in others)], np.column_stack([x, table[:, others]])


def _check_distance(text: TrackText, x: Reals, numbers: Sequence[int]) -> None:
    """Refuse missing, repeated and turning distances."""
    missing = np.flatnonzero(np.isnan(x))
    if missing.size:
        raise text.error(numbers[missing[0]], "the distance has no value")
    sign, relation = (1.0, ">") if np.median(np.diff(x)) >= 0.0 else (-1.0, "<")
    back = np.flatnonzero(sign * np.diff(x) <= 0.0)
    if back.size:
        i = int(back[0]) + 1
        raise text.error(numbers[i], f"x = {x[i]:.10g}: must be {relation} the x before it")


def _bridged(
    text: TrackText, names: Sequence[str], table: Reals, numbers: Sequence[int], bridge: float
) -> tuple[Reals, int]:
    """Fill gaps of at most ``bridge`` [m]; the table without them and the number of points filled in."""
    x = table[:, 0]
    step = float(np.median(np.abs(np.diff(x))))
    advice = "fill it, cut the file there, or allow it by irregularity.file_bridge"
    for i in np.flatnonzero(np.abs(np.diff(x)) > LARGEST_GAP * step):
        if (gap := abs(x[i + 1] - x[i])) > bridge + 0.01 * step:
            rule = f"x = {x[i + 1]:.10g}: a gap of {gap:g} m; the usual step is {step:g} m; {advice} = {gap:.4g}"
            raise text.error(numbers[int(i) + 1], rule)
    for j, name in enumerate(names[1:], start=1):
        known = np.flatnonzero(~np.isnan(table[:, j]))
        edges = np.concatenate([[-1], known, [len(x)]])
        for before, after in pairwise(edges.tolist()):
            if after - before == 1:
                continue
            where, line = f"{name} has no value up to line {numbers[after - 1]}", numbers[before + 1]
            if before < 0 or after == len(x):
                raise text.error(line, f"{where}: must not lack values at an end of the file; cut the file there")
            if (gap := abs(x[after] - x[before])) > bridge + 0.01 * step:
                raise text.error(line, f"{where}, a gap of {gap:g} m; {advice} = {gap:.4g}")
    filled = int(np.isnan(table).any(axis=1).sum())
    places = _with_missing_places(x, step)
    filled += len(places) - len(x)
    return (table, 0) if not filled else (_filled(table, places), filled)


def _with_missing_places(x: Reals, step: float) -> Reals:
    """Distances with those of missing rows, about a step apart."""
    counts = np.where(np.abs(np.diff(x)) > LARGEST_GAP * step, np.rint(np.abs(np.diff(x)) / step), 1).astype(int)
    pieces = [a + (b - a) * np.arange(n) / n for a, b, n in zip(x[:-1], x[1:], counts, strict=True)]
    return np.concatenate([*pieces, x[-1:]])


def _filled(table: Reals, places: Reals) -> Reals:
    """Table at the given distances, each column by a monotone cubic through its values."""
    sign = 1.0 if places[-1] > places[0] else -1.0
    columns = [places]
    for values in table[:, 1:].T:
        known = ~np.isnan(values)
        x, y = sign * table[known, 0], values[known]
        column = PchipInterpolator(x, y)(sign * places)
        same = np.isin(sign * places, x)
        column[same] = y  # exact at the points of the file
        columns.append(column)
    return np.column_stack(columns)


def _check_gauge(text: TrackText, gauge: Reals | None, numbers: Sequence[int]) -> None:
    """Refuse the full gauge where its deviation is expected."""
    large = np.flatnonzero(np.abs(gauge) > LARGEST_DEVIATION) if gauge is not None else np.empty(0, np.intp)
    if gauge is not None and large.size:
        line = numbers[min(large[0], len(numbers) - 1)]
        raise text.error(line, f"gauge = {gauge[large[0]]:g} m: must be the deviation from the nominal gauge")


def _check_size(text: TrackText, names: Sequence[str], rows: Reals, numbers: Sequence[int]) -> None:
    """Refuse values outside the range of any track."""
    most = np.array([LARGEST_CHAINAGE if name == "x" else LARGEST_HEIGHT for name in names])
    large = np.argwhere(np.abs(rows) > most)
    if large.size:
        i, j = large[0]
        rule = f"{names[j]} = {rows[i, j]:g}: must be at most {most[j]:g} in magnitude: are its units right?"
        raise text.error(numbers[i], rule)


def _check_steepness(text: TrackText, columns: dict[str, Reals], numbers: Sequence[int]) -> None:
    """Refuse heights and positions that change within a metre as no track does."""
    x = columns["x"]
    rising = np.abs(x - x[0])
    ahead = np.minimum(np.searchsorted(rising, rising + 1.0), len(x) - 1)
    for name, values in columns.items():
        change = np.abs(values[ahead] - values) * (name not in ("x", "theta"))
        i = int(np.argmax(change))
        if change[i] > STEEPEST:
            line = numbers[min(i, len(numbers) - 1)]
            rule = f"changes by {change[i]:.3g} m within 1 m; at most {STEEPEST:g} m expected: are its units right?"
            raise text.error(line, f"{name} {rule}")


def _channel(columns: dict[str, Reals], sources: Sequence[str], text: TrackText, number: int) -> Reals:
    """Compute one channel from the available columns; zero where there are none."""
    for source in sources:
        try:
            return _CHANNELS[source](columns)
        except KeyError:
            continue
    for side in ("left", "right"):
        for direction in ("vertical", "alignment"):
            if f"{direction}_{side}" in columns and direction in sources:
                raise text.error(number, f"column '{direction}_{side}' needs that of the other rail")
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
