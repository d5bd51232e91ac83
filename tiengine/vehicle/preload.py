"""Stiffness of a train that leans: vertical preloads at displaced ends, lateral springs at one height.

The equations of :mod:`tiengine.vehicle.assembly` are those of small motions about the middle. In a curve a car body
stands centimetres to one side for as long as the curve lasts, and its weight with it: of the load that moves to the
outer wheels a third is due to this. Two things are added to the stiffness there.

A spring between a and b carries the load P of the body a above it. The load acts where a's end stands, along b's
vertical axis, as that of a spring mounted on b: with u the lateral displacement of a's end, y and phi of the bodies,
Z_a and Z_b the ends' heights (down) from the centres of gravity,

    on a   lateral P phi_b,    roll  P Z_a (phi_a - phi_b)
    on b   lateral -P phi_b,   roll  P (u - y_b) + P Z_b phi_b,

the potential of which is symmetric in the coordinates. And the ends of a lateral spring are taken at their mean height,
so that its force and reaction have no resultant moment.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["LoadedSpring", "leaning_stiffness"]


class LoadedSpring(NamedTuple):
    """Spring of an assembly.

    Attributes:
        columns: Motions of both bodies (x, y, z, roll, pitch, yaw each), shape (12,).
        rows: Elongations by them, shape (6, 12).
        level_row: Lateral elongation with both ends at their mean height, shape (12,).
        heights: Z of the ends at a and b [m].
        ky, kz: Lateral and vertical stiffness [N/m].
    """

    columns: NDArray[np.intp]
    rows: NDArray[np.float64]
    level_row: NDArray[np.float64]
    heights: tuple[float, float]
    ky: float
    kz: float


def leaning_stiffness(springs: list[LoadedSpring], u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Change of the stiffness matrix.

    Args:
        springs: Springs.
        u: Motions under the weight, from the unloaded springs, shape (size,) [m, rad].

    Returns:
        Shape (size, size).
    """
    change = np.zeros((len(u), len(u)))
    for spring in springs:
        own = np.ix_(spring.columns, spring.columns)
        lateral = spring.rows[1]
        change[own] += spring.ky * (np.outer(spring.level_row, spring.level_row) - np.outer(lateral, lateral))
        load = spring.kz * float(spring.rows[2] @ u[spring.columns])  # positive: it carries a
        change[own] += load * _geometric(lateral, *spring.heights)
    return change


def _geometric(lateral: NDArray[np.float64], Z_a: float, Z_b: float) -> NDArray[np.float64]:
    """Stiffness per load over (x, y, z, roll, pitch, yaw) of a, then of b, shape (12, 12)."""
    y_b, roll_a, roll_b = 7, 3, 9
    u = np.where(np.arange(12) < 6, lateral, 0.0)  # a's end
    u[y_b] -= 1.0
    K = np.zeros((12, 12))
    K[roll_a, roll_a] -= Z_a
    K[roll_b] -= u
    K[:, roll_b] -= u
    K[roll_b, roll_b] -= Z_b
    return K
