"""Percentiles of a key figure over the trains of a study, with intervals by the bootstrap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tiengine.parameters.arrays import Reals

__all__ = ["CONFIDENCE", "Percentile", "percentiles"]

CONFIDENCE = 0.95
"""Level of all intervals of a study."""

RESAMPLES = 1000
SEED = 1


@dataclass(frozen=True)
class Percentile:
    """Percentile with its interval.

    Attributes:
        percent: Share of the trains below it [%].
        value: Estimate.
        low, high: Interval of the level ``CONFIDENCE``.
        reached: Whether there are enough trains for trains beyond it; otherwise it is near the largest value.
    """

    percent: float
    value: float
    low: float
    high: float
    reached: bool


def percentiles(values: Reals, percents: Sequence[float], resamples: int = RESAMPLES) -> list[Percentile]:
    """Estimate percentiles.

    Args:
        values: Values of a figure, shape (trains,).
        percents: Shares [%].
        resamples: Samples of the bootstrap, drawn with the same seed every time.

    Returns:
        Percentiles with intervals between percentiles of the resampled estimates.
    """
    generator = np.random.default_rng(SEED)
    drawn = values[generator.integers(0, len(values), (resamples, len(values)))]
    resampled = np.percentile(drawn, percents, axis=1)
    tails = 50.0 * (1.0 - CONFIDENCE), 100.0 - 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(resampled, tails, axis=1)
    found = np.percentile(values, percents)
    return [
        Percentile(percent, float(found[i]), float(low[i]), float(high[i]), _reached(percent, len(values)))
        for i, percent in enumerate(percents)
    ]


def _reached(percent: float, count: int) -> bool:
    """Whether at least one of ``count`` values is expected beyond a percentile."""
    return count * min(percent, 100.0 - percent) / 100.0 >= 1.0
