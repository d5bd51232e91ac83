"""Rolling-radius difference and equivalent conicity of a wheelset, from the unsmoothed profiles.

The wheelset is shifted by y on straight track; its roll phi follows from both wheels touching,
2 b0 phi = g(u, phi) - g(-u, -phi) with u = y - r0 phi (sigma = +1 right, -1 left).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tiengine.contact.search import Contacts
from tiengine.contact.table import WheelRailPair
from tiengine.parameters.arrays import Reals

__all__ = ["WheelsetPosition", "equivalent_conicity", "rolling_radius_difference", "wheelset_position"]

STEEPEST_ROLL = 0.03
"""Bracket of the roll [rad]: a flange on top of the rail rolls a wheelset by 28 mm / 1.5 m = 0.019."""


@dataclass(frozen=True, eq=False)
class WheelsetPosition:
    """A wheelset resting on both rails.

    Attributes:
        roll: Roll phi, right-handed about x forward [rad].
        right: Contact of the right wheel.
        left: Contact of the left wheel; stations are outward.
    """

    roll: Reals
    right: Contacts
    left: Contacts


def wheelset_position(pair: WheelRailPair, y: ArrayLike) -> WheelsetPosition:
    """Roll and contacts of a wheelset shifted to the right.

    Args:
        pair: Wheel and rail.
        y: Shifts of the wheelset's centre to the right [m], shape (n,).

    Returns:
        The position, arrays of shape (n,).
    """
    shift = np.atleast_1d(np.asarray(y, dtype=np.float64))
    b0, r0 = pair.settings.half_spacing, pair.settings.wheel_radius
    roll = np.zeros_like(shift)
    low, high = np.full_like(shift, -STEEPEST_ROLL), np.full_like(shift, STEEPEST_ROLL)
    active = np.arange(shift.size)
    for _ in range(60):
        phi = roll[active]
        right, left = _both_contacts(pair, shift[active], phi)
        error = 2.0 * b0 * phi - (right.gap - left.gap)
        # d gap/d u = -tan gamma, d gap/d alpha = -s_w
        slope = 2.0 * b0 - r0 * (right.tan_gamma + left.tan_gamma) + right.s_w + left.s_w
        low[active] = np.where(error < 0.0, phi, low[active])
        high[active] = np.where(error < 0.0, high[active], phi)
        newton = phi - error / slope
        inside = (newton >= low[active]) & (newton <= high[active])  # a contact jump may make Newton oscillate
        roll[active] = np.where(inside, newton, 0.5 * (low[active] + high[active]))
        active = active[np.abs(roll[active] - phi) > 1e-12]
        if active.size == 0:
            break
    return WheelsetPosition(roll, *_both_contacts(pair, shift, roll))


def _both_contacts(pair: WheelRailPair, y: Reals, roll: Reals) -> tuple[Contacts, Contacts]:
    """Contacts of the right and the left wheel."""
    u = y - pair.settings.wheel_radius * roll
    return pair.contacts(u, roll), pair.contacts(-u, -roll)


def rolling_radius_difference(pair: WheelRailPair, y: ArrayLike) -> Reals:
    """Right minus left rolling radius [m] of a wheelset shifted by y to the right [m], shape (n,)."""
    position = wheelset_position(pair, y)
    return position.right.dz_w - position.left.dz_w


def equivalent_conicity(pair: WheelRailPair, amplitude: ArrayLike, phases: int = 256) -> Reals:
    """Equivalent conicity by harmonic linearisation.

    lambda(A) = 1/(2 pi A) int_0^2pi Delta r(A sin t) sin t dt; a cone gives its tangent.

    Args:
        pair: Wheel and rail.
        amplitude: Amplitudes A [m], shape (n,).
        phases: Points per period of the mean.

    Returns:
        lambda, shape (n,).
    """
    A = np.atleast_1d(np.asarray(amplitude, dtype=np.float64))
    # the profiles are mirrored left to right, so Delta r is odd in y: a quarter period is enough
    t = (np.arange(phases // 4) + 0.5) * (2.0 * np.pi / phases)
    y = A[:, None] * np.sin(t)
    difference = rolling_radius_difference(pair, y.ravel()).reshape(y.shape)
    conicity: Reals = (difference * np.sin(t)).mean(axis=1) / A
    return conicity
