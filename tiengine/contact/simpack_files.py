"""Reader of SIMPACK profiles, ``.prw`` and ``.prr``.

``key = value`` in the sections ``header`` and ``spline``, points between ``point.begin`` and ``point.end``, ``!`` for
comments. The spline's keys are applied to the points in the order in which the format numbers them: least distance,
shift, rotation, bounds, mirrors, inversion; ``units.len.f`` is the number of length units per metre. The weights of
points and ``approx.smooth`` are not used.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tiengine.contact.column_files import Lines
from tiengine.contact.point_list import Kind, PointList, point_list
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import numbers_of

__all__ = ["read_simpack"]

LARGEST_FACTOR = 1e6  # of units


def read_simpack(lines: Lines, kind: Kind, where: str) -> PointList:
    """Read sections of keys and one of points.

    Args:
        lines: Numbered lines.
        kind: ``"wheel"`` or ``"rail"``; the header must agree.
        where: Name of the profile for messages.

    Returns:
        Points in mm, processed as the file's keys say.

    Raises:
        InputError: A line that is not understood, or a file that is cut off.
    """
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
    return _simpack_processed(point_list(rows, numbers, where), keys)


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
    return replace(found, points=points * (1000.0 / per_metre), lines=lines)
