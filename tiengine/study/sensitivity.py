"""Influence of the factors of a study on a key figure: swings of its mean, and Sobol' indices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.optional_packages import needed_by
from tiengine.study.plan import Plan
from tiengine.study.table import Table

__all__ = ["SobolIndex", "Swing", "sobol_indices", "swings"]

BINS = 5  # of a factor that takes many values
RESAMPLES = 200
LEAST_BLOCKS = 8
SEED = 1


@dataclass(frozen=True)
class Swing:
    """Range over which the mean of a figure moves with one factor, all others as they come.

    Attributes:
        factor: Name of the factor.
        low, high: Smallest and largest mean among the values, or fifths, of the factor.
        at_low, at_high: Values, or ends of the fifths, where they occur.
        correlation: Spearman's rank correlation; NaN where values are no numbers.
    """

    factor: str
    low: float
    high: float
    at_low: str
    at_high: str
    correlation: float


@dataclass(frozen=True)
class SobolIndex:
    """Sobol' indices of one factor.

    Attributes:
        factor: Name of the factor.
        first: Share of the variance that the factor explains alone.
        first_error: Half the width of its interval.
        total: Share in which the factor takes part.
        total_error: Half the width of its interval.
    """

    factor: str
    first: float
    first_error: float
    total: float
    total_error: float


def swings(table: Table, figure: str) -> list[Swing]:
    """Swings of a figure, the widest first.

    Args:
        table: Table of a study.
        figure: Name of a key figure.
    """
    used = table.complete & np.isfinite(table[figure])
    values = table[figure][used]
    found = [_swing(name, table[name][used], values) for name in table.factors]
    return sorted((each for each in found if each is not None), key=lambda each: each.low - each.high)


def _swing(name: str, factor: NDArray[Any], values: Reals) -> Swing | None:
    """Swing with one factor; None if it does not vary."""
    is_number = factor.dtype.kind in "fiu"
    different = np.unique(factor if is_number else factor.astype(str))
    if len(different) < 2:
        return None
    if is_number and len(different) > 2 * BINS:
        edges = np.quantile(factor, np.linspace(0.0, 1.0, BINS + 1))
        place = np.clip(np.searchsorted(edges, factor, side="right") - 1, 0, BINS - 1)
        words = [f"{edges[i]:.4g} to {edges[i + 1]:.4g}" for i in range(BINS)]
    else:
        place = np.searchsorted(different, factor if is_number else factor.astype(str))
        words = [f"{value:.6g}" if is_number else str(value) for value in different]
    kept = [i for i in range(len(words)) if (place == i).any()]
    means = [float(values[place == i].mean()) for i in kept]
    low, high = int(np.argmin(means)), int(np.argmax(means))
    correlation = _rank_correlation(factor.astype(np.float64), values) if is_number else float("nan")
    return Swing(name, means[low], means[high], words[kept[low]], words[kept[high]], correlation)


def _rank_correlation(x: Reals, y: Reals) -> float:
    from scipy import stats

    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return float("nan")
    return float(stats.spearmanr(x, y).statistic)


def sobol_indices(plan: Plan, table: Table, figure: str, blocks: int | None = None) -> list[SobolIndex]:
    """First-order and total indices from the design ``saltelli``; trains of a point are averaged over their seeds.

    Args:
        plan: Plan of the study.
        table: Its table.
        figure: Name of a key figure.
        blocks: Number of blocks of the design that are used; all if None.

    Raises:
        InputError: The study has another design, too few blocks are complete, or SALib is missing.
    """
    if plan.sample is None or plan.sample.method != "saltelli":
        raise InputError("Sobol' indices: need sample.method = 'saltelli' in the plan")
    with needed_by("Sobol' indices"):
        from SALib.analyze import sobol
    names = [factor.title for factor in plan.factors]
    width = len(names) + 2
    rows = _of_points(table, figure, plan.sample.size * width).reshape(-1, width)[:blocks]
    rows = rows[np.isfinite(rows).all(axis=1)]  # a block with a failed train tells nothing
    if len(rows) < LEAST_BLOCKS:
        raise InputError(f"Sobol' indices of {figure}: {len(rows)} complete blocks; must be at least {LEAST_BLOCKS}")
    if np.ptp(rows) == 0.0:
        return [SobolIndex(name, 0.0, 0.0, 0.0, 0.0) for name in names]
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    found = sobol.analyze(
        problem, rows.reshape(-1), calc_second_order=False, num_resamples=RESAMPLES, print_to_console=False, seed=SEED
    )
    columns: Sequence[Reals] = [found[key] for key in ("S1", "S1_conf", "ST", "ST_conf")]
    return [SobolIndex(name, *(float(column[i]) for column in columns)) for i, name in enumerate(names)]


def _of_points(table: Table, figure: str, points: int) -> Reals:
    """Mean of a figure over the trains of every point, NaN where one is missing; shape (points,)."""
    total, count = np.zeros(points), np.zeros(points)
    values = np.where(table.complete, table[figure], np.nan)
    np.add.at(total, table["point"], values)
    np.add.at(count, table["point"], 1.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(total / count)
