"""Points of factors that are drawn: Latin hypercube, Sobol', Halton or random points, through each distribution."""

from __future__ import annotations

from typing import Any

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.study.plan import Factor, Sample

__all__ = ["drawn_values", "unit_points"]


def unit_points(sample: Sample, factors: int) -> Reals:
    """Points in the unit cube.

    Args:
        sample: Method, size and seed.
        factors: Number of factors.

    Returns:
        Points, shape (points, factors). For ``saltelli`` blocks of ``factors + 2`` rows: a point of the first matrix,
        this point with one coordinate after the other from the second matrix, the point of the second matrix
        (Saltelli et al., Computer Physics Communications 181 (2010) 259).
    """
    from scipy.stats import qmc

    generator = np.random.default_rng(sample.seed)
    match sample.method:
        case "latin_hypercube":
            return np.asarray(qmc.LatinHypercube(factors, seed=generator).random(sample.size))
        case "halton":
            return np.asarray(qmc.Halton(factors, seed=generator).random(sample.size))
        case "random":
            return generator.random((sample.size, factors))
        case "sobol":
            return np.asarray(qmc.Sobol(factors, seed=generator).random(sample.size))
    both = np.asarray(qmc.Sobol(2 * factors, seed=generator).random(sample.size))
    first, second = both[:, :factors], both[:, factors:]
    rows = np.repeat(first[:, None, :], factors + 2, axis=1)
    rows[:, np.arange(1, factors + 1), np.arange(factors)] = second
    rows[:, -1] = second
    return rows.reshape(-1, factors)


def drawn_values(factor: Factor, points: Reals) -> list[Any]:
    """Values of one factor at points of the unit interval.

    Args:
        factor: Has a range or a distribution.
        points: Points between 0 and 1, shape (points,).

    Returns:
        Values, whole numbers if the factor is stated to be.

    Raises:
        InputError: There is no such distribution, its parameters do not fit it, or it reaches infinity.
    """
    if factor.range is not None:
        low, high = factor.range
        found = low + (high - low) * points
    else:
        found = _quantiles(factor, points)
    if not np.isfinite(found).all():
        raise InputError(f"factor {factor.title!r}: its distribution gives values that are not finite")
    return [int(value) for value in np.rint(found)] if factor.whole else [float(value) for value in found]


def _quantiles(factor: Factor, points: Reals) -> Reals:
    """Quantiles of a distribution of scipy.stats."""
    from scipy import stats

    name = str(factor.distribution)
    known = [each for each in dir(stats) if isinstance(getattr(stats, each), stats.rv_continuous)]
    if name not in known:
        raise InputError(f"factor {factor.title!r}: distribution = {name!r}: unknown{nearest(name, known)}")
    inner = np.clip(points, 1e-12, 1.0 - 1e-12)  # a Sobol' point may be exactly 0
    try:
        return np.asarray(getattr(stats, name)(**factor.parameters).ppf(inner), np.float64)
    except TypeError as error:
        needed = getattr(stats, name).shapes or "loc, scale"
        raise InputError(
            f"factor {factor.title!r}: parameters = {dict(factor.parameters)}: must be loc, scale and those of"
            f" {name} ({needed}) ({error})"
        ) from None
