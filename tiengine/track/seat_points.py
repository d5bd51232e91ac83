"""Points that stand for a seat with a length along the rail (MODEL §1a).

A fastening presses on the rail over its length L, evenly. The mean over L of a trial function and of its slope is taken
at five Gauss points, the same for what the rail does at the seat and for how the seat's force is spread over the rail,
so that action and reaction, and energy, agree. L = 0 is a point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["GAUSS_POINTS", "mean_cosine", "seat_points"]

GAUSS_POINTS = 5


def seat_points(length: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Offsets from the seat's middle and weights, which sum to one.

    Args:
        length: L [m], 0 for a point.

    Returns:
        Offsets [m] and weights [-], shape (5,) each, or (1,) for a point.
    """
    if length == 0.0:
        return np.zeros(1), np.ones(1)
    node, weight = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    node = 0.5 * (node - node[::-1])  # symmetric to the last bit
    return 0.5 * length * node, 0.5 * weight


def mean_cosine(wave_number: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Factor by which the mean over a seat of length L [m] reduces a wave, sin or cos, of a wave number k [1/m].

    The points are symmetric about the seat's middle: the mean of sin k(s + xi) is sin ks times the mean of cos k xi.
    """
    offset, weight = seat_points(length)
    mean: NDArray[np.float64] = np.cos(np.multiply.outer(wave_number, offset)) @ weight
    return mean
