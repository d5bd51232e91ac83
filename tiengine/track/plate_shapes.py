"""Shapes of a slab's plate elements at any of its points.

Places are measured from the slab's centre, x forward, y to the right. DOFs as in :mod:`tiengine.track.slab`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiengine.kernels import plate
from tiengine.track.slab import Slab

__all__ = ["WX", "WXX", "WXY", "WY", "WYY", "W", "element_dofs", "locate", "shapes_at", "tabulate_shapes"]

W, WX, WY, WXX, WYY, WXY = range(6)
"""Rows of a table of shapes: deflection and its derivatives by x and y."""


def tabulate_shapes(slab: Slab, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shapes and their derivatives at points of an element.

    Args:
        slab: Gives the element's size.
        points: Local coordinates -1...1, shape (points, 2).

    Returns:
        Rows ``W``, ``WX``, ... of each of the twelve shapes, shape (points, 6, 12).
    """
    table = np.zeros((len(points), 6, 12))
    half = slab.length / (2.0 * slab.elements_x), slab.width / (2.0 * slab.elements_y)
    plate.tabulate_shapes(*half, np.ascontiguousarray(points), table)
    return table


def element_dofs(slab: Slab) -> NDArray[np.int32]:
    """DOFs of every element, shape (n_el, 12)."""
    ex, ey = np.divmod(np.arange(slab.elements_x * slab.elements_y), slab.elements_y)
    corner = ex * (slab.elements_y + 1) + ey
    nodes = corner[:, None] + np.array([0, 1, slab.elements_y + 1, slab.elements_y + 2])
    dofs: NDArray[np.int32] = (3 * nodes[:, :, None] + np.arange(3)).reshape(-1, 12).astype(np.int32)
    return dofs


def locate(place: NDArray[np.float64], size: float, elements: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Element and local coordinate (-1...1) of places in a row of elements, from its centre [m]."""
    along = (place / size + 0.5) * elements
    element: NDArray[np.int64] = np.clip(along.astype(np.int64), 0, elements - 1)
    return element, 2.0 * (along - element) - 1.0


def shapes_at(
    slab: Slab, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Shapes at places of a slab.

    Args:
        slab: The slab.
        x: From its centre, forward [m], shape (n,).
        y: From its centre line, to the right [m], shape (n,).

    Returns:
        DOFs of the element at every place, shape (n, 12), and rows ``W``, ``WX``, ... of its shapes there, shape
        (n, 6, 12).
    """
    ex, xi = locate(x, slab.length, slab.elements_x)
    ey, eta = locate(y, slab.width, slab.elements_y)
    index: NDArray[np.int32] = element_dofs(slab)[ex * slab.elements_y + ey]
    return index, tabulate_shapes(slab, np.stack([xi, eta], axis=1))
