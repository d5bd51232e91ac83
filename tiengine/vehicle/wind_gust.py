"""The gust of EN 14067-6, "Chinese hat": two exponentials in space on a mean wind, passed by the train.

    u = U [1 + A sigma exp(-f sqrt((P_along s cos beta)^2 + (P_across s sin beta)^2) / U)],   f = 1/(2 T)

with s the distance from its top along the track, beta the wind's angle to the track. Constants from memory, not
checked against the text of the standard: A = 2.84 (99 % of amplitudes are smaller), sigma = 0.2446 of the mean wind,
hence a gust factor of 1.6946; T = 4.1825 s; P_along = 5.0462, P_across = 16.
"""

from __future__ import annotations

import numpy as np

from tiengine.parameters.arrays import Reals

__all__ = ["GUST_FACTOR", "PASSING_POINTS", "gust_share"]

AMPLITUDE, TURBULENCE = 2.84, 0.2446
DURATION = 4.1825  # T [s]
DECAY_ALONG, DECAY_ACROSS = 5.0462, 16.0

GUST_FACTOR = 1.0 + AMPLITUDE * TURBULENCE
"""Top of the gust over the mean wind, 1.6946."""

PASSING_POINTS = 33
"""Points of a car over which the wind is averaged."""


def gust_share(distance: Reals, mean: float, angle: float) -> Reals:
    """Rise of the wind in the gust, as a share of the mean wind.

    Args:
        distance: From its top along the track [m], any shape.
        mean: Mean wind [m/s].
        angle: Of the wind to the track [rad].
    """
    decay = np.hypot(DECAY_ALONG * np.cos(angle), DECAY_ACROSS * np.sin(angle)) / (2.0 * DURATION * max(mean, 1e-9))
    return np.asarray(AMPLITUDE * TURBULENCE * np.exp(-decay * distance), np.float64)
