"""Seats and slabs under the moving window."""

from __future__ import annotations

import numpy as np

from tiengine.kernels import layout as at
from tiengine.parameters.arrays import Ints, Reals
from tiengine.track.slab import Slab

__all__ = ["slabs_in_slots", "window_clock"]


def window_clock(slab: Slab, X: Reals, V: Reals, V_rate: Reals, reach: float = 0.0) -> Reals:
    """Position of the window over seats and slabs at a row of instants.

    Seat j is at chainage (j + 1/2) d and enters at s = l + r; the rear seat has -r < s_0 <= d - r. Slab K lies over
    K p < x < (K + 1) p.

    Args:
        slab: Gives the pitches of seats and slabs, d and p.
        X: Chainage of the window's rear end [m], shape (steps,).
        V: Speed [m/s].
        V_rate: Its rate [m/s^2].
        reach: How far outside the window a seat's middle may stand, r [m].

    Returns:
        Rows for the kernels, see ``layout``, shape (steps, N_CLOCK).
    """
    d, p = slab.fastening_pitch, slab.pitch
    clock = np.zeros((len(X), at.N_CLOCK))
    first = np.maximum(np.floor((X - reach) / d - 0.5).astype(np.int64) + 1, 0)
    clock[:, at.POSITION], clock[:, at.SPEED], clock[:, at.SPEED_RATE] = X, V, V_rate
    clock[:, at.FIRST_SEAT] = first
    clock[:, at.FIRST_SEAT_S] = (first + 0.5) * d - X
    clock[:, at.FIRST_SLAB] = np.floor(X / p)
    return clock


def slabs_in_slots(rear_slab: Ints, slots: int) -> Ints:
    """Compute the index of the slab in each slot, shape (rows, slots): slab i is in slot i modulo their number.

    Args:
        rear_slab: Rear slab in memory, shape (rows,).
        slots: Slabs in memory.
    """
    rear = rear_slab[:, None]
    return np.asarray(rear + (np.arange(slots) - rear) % slots)
