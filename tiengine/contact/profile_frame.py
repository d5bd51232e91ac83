"""Placement of point lists in the frame of profiles: orientation, origin, smoothness.

Orientation follows from the shape: a rail's head is highest in the middle; a wheel's flange protrudes most and lies
inside. The inner side of a symmetric railhead cannot be detected; y is taken as outward unless ``mirror`` is stated.

A kink is a turn of the surface between the 1 mm before a point and the 1 mm after it. On a radius R it is 1 mm/R: 0.08
at a gauge corner of R13 or a flange root of R12, 0.2 on R5, the limit for a running surface. A single point 0.1 mm off
a smooth curve makes the same turn, rounding to 0.01 mm a tenth of it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_smoothing_spline

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = [
    "FEWEST_POINTS",
    "Kind",
    "PointList",
    "check_kinks",
    "increasing_run",
    "oriented",
    "placed",
    "smoothing_curve",
]

Kind = Literal["wheel", "rail"]

FEWEST_POINTS = 10
KINK_WINDOW = 1.0  # mm
KINK_TURN, KINK_CURVATURE = 0.12, 0.08  # rad and rad/mm: together 0.2 over the window, more where points are sparser
FLANGE_HEIGHT = 15.0  # mm above the tread, at least; new flanges have 27 to 30
FLANGE_TIP = (-75.0, -35.0)  # mm from the tape circle; 70 mm from the flange's back, its tip some 15 mm
FIELD_SIDE = 55.0  # mm from the tape circle: chamfers beyond are not part of the running surface
HEAD_DEPTH = 20.0  # mm below the top: a rail's side below is not part of the running surface
UNEVEN_DEPTH = 5.0  # mm by which the points may reach deeper on the outer side than on the inner one
ORIGIN = 1e-3  # mm: a smaller offset of the origin is rounding of the list
RESAMPLED_STEP = 0.1  # mm
LARGEST = 1e4  # mm


@dataclass(frozen=True, eq=False)
class PointList:
    """Points of a file.

    Attributes:
        points: y and z [mm], shape (n, 2).
        lines: Line of each point in its file, shape (n,).
        where: Name of the profile for messages.
    """

    points: Reals
    lines: NDArray[np.int64]
    where: str


def oriented(listed: PointList, kind: Kind) -> PointList:
    """Orient points with z down and y from inside to outside, as far as their shape tells.

    Args:
        listed: Points in any orientation.
        kind: ``"wheel"`` or ``"rail"``.

    Returns:
        The same points, mirrored and reversed as needed; a rail keeps its y.
    """
    points, lines = listed.points.copy(), listed.lines
    y, z = points.T
    if kind == "rail":
        middle = z[np.argmin(np.abs(y - 0.5 * (y.min() + y.max())))]
        if 0.5 * (z[0] + z[-1]) < middle:
            points[:, 1] *= -1.0
    elif (tip := _flange_tip(z)) is not None:
        if z[tip] < np.median(z):
            points[:, 1] *= -1.0
        if y[tip] > 0.5 * (y.min() + y.max()):
            points[:, 0] *= -1.0
    if points[-1, 0] < points[0, 0]:
        points, lines = points[::-1].copy(), lines[::-1]
    return replace(listed, points=points + 0.0, lines=lines)  # no -0.0


def _flange_tip(z: Reals) -> int | None:
    """Index of the point that protrudes most, preferably not an end of the list; None without a flange."""
    height = z - np.median(z)
    tall = [int(i) for i in (np.argmax(height), np.argmin(height)) if abs(height[i]) >= FLANGE_HEIGHT]
    return max(tall, key=lambda i: (0 < i < z.size - 1, abs(height[i])), default=None)


def check_kinks(listed: PointList, kind: Kind) -> None:
    """Refuse a running surface that is not smooth.

    The flange's back and tip, the outer rim and a rail's sides are not checked: they never touch and may have edges.

    Args:
        listed: Oriented points.
        kind: ``"wheel"`` or ``"rail"``.

    Raises:
        InputError: A kink; the message names line, position and turn.
    """
    points = listed.points
    chord = np.hypot(*np.diff(points, axis=0).T)
    t = np.concatenate([[0.0], np.cumsum(chord)])
    rank = np.arange(t.size)
    before = np.minimum(np.searchsorted(t, t - KINK_WINDOW, side="right") - 1, rank - 1)
    after = np.maximum(np.searchsorted(t, t + KINK_WINDOW, side="left"), rank + 1)
    i = rank[(before >= 0) & (after < t.size)]
    first, second = points[i] - points[before[i]], points[after[i]] - points[i]
    turn = np.arctan2(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0], (first * second).sum(axis=1))
    bound = KINK_TURN + KINK_CURVATURE * 0.5 * (np.hypot(*first.T) + np.hypot(*second.T))
    excess = np.where(_is_run_on(points, kind)[i], np.abs(turn) / bound, 0.0)
    if excess.size and excess.max() > 1.0:
        worst = int(np.argmax(excess))
        y, z = points[i[worst]]
        raise InputError(
            f"{listed.where}: line {listed.lines[i[worst]]}: a kink of {np.degrees(abs(turn[worst])):.0f} deg within"
            f" {KINK_WINDOW:g} mm at y = {y:.2f} mm, z = {z:.2f} mm; a smooth surface, rounder than R5, expected"
        )


def _is_run_on(points: Reals, kind: Kind) -> NDArray[np.bool_]:
    """Points that may touch, shape (n,)."""
    y, z = points.T
    if kind == "rail":
        return np.asarray(z < z.min() + HEAD_DEPTH)
    tip = _flange_tip(z)
    if tip is None:
        return np.ones(y.size, dtype=np.bool_)
    tape_circle = y[tip] + 55.0  # near enough for the rim
    return np.asarray((y > y[tip] + 2.0) & (y < tape_circle + FIELD_SIDE))


def placed(
    points: Reals,
    kind: Kind,
    where: str,
    *,
    has_cant: bool = False,
    smoothing: float = 0.0,
    mirror: bool | None = None,
    tape_circle: float = 0.0,
) -> Reals:
    """Move points to the origin of profiles, with y increasing throughout.

    Lists whose y falls somewhere (overhanging sides, noise of a measurement on a steep flank) are replaced by equal
    steps along their smoothing spline, as far to either side as y increases.

    Args:
        points: y and z, oriented [mm], shape (n, 2).
        kind: ``"wheel"`` or ``"rail"``.
        where: Name of the profile for messages.
        has_cant: The points are those of an inclined rail, which is not moved.
        smoothing: Length of the smoothing spline [m].
        mirror: Whether a rail's gauge face is at positive y; None if not stated.
        tape_circle: Distance of a wheel's tape circle outward from the list's y = 0 [m].

    Returns:
        y and z [m], shape (m, 2).

    Raises:
        InputError: Too few or too large points, or a flange or side of a rail at an impossible place.
    """
    if len(points) < FEWEST_POINTS or not (np.abs(points) < LARGEST).all():
        raise InputError(
            f"{where}: {len(points)} points up to {np.abs(points).max(initial=0.0):g} mm; at least {FEWEST_POINTS}"
            f" finite pairs below {LARGEST:g} mm expected"
        )
    if mirror:
        if kind == "wheel":
            raise InputError(f"{where}: mirror = true: only for rails; a wheel is turned by its flange")
        points = points[::-1] * [-1.0, 1.0]
    if len(points) > 1 and (np.diff(points[:, 0]) <= 0.0).any():
        points = _resampled(points, max(1e3 * smoothing, 0.5 * RESAMPLED_STEP), kind, tape_circle)
    placed = _placed_wheel(points, where, tape_circle) if kind == "wheel" else _placed_rail(points, where, mirror)
    return (points if has_cant else placed) * 1e-3


def _placed_wheel(points: Reals, where: str, tape_circle: float) -> Reals:
    """A wheel with the origin at its tape circle [mm]."""
    moved = points - [1e3 * tape_circle, 0.0]
    y, z = moved.T
    if not y[0] < 0.0 < y[-1]:
        raise InputError(
            f"{where}: y from {y[0]:.2f} to {y[-1]:.2f} mm; the tape circle, y = 0, must lie between:"
            " state tape_circle, its distance outward from the list's y = 0"
        )
    tip = _flange_tip(z)
    if tip is not None and not FLANGE_TIP[0] <= y[tip] <= FLANGE_TIP[1]:
        raise InputError(
            f"{where}: the flange's tip lies at y = {y[tip]:.2f} mm; {FLANGE_TIP[0]:g} to {FLANGE_TIP[1]:g} mm from"
            " the tape circle expected: state tape_circle, its distance outward from the list's y = 0"
        )
    height = float(np.interp(0.0, y, z))
    return moved - [0.0, height] if abs(height) > ORIGIN else moved


def _placed_rail(points: Reals, where: str, mirror: bool | None) -> Reals:
    """A rail with the top of its head at z = 0 [mm]."""
    top = float(points[:, 1].min())
    inner, outer = points[0, 1] - top, points[-1, 1] - top
    if mirror is None and outer > inner + UNEVEN_DEPTH:
        raise InputError(
            f"{where}: reaches {inner:.1f} mm below its top at negative y, the inner side, and {outer:.1f} mm at"
            " positive y: state mirror = true if its gauge face is at positive y, else mirror = false"
        )
    return points - [0.0, top] if abs(top) > ORIGIN else points


def _resampled(points: Reals, smoothing: float, kind: Kind, tape_circle: float) -> Reals:
    """Resample in equal steps along the smooth curve, as far around top or tread as y increases [mm]."""
    apart = np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-6])
    curve = smoothing_curve(points[apart], smoothing)
    t = np.linspace(curve.x[0], curve.x[-1], int(curve.x[-1] / RESAMPLED_STEP) + 2)
    fine = curve(t)
    inside = np.argmin(fine[:, 1]) if kind == "rail" else np.argmin(np.abs(fine[:, 0] - 1e3 * tape_circle))
    first, last = increasing_run(fine[:, 0], int(inside), 1e-6)
    kept: Reals = fine[first:last]
    return kept


def smoothing_curve(points: Reals, smoothing: float) -> CubicSpline:
    """The smooth curve (y, z) through points over their chord length.

    Args:
        points: Shape (n, 2).
        smoothing: Length l of the smoothing spline in the points' unit; 0 for interpolation.
    """
    t = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(points[:, 0]), np.diff(points[:, 1])))])
    smooth = points.copy()
    if smoothing > 0.0:
        scaled = t / smoothing
        for column in smooth.T:
            column[:] = make_smoothing_spline(scaled, column, np.gradient(scaled), lam=1.0)(scaled)
    return CubicSpline(t, smooth, bc_type="natural")


def increasing_run(y: Reals, inside: int, rounding: float = 1e-9) -> tuple[int, int]:
    """The slice [first, last) around index ``inside`` over which y increases by more than ``rounding``."""
    falls = np.flatnonzero(np.diff(y) <= rounding)
    before, after = falls[falls < inside], falls[falls >= inside]
    return (int(before[-1]) + 1 if before.size else 0), (int(after[0]) + 1 if after.size else y.size)
