"""Geometry of two contact patches on the nodes of a contact table.

Shares are smoothed over the wheel's shift as all columns are, and geometry by the shares: a slot's geometry is the mean
over those places nearby where it holds a patch. Where it holds none it keeps the geometry of the nearest such place, at
a gap beyond reach.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import correlate1d, distance_transform_edt

from tiengine.contact.branches import in_slots, split_stations
from tiengine.contact.search import DEEPEST, Contacts, SecondContacts
from tiengine.parameters.arrays import Reals

__all__ = ["SMALLEST_SHARE", "raw_slots", "smoothed_slots"]

SMALLEST_SHARE = 1e-9
"""Share of an empty slot, not zero: Hertz's stiffness stays positive."""
NAMES = ("gap", "s_w", "s_r", "dz_w", "tan_gamma")
NEGLIGIBLE = 1e-5
"""Smoothed shares below this are those of an empty slot: the tail of the Gaussian five standard deviations away."""


def raw_slots(first: Contacts, second: SecondContacts, curvature: Callable[[Contacts], Reals]) -> tuple[Reals, Reals]:
    """Geometry and shares of both slots, not smoothed.

    Args:
        first: Lower minima of the gap, shape (n,).
        second: Higher minima beside them.
        curvature: Transverse curvature of the gap at contacts [1/m], shape (n,).

    Returns:
        Gap, s_w, s_r, radius less r0, tan gamma, transverse curvature, shape (2, 6, n); shares, shape (2, n).
    """
    slots = in_slots(first, second, split_stations(first, second))
    geometry = [np.stack([*(getattr(c, name) for name in NAMES), curvature(c)]) for c in slots.contacts]
    return np.stack(geometry), slots.share


def smoothed_slots(geometry: Reals, share: Reals, lowest: Reals, kernel: Reals) -> tuple[Reals, Reals, Reals]:
    """Smooth over u, and fill empty slots.

    Args:
        geometry: See :func:`raw_slots`, on a grid: shape (2, 6, n_u, n_alpha).
        share: Shares, shape (2, n_u, n_alpha).
        lowest: Gap of the lower minimum [m], shape (n_u, n_alpha).
        kernel: Weights of the smoothing over u, sum 1, shape (odd,).

    Returns:
        Geometry and shares of the same shapes, and the smoothed gap of the lower minimum.
    """
    smooth_share = correlate1d(share, kernel, axis=1)
    weighted = correlate1d(geometry * share[:, None], kernel, axis=2)
    whole = smooth_share > 1.0 - 1e-12
    empty = smooth_share <= NEGLIGIBLE
    divisor = np.where(whole | empty, 1.0, smooth_share)
    smooth = weighted / divisor[:, None]
    gap = correlate1d(lowest, kernel, axis=0)
    for slot in range(2):
        if empty[slot].all():
            smooth[slot] = smooth[1 - slot]
        elif empty[slot].any():
            nearest = distance_transform_edt(empty[slot], return_distances=False, return_indices=True)
            smooth[slot] = smooth[slot][:, nearest[0], nearest[1]]
        smooth[slot, 0] = np.where(empty[slot], np.maximum(smooth[slot, 0], gap + DEEPEST), smooth[slot, 0])
    found = np.maximum((smooth_share - NEGLIGIBLE) / (1.0 - NEGLIGIBLE), SMALLEST_SHARE)
    return smooth, np.where(whole, 1.0, found), gap
