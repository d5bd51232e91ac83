"""Convergence of the answers of a study with the number of its trains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.study.percentiles import percentiles

__all__ = ["Course", "course"]

SEED = 1
RESAMPLES = 200  # a figure needs fewer than a table
LEAST = 8  # trains of the first estimate


@dataclass(frozen=True, eq=False)
class Course:
    """Estimate from growing numbers of trains.

    Attributes:
        counts: Numbers of trains, shape (n,).
        value: Estimates, shape (n,).
        low, high: Intervals, shape (n,).
    """

    counts: Reals
    value: Reals
    low: Reals
    high: Reals


def course(values: Reals, percent: float) -> Course:
    """Estimate a percentile from the first trains of a random order, twice as many every time.

    Args:
        values: Values of a figure, shape (trains,).
        percent: Share below the percentile [%].
    """
    mixed = np.random.default_rng(SEED).permutation(values)
    counts = [count for count in (LEAST << i for i in range(40)) if count < len(values)] + [len(values)]
    found = [percentiles(mixed[:count], [percent], RESAMPLES)[0] for count in counts]
    value, low, high = np.array([(each.value, each.low, each.high) for each in found]).T
    return Course(np.array(counts, np.float64), value, low, high)
