"""A wheelset whose sides differ: where it rolls straight, and its conicity about there by harmonic linearisation.

With other profiles or radii left and right the rolling-radius difference Delta r(y) is not odd. A wave of amplitude A
runs about the shift y_m(A) over which the mean of Delta r(y_m + A sin t) vanishes, and its conicity is

    lambda(A) = 1/(2 pi A) int_0^2pi Delta r(y_m + A sin t) sin t dt;

y_m(0) is the shift of steady rolling, (r_L - r_R)/(2 lambda) for cones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tiengine.contact.conicity import UnequalSides, rolling_radius_difference
from tiengine.parameters.arrays import Reals

__all__ = ["rolling_shift", "unequal_conicity"]

GRID = 1e-5
"""Step of the shifts between which Delta r is taken as linear [m]."""
PHASES = 256
HALVINGS = 40


def rolling_shift(sides: UnequalSides, largest: float) -> float:
    """Find the shift to the right at which the rolling radii are equal and a larger shift makes up for more [m].

    Args:
        sides: Left and right pair, and radii.
        largest: Largest shift considered to either side [m].

    Returns:
        The shift nearest to the middle; NaN if there is none.
    """
    y, difference = _curve(sides, largest)
    rising = np.flatnonzero((difference[:-1] <= 0.0) & (difference[1:] > 0.0))
    if not rising.size:
        return float("nan")
    places = y[rising] - difference[rising] * GRID / (difference[rising + 1] - difference[rising])
    return float(places[np.argmin(np.abs(places))])


def unequal_conicity(sides: UnequalSides, amplitude: ArrayLike, largest: float) -> Reals:
    """Equivalent conicity about the mean shift of each amplitude.

    Args:
        sides: Left and right pair, and radii.
        amplitude: Amplitudes A [m], shape (n,).
        largest: Largest shift considered to either side [m].

    Returns:
        lambda, shape (n,); NaN where the wheelset does not find back to a mean shift within ``largest`` less A.
    """
    y, difference = _curve(sides, largest)
    t = (np.arange(PHASES) + 0.5) * (2.0 * np.pi / PHASES)
    found = []
    for A in np.atleast_1d(np.asarray(amplitude, dtype=np.float64)):
        wave = A * np.sin(t)
        low, high = A - largest, largest - A
        if not low < high or not _mean(low + wave, y, difference) <= 0.0 < _mean(high + wave, y, difference):
            found.append(np.nan)
            continue
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            below = _mean(middle + wave, y, difference) <= 0.0
            low, high = (middle, high) if below else (low, middle)
        found.append(float((np.interp(low + wave, y, difference) * np.sin(t)).mean() / A))
    return np.array(found)


def _curve(sides: UnequalSides, largest: float) -> tuple[Reals, Reals]:
    """Shifts [m] and rolling-radius differences [m]."""
    half = int(np.ceil(largest / GRID))
    y: Reals = GRID * np.arange(-half, half + 1, dtype=np.float64)
    return y, rolling_radius_difference(sides, y)


def _mean(at: Reals, y: Reals, difference: Reals) -> float:
    return float(np.interp(at, y, difference).mean())
