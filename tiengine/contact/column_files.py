"""Reader of profiles in columns of text: y and z, with what spreadsheets and other programs add to them.

``#``, ``%``, ``!`` and ``//`` begin comments; y rises or falls from line to line. Understood and reported: a header
row, which may name the columns and a unit (``y [mm]; z [mm]``), a first row with the number of points, a first column
that counts the points, decimal commas, words behind the numbers, repeated points.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tiengine.contact.number_rows import has_decimal_commas, leading_numbers, split_row
from tiengine.contact.point_list import FEWEST_POINTS, Kind, PointList, point_list, without_repeats
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["Lines", "in_millimetres", "read_columns"]

Lines = Sequence[tuple[int, str]]
"""Numbered lines."""

COMMENT = re.compile(r"#|%|!|//")
HEADER_UNIT = re.compile(r"[\[(]\s*(mm|m|in|inch|inches)\s*[\])]", flags=re.IGNORECASE)
MILLIMETRES = {"mm": 1.0, "m": 1000.0, "in": 25.4, "inch": 25.4, "inches": 25.4}
LATERAL, VERTICAL = {"y", "lateral"}, {"z", "vertical", "height"}
WIDEST = 0.4  # m: a narrower list holds metres
Row = tuple[int, str, list[str], list[float]]
"""Line, text, columns, numbers at its beginning."""


def read_columns(lines: Lines, kind: Kind, where: str) -> PointList:
    """Read two columns of text.

    Args:
        lines: Numbered lines.
        kind: ``"wheel"`` or ``"rail"``, not needed here.
        where: Name of the profile for messages.

    Returns:
        Points in mm in the order of the file.

    Raises:
        InputError: A row that is not understood, or y that turns back.
    """
    texts = [(number, COMMENT.split(line)[0].strip()) for number, line in lines]
    decimal_commas = has_decimal_commas([text for _, text in texts])
    rows: list[Row] = []
    for number, text in texts:
        if fields := split_row(text, decimal_commas):
            rows.append((number, text, fields, leading_numbers(fields)))
    notes = ["commas are read as decimal points"] if decimal_commas else []
    header, rows = _without_header(rows, notes)
    rows = _without_count(rows, where, notes)
    values = _two_columns(rows, where, notes)
    names = [word.lower() for word in re.findall(r"[A-Za-z]+", HEADER_UNIT.sub("", header))]
    if len(names) == 2 and names[0] in VERTICAL and names[1] in LATERAL:
        values = [row[::-1] for row in values]
        notes.append("columns are exchanged as the header row names them")
    found = without_repeats(point_list(values, [row[0] for row in rows], where, tuple(notes)))
    unit = HEADER_UNIT.search(header)
    found = replace(found, points=found.points * MILLIMETRES[unit[1].lower()]) if unit else in_millimetres(found)
    _check_order(found)
    return found


def in_millimetres(found: PointList) -> PointList:
    """Convert to millimetres; the width tells metres from millimetres.

    Args:
        found: Points in m or mm.
    """
    in_metres = len(found.points) > 0 and float(np.ptp(found.points[:, 0])) <= WIDEST
    return replace(found, points=found.points * 1e3) if in_metres else found


def _without_header(rows: list[Row], notes: list[str]) -> tuple[str, list[Row]]:
    """Text of a first row without numbers, and the other rows."""
    if len(rows) < 2 or rows[0][3] or not rows[1][3] or any(leading_numbers([field]) for field in rows[0][2]):
        return "", rows
    if any(re.match(r"[+-]?[.,]?\d", field) for field in rows[0][2]):
        return "", rows  # a point with a slip of the pen, not a header
    notes.append(f"line {rows[0][0]} is read as a header row")
    return rows[0][1], rows[1:]


def _without_count(rows: list[Row], where: str, notes: list[str]) -> list[Row]:
    """Rows without a first one that holds nothing but the number of points."""
    if len(rows) < 2 or len(rows[1][2]) < 2 or not re.fullmatch(r"\d+", rows[0][1]):
        return rows
    number, announced = rows[0][0], int(rows[0][1])
    if announced != len(rows) - 1:
        raise InputError(f"{where}: line {number}: announces {announced} points; {len(rows) - 1} follow")
    notes.append(f"line {number} is read as the number of points")
    return rows[1:]


def _two_columns(rows: list[Row], where: str, notes: list[str]) -> list[list[float]]:
    """Values y and z of every row."""
    counted = [row[2][0] for row in rows if len(row[2]) == len(row[3]) == 3]
    first = int(counted[0]) if counted and counted[0] in ("0", "1") else 0
    if len(rows) >= FEWEST_POINTS and counted == [str(first + i) for i in range(len(rows))]:
        notes.append("a first column that counts the points is left out")
        return [row[3][1:] for row in rows]
    for number, text, fields, values in rows:
        if len(values) != 2:
            raise InputError(
                f"{where}: line {number} is {text[:80]!r}; two numbers, y and z in mm, expected, separated by"
                " semicolons, tabs or blanks if commas are decimal"
            )
        if len(fields) > 2:
            notes.append(f"line {number}: words behind the numbers are left out")
    return [row[3] for row in rows]


def _check_order(found: PointList) -> None:
    """Refuse y that turns back."""
    y: Reals = found.points[:, 0]
    if y.size < 2:
        return
    rises = y[-1] >= y[0]
    back = np.flatnonzero(np.diff(y) * (1.0 if rises else -1.0) <= 0.0)
    if back.size:
        i = back[0] + 1
        raise InputError(
            f"{found.where}: line {found.lines[i]}: y goes from {y[i - 1]:.9g} to {y[i]:.9g} at point {i + 1};"
            f" y must {'increase' if rises else 'decrease'} from point to point"
        )
