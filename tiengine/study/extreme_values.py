"""Extreme-value law of block maxima: the largest value of every train, a train being a block.

The largest of many weakly dependent values follows a generalised extreme-value law; Gumbel's is the one with shape zero
(Coles, An Introduction to Statistical Modeling of Extreme Values, 2001, chapter 3). Its level exceeded by one train in
T is the quantile 1 - 1/T.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.study.percentiles import CONFIDENCE

__all__ = ["ExtremeLaw", "Level", "fit_extremes"]

LEAST = 10  # blocks for a fit
RESAMPLES = 100
SEED = 1
SIGNIFICANT = 3.841  # 95 % of chi-squared with one degree of freedom: twice the gain in log-likelihood of a shape


@dataclass(frozen=True)
class Level:
    """Level that one train in many exceeds.

    Attributes:
        trains: Number of trains, one of which exceeds it.
        value: Estimate.
        low, high: Interval by the parametric bootstrap.
    """

    trains: float
    value: float
    low: float
    high: float


@dataclass(frozen=True)
class ExtremeLaw:
    """Law of the largest values, or of the smallest ones with their sign reversed.

    Attributes:
        law: ``"gumbel"`` or ``"gev"``.
        shape: Shape xi; positive for heavy tails, zero for Gumbel's law.
        location, scale: Parameters in the unit of the values.
        smallest: Whether smallest values are described.
        blocks: Number of blocks.
        resampled: Shape, location and scale of the bootstrap's samples, shape (resamples, 3).
    """

    law: Literal["gumbel", "gev"]
    shape: float
    location: float
    scale: float
    smallest: bool
    blocks: int
    resampled: Reals

    def levels(self, trains: Sequence[float]) -> list[Level]:
        """Levels that one train in many exceeds.

        Args:
            trains: Numbers of trains, each above 1.
        """
        found = []
        for count in trains:
            value = self._quantile(1.0 - 1.0 / count, np.array([[self.shape, self.location, self.scale]]))[0]
            many = self._quantile(1.0 - 1.0 / count, self.resampled)
            low, high = np.quantile(many, (0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE))
            found.append(Level(float(count), float(value), float(low), float(high)))
        return found

    def _quantile(self, probability: float, parameters: Reals) -> Reals:
        """Quantile for parameters of shape (n, 3); shape (n,)."""
        xi, location, scale = parameters.T
        reduced = -np.log(-np.log(probability))
        gentle = np.abs(xi) < 1e-9
        bent = np.expm1(np.where(gentle, 1.0, xi) * reduced) / np.where(gentle, 1.0, xi)
        level: Reals = location + scale * np.where(gentle, reduced, bent)
        return -level if self.smallest else level


def fit_extremes(
    values: Reals, law: Literal["auto", "gumbel", "gev"] = "auto", *, smallest: bool = False, resamples: int = RESAMPLES
) -> ExtremeLaw:
    """Fit a law to the extreme values of the blocks by maximum likelihood.

    Args:
        values: One extreme value a block, shape (blocks,).
        law: ``"gumbel"``, ``"gev"``; ``"auto"`` takes Gumbel's unless a shape raises the likelihood significantly.
        smallest: Whether values are smallest ones.
        resamples: Samples of the parametric bootstrap.

    Raises:
        InputError: There are fewer than ten blocks, or all are equal.
    """
    from scipy import stats

    if len(values) < LEAST or np.ptp(values) == 0.0:
        raise InputError(f"extreme values: {len(values)} blocks; must be at least {LEAST} that differ")
    signed = -values if smallest else values
    chosen = law if law != "auto" else _better(signed)
    fitted = _fit(signed, chosen)
    generator = np.random.default_rng(SEED)
    distribution: Any = stats.genextreme(-fitted[0], fitted[1], fitted[2])  # scipy's shape has the other sign
    drawn = distribution.rvs((resamples, len(values)), random_state=generator)
    resampled = np.array([_fit(sample, chosen) for sample in drawn])
    shape, location, scale = fitted
    return ExtremeLaw(chosen, shape, location, scale, smallest, len(values), resampled)


def _fit(values: Reals, law: str) -> tuple[float, float, float]:
    """Shape, location and scale of the greatest likelihood."""
    from scipy import stats

    location, scale = stats.gumbel_r.fit(values)
    if law == "gumbel":
        return 0.0, float(location), float(scale)
    bend = max(min(float(stats.skew(values)) - 1.14, 1.0), -1.0) / 5.0  # Gumbel's law has a skewness of 1.14
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the search leaves the support for a while
        shape, location, scale = stats.genextreme.fit(values, -bend, loc=location, scale=scale)
    return -float(shape), float(location), float(scale)


def _better(values: Reals) -> Literal["gumbel", "gev"]:
    """Law by the likelihood ratio."""
    from scipy import stats

    _, location, scale = _fit(values, "gumbel")
    shape, at, wide = _fit(values, "gev")
    gain = (
        stats.genextreme.logpdf(values, -shape, at, wide).sum() - stats.gumbel_r.logpdf(values, location, scale).sum()
    )
    return "gev" if 2.0 * gain > SIGNIFICANT else "gumbel"
