"""Shape functions of the plate elements at any point of a slab.

Coordinates are measured from the slab's centre, x forward, y to the right. DOFs as in :mod:`tiengine.track.slab`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiengine.kernels import plate
from tiengine.track.slab import Slab

__all__ = ["WX", "WXX", "WXY", "WY", "WYY", "W", "element_dofs", "locate", "shapes_at", "tabulate_shapes"]

W, WX, WY, WXX, WYY, WXY = range(6)
"""Rows of a shape table: deflection and its derivatives by x and y."""


def tabulate_shapes(slab: Slab, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Tabulate shape functions and their derivatives at points of an element.

    Args:
        slab: Slab with its mesh.
        points: Local coordinates -1...1, shape (points, 2).

    Returns:
        Rows ``W``, ``WX``, ... of each of the twelve shapes, shape (points, 6, 12).
    """
    table = np.zeros((len(points), 6, 12))
    half = slab.length / (2.0 * slab.elements_x), slab.width / (2.0 * slab.elements_y)
    plate.tabulate_shapes(*half, np.ascontiguousarray(points), table)
    return table


def element_dofs(slab: Slab) -> NDArray[np.int32]:
    """Return the DOFs of every element, shape (n_el, 12)."""
    ex, ey = np.divmod(np.arange(slab.elements_x * slab.elements_y), slab.elements_y)
    corner = ex * (slab.elements_y + 1) + ey
    nodes = corner[:, None] + np.array([0, 1, slab.elements_y + 1, slab.elements_y + 2])
    dofs: NDArray[np.int32] = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 12).astype(np.int32)
    return dofs


def locate(distance: NDArray[np.float64], size: float, elements: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Find element and local coordinate (-1...1) of distances from the centre of a row of elements [m]."""
    along = (distance / size + 0.5) * elements
    element: NDArray[np.int64] = np.clip(along.astype(np.int64), 0, elements - 1)
    return element, 2.0 * (along - element) - 1.0


def shapes_at(
    slab: Slab, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Evaluate shape functions at points of a slab.

    Args:
        slab: The slab.
        x: From its centre, forward [m], shape (n,).
        y: From its centre line, to the right [m], shape (n,).

    Returns:
        DOFs of the element at every point, shape (n, 12), and rows ``W``, ``WX``, ... of its shapes there, shape
        (n, 6, 12).
    """
    ex, xi = locate(x, slab.length, slab.elements_x)
    ey, eta = locate(y, slab.width, slab.elements_y)
    index: NDArray[np.int32] = element_dofs(slab)[ex * slab.elements_y + ey]
    return index, tabulate_shapes(slab, np.stack([xi, eta], axis=1))
