"""Text of a measured track: encoding, separator, decimal mark, cells and their numbers.

Encoding: UTF-8 (or UTF-16 with its mark) where the bytes are valid; otherwise GBK if all bytes beyond ASCII come in
pairs of the national character set, as in Chinese heads, else Latin-1. Separator: that of a row in the middle of the
file, tab before semicolon before comma before blanks. Decimal commas are read where commas do not separate; a file with
decimal commas and decimal points is refused, since one of them would group thousands.
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import LARGEST_TRACK, LONGEST_LINE, numbers_of, read_bytes

__all__ = ["Encoding", "TrackText", "read_track_text"]

Encoding = Literal["auto", "utf-8", "gbk", "latin-1", "utf-16"]

SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "blanks"}
MISSING = {"", "-", "--", "*", "na", "n/a", "nan", "null", "none"}
"""Cells without a value, in small letters."""
MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}
NATIONAL = re.compile(rb"(?:[\xa1-\xf7][\xa1-\xfe])+")
"""Characters of GB 2312, the part of GBK that texts use."""
MILEAGE = re.compile(r"([A-Za-z]{0,4})[ ]*(\d{1,5})[ ]*\+[ ]*(\d{1,4}(?:[.,]\d+)?)")
"""Kilometre and metre as surveyors write them: K120+003.250."""
HEAD = re.compile(r"\S+(?:[ ]*[\[(][^\])]*[\])])?")
"""A column's head among heads separated by blanks, with its unit."""


@dataclass
class TrackText:
    """Lines of a file and how to read them.

    Attributes:
        path: The file.
        encoding: Its encoding, in words.
        separator: Between two cells of a line; a blank for any blanks.
        lines: Number and text of each line that is neither blank nor a comment.
        decimal_mark: ``"."`` or ``","`` once one has been met.
    """

    path: str
    encoding: str
    separator: str
    lines: list[tuple[int, str]]
    decimal_mark: str = field(default="", init=False)

    @property
    def description(self) -> str:
        """How the file is read, in words."""
        comma = ", decimal commas" if self.decimal_mark == "," else ""
        return f"{self.encoding}, separated by {SEPARATORS[self.separator]}{comma}"

    def error(self, line: int, rule: str) -> InputError:
        """Error of a line, with how the file is read.

        Args:
            line: Number of the line, from 1.
            rule: What is wrong with it.
        """
        return InputError(f"{self.path}, line {line}: {rule} (read as {self.description})")

    def cells(self, line: str) -> list[str]:
        """Split a line into its cells."""
        return _split(line, self.separator)

    def heads(self, line: str) -> list[str]:
        """Split a line of heads, which may hold blanks before a unit; separators at its end head nothing."""
        if self.separator == " ":
            return HEAD.findall(line)
        cells = self.cells(line)
        while cells and not cells[-1]:
            cells.pop()
        return cells

    def number(self, cell: str, mileage: bool = False) -> float | None:
        """Number of a cell: NaN where it holds no value, None where it is not a finite number.

        Args:
            cell: Text of the cell.
            mileage: Whether it may be written as K120+003.250, which is 120003.25 m.
        """
        if cell.lower() in MISSING:
            return math.nan
        mark = "," if "," in cell else "." if "." in cell else ""
        if mark and self.decimal_mark not in ("", mark):
            return None
        if mileage and (found := MILEAGE.fullmatch(cell)) is not None:
            value = 1e3 * float(found[2]) + float(found[3].replace(",", "."))
        else:
            values = numbers_of([cell.replace(",", ".")])
            if values is None or not math.isfinite(values[0]):
                return None
            value = values[0]
        self.decimal_mark = mark or self.decimal_mark
        return value


def read_track_text(path: str | Path, encoding: Encoding = "auto", key: str = "irregularity.file") -> TrackText:
    """Read the text of a measured track.

    Args:
        path: The file.
        encoding: Its encoding; ``"auto"`` detects it.
        key: Key of the scenario that names it.

    Raises:
        InputError: The file cannot be read, is too large, is not text in this encoding, or holds too long a line.
    """
    where = f"{key} = {str(path)!r}"
    data = read_bytes(path, where, LARGEST_TRACK)
    text, name = _decoded(data, encoding, where)
    lines = []
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > LONGEST_LINE:
            raise InputError(f"{where}: line {number}: {len(line)} characters; must be at most {LONGEST_LINE}")
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            lines.append((number, line))
    return TrackText(str(path), name, _separator(lines[len(lines) // 2][1]) if lines else ",", lines)


def _decoded(data: bytes, encoding: Encoding, where: str) -> tuple[str, str]:
    """Text and name of the encoding."""
    mark = next((name for start, name in MARKS.items() if data.startswith(start)), "utf-8")
    name: str = mark if encoding == "auto" else encoding
    if name == "utf-8" and data.startswith(b"\xef\xbb\xbf"):
        name = "utf-8-sig"
    if name != "utf-16" and b"\0" in data:
        raise InputError(f"{where}: line {data[: data.index(0)].count(10) + 1}: not a text file")
    try:
        return data.decode(name), name.removesuffix("-sig").upper()
    except UnicodeDecodeError as error:
        if encoding != "auto":
            line = data[: error.start].count(b"\n") + 1
            raise InputError(f"{where}: line {line}: not in the encoding {encoding} of file_encoding") from None
    high = re.findall(rb"[\x80-\xff]+", data)
    if all(NATIONAL.fullmatch(run) for run in high):
        return data.decode("gbk", errors="replace"), "GBK"
    return data.decode("latin-1"), "Latin-1"


def _separator(line: str) -> str:
    """Separator of a row of numbers."""
    for separator in ("\t", ";"):
        if separator in line:
            return separator
    blanks = line.split()
    if numbers_of(_split(line, ",")) is None and numbers_of([cell.replace(",", ".") for cell in blanks]) is not None:
        return " " if len(blanks) > 1 else ","
    return "," if "," in line else " "


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        return line.split()
    cells = next(csv.reader([line], delimiter=separator)) if '"' in line else line.split(separator)
    return [cell.strip() for cell in cells]
