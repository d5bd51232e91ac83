"""Kinks of profiles: places where a running surface is not smooth.

A kink is a turn of the smoothed surface between the 1 mm before a point and the 1 mm after it. On a radius R it is
1 mm/R: 0.08 at a gauge corner of R13 or a flange root of R12, 0.2 on R5, the limit where wheel and rail can touch.
Worn flange tips and the field corners of worn railheads are sharper and never touch: kinks are only reported there. The
flange's back, the outer rim and a rail's sides may have edges.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from tiengine.contact.point_list import Kind, Placement, PointList, flange_tip
from tiengine.contact.smoothing import smoothing_curve
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, InputNote

__all__ = ["check_kinks"]

WINDOW = 1.0  # mm
LARGEST_TURN = 0.2  # rad over the window on either side, R5
FIELD_SIDE = 55.0  # mm from the tape circle: chamfers beyond are not part of the running surface
HEAD_DEPTH = 20.0  # mm below the top: a rail's side below is not part of the running surface
CHORD = 3.0  # mm to either side, over which inclinations are measured
FIELD_INCLINATION = np.radians(20.0)  # a tread does not reach a railhead's outer side where it is steeper


def check_kinks(listed: PointList, kind: Kind, stated: Placement) -> None:
    """Refuse kinks where wheel and rail can touch, report those on the rest of the surface.

    Args:
        listed: Oriented points, a rail's gauge face at negative y.
        kind: ``"wheel"`` or ``"rail"``.
        stated: ``smoothing`` and ``allow_kinks`` are used.

    Raises:
        InputError: A kink where wheel and rail can touch, unless kinks are allowed; the message names line, position
            and turn.
    """
    apart = np.concatenate([[True], np.hypot(*np.diff(listed.points, axis=0).T) > 1e-6])
    curve = smoothing_curve(listed.points[apart], 1e3 * stated.smoothing)
    t, lines = curve.x, listed.lines[apart]
    middle = curve(t)
    first, second = middle - curve(np.maximum(t - WINDOW, t[0])), curve(np.minimum(t + WINDOW, t[-1])) - middle
    turn = np.arctan2(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0], (first * second).sum(axis=1))
    turn = np.abs(np.where((t - WINDOW < t[0]) | (t + WINDOW > t[-1]), 0.0, turn))
    surface = _is_surface(middle, kind)
    chord = curve(np.minimum(t + CHORD, t[-1])) - curve(np.maximum(t - CHORD, t[0]))
    touched = surface & _can_touch(middle, np.arctan2(chord[:, 1], chord[:, 0]), kind)
    for part, is_refused in ((touched, not stated.allow_kinks), (surface & ~touched, False)):
        sharp = np.where(part, turn, 0.0)
        worst = int(np.argmax(sharp))
        if sharp[worst] <= LARGEST_TURN:
            continue
        y, z = middle[worst]
        kink = (
            f"{listed.where}: line {lines[worst]}: a kink of {np.degrees(sharp[worst]):.0f} deg within {WINDOW:g} mm at"
            f" y = {y:.2f} mm, z = {z:.2f} mm"
        )
        if is_refused:
            raise InputError(
                f"{kink}; a smooth surface, rounder than R5, expected: state a larger smoothing, or allow_kinks = true"
            )
        where = "kinks are allowed" if part is touched else "wheel and rail do not touch there"
        warnings.warn(f"{kink}; {where}", InputNote, stacklevel=2)


def _is_surface(points: Reals, kind: Kind) -> NDArray[np.bool_]:
    """Points of the running surface or next to it, shape (n,)."""
    y, z = points.T
    if kind == "rail":
        return np.asarray(z < z.min() + HEAD_DEPTH)
    tip = flange_tip(z)
    if tip is None:
        return np.ones(y.size, dtype=np.bool_)
    tape_circle = y[tip] + 55.0  # near enough for the rim
    return np.asarray((y > y[tip] + 2.0) & (y < tape_circle + FIELD_SIDE))


def _can_touch(points: Reals, inclination: Reals, kind: Kind) -> NDArray[np.bool_]:
    """Points where wheel and rail can touch, shape (n,).

    On a wheel all but the flange beyond the steepest place of its flank, on a rail all but the steep outer side.
    """
    index = np.arange(len(points))
    if kind == "rail":
        top = int(np.argmin(points[:, 1]))
        steep = np.flatnonzero((index > top) & (inclination > FIELD_INCLINATION))
        return np.asarray(index < (steep[0] if steep.size else len(points)))
    tip = flange_tip(points[:, 1])
    if tip is None:
        return np.ones(index.size, dtype=np.bool_)
    flank = np.abs(inclination[tip:])
    # the flank is the steepest part between tip and tread; beyond 90 deg the list turns back at the flange's back
    return np.asarray(index > tip + int(np.argmax(np.where(flank < np.pi / 2.0, flank, 0.0))))
