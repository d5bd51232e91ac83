"""Reader of profiles in columns of text: y and z, with what spreadsheets and other programs add to them.

``#``, ``%``, ``!`` and ``//`` begin comments; y rises or falls from line to line. Understood and reported: lines of
words above the points, which may name the columns and their units (``y [mm]; z [mm]``, or the units in a line below), a
first row with the number of points, a first column that counts the points, decimal commas, words behind the numbers,
repeated points. Cells may be quoted.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tiengine.contact.number_rows import has_decimal_commas, leading_numbers, split_row, unquoted
from tiengine.contact.point_list import FEWEST_POINTS, Kind, PointList, point_list, without_repeats
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["Lines", "in_millimetres", "read_columns"]

Lines = Sequence[tuple[int, str]]
"""Numbered lines."""

COMMENT = re.compile(r"#|%|!|//")
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "inch": 25.4, "inches": 25.4}
HEADER_UNIT = re.compile(rf"[\[(/_]\s*({'|'.join(MILLIMETRES)})\s*(?:[\])]|$|(?=[\s,;]))", flags=re.IGNORECASE)
HEADER_WORD = re.compile(r"[^\W\d_]{3,}[.:]*")
"""A line that begins with such a word is no point, whatever numbers follow."""
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
    texts = [(number, unquoted(COMMENT.split(line)[0].strip())) for number, line in lines]
    decimal_commas = has_decimal_commas([text for _, text in texts])
    rows: list[Row] = []
    for number, text in texts:
        if fields := split_row(text, decimal_commas):
            rows.append((number, text, fields, leading_numbers(fields)))
    notes = ["commas are read as decimal points"] if decimal_commas else []
    header, rows = _without_header(rows, notes)
    rows = _without_count(rows, where, notes)
    values = _two_columns(rows, where, notes)
    scale = _units(header, where)
    exchanged = any(_exchanged(text) for text in header)
    if exchanged:
        notes.append("columns are exchanged as the header row names them")
    listed = point_list(values, [row[0] for row in rows], where, tuple(notes))
    found = without_repeats(replace(listed, points=listed.points * scale) if scale else in_millimetres(listed))
    found = replace(found, points=found.points[:, ::-1]) if exchanged else found
    _check_order(found)
    return found


def in_millimetres(found: PointList) -> PointList:
    """Convert to millimetres; the width tells metres from millimetres.

    Args:
        found: Points in m or mm.
    """
    in_metres = len(found.points) > 0 and float(np.ptp(found.points[:, 0])) <= WIDEST
    return replace(found, points=found.points * 1e3) if in_metres else found


def _without_header(rows: list[Row], notes: list[str]) -> tuple[list[str], list[Row]]:
    """Texts of the first rows, which hold words, and the other rows."""
    count = next((i for i, row in enumerate(rows) if row[3]), 0)
    if not count or any(_is_slip(row) for row in rows[:count]):
        return [], rows
    first, last = rows[0][0], rows[count - 1][0]
    notes.append(
        f"line {first} is read as a header row" if count == 1 else f"lines {first} to {last} are read as header rows"
    )
    return [row[1] for row in rows[:count]], rows[count:]


def _is_slip(row: Row) -> bool:
    """Whether a row without a number at its beginning is a point with a slip of the pen rather than a header."""
    numbers = any(leading_numbers([field]) or re.match(r"[+-]?[.,]?\d", field) for field in row[2])
    return numbers and not HEADER_WORD.fullmatch(row[2][0])


def _units(header: list[str], where: str) -> list[float]:
    """Millimetres in the units of both columns; empty where the header states none."""
    found = [unit.lower() for text in header for unit in HEADER_UNIT.findall(text)]
    for text in header:
        words = [word.lower() for word in re.findall(r"[^\W\d_]+", text)]
        if words and all(word in MILLIMETRES for word in words):
            found += words
    if len(set(found)) > 1 and len(found) != 2:
        raise InputError(f"{where}: the header states the units {', '.join(found)}; one for y and one for z expected")
    return [MILLIMETRES[unit] for unit in (found * 2 if len(set(found)) == 1 else found)[:2]]


def _exchanged(text: str) -> bool:
    """Whether a row of the header names z before y."""
    names = [word.lower() for word in re.findall(r"[A-Za-z]+", HEADER_UNIT.sub("", text))][-2:]
    return len(names) == 2 and names[0] in VERTICAL and names[1] in LATERAL


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
