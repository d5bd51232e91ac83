"""Columns of a measured track: their names, their units, and which of them are read."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from tiengine.irregularity.track_text import TrackText
from tiengine.parameters.errors import nearest
from tiengine.parameters.quantity import Params

__all__ = ["Column", "FileColumns", "find_columns"]

_Position = Annotated[int, Field(ge=1, le=10_000)]
_Head = Annotated[str, Field(max_length=200)]


class FileColumns(Params):
    """Columns of ``irregularity.file``, each by its head in the file (with or without its unit) or its number from 1.

    Where any is named, all other columns of the file are ignored. Without this table the heads in the file must be
    these keys or their synonyms (docs/files.md).
    """

    x: _Head | _Position | None = Field(default=None, description="distance along the track")
    km: _Head | _Position | None = Field(default=None, description="distance in kilometres, or their part of it")
    m: _Head | _Position | None = Field(default=None, description="metres beyond `km`")
    vertical: _Head | _Position | None = Field(default=None, description="mean height of the rails")
    vertical_left: _Head | _Position | None = Field(default=None, description="height of the left rail")
    vertical_right: _Head | _Position | None = Field(default=None, description="height of the right rail")
    cross_level: _Head | _Position | None = Field(default=None, description="left rail above right, over 1.5 m")
    theta: _Head | _Position | None = Field(default=None, description="cross level as an angle")
    alignment: _Head | _Position | None = Field(default=None, description="mean lateral position of the rails")
    alignment_left: _Head | _Position | None = Field(default=None, description="lateral position of the left rail")
    alignment_right: _Head | _Position | None = Field(default=None, description="lateral position of the right rail")
    gauge: _Head | _Position | None = Field(default=None, description="deviation from the nominal gauge")


_SYNONYMS = {
    **dict.fromkeys(("distance", "chainage", "mileage"), "x"),
    "vertical": "z_v",
    "alignment": "y_a",
}
_NAMES = (*FileColumns.model_fields, *_SYNONYMS, "z_v", "y_a")
_UNITS = {"m": 1.0, "mm": 1e-3, "km": 1e3, "rad": 1.0, "mrad": 1e-3}
_ALLOWED = {"x": ("m", "km"), "km": ("km",), "m": ("m",), "theta": ("rad", "mrad")}
_LENGTHS = ("m", "mm")
_HEAD_UNIT = re.compile(r"([^\[(（]*?)\s*(?:[\[(（]\s*(\w*)\s*[\])）])?")
_PREAMBLE = 50  # lines before the heads at most


@dataclass(frozen=True)
class Column:
    """A column that is read.

    Attributes:
        name: x, km, m, z_v, y_a, theta, gauge, vertical_left, ...
        index: Its place in a line, from 0.
        factor: To SI units.
    """

    name: str
    index: int
    factor: float


def find_columns(text: TrackText, columns: FileColumns, unit: str) -> tuple[list[Column], int, int]:
    """Find the columns that are read.

    Args:
        text: The file.
        columns: Columns that the scenario names.
        unit: Unit of heights, positions and gauge whose head states none.

    Returns:
        The columns, the number of cells in a line, and the index in ``text.lines`` of the first row.

    Raises:
        InputError: The heads break a rule.
    """
    wanted = {name: place for name, place in columns.model_dump().items() if place is not None}
    if not text.lines:
        raise text.error(1, "must name the columns x, z_v, y_a, theta, gauge or others")
    at = _head_line(text, wanted)
    number, line = text.lines[max(at, 0)]
    cells = text.heads(line) if at >= 0 else [""] * len(text.cells(line))
    first, units = at + 1, [""] * len(cells)
    if at >= 0 and first < len(text.lines) and (row := _unit_row(text.cells(text.lines[first][1]), len(cells))):
        first, units = first + 1, row
    found = _mapped(text, number, cells, wanted) if wanted else _named(text, number, cells)
    names = [name for name, _ in found]
    if len(set(names)) < len(names):
        raise text.error(number, "a column is named twice")
    if not {"x", "km", "m"} & set(names) or set(names) <= {"x", "km", "m"}:
        raise text.error(number, "needs column 'x' and one of z_v, y_a, theta, gauge or their equivalents")
    if "x" in names and {"km", "m"} & set(names):
        raise text.error(number, "must have either 'x' or 'km' and 'm'")
    factors = [_factor(text, number, name, cells[index], units[index], unit) for name, index in found]
    return [Column(name, index, f) for (name, index), f in zip(found, factors, strict=True)], len(cells), first


def _head_line(text: TrackText, wanted: dict[str, str | int]) -> int:
    """Index of the line with the heads: the first that has those looked for, else the first; -1 without heads."""
    heads = {_plain(place) for place in wanted.values() if isinstance(place, str)}
    for i, (_, line) in enumerate(text.lines[:_PREAMBLE]):
        cells = text.heads(line)
        known = {_plain(cell) for cell in cells} | {_plain(_label(cell)) for cell in cells}
        if heads and heads <= known:
            return i
        if not wanted and len(cells) > 1 and all(_known(cell) for cell in cells):
            return i
    if wanted and not heads:
        cells = text.cells(text.lines[0][1])
        if all(place <= len(cells) and text.number(cells[place - 1], True) is not None for place in wanted.values()):  # type: ignore[operator]
            return -1
    return 0


def _unit_row(cells: list[str], count: int) -> list[str] | None:
    """Units of a line that holds nothing else."""
    units = [cell.strip("[]() ").lower() for cell in cells[:count]]
    only_units = len(units) == count and any(units) and all(u in (*_UNITS, "", "-") or "/" in u for u in units)
    return ["" if u not in _UNITS else u for u in units] if only_units else None


def _mapped(text: TrackText, number: int, cells: list[str], wanted: dict[str, str | int]) -> list[tuple[str, int]]:
    """Name and place of the columns that the scenario names."""
    heads = [_plain(cell) for cell in cells]
    labels = [_plain(_label(cell)) for cell in cells]
    found = []
    for key, place in wanted.items():
        where = f"irregularity.file_columns.{key} = {place!r}"
        if isinstance(place, int):
            if place > len(cells):
                raise text.error(number, f"{where}: there are {len(cells)} columns")
            index = place - 1
        else:
            matches = [i for i, head in enumerate(heads) if head == _plain(place)]
            matches = matches or [i for i, label in enumerate(labels) if label == _plain(place)]
            if len(matches) != 1:
                rule = f"{len(matches)} columns have this head" if matches else f"no such head in {', '.join(cells)!r}"
                raise text.error(number, f"{where}: {rule}")
            index = matches[0]
        found.append((_SYNONYMS.get(key, key), index))
    return found


def _named(text: TrackText, number: int, cells: list[str]) -> list[tuple[str, int]]:
    """Name and place of all columns, by their heads."""
    found = []
    for index, cell in enumerate(cells):
        if not _known(cell):
            hint = nearest(_plain(_label(cell)), _NAMES)
            hint = hint if "did you mean" in hint else ""
            rule = f"column {cell!r}: unknown{hint}; name the columns to be read in irregularity.file_columns"
            raise text.error(number, rule)
        name = _plain(_label(cell))
        found.append((_SYNONYMS.get(name, name), index))
    return found


def _factor(text: TrackText, number: int, name: str, cell: str, below: str, unit: str) -> float:
    """Factor of a column to SI units: the unit of its head, that of the line below, the default."""
    match = _HEAD_UNIT.fullmatch(cell)
    stated = ((match[2] if match else None) or below or "").lower() or None
    allowed = _ALLOWED.get(name, _LENGTHS)
    if stated is not None and stated not in allowed:
        raise text.error(number, f"column {cell!r}: its unit must be {' or '.join(allowed)}")
    return _UNITS[stated or (allowed[0] if name in _ALLOWED else unit)]


def _known(cell: str) -> bool:
    return _plain(_label(cell)) in _NAMES


def _label(cell: str) -> str:
    """Head of a column without its unit."""
    match = _HEAD_UNIT.fullmatch(cell)
    return match[1] if match else cell


def _plain(head: str) -> str:
    """A head for comparison: small letters, no blanks."""
    return "_".join(head.casefold().split())
