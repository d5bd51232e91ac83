"""Functions that are cubic between breaks and mostly zero: the table that host and kernels read (MODEL §1a).

On piece p, from breaks[p] to breaks[p + 1], the functions first[p] .. first[p] + width - 1 may differ from zero:

    f_{first + q}(s) = c_0 + c_1 x + c_2 x^2 + c_3 x^3,   x = s - breaks[p],   c = coefficients[p, q]

The mean over a seat's points is a table of the same form, with more breaks and a piece or two more in width, so that a
seat with a length costs no more to evaluate than a point.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

__all__ = ["Lookup", "Pieces"]

POWERS = 4
SLIVER = 1e-9  # m: breaks as close are one; the functions are C2, so that they change by its cube


@dataclass(frozen=True, eq=False)
class Lookup:
    """From a place to its piece p = start[int((s - breaks[0]) / cell)], then on while s >= breaks[p + 1].

    Attributes:
        cell: Length of a cell [m].
        start: Piece at the rear end of every cell, shape (cells,).
        advances: Most steps on that it takes.
    """

    cell: float
    start: NDArray[np.int32]
    advances: int


@dataclass(frozen=True, eq=False)
class Pieces:
    """Piecewise cubics.

    Attributes:
        breaks: Ascending places [m], shape (pieces + 1,).
        first: First function of every piece, shape (pieces,).
        coefficients: Of 1, x, x^2, x^3 [1/m^power], shape (pieces, width, 4).
    """

    breaks: NDArray[np.float64]
    first: NDArray[np.int32]
    coefficients: NDArray[np.float64]

    @property
    def width(self) -> int:
        """Functions on a piece."""
        return int(self.coefficients.shape[1])

    def locate(self, s: NDArray[np.float64]) -> NDArray[np.int64]:
        """Piece of every place, that ahead of a break; the last one at the front end."""
        found: NDArray[np.int64] = np.searchsorted(self.breaks, s, side="right") - 1
        return np.clip(found, 0, len(self.first) - 1)

    def weights(self, s: NDArray[np.float64], derivative: int = 0) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Functions that touch places, and their values there.

        Args:
            s: Places [m], shape (...).
            derivative: Order of the derivative by s.

        Returns:
            First function, shape (...), and values or derivatives, shape (..., width); zero beyond the ends.
        """
        s = np.asarray(s, dtype=np.float64)
        piece = self.locate(s)
        powers = _monomials(s - self.breaks[piece], derivative)
        inside = (s >= self.breaks[0]) & (s <= self.breaks[-1])
        values = np.einsum("...qp,...p->...q", self.coefficients[piece], powers)
        return self.first[piece], np.where(inside[..., None], values, 0.0)

    def dense(self, s: NDArray[np.float64], count: int, derivative: int = 0) -> NDArray[np.float64]:
        """Values of all ``count`` functions at places s [m], shape (k, count)."""
        first, values = self.weights(s, derivative)
        out = np.zeros((len(s), count))
        np.put_along_axis(out, first[:, None] + np.arange(self.width), values, axis=1)
        return out

    def mean(self, offset: NDArray[np.float64], weight: NDArray[np.float64], count: int) -> Pieces:
        """Weighted mean over points around a place, as pieces over that place.

        Points beyond the ends count as zero; the table reaches as far out as one of them is still inside.

        Args:
            offset: Points from the place [m], on both sides of it, shape (g,).
            weight: Their weights, shape (g,).
            count: Functions in all.
        """
        low, high = self.breaks[0], self.breaks[-1]
        edges = np.unique(np.subtract.outer(self.breaks, offset))
        edges = edges[np.append(True, np.diff(edges) > SLIVER)]
        at = 0.5 * (edges[1:] + edges[:-1])[:, None] + offset
        piece, inside = self.locate(at), (at > low) & (at < high)
        start = self.first[piece]
        least = np.where(inside, start, count).min(axis=1)
        width = int(np.where(inside, start - least[:, None], 0).max()) + self.width
        least = np.minimum(least, count - width)
        out = np.zeros((len(at), width, POWERS))
        rows = np.arange(len(at))[:, None]
        for g in range(len(offset)):
            shift = edges[:-1] + offset[g] - self.breaks[piece[:, g]]
            shifted = _shifted(self.coefficients[piece[:, g]], shift) * (weight[g] * inside[:, g])[:, None, None]
            column = np.where(inside[:, g], start[:, g] - least, 0)[:, None] + np.arange(self.width)
            out[rows, column] += shifted
        return Pieces(edges, least.astype(np.int32), out)

    def lookup(self, cell: float) -> Lookup:
        """Uniform table of about a cell's length [m]; whole cells from end to end."""
        length = float(self.breaks[-1] - self.breaks[0])
        cells = int(np.ceil(length / cell - 1e-9))
        edges = self.breaks[0] + length / cells * np.arange(cells + 1)
        # a cell's edge is moved out by a rounding, since int(s / cell) may round a place into the neighbouring cell
        start = self.locate(edges[:-1] - 1e-12 * length)
        last = self.locate(edges[1:] + 1e-12 * length)
        return Lookup(length / cells, start.astype(np.int32), int((last - start).max()))


def _monomials(x: NDArray[np.float64], derivative: int) -> NDArray[np.float64]:
    """Derivatives of 1, x, x^2, x^3, shape (..., 4)."""
    powers = np.zeros((*x.shape, POWERS))
    for p in range(derivative, POWERS):
        factor = np.prod(np.arange(p - derivative + 1, p + 1), initial=1.0)
        powers[..., p] = factor * x ** (p - derivative)
    return powers


def _shifted(c: NDArray[np.float64], shift: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients, shape (k, width, 4), of the same cubics over x - shift, shape (k,)."""
    out = np.zeros_like(c)
    for low in range(POWERS):
        for high in range(low, POWERS):
            out[..., low] += comb(high, low) * c[..., high] * (shift ** (high - low))[:, None]
    return out
