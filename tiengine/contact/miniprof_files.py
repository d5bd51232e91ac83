"""Reader of MiniProf profiles, ``.whl`` and ``.ban``.

``key=value`` lines (or the free text of the old style), then rows of the columns that ``ColumnDef`` names, x and y
first unless it says otherwise; ``"``, ``!``, ``%`` and ``#`` begin comments. Understood and reported: rows quoted out,
words behind a row, a row of flange dimensions in an old header.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from tiengine.contact.column_files import Lines, in_millimetres
from tiengine.contact.number_rows import has_decimal_commas, leading_numbers, split_row
from tiengine.contact.point_list import FEWEST_POINTS, Kind, PointList, point_list
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import numbers_of

__all__ = ["read_miniprof"]


@dataclass
class _Body:
    """Rows of a file as they are collected.

    Attributes:
        rows: Numbers of each row, all columns.
        lines: Line of each row.
        quoted: Numbers in each row that is quoted out.
        notes: As in :class:`tiengine.contact.point_list.PointList`.
    """

    rows: list[list[float]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    quoted: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def drop(self, count: int) -> None:
        """Take the first rows for part of the header."""
        self.notes.append(f"line {self.lines[0]}: {count} row(s) of numbers read as part of the header")
        del self.rows[:count], self.lines[:count]


def read_miniprof(lines: Lines, kind: Kind, where: str) -> PointList:
    """Read header lines, then rows of columns.

    Args:
        lines: Numbered lines.
        kind: ``"wheel"`` or ``"rail"``, not needed here.
        where: Name of the profile for messages.

    Returns:
        Points in mm in the order of the file.

    Raises:
        InputError: A row that is not understood, or fewer points than announced.
    """
    header: dict[str, str] = {}
    body = _Body()
    texts = [(number, line, re.split('["!%#]', line)[0].strip()) for number, line in lines]
    decimal_commas = has_decimal_commas([text for _, _, text in texts if "=" not in text])
    for number, line, text in texts:
        if not text:
            body.quoted.append(len(leading_numbers(split_row(line.strip(' \t"!%#'), decimal_commas))))
            continue
        fields = split_row(text, decimal_commas)
        values = leading_numbers(fields)
        if not values:
            if body.rows and ("columndef" in header or len(body.rows) >= FEWEST_POINTS):
                raise _unreadable(line, number, header, where)
            if body.rows:
                body.drop(len(body.rows))
            key, equals, value = text.partition("=")
            if equals:
                header[key.strip().lower()] = value.strip()
            continue
        needed = max(_columns(header, where)) + 1
        if len(values) < len(fields):
            if len(values) < needed:
                raise _unreadable(line, number, header, where)
            body.notes.append(f"line {number}: words behind the numbers are left out")
        body.rows.append(values)
        body.lines.append(number)
    return in_millimetres(_points(body, header, lines, where))


def _points(body: _Body, header: dict[str, str], lines: Lines, where: str) -> PointList:
    """X and y of the rows, as many as announced."""
    columns = _columns(header, where)
    if "columndef" not in header and len(body.rows) > FEWEST_POINTS:
        usual = len(body.rows[-1])
        odd = next((i for i, row in enumerate(body.rows) if len(row) == usual), 0)
        if 0 < odd < FEWEST_POINTS:
            body.drop(odd)
    for number, row in zip(body.lines, body.rows, strict=True):
        if len(row) <= max(columns):
            raise _unreadable(dict(lines)[number], number, header, where)
    promised = numbers_of([header.get("xypoints", "")])
    quoted = body.quoted.count(len(body.rows[-1])) if body.rows else 0
    if promised and promised[0] > len(body.rows) + quoted:
        last = body.lines[-1] if body.lines else len(lines)
        raise InputError(f"{where}: line {last}: {len(body.rows)} points; XYPoints = {promised[0]:g} are expected")
    if promised and promised[0] < len(body.rows):
        body.notes.append(f"XYPoints = {promised[0]:g}, and {len(body.rows)} points follow, which are all read")
    if quoted:
        body.notes.append(f"{quoted} point(s) quoted out in the file are left out")
    rows = [[row[column] for column in columns] for row in body.rows]
    return point_list(rows, body.lines, where, tuple(body.notes))


def _unreadable(line: str, number: int, header: dict[str, str], where: str) -> InputError:
    """Make the error of a row that lacks numbers."""
    needed = max(_columns(header, where)) + 1
    return InputError(f"{where}: line {number} is {line.strip()[:80]!r}; {needed} or more numbers expected")


def _columns(header: dict[str, str], where: str) -> tuple[int, int]:
    """Columns of x and y."""
    definition = header.get("columndef", "X,Y")
    names = [name.strip().upper() for name in re.split("[,;]", definition)]
    if "X" not in names or "Y" not in names:
        raise InputError(f"{where}: ColumnDef = {definition!r}: must name X and Y")
    return names.index("X"), names.index("Y")
