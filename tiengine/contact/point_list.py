"""Point lists of profiles and what a user states about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = [
    "FEWEST_POINTS",
    "ROUNDING_LENGTH",
    "Kind",
    "Placement",
    "PointList",
    "flange_tip",
    "point_list",
    "without_repeats",
]

Kind = Literal["wheel", "rail"]

FEWEST_POINTS = 10
FLANGE_HEIGHT = 15.0  # mm above the tread, at least; new flanges have 27 to 30
ROUNDING_LENGTH = 5e-5
"""Default smoothing length l [m]: leaves 1 % of curvature noise on CHN60_analytic's 0.05 mm list."""


@dataclass(frozen=True, eq=False)
class PointList:
    """Points of a file.

    Attributes:
        points: y and z [mm], shape (n, 2).
        lines: Line of each point in its file, shape (n,).
        where: Name of the profile for messages.
        notes: Sentences on how the file was interpreted where its format left a choice.
    """

    points: Reals
    lines: NDArray[np.int64]
    where: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Placement:
    """Statements of the user about the points of a profile; None where nothing is stated.

    Attributes:
        has_cant: Whether the points are those of a rail already inclined in the track.
        smoothing: Length l of the smoothing spline [m].
        mirror: Whether a rail's gauge face is at the list's positive y.
        tape_circle: Distance of a wheel's tape circle outward from the list's y = 0 [m].
        allow_kinks: Whether kinks of the running surface are accepted.
        rail_axis: The list's y at the axis of an upright rail [m].
    """

    has_cant: bool | None = None
    smoothing: float = ROUNDING_LENGTH
    mirror: bool | None = None
    tape_circle: float | None = None
    allow_kinks: bool = False
    rail_axis: float | None = None


def point_list(rows: list[list[float]], numbers: list[int], where: str, notes: tuple[str, ...] = ()) -> PointList:
    """Make a point list of finite rows.

    Args:
        rows: y and z of each row.
        numbers: Line of each row.
        where: Name of the profile for messages.
        notes: As in :class:`PointList`.

    Raises:
        InputError: A value is not finite.
    """
    points = np.array(rows, dtype=np.float64).reshape(-1, 2)
    lines = np.array(numbers, dtype=np.int64)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if bad.size:
        y, z = points[bad[0]]
        line = f"line {numbers[bad[0]]}: point {bad[0] + 1}"
        raise InputError(f"{where}: {line} is ({y}, {z}); finite numbers expected")
    return PointList(points, lines, where, notes)


def without_repeats(listed: PointList) -> PointList:
    """Leave out points that repeat their predecessor.

    Args:
        listed: Points in any orientation.
    """
    repeated = np.flatnonzero((np.diff(listed.points, axis=0) == 0.0).all(axis=1)) + 1
    if not repeated.size:
        return listed
    note = f"line {listed.lines[repeated[0]]}: {repeated.size} repeated point(s) left out"
    points, lines = np.delete(listed.points, repeated, axis=0), np.delete(listed.lines, repeated)
    return PointList(points, lines, listed.where, (*listed.notes, note))


def flange_tip(z: Reals) -> int | None:
    """Index of the point that protrudes most, preferably not an end of the list; None without a flange.

    Args:
        z: Heights of a wheel [mm], either sign, shape (n,).
    """
    height = z - np.median(z)
    tall = [int(i) for i in (np.argmax(height), np.argmin(height)) if abs(height[i]) >= FLANGE_HEIGHT]
    return max(tall, key=lambda i: (0 < i < z.size - 1, abs(height[i])), default=None)
