"""Placement of point lists in the frame of profiles: orientation, origin, inclination.

Orientation follows from the shape: a rail's head is highest in the middle; a wheel's flange protrudes most and lies
inside. The inner side of a symmetric railhead cannot be detected; y is taken as outward unless ``mirror`` is stated.
What the shape contradicts is refused until it is stated: a wheel whose height is not zero at y = 0 may count from
elsewhere than its tape circle; a railhead that is inclined leans towards its inner side.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tiengine.contact.point_list import FEWEST_POINTS, Kind, Placement, PointList, flange_tip
from tiengine.contact.smoothing import increasing_run, smoothing_curve
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["mirrored", "oriented", "placed"]

FLANGE_TIP = (-75.0, -35.0)  # mm from the tape circle; 70 mm from the flange's back, its tip some 15 mm
UNEVEN_DEPTH = 5.0  # mm by which the points may reach deeper on the outer side than on the inner one
ORIGIN = 1e-3  # mm: a smaller offset of the origin is rounding of the list
ORIGIN_HEIGHT = 0.03  # mm: a wheel's height at its tape circle may be off by the noise of a measurement
HEAD_INCLINATION = 1.0 / 80.0  # of the head at the list's y = 0: half of the smallest inclination of rails, 1:40
MIDDLE_INCLINATION = 1.0 / 60.0  # of the head's middle, which uneven sides move by a few mm on R300
HEAD_LEVEL = 10.0  # mm below the top, where the middle of a railhead is taken
HEAD_CHORD = 10.0  # mm to either side of the middle, over which its inclination is measured
OFF_AXIS = 15.0  # mm by which the middle of a worn head may lie beside the rail's axis
SHALLOW = 3.0  # mm: heads that reach less deep below their top are too flat to tell their inclination
RESAMPLED_STEP = 0.1  # mm
LARGEST = 1e4  # mm


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
    elif (tip := flange_tip(z)) is not None:
        if z[tip] < np.median(z):
            points[:, 1] *= -1.0
        if y[tip] > 0.5 * (y.min() + y.max()):
            points[:, 0] *= -1.0
    if points[-1, 0] < points[0, 0]:
        points, lines = points[::-1].copy(), lines[::-1]
    return replace(listed, points=points + 0.0, lines=lines)  # no -0.0


def mirrored(listed: PointList, kind: Kind, stated: Placement) -> PointList:
    """Mirror a rail whose gauge face is stated to be at positive y.

    Args:
        listed: Oriented points.
        kind: ``"wheel"`` or ``"rail"``.
        stated: ``mirror`` is used.

    Raises:
        InputError: ``mirror`` is stated of a wheel.
    """
    if not stated.mirror:
        return listed
    if kind == "wheel":
        raise InputError(f"{listed.where}: mirror = true: only for rails; a wheel is turned by its flange")
    return replace(listed, points=listed.points[::-1] * [-1.0, 1.0], lines=listed.lines[::-1])


def placed(listed: PointList, kind: Kind, stated: Placement) -> Reals:
    """Move points to the origin of profiles, with y increasing throughout.

    Lists whose y falls somewhere (overhanging sides, noise of a measurement on a steep flank) are replaced by equal
    steps along their smoothing spline, as far to either side as y increases.

    Args:
        listed: Oriented points.
        kind: ``"wheel"`` or ``"rail"``.
        stated: Statements of the user; a rail stated to be inclined is not moved.

    Returns:
        y and z [m], shape (m, 2).

    Raises:
        InputError: Too few or too large points, or a shape that contradicts what is stated or assumed.
    """
    where, points = listed.where, mirrored(listed, kind, stated).points
    for key in ("rail_axis", "has_cant") if kind == "wheel" else ("tape_circle",):
        if (value := getattr(stated, key)) is not None:
            raise InputError(f"{where}: {key} = {str(value).lower()}: not for a {kind}")
    if len(points) < FEWEST_POINTS or not (np.abs(points) < LARGEST).all():
        raise InputError(
            f"{where}: {len(points)} points up to {np.abs(points).max(initial=0.0):g} mm; at least {FEWEST_POINTS}"
            f" finite pairs below {LARGEST:g} mm expected"
        )
    tape_circle = 1e3 * (stated.tape_circle or 0.0)
    if kind == "wheel":
        _check_tape_circle(points, where, tape_circle)
    if (np.diff(points[:, 0]) <= 0.0).any():
        points = _resampled(points, max(1e3 * stated.smoothing, 0.5 * RESAMPLED_STEP), kind, tape_circle)
    if len(points) < FEWEST_POINTS:
        raise InputError(f"{where}: y increases over {len(points)} points only; at least {FEWEST_POINTS} expected")
    if kind == "wheel":
        return _placed_wheel(points, where, stated) * 1e-3
    rail = _placed_rail(points, where, stated)
    axis = _axis(points, where, stated)
    return (points if stated.has_cant else rail - [axis, 0.0]) * 1e-3


def _check_tape_circle(points: Reals, where: str, tape_circle: float) -> None:
    """Refuse a tape circle [mm] that does not lie on the tread."""
    y, z = points[:, 0] - tape_circle, points[:, 1]
    tip = flange_tip(z)
    if tip is not None and not FLANGE_TIP[0] <= y[tip] <= FLANGE_TIP[1]:
        raise InputError(
            f"{where}: the flange's tip lies at y = {y[tip]:.2f} mm; {FLANGE_TIP[0]:g} to {FLANGE_TIP[1]:g} mm from"
            " the tape circle expected: state tape_circle, its distance outward from the list's y = 0"
            " (0.07 where y counts from the flange's back)"
        )
    if not y.min() < 0.0 < y.max():
        raise InputError(
            f"{where}: y from {y.min():.2f} to {y.max():.2f} mm; the tape circle, y = 0, must lie between:"
            " state tape_circle, its distance outward from the list's y = 0"
        )


def _placed_wheel(points: Reals, where: str, stated: Placement) -> Reals:
    """A wheel with the origin at its tape circle [mm]."""
    moved = points - [1e3 * (stated.tape_circle or 0.0), 0.0]
    if not moved[0, 0] < 0.0 < moved[-1, 0]:
        raise InputError(
            f"{where}: y increases from {moved[0, 0]:.2f} to {moved[-1, 0]:.2f} mm only; the tape circle, y = 0, must"
            " lie between: state tape_circle, its distance outward from the list's y = 0"
        )
    height = float(np.interp(0.0, moved[:, 0], moved[:, 1]))
    if stated.tape_circle is None and abs(height) > ORIGIN_HEIGHT:
        raise InputError(
            f"{where}: z = {height:.3f} mm at y = 0, which would be 0 at the tape circle: state tape_circle, its"
            " distance outward from the list's y = 0 (0 if it is there and z counts from elsewhere)"
        )
    return moved - [0.0, height] if abs(height) > ORIGIN else moved


def _placed_rail(points: Reals, where: str, stated: Placement) -> Reals:
    """A rail with the top of its head at z = 0 [mm]."""
    top = float(points[:, 1].min())
    inner, outer = points[0, 1] - top, points[-1, 1] - top
    slope = _head_slope(points)
    if slope:
        side = "negative" if slope < 0.0 else "positive"
        leans = f"{where}: the head is inclined by 1:{1.0 / abs(slope):.0f} towards {side} y"
        if stated.has_cant is None:
            hint = "" if slope < 0.0 or stated.mirror is not None else " and mirror = true"
            raise InputError(
                f"{leans}: state has_cant = true{hint} if the points are those of a rail inclined in the track, else"
                " has_cant = false"
            )
        if slope > 0.0 and stated.has_cant and stated.mirror is None:
            raise InputError(
                f"{leans}, a rail in the track towards its gauge face: state mirror = true if that is at positive y,"
                " else mirror = false"
            )
    if stated.mirror is None and outer > inner + UNEVEN_DEPTH:
        raise InputError(
            f"{where}: reaches {inner:.1f} mm below its top at negative y, the inner side, and {outer:.1f} mm at"
            " positive y: state mirror = true if its gauge face is at positive y, else mirror = false"
        )
    return points - [0.0, top] if abs(top) > ORIGIN else points


def _axis(points: Reals, where: str, stated: Placement) -> float:
    """Place of an upright rail's axis in a list that may be mirrored [mm]."""
    if stated.rail_axis is not None:
        if stated.has_cant:
            raise InputError(f"{where}: rail_axis = {stated.rail_axis:g}: only for upright rails, has_cant is true")
        return 1e3 * stated.rail_axis * (-1.0 if stated.mirror else 1.0)
    head = None if stated.has_cant else _head(points)  # an inclined rail's crown is where its tangent is inclined
    if head is not None and abs(head.middle) > OFF_AXIS:
        middle = head.middle * (-1.0 if stated.mirror else 1.0)
        raise InputError(
            f"{where}: the middle of the head lies at y = {middle:.1f} mm; within {OFF_AXIS:g} mm of the rail's axis"
            " expected: state rail_axis, the y of the axis in the file"
        )
    return 0.0


class _Head(NamedTuple):
    """Middle of a railhead at a level, and half the chord over which its inclination is measured [mm]."""

    middle: float
    half: float


def _head(points: Reals) -> _Head | None:
    """Where a head's sides are equally deep; None if it is too shallow to tell."""
    y, z = points.T
    top = int(np.argmin(z))
    level = (1.0 - 1e-9) * min(HEAD_LEVEL, z[0] - z[top], z[-1] - z[top])  # both ends are as deep, rounded or not
    if level < SHALLOW:
        return None
    inner = np.flatnonzero(z[: top + 1] >= z[top] + level)[-1]
    outer = top + np.flatnonzero(z[top:] >= z[top] + level)[0]
    return _Head(0.5 * float(y[inner] + y[outer]), min(HEAD_CHORD, 0.3 * float(y[outer] - y[inner])))


def _head_slope(points: Reals) -> float:
    """Slope dz/dy of an inclined railhead; 0 if it stands upright or is too shallow to tell.

    An inclined head falls towards its inner side in its middle and at its crown, which is y = 0 in drawings; its
    highest point lies outward by R times the inclination.
    """
    y, z = points.T
    head = _head(points)
    if head is None:
        return 0.0
    middle, half = head

    def slope(place: float) -> float:
        low, high = np.interp([place - half, place + half], y, z)
        return float(high - low) / (2.0 * half)

    if abs(slope(middle)) > MIDDLE_INCLINATION:
        return slope(middle)
    return slope(0.0) if abs(middle) < HEAD_CHORD and abs(slope(0.0)) > HEAD_INCLINATION else 0.0


def _resampled(points: Reals, smoothing: float, kind: Kind, tape_circle: float) -> Reals:
    """Resample in equal steps along the smooth curve, as far around top or tread as y increases [mm]."""
    apart = np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-6])
    curve = smoothing_curve(points[apart], smoothing)
    t = np.linspace(curve.x[0], curve.x[-1], int(curve.x[-1] / RESAMPLED_STEP) + 2)
    fine = curve(t)
    if kind == "rail":
        inside = int(np.argmin(fine[:, 1]))
    else:
        tip = flange_tip(fine[:, 1]) or 0
        inside = tip + int(np.argmin(np.abs(fine[tip:, 0] - tape_circle)))
    first, last = increasing_run(fine[:, 0], inside, 1e-6)
    kept: Reals = fine[first:last]
    return kept
