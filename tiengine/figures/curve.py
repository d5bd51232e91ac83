"""Curves of any length in bounded memory: short ones sample by sample, long ones as least and largest value per bin."""

from __future__ import annotations

import numpy as np

from tiengine.parameters.arrays import Reals

__all__ = ["BINS", "Band", "Curve", "bins_for"]

BINS = 1600
"""Bins along a figure's width, 0.1 mm each in print."""


def bins_for(samples: int) -> int:
    """Number of bins for a band over a number of samples: half of ``BINS``, fewer where bins would stay empty."""
    return int(np.clip(samples // 4, 1, BINS // 2))


class Band:
    """Least and largest of many values in every bin of an abscissa.

    Attributes:
        x: Middle of each bin, shape (bins,).
        low: Least value in each bin, NaN where there is none, shape (bins,).
        high: Largest value in each bin, likewise, shape (bins,).
    """

    def __init__(self, begin: float, end: float, bins: int = BINS) -> None:
        """Divide an abscissa into bins.

        Args:
            begin: Lower edge of the first bin.
            end: Upper edge of the last bin.
            bins: Number of bins.
        """
        self._begin, self._width = begin, max(end - begin, 1e-12) / bins
        self.x: Reals = begin + self._width * (np.arange(bins, dtype=np.float64) + 0.5)
        self.low, self.high = np.full(bins, np.nan), np.full(bins, np.nan)

    def add(self, x: Reals, values: Reals) -> None:
        """Add values.

        Args:
            x: Abscissae, in ascending order, shape (n,).
            values: One or several values at each abscissa, shape (n,) or (n, k).
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
    """One curve, built up slice by slice."""

    def __init__(self, begin: float, end: float, bins: int = BINS) -> None:
        """Prepare for an abscissa from ``begin`` to ``end``; beyond two samples per bin the curve is thinned."""
        self._pieces: list[tuple[Reals, Reals]] = []
        self._count = 0
        self._band = Band(begin, end, bins)

    def add(self, x: Reals, y: Reals) -> None:
        """Append samples.

        Args:
            x: Abscissae, in ascending order and not below those added before, shape (n,).
            y: Ordinates, shape (n,).
        """
        self._count += len(x)
        self._pieces.append((x, y))
        if self.is_thinned:
            for piece in self._pieces:
                self._band.add(*piece)
            self._pieces = []

    @property
    def is_thinned(self) -> bool:
        """Whether the curve holds extremes per bin instead of single samples."""
        return self._count > 2 * len(self._band.x)

    @property
    def line(self) -> tuple[Reals, Reals]:
        """Abscissae and ordinates to draw: every sample, or the least and the largest value of each bin in turn."""
        if not self.is_thinned:
            pieces = self._pieces or [(np.empty(0), np.empty(0))]
            return np.concatenate([x for x, _ in pieces]), np.concatenate([y for _, y in pieces])
        filled = ~np.isnan(self._band.low)
        x = np.repeat(self._band.x[filled], 2)
        return x, np.stack([self._band.low, self._band.high], axis=1)[filled].ravel()
