"""Readers of profile files: SIMPACK ``.prw`` and ``.prr``, MiniProf ``.whl`` and ``.ban``, two columns of text.

SIMPACK: ``key = value`` in the sections ``header`` and ``spline``, points between ``point.begin`` and ``point.end``,
``!`` for comments. The spline's keys are applied to the points in the order in which the format numbers them: least
distance, shift, rotation, bounds, mirrors, inversion; ``units.len.f`` is the number of length units per metre. The
weights of points and ``approx.smooth`` are not used.

MiniProf: ``key=value`` lines (or the old style's free text), then rows of the columns that ``ColumnDef`` names, x and y
first unless it says otherwise; ``"``, ``!`` and ``%`` begin comments.

Text: y and z, separated by commas, semicolons or blanks, ``#`` for comments, y rising or falling from line to line.

Text and MiniProf hold millimetres or metres, distinguished by the profile's width. No content is ever evaluated.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tiengine.contact.profile_frame import FEWEST_POINTS, Kind, PointList, check_kinks, oriented
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import LARGEST_PROFILE, numbers_of, read_text_file

__all__ = ["FORMATS", "MOST_POINTS", "read_profile"]

MOST_POINTS = 20_000  # laser scans have some thousand
LARGEST_FACTOR = 1e6  # of units
WIDTH = (10.0, 400.0)  # mm, range of widths
Lines = Sequence[tuple[int, str]]
"""Numbered lines."""


def read_profile(path: str | Path, kind: Kind, where: str = "") -> PointList:
    """Read the points of a file, orient them and check that they are smooth.

    Args:
        path: A file; its suffix selects the format, two columns for any suffix not in :data:`FORMATS`.
        kind: ``"wheel"`` or ``"rail"``.
        where: Name of the profile for messages; kind and path if empty.

    Returns:
        y and z in mm, y outward and z down, as a wheel's flange or a rail's head shows.

    Raises:
        InputError: The file breaks a rule; the message names the file, the line and the rule.
    """
    where = where or f"{kind} profile {str(path)!r}"
    lines = list(enumerate(read_text_file(path, where, LARGEST_PROFILE).splitlines(), start=1))
    found = FORMATS.get(Path(path).suffix.lower(), _read_columns)(lines, kind, where)
    if len(found.points) < FEWEST_POINTS:
        raise InputError(f"{where}: {len(found.points)} points; at least {FEWEST_POINTS} pairs expected")
    if len(found.points) > MOST_POINTS:
        raise InputError(f"{where}: {len(found.points)} points; at most {MOST_POINTS} expected")
    width = float(np.ptp(found.points[:, 0]))
    if not WIDTH[0] <= width <= WIDTH[1]:
        raise InputError(f"{where}: {width:g} mm wide; {WIDTH[0]:g} to {WIDTH[1]:g} mm expected: are its units right?")
    away = np.abs(found.points[:, 1] - np.median(found.points[:, 1]))
    if away.max() > WIDTH[1]:
        i = int(np.argmax(away))
        raise InputError(
            f"{where}: line {found.lines[i]}: z lies {away[i]:g} mm from the other points';"
            f" at most {WIDTH[1]:g} mm expected"
        )
    found = oriented(found, kind)
    check_kinks(found, kind)
    return found


def _point_list(rows: Sequence[Sequence[float]], numbers: Sequence[int], where: str) -> PointList:
    """Make a point list of finite rows (y, z)."""
    points = np.array(rows, dtype=np.float64).reshape(-1, 2)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        y, z = points[bad[0]]
        line = f"line {numbers[bad[0]]}: point {bad[0] + 1}"
        raise InputError(f"{where}: {line} is ({y}, {z}); finite numbers expected")
    return PointList(points, np.array(numbers, dtype=np.int64), where)


def _in_millimetres(found: PointList) -> PointList:
    """Convert to millimetres; the width tells metres from millimetres."""
    in_metres = len(found.points) > 0 and float(np.ptp(found.points[:, 0])) <= 1e-3 * WIDTH[1]
    return PointList(found.points * 1e3, found.lines, found.where) if in_metres else found


def _read_columns(lines: Lines, kind: Kind, where: str) -> PointList:
    """Read two columns; y must rise, or fall, from line to line."""
    rows, numbers = [], []
    for number, line in lines:
        fields = line.split("#")[0].replace(",", " ").replace(";", " ").split()
        if not fields:
            continue
        values = numbers_of(fields)
        if values is None or len(values) != 2:
            raise InputError(f"{where}: line {number} is {line.strip()[:80]!r}; two numbers, y and z in mm, expected")
        rows.append(values)
        numbers.append(number)
    found = _point_list(rows, numbers, where)
    y = found.points[:, 0]
    if y.size > 1:
        step = np.diff(y) * (1.0 if y[-1] >= y[0] else -1.0)
        back = np.flatnonzero(step <= 0.0)
        if back.size:
            i = back[0] + 1
            word = "increase" if y[-1] >= y[0] else "decrease"
            raise InputError(
                f"{where}: line {numbers[i]}: y goes from {y[i - 1]:.9g} to {y[i]:.9g} at point {i + 1};"
                f" y must {word} from point to point"
            )
    return _in_millimetres(found)


def _read_miniprof(lines: Lines, kind: Kind, where: str) -> PointList:
    """Read header lines, then rows of columns."""
    header: dict[str, str] = {}
    rows: list[list[float]] = []
    numbers: list[int] = []
    columns: tuple[int, int] | None = None
    for number, line in lines:
        text = re.split('["!%]', line)[0].strip()
        values = numbers_of(text.replace(",", " ").replace(";", " ").split())
        if not text or (values is None and not rows):
            key, equals, value = text.partition("=")
            if equals:
                header[key.strip().lower()] = value.strip()
            continue
        columns = columns or _miniprof_columns(header.get("columndef", "X,Y"), where)
        if values is None or len(values) <= max(columns):
            raise InputError(
                f"{where}: line {number} is {line.strip()[:80]!r}; {max(columns) + 1} or more numbers expected"
            )
        rows.append([values[column] for column in columns])
        numbers.append(number)
    promised = numbers_of([header.get("xypoints", "")])
    if promised and promised[0] > len(rows):
        last = numbers[-1] if numbers else len(lines)
        raise InputError(f"{where}: line {last}: {len(rows)} points; XYPoints = {promised[0]:g} are expected")
    return _in_millimetres(_point_list(rows, numbers, where))


def _miniprof_columns(definition: str, where: str) -> tuple[int, int]:
    """Columns of x and y."""
    names = [name.strip().upper() for name in definition.split(",")]
    if "X" not in names or "Y" not in names:
        raise InputError(f"{where}: ColumnDef = {definition!r}: must name X and Y")
    return names.index("X"), names.index("Y")


def _read_simpack(lines: Lines, kind: Kind, where: str) -> PointList:
    """Read sections of keys and one of points."""
    keys: dict[str, tuple[int, str]] = {}
    rows: list[list[float]] = []
    numbers: list[int] = []
    section: list[str] = []
    is_complete = False
    for number, line in lines:
        text = line.split("!")[0].strip()
        if text.endswith(".begin"):
            section.append(text.removesuffix(".begin"))
        elif text.endswith(".end"):
            is_complete |= text == "point.end" and section[-1:] == ["point"]
            section = section[:-1]
        elif "=" in text:
            key, _, value = text.partition("=")
            keys[f"{section[-1] if section else ''}:{key.strip().lower()}"] = (number, value.strip())
        elif text and section[-1:] == ["point"]:
            values = numbers_of(text.split())
            if values is None or len(values) < 2:
                raise InputError(f"{where}: line {number} is {line.strip()[:80]!r}; y, z and a weight expected")
            rows.append(values[:2])
            numbers.append(number)
    if not is_complete:
        raise InputError(f"{where}: line {len(lines)}: ends without point.begin ... point.end; is the file cut off?")
    if "header:type" in keys and (stated := _simpack_number(keys, "header:type", 0.0, where)) != (kind == "wheel"):
        number = keys["header:type"][0]
        raise InputError(f"{where}: line {number}: header type = {stated:g}: must be 0 for a rail, 1 for a wheel")
    return _simpack_processed(_point_list(rows, numbers, where), keys)


def _simpack_number(keys: dict[str, tuple[int, str]], key: str, default: float, where: str) -> float:
    """Numeric value of a key."""
    number, text = keys.get(key, (0, str(default)))
    values = numbers_of([text])
    if values is None or not np.isfinite(values[0]):
        raise InputError(f"{where}: line {number}: {key.partition(':')[2]} = {text!r}: must be a number")
    return values[0]


def _simpack_processed(found: PointList, keys: dict[str, tuple[int, str]]) -> PointList:
    """Apply the processing keys of the file to its points [mm]."""

    def value(key: str, default: float = 0.0) -> float:
        return _simpack_number(keys, f"spline:{key}", default, found.where)

    per_metre, per_radian = value("units.len.f", 1000.0), value("units.ang.f", 1.0)
    for name, factor in (("units.len.f", per_metre), ("units.ang.f", per_radian)):
        if not 0.0 < factor <= LARGEST_FACTOR:
            line = keys[f"spline:{name}"][0]
            raise InputError(f"{found.where}: line {line}: {name} = {factor:g}: must be > 0 and <= {LARGEST_FACTOR:g}")
        if factor < 1.0 / LARGEST_FACTOR:
            line = keys[f"spline:{name}"][0]
            raise InputError(f"{found.where}: line {line}: {name} = {factor:g}: must be >= {1.0 / LARGEST_FACTOR:g}")
    points, lines = found.points, found.lines
    if (least := value("point.dist.min")) > 0.0:
        kept = [0]
        for i in range(1, len(points)):
            if np.hypot(*(points[i] - points[kept[-1]])) >= least:
                kept.append(i)
        points, lines = points[kept], lines[kept]
    points = points + np.array([value("shift.y"), value("shift.z")])
    if angle := value("rotate") / per_radian:
        points = points @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    for axis, name in enumerate("yz"):
        low, high = value(f"bound.{name}.min"), value(f"bound.{name}.max")
        if low < high:  # bounds with low >= high are inactive
            within = (points[:, axis] >= low) & (points[:, axis] <= high)
            points, lines = points[within], lines[within]
    points = points * [-1.0 if value("mirror.y") else 1.0, -1.0 if value("mirror.z") else 1.0]
    if value("inversion"):
        points, lines = points[::-1], lines[::-1]
    return PointList(points * (1000.0 / per_metre), lines, found.where)


FORMATS: dict[str, Callable[[Lines, Kind, str], PointList]] = {
    ".prw": _read_simpack,
    ".prr": _read_simpack,
    ".whl": _read_miniprof,
    ".ban": _read_miniprof,
}
"""Readers by suffix."""
