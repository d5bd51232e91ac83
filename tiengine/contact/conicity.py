"""Rolling-radius difference and equivalent conicity of a wheelset, from the unsmoothed profiles.

The wheelset is shifted by y on straight track; its roll phi follows from both wheels touching,
2 b0 phi = g(u, phi) - g(-u, -phi) with u = y - r0 phi (sigma = +1 right, -1 left). EN 15302 neglects the roll.
With sides that differ, either has its own g and radius, and r_L - r_R adds to the right-hand side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tiengine.contact.search import Contacts
from tiengine.contact.table import WheelRailPair
from tiengine.parameters.arrays import Reals

__all__ = [
    "UnequalSides",
    "WheelsetPosition",
    "en15302_conicity",
    "equivalent_conicity",
    "integrated_conicity",
    "rolling_radius_difference",
    "unrolled_position",
    "wheelset_position",
]

SHIFT_STEP = 5e-6
"""Step of the shift in the integral of EN 15302 [m]; it places a jump of the contact to half of this."""
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


@dataclass(frozen=True, eq=False)
class UnequalSides:
    """A wheelset whose profiles, rails or radii differ from left to right.

    Attributes:
        left, right: Pairs of either side, with the same mean radius.
        larger_left: Radius of the left wheel less that of the right one [m].
    """

    left: WheelRailPair
    right: WheelRailPair
    larger_left: float = 0.0


Sides = WheelRailPair | UnequalSides


def wheelset_position(pair: Sides, y: ArrayLike) -> WheelsetPosition:
    """Roll and contacts of a wheelset shifted to the right.

    Args:
        pair: Wheel and rail, or those of either side.
        y: Shifts of the wheelset's centre to the right [m], shape (n,).

    Returns:
        The position, arrays of shape (n,).
    """
    shift = np.atleast_1d(np.asarray(y, dtype=np.float64))
    _, right_pair, larger_left = _sides(pair)
    b0, r0 = right_pair.settings.half_spacing, right_pair.settings.wheel_radius
    roll = np.zeros_like(shift)
    low, high = np.full_like(shift, -STEEPEST_ROLL), np.full_like(shift, STEEPEST_ROLL)
    active = np.arange(shift.size)
    for _ in range(60):
        phi = roll[active]
        right, left = _both_contacts(pair, shift[active], phi)
        error = 2.0 * b0 * phi - (right.gap - left.gap) - larger_left
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


def _sides(pair: Sides) -> tuple[WheelRailPair, WheelRailPair, float]:
    """Left and right pair, and by how much the left radius is larger [m]."""
    return (pair, pair, 0.0) if isinstance(pair, WheelRailPair) else (pair.left, pair.right, pair.larger_left)


def _both_contacts(pair: Sides, y: Reals, roll: Reals) -> tuple[Contacts, Contacts]:
    """Contacts of the right and the left wheel."""
    left, right, larger_left = _sides(pair)
    u_right = y - (right.settings.wheel_radius - 0.5 * larger_left) * roll
    u_left = y - (left.settings.wheel_radius + 0.5 * larger_left) * roll
    return right.contacts(u_right, roll), left.contacts(-u_left, -roll)


def rolling_radius_difference(pair: Sides, y: ArrayLike) -> Reals:
    """Right minus left rolling radius [m] of a wheelset shifted by y to the right [m], shape (n,)."""
    position = wheelset_position(pair, y)
    return position.right.dz_w - position.left.dz_w - _sides(pair)[2]


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


def unrolled_position(pair: WheelRailPair, y: ArrayLike) -> WheelsetPosition:
    """Contacts of a wheelset shifted to the right without roll, as EN 15302 takes them.

    Args:
        pair: Wheel and rail.
        y: Shifts of the wheelset's centre to the right [m], shape (n,).

    Returns:
        The position with zero roll, arrays of shape (n,).
    """
    shift = np.atleast_1d(np.asarray(y, dtype=np.float64))
    roll = np.zeros_like(shift)
    return WheelsetPosition(roll, *_both_contacts(pair, shift, roll))


def en15302_conicity(pair: WheelRailPair, amplitude: ArrayLike) -> Reals:
    """Equivalent conicity by the integral of EN 15302 over the rolling-radius difference, without roll.

    Args:
        pair: Wheel and rail.
        amplitude: Amplitudes A > 0 [m], shape (n,).

    Returns:
        tan gamma_e, shape (n,), see :func:`integrated_conicity`.
    """
    A = np.atleast_1d(np.asarray(amplitude, dtype=np.float64))
    y = np.linspace(0.0, A.max(), int(np.ceil(A.max() / SHIFT_STEP)) + 1)
    position = unrolled_position(pair, y)
    return integrated_conicity(y, position.right.dz_w - position.left.dz_w, A)


def integrated_conicity(y: ArrayLike, difference: ArrayLike, amplitude: ArrayLike, nodes: int = 4000) -> Reals:
    """Equivalent conicity from the wavelength of the kinematic motion.

    The motion y'' = -Delta r(y)/(e r0) along the track, e the distance of the contacts, has the slope
    psi^2 = 2 [W(A) - W(y)]/(e r0) with W(y) the integral of Delta r from 0 to y, and the wavelength
    L = 4 int_0^A dy/psi. The cone of the same wavelength has tan gamma_e = 2 e r0 (pi/L)^2 (Klingel), so that e r0
    cancels. With y = A sin t the integrand is smooth at the turning point.

    Args:
        y: Shifts from 0 [m], increasing, shape (m,).
        difference: Rolling-radius difference Delta r, an odd function of y [m], shape (m,); linear in between.
        amplitude: Amplitudes A > 0 within the shifts [m], shape (n,).
        nodes: Points of the quadrature over t.

    Returns:
        tan gamma_e, shape (n,); 0 where the wheelset does not return to the track's centre.
    """
    shift, step = np.asarray(y, dtype=np.float64), np.asarray(difference, dtype=np.float64)
    slope = np.diff(step) / np.diff(shift)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (step[1:] + step[:-1]) * np.diff(shift))])

    def integral(place: Reals) -> Reals:
        cell = np.clip(np.searchsorted(shift, place, side="right") - 1, 0, slope.size - 1)
        x = place - shift[cell]
        return np.asarray(work[cell] + x * (step[cell] + 0.5 * slope[cell] * x))

    A = np.atleast_1d(np.asarray(amplitude, dtype=np.float64))
    t = (np.arange(nodes) + 0.5) * (0.5 * np.pi / nodes)
    left = integral(A)[:, None] - integral(A[:, None] * np.sin(t))
    returns = (left > 0.0).all(axis=1)
    quarter = (A[:, None] * np.cos(t) / np.sqrt(2.0 * np.where(left > 0.0, left, 1.0))).mean(axis=1) * (0.5 * np.pi)
    return np.where(returns, 0.125 * (np.pi / quarter) ** 2, 0.0)
