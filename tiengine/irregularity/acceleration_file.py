"""Acceleration record of the ground: a text file of time, vertical and lateral acceleration."""

from __future__ import annotations

import re

import numpy as np

from tiengine.irregularity.track_text import TrackText, read_track_text
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import InputError

__all__ = ["read_acceleration"]

HEAD = re.compile(r"(\w+)\s*[\[(]\s*([^\])\s]+)\s*[\])]")
ACCELERATIONS = {
    **dict.fromkeys(("m/s^2", "m/s2", "m/s²"), 1.0),
    **dict.fromkeys(("cm/s^2", "cm/s2", "cm/s²", "gal"), 1e-2),
    "g": GRAVITY,
}
UNITS = {"time": {"s": 1.0, "ms": 1e-3}, "vertical": ACCELERATIONS, "lateral": ACCELERATIONS}
FEWEST = 4  # rows, for a spline
LARGEST = 50.0  # m/s^2: twice the largest that has been recorded
LONGEST, SHORTEST_STEP = 1e4, 1e-5  # s: of a record, between two rows


def read_acceleration(path: str, key: str) -> Reals:
    """Read a record.

    One line of heads, ``time [s], vertical [m/s^2], lateral [m/s^2]`` (also ms; cm/s^2, gal, g), of which vertical or
    lateral may be absent, then one row for each instant, the time rising from row to row by any steps.

    Args:
        path: The file.
        key: Key of the scenario that names it.

    Returns:
        Time from the first row on [s], acceleration in the columns vertical and lateral [m/s^2], shape (n, 3).

    Raises:
        InputError: The file breaks a rule; the message names file, line and rule.
    """
    text = read_track_text(path, key=key)
    if len(text.lines) < 1 + FEWEST:
        raise InputError(f"{key} = {path!r}: {max(len(text.lines) - 1, 0)} rows; must have at least {FEWEST}")
    columns, width = _columns(text)
    record = np.zeros((len(text.lines) - 1, 3))
    for i, (number, row) in enumerate(text.lines[1:]):
        values = [text.number(cell) for cell in text.cells(row)]
        if len(values) != width or any(value is None or not np.isfinite(value) for value in values):
            raise text.error(number, f"must be {width} numbers")
        for target, index, factor in columns:
            record[i, target] = factor * float(values[index] or 0.0)
        if np.abs(record[i, 1:]).max() > LARGEST:
            raise text.error(number, f"acceleration above {LARGEST:g} m/s^2: are its units right?")
        if i and not record[i, 0] >= record[i - 1, 0] + SHORTEST_STEP:
            raise text.error(number, f"the time must rise from row to row, by {SHORTEST_STEP:g} s at least")
        if record[i, 0] - record[0, 0] > LONGEST:
            raise text.error(number, f"time: must be at most {LONGEST:g} s after the first row")
    record[:, 0] -= record[0, 0]
    return record


def _columns(text: TrackText) -> tuple[list[tuple[int, int, float]], int]:
    """Place in the record, place in the line and factor of each column; columns in a line."""
    line, heads = text.lines[0]
    cells, names, found = text.heads(heads), list(UNITS), []
    for index, cell in enumerate(cells):
        head = HEAD.fullmatch(cell.strip().lower())
        if head is None or head[1] not in UNITS or head[2] not in UNITS[head[1]]:
            raise text.error(
                line, f"column {cell!r}: must be time [s], vertical or lateral [m/s^2], [cm/s^2], [gal] or [g]"
            )
        found.append((names.index(head[1]), index, UNITS[head[1]][head[2]]))
    if len({target for target, *_ in found}) < len(found) or found[0][0] != 0 or len(found) < 2:
        raise text.error(line, "must name the column time first, then vertical, lateral or both, once each")
    return found, len(cells)
