r"""A linear structure at rest on springs that only push, by Newton's method.

The energy is convex, its gradient piecewise linear:

    E = q^T K q / 2 - f^T q + sum k max(0, R q - o)^2 / 2

Newton's step takes the springs that push at the last iterate as linear. Along it the slope of E is a rising function
with kinks, whose root is found by bisection where the whole step overshoots; every step then lowers E.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["PushingSprings", "at_rest"]

NEWTON = 200
BALANCED = 1e-8  # of the largest load
HALVINGS = 40


@dataclass(frozen=True, eq=False)
class PushingSprings:
    """Springs that push once they are compressed by more than a gap.

    Attributes:
        rows: Coordinates of the structure to the compression of each spring, shape (m, n).
        stiffness: k [N/m], shape (m,).
        gap: o [m], shape (m,).
    """

    rows: sp.csr_array
    stiffness: Reals
    gap: Reals


def at_rest(K: sp.csc_array, load: Reals, springs: PushingSprings) -> Reals:
    """Coordinates of the structure at rest, shape (n,).

    Args:
        K: Stiffness of the structure without the springs; regular, symmetric, shape (n, n).
        load: f, shape (n,).
        springs: The springs.

    Raises:
        InputError: Forces stay out of balance.
    """
    R, k, o = springs.rows, springs.stiffness, springs.gap
    q, compression = np.zeros(len(load)), np.ones(len(k))  # all push at first
    tolerance, left = BALANCED * max(float(np.abs(load).max()), 1.0), np.inf
    for _ in range(NEWTON):
        pushing = np.where(compression > 0.0, k, 0.0)
        tangent = sp.csc_array(K + R.T @ sp.diags_array(pushing) @ R)
        try:
            step: Reals = splu(tangent).solve(load + R.T @ (pushing * o)) - q
        except RuntimeError:
            raise InputError("track: a slab rests on nothing; fastenings or a part of its bed must hold it") from None
        slope = _Slope(float(step @ (K @ q - load)), float(step @ (K @ step)), k, R @ q - o, R @ step)
        q = q + slope.root() * step
        compression = R @ q - o
        left = float(np.abs(K @ q - load + R.T @ (k * np.maximum(compression, 0.0))).max())
        if left < tolerance:
            return q
    raise InputError(f"track: no state of rest found on a bed without tension (forces out of balance by {left:.3g} N)")


@dataclass(frozen=True, eq=False)
class _Slope:
    """Slope of the energy along a step, over the share t of the step.

    Attributes:
        first, rise: Of the structure: first + rise t [J].
        stiffness, compression, change: Of the springs, at the step's begin and along it, shape (m,) each.
    """

    first: float
    rise: float
    stiffness: Reals
    compression: Reals
    change: Reals

    def __call__(self, t: float) -> float:
        pushed = np.maximum(self.compression + t * self.change, 0.0)
        return self.first + self.rise * t + float(np.sum(self.stiffness * pushed * self.change))

    def root(self) -> float:
        """Share at which the energy is least, at most the whole step."""
        if self(1.0) <= 0.0:
            return 1.0
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self(middle) < 0.0 else (low, middle)
        return high
