"""Seats that press on a rectangle of the slab, that of the baseplate (MODEL §15).

The fastening's force presses on a rectangle of length L along and width B across the track, evenly, and its couple by
a pressure that is linear across it, 12 M y / (L B^3). With the slab's motion at the seat taken as

    w = (1/LB) int w dA,        dw/dy = 12/(L B^3) int y w dA

action and reaction, and energy, agree. A rectangle without sides is a point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiengine.track.plate_shapes import WY, W, shapes_at
from tiengine.track.slab import Slab

__all__ = ["seat_rows"]

GAUSS = 4  # points per direction and element: shapes are cubic, times y makes degree 4, and four points integrate 7


def seat_rows(
    slab: Slab, x: NDArray[np.float64], y: NDArray[np.float64], rectangle: tuple[float, float]
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
    """Rows that give the slab's deflection and slope at seats.

    Args:
        slab: The slab with its mesh, n plate DOFs.
        x: Seats from its centre, forward [m], shape (k,).
        y: Seats from its centre line, to the right [m], shape (k,).
        rectangle: Length along and width across the track [m], :data:`POINT` for none.

    Returns:
        DOFs that a seat touches, the same number for all, shape (k, touched); shapes of w and of dw/dy on them, shape
        (k, touched) each.
    """
    rows = np.stack([_rows_of_one(slab, float(a), float(b), *rectangle) for a, b in zip(x, y, strict=True)])
    used = np.any(rows != 0.0, axis=1)
    touched = int(used.sum(axis=1).max())
    # those in use first; seats that touch fewer elements take on DOFs whose shapes are zero
    index = np.sort(np.argsort(~used, axis=1, kind="stable")[:, :touched], axis=1).astype(np.int32)
    deflection, slope = (np.take_along_axis(rows[:, kind], index, axis=1) for kind in range(2))
    return index, deflection, slope


def _rows_of_one(slab: Slab, x: float, y: float, length: float, width: float) -> NDArray[np.float64]:
    """Deflection and slope of one seat by the plate's DOFs, shape (2, n)."""
    along, along_weight = _points(x, length, slab.length, slab.elements_x)
    across, across_weight = _points(y, width, slab.width, slab.elements_y)
    X, Y = (part.ravel() for part in np.meshgrid(along, across, indexing="ij"))
    weight = np.outer(along_weight, across_weight).ravel()
    index, table = shapes_at(slab, X, Y)
    mean = weight[:, None] * table[:, W]
    turn = weight[:, None] * table[:, WY] if width == 0.0 else (12.0 / width**2 * (Y - y))[:, None] * mean
    return np.stack([np.bincount(index.ravel(), part.ravel(), slab.plate_dofs) for part in (mean, turn)])


def _points(middle: float, side: float, size: float, elements: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss points and weights, which sum to one, of a stretch of a row of elements; it is cut at their edges.

    Args:
        middle: Of the stretch, from the centre of the row [m].
        side: Its length [m].
        size: Length of the row [m].
        elements: Elements in it.
    """
    if side == 0.0:
        return np.array([middle]), np.ones(1)
    edges = size * (np.arange(elements + 1) / elements - 0.5)
    first, last = middle - side / 2.0, middle + side / 2.0
    cuts = np.concatenate([[first], edges[(edges > first) & (edges < last)], [last]])
    node, weight = np.polynomial.legendre.leggauss(GAUSS)
    half = np.diff(cuts)[:, None] / 2.0
    return ((cuts[:-1, None] + half) + half * node).ravel(), (half * weight).ravel() / side
