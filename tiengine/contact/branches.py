"""Two contact patches of a wheel in two slots whose geometry does not jump where load passes from one to the other.

Where the gap has two minima that are patches (:mod:`tiengine.contact.search`), they swap order as the wheel moves: the
lower one is the tread, then the flange. Slots are therefore told apart by place, not by order. Split stations divide
the wheel, each between the two minima of such pairs, and minima on either side of a split are in different slots: the
field side in the first, and alternately with every split. A slot acts with a share of its patch's forces: 1 for the
lower minimum, the second's own share for the other. A lone contact that moves across a split is in both slots at once,
with shares that add up to 1; one that jumps across it likewise, once the shares are smoothed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiengine.contact.search import Contacts, SecondContacts
from tiengine.parameters.arrays import Reals

__all__ = ["RAMP", "Slots", "in_slots", "split_stations"]

RAMP = 1e-3
"""Half width of the stretch of the wheel around a split over which a lone contact moves from slot to slot [m]; minima
of a pair are more than 4 mm apart."""


@dataclass(frozen=True, eq=False)
class Slots:
    """Contacts in two slots.

    Attributes:
        share: Part of the patch's forces with which a slot acts, 0 if it is empty, shape (2, n).
        contacts: Contacts in each slot, of shape (n,); those of an empty slot have no meaning.
    """

    share: Reals
    contacts: tuple[Contacts, Contacts]


def split_stations(first: Contacts, second: SecondContacts) -> Reals:
    """Fewest stations of the wheel that lie between the minima of all pairs [m], descending.

    Args:
        first: Lower minima, shape (n,).
        second: Higher minima beside them.
    """
    pair = second.share > 0.0
    ends = np.sort(np.stack([first.s_w[pair], second.at.s_w[pair]], axis=1), axis=1)
    low, high = ends[:, 0] + RAMP, ends[:, 1] - RAMP
    low, high = low[low < high], high[low < high]
    splits = []
    while high.size:
        end = high.min()
        through = low <= end  # all these intervals have a common part that ends there
        splits.append(0.5 * (low[through].max() + end))
        low, high = low[~through], high[~through]
    return np.array(splits[::-1])


def in_slots(first: Contacts, second: SecondContacts, splits: Reals) -> Slots:
    """Put contacts into slots.

    Args:
        first: Lower minima, shape (n,).
        second: Higher minima beside them.
        splits: Stations between slots [m].
    """
    in_first = _share_of_first_slot(first.s_w, splits)
    home = (in_first < 0.5).astype(np.intp)
    away = (_share_of_first_slot(second.at.s_w, splits) < 0.5).astype(np.intp)
    two = (second.share > 0.0) & (home != away)
    share = np.stack([in_first, 1.0 - in_first])
    case = np.flatnonzero(two)
    share[home[case], case] = 1.0
    share[away[case], case] = second.share[case]
    contacts = []
    for slot in range(2):
        other = two & (away == slot)
        parts = (
            np.where(other, getattr(second.at, name), getattr(first, name))
            for name in ("gap", "s_w", "s_r", "dz_w", "tan_gamma")
        )
        contacts.append(Contacts(*parts))
    return Slots(share, (contacts[0], contacts[1]))


def _share_of_first_slot(station: Reals, splits: Reals) -> Reals:
    """Share of the first slot in a lone contact at a station [m]."""
    passed = np.zeros_like(station)  # splits between the field side and the station, parts of one within a ramp
    for split in splits:
        t = np.clip((split + RAMP - station) / (2.0 * RAMP), 0.0, 1.0)
        passed += t * t * (3.0 - 2.0 * t)
    within = passed % 2.0
    return np.asarray(np.where(within <= 1.0, 1.0 - within, within - 1.0))
