"""Alignment from a CSV file: chainage, curvature or radius, cant, gradient."""

from __future__ import annotations

from pathlib import Path

from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import numbers_of, read_text_file

__all__ = ["MOST_ROWS", "read_alignment"]

COLUMNS = ("chainage", "curvature", "radius", "cant_mm", "gradient_permille")
LARGEST_FILE = 20_000_000  # bytes
MOST_ROWS = 100_000


def read_alignment(path: Path, where: str) -> tuple[tuple[float, float, float, float], ...]:
    """Read a file whose head names its columns; separators are commas, semicolons or tabs, ``#`` begins a comment.

    ``chainage`` [m] is needed, and ``curvature`` [1/m] or ``radius`` [m], both positive to the right (radius 0 or
    "inf" on the straight); ``cant_mm`` and ``gradient_permille`` are 0 where they are left out.

    Args:
        path: The file.
        where: Its name for messages.

    Returns:
        Rows of chainage [m], curvature [1/m], cant [mm], gradient [permille].

    Raises:
        InputError: Names the line and the rule.
    """
    lines = [
        (number, line.split("#")[0].strip())
        for number, line in enumerate(read_text_file(path, where, LARGEST_FILE).splitlines(), start=1)
    ]
    lines = [(number, line) for number, line in lines if line]
    if not lines:
        raise InputError(f"{where}: empty; must have a head with the columns {', '.join(COLUMNS)}")
    if len(lines) > MOST_ROWS + 1:
        raise InputError(f"{where}: {len(lines) - 1} rows; must be at most {MOST_ROWS}")
    number, head = lines[0]
    separator = next((mark for mark in (";", "\t", ",") if mark in head), ",")
    names = [name.strip().lower() for name in head.split(separator)]
    _check_head(names, f"{where}: line {number}")
    rows = []
    for number, line in lines[1:]:
        cells = [cell.strip() for cell in line.split(separator)]
        values = numbers_of(cells)
        if len(cells) != len(names) or values is None:
            raise InputError(f"{where}: line {number}: must have {len(names)} numbers, one for each column of the head")
        row = dict(zip(names, values, strict=True))
        bend = row["curvature"] if "curvature" in row else 1.0 / row["radius"] if row["radius"] else 0.0
        rows.append((row["chainage"], bend, row.get("cant_mm", 0.0), row.get("gradient_permille", 0.0)))
    if not rows:
        raise InputError(f"{where}: no rows below the head")
    return tuple(rows)


def _check_head(names: list[str], where: str) -> None:
    """Refuse unknown, repeated and missing columns."""
    for i, name in enumerate(names):
        if name not in COLUMNS:
            raise InputError(f"{where}: unknown column {name[:40]!r}{nearest(name, COLUMNS)}")
        if name in names[:i]:
            raise InputError(f"{where}: column {name!r} is there twice")
    if "chainage" not in names:
        raise InputError(f"{where}: no column 'chainage'")
    if ("curvature" in names) == ("radius" in names):
        raise InputError(f"{where}: must have one of the columns 'curvature' and 'radius'")
