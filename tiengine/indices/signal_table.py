"""Measured signals from a text file: named columns, evenly spaced samples.

The first line that is neither blank nor a comment (``#`` or ``%``) names the columns, each with its unit in brackets
if it is not the SI unit: ``time [s]; ay [g]; az [m/s^2]; Q1 [kN]``. Columns are separated by tabs, semicolons or
commas; with tabs or semicolons, numbers may have decimal commas. Columns that are not asked for may hold anything.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import numbers_of, read_text_file

__all__ = ["SignalTable", "read_signals"]

LARGEST = 2**29  # bytes
UNITS = {
    **dict.fromkeys(("m/s^2", "m/s2", "m/s²", "m/s**2", "n", "s", "m"), 1.0),
    **dict.fromkeys(("kn", "km"), 1e3),
    **dict.fromkeys(("mm/s^2", "mm/s2", "mm/s²", "ms", "mm"), 1e-3),
    "g": 9.80665,
}
"""Factors to SI by unit, in lower case."""


class SignalTable:
    """Rows of a text file, of which columns are read by name."""

    def __init__(self, where: str, names: list[str], factors: list[float | None], rows: list[tuple[int, list[str]]]):
        """Keep the texts of a table.

        Args:
            where: Path of the file, for messages.
            names: Names of the columns, without units.
            factors: Factor of each column to SI units; None for an unknown unit.
            rows: Number of the line and fields of each row.
        """
        self._where, self._names, self._factors, self._rows = where, names, factors, rows

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        return list(self._names)

    def __contains__(self, name: str) -> bool:
        """Whether there is a column of that name."""
        return name in self._names

    def column(self, name: str) -> Reals:
        """Read one column in SI units, shape (n,).

        Args:
            name: Name of the column.

        Raises:
            InputError: There is no such column, its unit is unknown, or a field is not a finite number.
        """
        if name not in self._names:
            known = ", ".join(self._names)
            raise InputError(f"{self._where}: no column {name!r}{nearest(name, self._names)}; there are: {known}")
        place = self._names.index(name)
        factor = self._factors[place]
        if factor is None:
            raise InputError(f"{self._where}: column {name!r}: its unit must be one of {', '.join(UNITS)}")
        values = np.empty(len(self._rows))
        for i, (line, fields) in enumerate(self._rows):
            text = fields[place] if place < len(fields) else ""
            number = numbers_of([text])
            if number is None or not np.isfinite(number[0]):
                raise InputError(f"{self._where}: line {line}: {name} = {text!r}: must be a finite number")
            values[i] = number[0]
        return factor * values


def read_signals(path: Path) -> SignalTable:
    """Read the texts of a file.

    Args:
        path: The file.

    Raises:
        InputError: The file cannot be read or holds no header with rows below it.
    """
    lines = list(_lines(read_text_file(path, str(path), LARGEST).splitlines()))
    if len(lines) < 2:
        raise InputError(f"{path}: must hold a line that names the columns, and rows of numbers below it")
    header = lines[0][1]
    separator = next((each for each in "\t;" if each in header), ",")
    head, *rows = ((number, next(csv.reader([text], delimiter=separator))) for number, text in lines)
    names, factors = zip(*map(_name_and_factor, head[1]), strict=True)
    if repeated := {name for name in names if names.count(name) > 1}:
        raise InputError(f"{path}: line {head[0]}: two columns are called {min(repeated)!r}")
    if numbers_of(names) is not None:
        raise InputError(f"{path}: line {head[0]}: must name the columns, not hold numbers")
    comma = separator != ","
    fields = [
        (number, [text.strip().replace(",", ".") if comma else text.strip() for text in row]) for number, row in rows
    ]
    return SignalTable(str(path), list(names), list(factors), fields)


def _lines(lines: Iterable[str]) -> Iterator[tuple[int, str]]:
    """Yield number and text of lines that are neither blank nor comments."""
    for number, line in enumerate(lines, start=1):
        if line.strip() and not line.lstrip().startswith(("#", "%")):
            yield number, line


def _name_and_factor(text: str) -> tuple[str, float | None]:
    """Name of a column and its factor to SI; without a unit 1."""
    name, bracket, unit = text.strip().partition("[")
    return name.strip(), UNITS.get(unit.strip().rstrip("]").strip().lower()) if bracket else 1.0
