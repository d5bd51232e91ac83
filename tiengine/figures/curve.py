"""Curves of any length in bounded memory: short ones as they are, long ones as least and largest value per pixel."""

from __future__ import annotations

import numpy as np

from tiengine.parameters.arrays import Reals

__all__ = ["BINS", "Band", "Curve", "bins_for"]

BINS = 1600
"""Bins along a figure's width: a fifteenth of a millimetre each in print."""


def bins_for(samples: int) -> int:
    """Bins of a band over so many samples: half a figure's, and fewer where some would stay empty."""
    return int(np.clip(samples // 4, 1, BINS // 2))


class Band:
    """Least and largest of many values in every bin of an abscissa.

    Attributes:
        x: Middle of each bin, shape (bins,).
        low: Least value in it, NaN where there is none, shape (bins,).
        high: Largest.
    """

    def __init__(self, begin: float, end: float, bins: int = BINS) -> None:
        """Divide an abscissa.

        Args:
            begin: Where the first bin begins.
            end: Where the last ends.
            bins: How many.
        """
        self._begin, self._width = begin, max(end - begin, 1e-12) / bins
        self.x: Reals = begin + self._width * (np.arange(bins, dtype=np.float64) + 0.5)
        self.low, self.high = np.full(bins, np.nan), np.full(bins, np.nan)

    def add(self, x: Reals, values: Reals) -> None:
        """Take values into account.

        Args:
            x: Where they are, not falling, shape (n,).
            values: One or several at each place, shape (n,) or (n, k).
        """
        if not len(x):
            return
        values = values.reshape(len(x), -1)
        place = np.clip(((x - self._begin) / self._width).astype(np.intp), 0, len(self.x) - 1)
        first = np.flatnonzero(np.diff(place, prepend=-1))
        bins = place[first]
        low, high = np.fmin.reduceat(values.min(axis=1), first), np.fmax.reduceat(values.max(axis=1), first)
        self.low[bins] = np.fmin(self.low[bins], low)
        self.high[bins] = np.fmax(self.high[bins], high)


class Curve:
    """One curve, given piece by piece."""

    def __init__(self, begin: float, end: float, bins: int = BINS) -> None:
        """Prepare for an abscissa from ``begin`` to ``end``; beyond two samples a bin the curve is thinned."""
        self._pieces: list[tuple[Reals, Reals]] = []
        self._count = 0
        self._band = Band(begin, end, bins)

    def add(self, x: Reals, y: Reals) -> None:
        """Go on with samples.

        Args:
            x: Not falling, nor below what was added before, shape (n,).
            y: Shape (n,).
        """
        self._count += len(x)
        self._pieces.append((x, y))
        if self.is_thinned:
            for piece in self._pieces:
                self._band.add(*piece)
            self._pieces = []

    @property
    def is_thinned(self) -> bool:
        """Whether single samples are no longer kept."""
        return self._count > 2 * len(self._band.x)

    @property
    def line(self) -> tuple[Reals, Reals]:
        """Abscissa and ordinate to draw: every sample, or the least and the largest of every bin in turn."""
        if not self.is_thinned:
            pieces = self._pieces or [(np.empty(0), np.empty(0))]
            return np.concatenate([x for x, _ in pieces]), np.concatenate([y for _, y in pieces])
        filled = ~np.isnan(self._band.low)
        x = np.repeat(self._band.x[filled], 2)
        return x, np.stack([self._band.low, self._band.high], axis=1)[filled].ravel()
