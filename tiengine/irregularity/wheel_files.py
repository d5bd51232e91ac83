"""Measured polygon of a wheel: a text file of angle and radius deviation over one revolution."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from tiengine.irregularity.track_text import read_track_text
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["read_polygon"]

HEAD = re.compile(r"(\w+)\s*[\[(]\s*(\w+)\s*[\])]")
UNITS = {
    "angle": {"deg": np.pi / 180.0, "rad": 1.0},
    "deviation": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
}
FEWEST, LARGEST = 8, 5e-3  # rows; deviation [m]


def read_polygon(path: str, key: str) -> Callable[[Reals], Reals]:
    """Read a polygon.

    One line of heads, ``angle [deg], deviation [mm]`` (also rad; m, um), then one row a point, the angle rising over at
    most one revolution. Between the points lies a periodic cubic spline.

    Args:
        path: The file.
        key: Key of the scenario that names it.

    Returns:
        Radius deviation [m], positive outward, from angles [rad] of any size.

    Raises:
        InputError: The file breaks a rule; the message names file, line and rule.
    """
    text = read_track_text(path, key=key)
    where = f"{key} = {path!r}"
    if len(text.lines) < 1 + FEWEST:
        raise InputError(f"{where}: {max(len(text.lines) - 1, 0)} points; must have at least {FEWEST}")
    line, heads = text.lines[0]
    columns = {}
    for index, cell in enumerate(text.heads(heads)):
        found = HEAD.fullmatch(cell.strip().lower())
        if found is None or found[1] not in UNITS or found[2] not in UNITS[found[1]]:
            raise text.error(line, f"column {cell!r}: must be angle [deg] or [rad], or deviation [m], [mm] or [um]")
        columns[found[1]] = (index, UNITS[found[1]][found[2]])
    if set(columns) != set(UNITS) or len(text.heads(heads)) != 2:
        raise text.error(line, "must name the columns angle and deviation, once each")
    rows = np.zeros((len(text.lines) - 1, 2))
    for i, (number, row) in enumerate(text.lines[1:]):
        cells = text.cells(row)
        values = [text.number(cell) for cell in cells]
        if len(values) != 2 or any(value is None or not np.isfinite(value) for value in values):
            raise text.error(number, "must be two numbers")
        for k, name in enumerate(UNITS):
            index, factor = columns[name]
            rows[i, k] = factor * float(values[index] or 0.0)
        if abs(rows[i, 1]) > LARGEST:
            raise text.error(number, f"deviation of {rows[i, 1]:g} m; must be at most {LARGEST:g} m")
        if i and not rows[i, 0] > rows[i - 1, 0]:
            raise text.error(number, "the angle must rise from row to row")
    return _closed(rows, where)


def _closed(rows: Reals, where: str) -> Callable[[Reals], Reals]:
    """Periodic spline through the rows; the mean is the nominal radius and is taken off."""
    angle, deviation = rows.T
    whole = 2.0 * np.pi
    turn = angle[-1] - angle[0]
    if abs(turn - whole) < 1e-9 * whole:  # the first point is repeated at the end
        angle, deviation = angle[:-1], deviation[:-1]
    elif turn > whole:
        raise InputError(f"{where}: covers {np.degrees(turn):g} degrees; must be one revolution at most")
    elif whole - turn > 3.0 * float(np.median(np.diff(angle))):
        raise InputError(
            f"{where}: covers {np.degrees(turn):g} degrees; must be one revolution, without its last point or with it"
        )
    spline = CubicSpline(np.append(angle, angle[0] + whole), np.append(deviation, deviation[0]), bc_type="periodic")
    mean = float(spline.integrate(angle[0], angle[0] + whole)) / whole
    return lambda x: np.asarray(spline(x) - mean, np.float64)
