"""Contact point of a rigid wheel profile on a rigid rail profile.

Outward coordinate o from the crown of the canted rail, z down. A wheel shifted outward by u and tilted
outward by alpha about its tape-circle point has the points

    o = u + offset + s cos(alpha) - z_w(s) sin(alpha),   z = s sin(alpha) + z_w(s) cos(alpha),

and touches the rail where F(s) = z - z_r(o) is largest; -F is the vertical gap. Every local maximum of F on a
coarse grid of stations that could be the largest is refined by Newton's method inside its bracket, so that
jumps of the contact from one place to another occur at the right u.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tiengine.contact.profile import Profile
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["Contacts", "SecondContacts", "find_contacts", "find_second_contacts", "transverse_curvature"]

STATION_STEP = 0.2e-3
CANDIDATE_BAND = 10e-6
"""Grid maxima this far [m] below the best are refined too, twice what 0.2 mm misses at a 1:15 corner."""

ROWS_AT_ONCE = 256  # keeps the arrays of the grid search in the cache

NEAR, FAR = 4e-3, 8e-3
"""Minima of the gap closer together than the first [m] are one patch, further apart than the second are two."""
LOW_RIDGE, HIGH_RIDGE = 5e-6, 10e-6
"""Minima between which the gap rises by less than the first [m] above the higher one are one patch: a wheel load closes
it many times over. From the second on they are two. CONTACT finds one patch over both minima of S1002's tread on
60E1, 3 um deep and 9 mm apart, at 10 kN, and may find two at the flange root, where the ridge has 26 um."""
DEEP, DEEPEST = 0.15e-3, 0.2e-3
"""A second minimum this much above the first [m] is out of reach: at the second, wholly, no wheel load closes it."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contact points, arrays of one common shape.

    Attributes:
        gap: Vertical gap when both profiles' origins are level, negative for overlap [m].
        s_w: Station on the wheel, outward from the tape circle [m].
        s_r: Station on the rail, outward from the crown [m].
        dz_w: Radius there less the nominal radius [m].
        tan_gamma: Tangent of the contact angle in the rail's frame, positive where the rail falls inward.
    """

    gap: Reals
    s_w: Reals
    s_r: Reals
    dz_w: Reals
    tan_gamma: Reals


def find_contacts(wheel: Profile, rail: Profile, offset: float, u: ArrayLike, alpha: ArrayLike) -> Contacts:
    """The contact point for each outward shift and tilt.

    Args:
        wheel: Wheel profile.
        rail: Canted rail profile, origin at its crown.
        offset: Outward position of the tape circle from the crown at u = 0, b0 - y_r [m].
        u: Outward shifts [m], broadcast against alpha.
        alpha: Outward tilts [rad].

    Returns:
        Contacts of the common shape of u and alpha.

    Raises:
        InputError: The wheel is not above the rail, or touches at the very end of one of the profiles.
    """
    shift, tilt = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(alpha, dtype=np.float64))
    flat_u, flat_alpha = shift.ravel() + offset, tilt.ravel()
    case, station = _candidates(wheel, rail, flat_u, flat_alpha)
    if np.unique(case).size < flat_u.size:
        lost = np.setdiff1d(np.arange(flat_u.size), case)[0]
        raise InputError(
            f"wheel {wheel.name!r} on rail {rail.name!r}: no contact inside both profiles at "
            f"u = {shift.ravel()[lost] * 1e3:.2f} mm, alpha = {flat_alpha[lost] * 1e3:.2f} mrad; "
            "longer profiles or a narrower range of u expected"
        )
    station = _refine(wheel, rail, flat_u[case], flat_alpha[case], station)
    o, z = _placed(wheel, flat_u[case], flat_alpha[case], station)
    F = z - rail.height(o)
    order = np.lexsort((F, case))
    best = order[np.append(np.diff(case[order]) > 0, True)]  # the last of each case has the largest F
    return Contacts(
        gap=-F[best].reshape(shift.shape),
        s_w=station[best].reshape(shift.shape),
        s_r=o[best].reshape(shift.shape),
        dz_w=wheel.height(station[best]).reshape(shift.shape),
        tan_gamma=-rail.height(o[best], 1).reshape(shift.shape),
    )


@dataclass(frozen=True, eq=False)
class SecondContacts:
    """Second minima of the gap, arrays of shape (n,).

    Attributes:
        share: Part of a patch's forces that the second minimum has as a patch of its own: 0 for none, up to 1.
        at: Contact there; the first one's where there is none.
    """

    share: Reals
    at: Contacts


def find_second_contacts(
    wheel: Profile, rail: Profile, offset: float, u: Reals, alpha: Reals, first: Contacts
) -> SecondContacts:
    """The lowest minimum of the gap that is a patch beside the first one, for each outward shift and tilt.

    Args:
        wheel: Wheel profile.
        rail: Canted rail profile, origin at its crown.
        offset: Outward position of the tape circle from the crown at u = 0 [m].
        u: Outward shifts [m], shape (n,).
        alpha: Outward tilts [rad], shape (n,).
        first: Contacts found there, shape (n,).
    """
    shift = u + offset
    case, station = _candidates(wheel, rail, shift, alpha, DEEPEST)
    apart = np.abs(station - first.s_w[case]) > 0.5 * NEAR
    case, station = case[apart], station[apart]
    if case.size == 0:
        return SecondContacts(np.zeros_like(u), first)
    ridge = _ridges(wheel, rail, shift[case], alpha[case], station, first.s_w[case])
    station = _refine(wheel, rail, shift[case], alpha[case], station)
    o, z = _placed(wheel, shift[case], alpha[case], station)
    gap = rail.height(o) - z
    distance = np.hypot(o - first.s_r[case], rail.height(o) - rail.height(first.s_r[case]))
    share = (
        _rise(distance, NEAR, FAR)
        * _rise(ridge - gap, LOW_RIDGE, HIGH_RIDGE)
        * (1.0 - _rise(gap - first.gap[case], DEEP, DEEPEST))
    )
    order = np.lexsort((-gap, share > 0.0, case))
    best = order[np.append(np.diff(case[order]) > 0, True)]  # the lowest that is a patch
    best = best[share[best] > 0.0]
    parts = (gap, station, o, wheel.height(station), -rail.height(o, 1))
    found = [getattr(first, name).copy() for name in ("gap", "s_w", "s_r", "dz_w", "tan_gamma")]
    shares = np.zeros_like(u)
    shares[case[best]] = share[best]
    for target, part in zip(found, parts, strict=True):
        target[case[best]] = part[best]
    return SecondContacts(shares, Contacts(*found))


def _rise(x: Reals, low: float, high: float) -> Reals:
    """From 0 at ``low`` to 1 at ``high``, level at both."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def _ridges(wheel: Profile, rail: Profile, u: Reals, alpha: Reals, one: Reals, other: Reals) -> Reals:
    """Largest gap between two stations of a wheel [m], shape (n,); infinite where the wheel leaves the rail between."""
    part = np.linspace(0.0, 1.0, int(30e-3 / STATION_STEP))
    first, last = rail.span
    highest = np.empty_like(u)
    for start in range(0, u.size, ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        s = one[rows, None] + (other[rows] - one[rows])[:, None] * part
        o, z = _placed(wheel, u[rows, None], alpha[rows, None], s)
        gap = np.where((o < first) | (o > last), np.inf, rail.height(np.clip(o, first, last)) - z)
        highest[rows] = gap.max(axis=1)
    return highest


def transverse_curvature(wheel: Profile, rail: Profile, contacts: Contacts, span: float) -> Reals:
    """Mean transverse curvature of the gap over a patch of half width ``span``.

    B = [g(+e) + g(-e) - 2 g(0)]/(2 e^2) with g the separation of the touching profiles normal to the contact
    plane and e along it.

    Args:
        wheel: Wheel profile.
        rail: Canted rail profile.
        contacts: Contact points, shape (n,).
        span: The distance e [m].

    Returns:
        B [1/m], shape (n,).
    """
    separation = np.zeros_like(contacts.gap)
    for eta in (-span, span):
        separation += rail.normal_offset(contacts.s_r, eta) - wheel.normal_offset(contacts.s_w, eta)
    return separation / (2.0 * span**2)


def _placed(wheel: Profile, u: Reals, alpha: Reals, s: Reals) -> tuple[Reals, Reals]:
    """Position (o, z) of wheel stations; u is from the crown here."""
    z_w = wheel.height(s)
    return u + s * np.cos(alpha) - z_w * np.sin(alpha), s * np.sin(alpha) + z_w * np.cos(alpha)


def _candidates(
    wheel: Profile, rail: Profile, u: Reals, alpha: Reals, band: float = CANDIDATE_BAND
) -> tuple[NDArray[np.intp], Reals]:
    """Cases and stations of the grid maxima of F within a band below the largest; u and alpha of shape (n,)."""
    first, last = wheel.span
    s = np.linspace(first, last, int((last - first) / STATION_STEP) + 2)
    lower, upper = rail.span
    fine = np.linspace(lower, upper, int((upper - lower) / (0.1 * STATION_STEP)) + 2)
    head = rail.height(fine)
    cases, stations = [], []
    for start in range(0, u.size, ROWS_AT_ONCE):
        part = slice(start, start + ROWS_AT_ONCE)
        o, z = _placed(wheel, u[part, None], alpha[part, None], s)
        F = z - np.interp(o, fine, head, left=np.inf, right=np.inf)
        best = F.max(axis=1, keepdims=True)
        inner = F[:, 1:-1]
        peak = (inner >= F[:, :-2]) & (inner > F[:, 2:]) & (inner > best - band)
        peak &= np.isfinite(F[:, :-2]) & np.isfinite(F[:, 2:])  # not at the end of the rail's points
        row, column = np.nonzero(peak)
        cases.append(row + start)
        stations.append(s[column + 1])
    return np.concatenate(cases), np.concatenate(stations)


def _refine(wheel: Profile, rail: Profile, u: Reals, alpha: Reals, s: Reals) -> Reals:
    """Stations where F' = 0, by Newton steps kept inside the bracket that the sign of F' narrows."""
    low, high = s - STATION_STEP, s + STATION_STEP
    cos, sin = np.cos(alpha), np.sin(alpha)
    for _ in range(60):
        o, _z = _placed(wheel, u, alpha, s)
        slope_w, bend_w = wheel.height(s, 1), wheel.height(s, 2)
        slope_r, bend_r = rail.height(o, 1), rail.height(o, 2)
        do = cos - slope_w * sin
        first = sin + slope_w * cos - slope_r * do
        second = bend_w * (cos + slope_r * sin) - bend_r * do**2
        low, high = np.where(first > 0.0, s, low), np.where(first > 0.0, high, s)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = s - first / second
        inside = (second < 0.0) & (newton > low) & (newton < high)
        moved = np.where(inside, newton, 0.5 * (low + high))
        step = np.abs(moved - s).max()
        s = moved
        if step < 1e-10:
            break
    return s
