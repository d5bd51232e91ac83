"""Cross-sections of wheels and rails as smooth curves.

Frame of a profile (metres): a wheel's y is 0 at the tape circle and positive to the field side, its z is the
increase of radius; a rail's y is 0 on the rail's axis and positive outward (away from the track's centre),
its z is positive down, 0 at the crown. So both bodies are described by z(y) with z down, and left and right
share one description.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from tiengine.contact.point_list import FEWEST_POINTS, ROUNDING_LENGTH, Kind, Placement
from tiengine.contact.profile_files import read_profile
from tiengine.contact.profile_frame import mirrored, placed
from tiengine.contact.profile_kinks import check_kinks
from tiengine.contact.smoothing import increasing_run, smoothing_curve
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import is_file
from tiengine.parameters.presets import find_preset, preset_names

__all__ = ["Kind", "Profile", "load_profile", "profile_names"]


@dataclass(frozen=True, eq=False)
class Profile:
    """A wheel's or a rail's cross-section.

    Attributes:
        name: Name of the preset or file, for messages.
        kind: ``"wheel"`` or ``"rail"``.
        y: Lateral positions, outward positive, strictly increasing [m], shape (n,).
        z: Heights, down positive [m], shape (n,).
        has_cant: The points are those of a rail already inclined in the track.
        smoothing: Length l of the smoothing spline [m], 0 for interpolation; about 0.5e-3 for a
            measured profile.

    Raises:
        InputError: Fewer than 10 points, a value that is not finite, or y that does not increase.
    """

    name: str
    kind: Kind
    y: Reals
    z: Reals
    has_cant: bool = False
    smoothing: float = ROUNDING_LENGTH

    def __post_init__(self) -> None:
        """Refuse points that do not describe a curve z(y)."""
        where = f"{self.kind} profile {self.name!r}"
        if self.y.shape != self.z.shape or self.y.ndim != 1 or self.y.size < FEWEST_POINTS:
            raise InputError(f"{where}: y {self.y.shape}, z {self.z.shape}; at least {FEWEST_POINTS} pairs expected")
        if not (np.isfinite(self.y).all() and np.isfinite(self.z).all()):
            bad = int(np.flatnonzero(~(np.isfinite(self.y) & np.isfinite(self.z)))[0])
            raise InputError(f"{where}: point {bad + 1} is ({self.y[bad]}, {self.z[bad]}); finite numbers expected")
        if (np.diff(self.y) <= 0.0).any():
            bad = int(np.flatnonzero(np.diff(self.y) <= 0.0)[0])
            raise InputError(
                f"{where}: y goes from {self.y[bad]:.9g} m to {self.y[bad + 1]:.9g} m at point {bad + 2}; "
                "y must increase from point to point"
            )

    @cached_property
    def path(self) -> CubicSpline:
        """The smoothed curve (y, z) over the chord length t [m]."""
        return smoothing_curve(np.stack([self.y, self.z], axis=1), self.smoothing)

    @cached_property
    def height(self) -> CubicSpline:
        """The smoothed curve as z(y) [m], twice continuously differentiable within :attr:`span`."""
        points = self.path(self.path.x)
        return CubicSpline(points[:, 0], points[:, 1], bc_type="natural")

    @property
    def span(self) -> tuple[float, float]:
        """First and last y of the smoothed curve [m]."""
        return float(self.height.x[0]), float(self.height.x[-1])

    def normal_offset(self, y: Reals, eta: float) -> Reals:
        """Distance of the curve from its own tangent, measured along the normal.

        With the tangent at y as axis: the point of the curve whose coordinate along the tangent is ``eta``
        (outward positive) lies this far below the tangent. Ends are continued straight.

        Args:
            y: Points of contact [m], shape (n,).
            eta: Coordinate along the tangent [m].

        Returns:
            Distances, into the rail positive [m], shape (n,).
        """
        angle = np.arctan(self.height(y, 1))
        along = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        below = np.stack([-np.sin(angle), np.cos(angle)], axis=1)
        start = np.stack([y, self.height(y)], axis=1)
        t = np.interp(y, self.height.x, self.path.x) + eta
        for _ in range(6):  # the curve turns by less than 60 deg within eta: Newton's first slope is at least 1/2
            point, slope = self._straightened(t)
            t -= (((point - start) * along).sum(axis=1) - eta) / (slope * along).sum(axis=1)
        offset: Reals = ((self._straightened(t)[0] - start) * below).sum(axis=1)
        return offset

    def _straightened(self, t: Reals) -> tuple[Reals, Reals]:
        """Points and tangents at chord length t, shape (n, 2) each, with both ends continued straight."""
        inside = np.clip(t, self.path.x[0], self.path.x[-1])
        slope = self.path(inside, 1)
        return self.path(inside) + slope * (t - inside)[:, None], slope

    def canted(self, cant: float) -> Profile:
        """Rail inclined inward by the cant, as installed in the track.

        The origin is the crown, the point of the head whose tangent is inclined by the cant: for a rail drawn
        upright it is the origin of the drawing. A rail whose points are inclined already is only shifted.

        Args:
            cant: Inclination, 0.025 for 1:40.

        Returns:
            The inclined profile, cut where its side would overhang.
        """
        if self.has_cant:
            crown = self._crown(cant)
            return replace(self, y=self.y - crown, z=self.z - float(self.height(crown)))
        angle = np.arctan(cant)
        y = self.y * np.cos(angle) + self.z * np.sin(angle)
        z = self.z * np.cos(angle) - self.y * np.sin(angle)
        first, last = increasing_run(y, int(np.argmin(z)))
        return replace(self, y=y[first:last], z=z[first:last], has_cant=True)

    def flange_face(self, depth: float) -> float | None:
        """The y of a wheel's flange at a depth below the tape circle [m]; None if it has no flange that deep.

        Args:
            depth: Increase of radius [m].
        """
        z = self.height
        y = z.x[z.x < 0.0]
        deep = np.flatnonzero(z(y) > depth)
        if not deep.size or deep[-1] + 1 >= y.size:
            return None
        return float(brentq(lambda s: float(z(s)) - depth, y[deep[-1]], y[deep[-1] + 1], xtol=1e-12))

    @property
    def flange_angle(self) -> float | None:
        """Steepest angle of a wheel's flange between its tip and the tread [rad]; None without a flange of 10 mm."""
        y = self.height.x[self.height.x <= 0.0]
        if y.size < 2 or (z := self.height(y)).max() < 10e-3:
            return None
        flank = np.linspace(y[int(np.argmax(z))], 0.0, 2000)
        return float(np.arctan(-self.height(flank, 1).min()))

    def _crown(self, cant: float) -> float:
        """The y where the head's tangent falls inward by ``cant`` [m]."""
        top = float(self.y[np.argmin(self.z)])
        try:
            return float(brentq(lambda y: float(self.height(y, 1)) + cant, top - 25e-3, top + 1e-3, xtol=1e-12))
        except ValueError:
            raise InputError(
                f"rail profile {self.name!r}: no point within 25 mm inside its top is inclined by {cant}; "
                "expected of a profile given as canted"
            ) from None

    def inner_side(self, depth: float) -> float:
        """The y of the inner side of the head at a depth below the profile's highest point [m].

        Raises:
            InputError: The points do not reach that deep.
        """
        head = self.height
        top = int(np.argmin(head(head.x)))
        level = float(head(head.x[top])) + depth
        if float(head(head.x[0])) <= level:
            reached = float(head(head.x[0])) - float(head(head.x[top]))
            raise InputError(
                f"rail profile {self.name!r} reaches {reached * 1e3:.2f} mm below its top on the inner side; "
                f"gauge_depth = {depth * 1e3:g} mm must lie above that"
            )
        return float(brentq(lambda y: float(head(y)) - level, head.x[0], head.x[top], xtol=1e-12))


def profile_names() -> list[str]:
    """Names of the profiles of the library."""
    return preset_names("profiles")


def load_profile(
    name_or_path: str | Path,
    kind: Kind,
    *,
    has_cant: bool | None = None,
    smoothing: float = ROUNDING_LENGTH,
    mirror: bool | None = None,
    tape_circle: float | None = None,
    allow_kinks: bool = False,
    rail_axis: float | None = None,
) -> Profile:
    """Load a profile of the library or of a file (formats: :mod:`tiengine.contact.profile_files`).

    Args:
        name_or_path: Name of a preset (``"LMA"``, ``"S1002"``, ``"CHN60"``, ``"60E1"``) or path of a file.
        kind: ``"wheel"`` or ``"rail"``.
        has_cant: Whether the points are those of an inclined rail; None if not stated.
        smoothing: Length of the smoothing spline [m].
        mirror: Whether a rail's gauge face is at the file's positive y; None if not stated.
        tape_circle: Distance of a wheel's tape circle outward from the file's y = 0 [m]; None if not stated.
        allow_kinks: Accept kinks where wheel and rail can touch.
        rail_axis: The file's y at the axis of an upright rail [m]; None if not stated.

    Returns:
        The profile in metres.

    Raises:
        InputError: No such preset or file, one that breaks a rule of its format, a surface with kinks, or points
            :class:`Profile` refuses.
    """
    name = str(name_or_path)
    if name in profile_names():
        path = find_preset("profiles", name)
    elif is_file(Path(name)):
        path = Path(name)
    else:
        raise InputError(f"{kind} profile {name!r}: neither a file nor a preset{nearest(name, profile_names())}")
    stated = Placement(has_cant, smoothing, mirror, tape_circle, allow_kinks, rail_axis)
    found = read_profile(path, kind, f"{kind} profile {name!r}")
    points = placed(found, kind, stated)
    check_kinks(mirrored(found, kind, stated), kind, stated)
    return Profile(name, kind, points[:, 0].copy(), points[:, 1].copy(), bool(has_cant), smoothing)
