"""Wheel-rail contact tabulated once per pair of profiles over the wheel's outward shift and outward tilt.

With sigma = -1 left, +1 right, v and theta_x the rail's lateral and torsional displacement::

    u = sigma [(y_w - r0 phi_w) - (v + h_r theta_x + y_irr)],   alpha = sigma (phi_w - theta_x - cross level)

and the penetration measured vertically is z_w + sigma b0 phi_w - (rail) - g(u, alpha). Left and right wheels
share the table. All tabulated quantities are smoothed by a Gaussian in u: contact jumps become C1 and means
are kept. Curvature is measured over a patch of finite width, so that the stiffness does not jump where two
arcs of a drawn profile join.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field
from scipy.ndimage import correlate1d

from tiengine.contact.hertz import hertz, zhai_G
from tiengine.contact.kalker import kalker
from tiengine.contact.profile import Profile
from tiengine.contact.search import (
    Contacts,
    SecondContacts,
    find_contacts,
    find_second_contacts,
    transverse_curvature,
)
from tiengine.contact.slot_geometry import raw_slots, smoothed_slots
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["ContactSettings", "ContactTable", "WheelRailPair", "build_contact_table"]

GAUSSIAN_REACH = 5.0
"""The Gaussian is cut at this many standard deviations (6e-7 of it is lost and normalised away)."""
STEPS_PER_SIGMA = 4.0
"""Least sampling of the Gaussian: a contact jump is placed to sigma/8."""
SMALLEST_CURVATURE = 0.02
"""Floor of the transverse curvature [1/m], a 25 m radius: profiles that fit closely over the whole patch."""
FLANGE_DEPTH = 10e-3
"""Depth below the tape circle where a flange's thickness is measured [m]."""
SPIN_SHARE = 0.01
"""Least share of which the spin moment takes account; p^-1/3 has no bound."""
LARGEST_CLEARANCE = 40e-3
"""Largest clearance of a flange [m]: 22 mm thick, worn, on a track 20 mm wide."""


class ContactSettings(Params):
    """Placement and material of wheel and rail, range and resolution of the table.

    Attributes are in SI; ``u`` is the wheel's outward shift, ``alpha`` its outward tilt.
    """

    gauge: Annotated[float, Q("m", "distance between the gauge faces", gt=0)] = 1.435
    gauge_depth: Annotated[float, Q("m", "where gauge is measured, below the rail's top", gt=0)] = 0.016
    cant: Annotated[float, Q("-", "inclination of the rails, 0.025 for 1:40", ge=0, le=0.1)] = 0.025
    half_spacing: Annotated[float, Q("m", "half distance of the tape circles, b0", gt=0)] = 0.7465
    wheel_radius: Annotated[float, Q("m", "radius at the tape circle, r0", gt=0)] = 0.43
    E: Annotated[float, Q("N/m^2", "Young's modulus of both bodies", gt=0)] = 2.059e11
    nu: Annotated[float, Q("-", "Poisson's ratio of both bodies", ge=0, le=0.5)] = 0.3
    hertz: Literal["exact", "zhai_worn", "zhai_cone"] = "exact"
    smoothing: Annotated[float, Q("m", "standard deviation of the Gaussian in u; 0 for none", ge=0)] = 1e-4
    curvature_span: Annotated[float, Q("m", "half width over which curvature is measured", gt=0)] = 4e-3
    u_min: Annotated[float, Q("m", "inner end of the table", lt=0)] = -16e-3
    u_max: Annotated[float, Q("m", "outer end of the table", gt=0)] = 13e-3
    du: Annotated[
        float,
        Q("m", "step in u; at 0.05 mm the slope of g misses tan gamma by 0.5 % at the flange root", gt=0, le=5e-5),
    ] = 0.025e-3
    alpha_max: Annotated[
        float, Q("rad", "largest tilt; a wheel on its flange rolls the wheelset by up to 10 mrad", gt=0, le=0.1)
    ] = 12e-3
    dalpha: Annotated[float, Q("rad", "step in alpha", gt=0)] = 0.25e-3
    patches: Annotated[Literal[1, 2], Field(description="contact patches a wheel can have")] = 1

    def axis(self, axis: Literal["u", "alpha"]) -> Reals:
        """Nodes of the table: the range and one more at each end, for the outer point of the interpolation.

        Nodes are multiples of the step, so that (0, 0) is one.

        Args:
            axis: ``"u"`` [m] or ``"alpha"`` [rad].
        """
        low, high, step = (
            (self.u_min, self.u_max, self.du) if axis == "u" else (-self.alpha_max, self.alpha_max, self.dalpha)
        )
        inside = 1e-9  # a range that is a multiple of the step up to rounding gets no additional node
        return step * np.arange(np.floor(low / step + inside) - 1, np.ceil(high / step - inside) + 2)


@dataclass(frozen=True, eq=False)
class ContactTable:
    """Contact quantities on a grid of u and alpha.

    Attributes:
        u_min: First node of u [m], one step before the range of the settings.
        du: Step of u [m].
        alpha_min: First node of alpha [rad], one step before the range.
        dalpha: Step of alpha [rad].
        values: Shape (n_u, n_alpha, 10 patches), C-contiguous; the last axis as in :attr:`COLUMNS`, patch by patch.
        crown_offset: Distance of the rails' crowns from the track's centre, y_r [m].
        settings: Settings the table was built with.
    """

    u_min: float
    du: float
    alpha_min: float
    dalpha: float
    values: Reals
    crown_offset: float
    settings: ContactSettings

    COLUMNS: ClassVar[dict[str, str]] = {
        "gap": "m",  # vertical, 0 at (0, 0)
        "s_w": "m",  # outward from the tape circle
        "s_r": "m",  # outward from the crown
        "r_c": "m",
        "tan_gamma": "-",  # = -d gap/d u; positive where the rail falls inward
        "hertz_K": "N/m^1.5",  # N = K delta^1.5
        "c11": "N^(1/3)",  # f11 = c11 N^(2/3)
        "c22": "N^(1/3)",  # f22 = c22 N^(2/3)
        "c23": "m",  # f23 = c23 N
        "c33": "m^2/N^(1/3)",  # f33 = c33 N^(4/3)
    }

    @property
    def patches(self) -> int:
        """Contact patches a wheel can have."""
        return self.settings.patches

    def lookup(self, u: ArrayLike, alpha: ArrayLike) -> Reals:
        """Catmull-Rom interpolation, continuous with its slope.

        Arguments beyond the range of the settings are clipped to it.

        Args:
            u: Outward shifts [m], broadcast against alpha.
            alpha: Outward tilts [rad].

        Returns:
            Shape (..., 10 patches) in the order of :attr:`COLUMNS`, patch by patch.
        """
        x, y = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(alpha, dtype=np.float64))
        i, weight_u = _taps((x - self.u_min) / self.du, self.values.shape[0])
        j, weight_alpha = _taps((y - self.alpha_min) / self.dalpha, self.values.shape[1])
        block = self.values[i[..., :, None], j[..., None, :]]
        found: Reals = np.einsum("...i,...j,...ijk->...k", weight_u, weight_alpha, block)
        return found


@dataclass(frozen=True, eq=False)
class WheelRailPair:
    """Wheel and rail in their placement, neither tabulated nor smoothed.

    Attributes:
        wheel: Wheel profile.
        rail: Rail profile, uncanted unless flagged.
        settings: Gauge, cant, spacing and radius.
    """

    wheel: Profile
    rail: Profile
    settings: ContactSettings

    def __post_init__(self) -> None:
        """Refuse a rail in the wheel's place, and a gauge that does not fit the wheelset."""
        for place, profile in (("wheel", self.wheel), ("rail", self.rail)):
            if profile.kind != place:
                raise InputError(f"profile {profile.name!r} is that of a {profile.kind}; a {place} profile expected")

        clearance, fit = self.flange_clearance, LARGEST_CLEARANCE
        if clearance is not None and not 0.0 < clearance <= fit:
            raise InputError(
                f"gauge = {self.settings.gauge:g} m does not fit wheel {self.wheel.name!r} with tape circles"
                f" {2.0 * self.settings.half_spacing:g} m apart: {clearance * 1e3:.1f} mm between flange and gauge"
                f" face, 0 to {fit * 1e3:g} mm expected; state track.gauge or the vehicle's half_span_contact"
                " (tiengine contact: --gauge, --half-spacing)"
            )

    @cached_property
    def flange_clearance(self) -> float | None:
        """Shift of the centred wheelset until a flange meets its gauge face [m]; None for a wheel without a flange."""
        face = self.wheel.flange_face(FLANGE_DEPTH)
        return None if face is None else 0.5 * self.settings.gauge - (self.settings.half_spacing + face)

    @cached_property
    def canted_rail(self) -> Profile:
        """Rail inclined by the cant, origin at its crown."""
        return self.rail.canted(self.settings.cant)

    @cached_property
    def crown_offset(self) -> float:
        """Distance of the crown from the track's centre, y_r [m]; the gauge holds at gauge_depth below the top."""
        return 0.5 * self.settings.gauge - self.canted_rail.inner_side(self.settings.gauge_depth)

    def contacts(self, u: ArrayLike, alpha: ArrayLike) -> Contacts:
        """Contact points for outward shifts [m] and tilts [rad], broadcast; the gap is 0 at (0, 0)."""
        offset = self.settings.half_spacing - self.crown_offset
        datum = find_contacts(self.wheel, self.canted_rail, offset, 0.0, 0.0).gap
        found = find_contacts(self.wheel, self.canted_rail, offset, u, alpha)
        return Contacts(found.gap - datum, found.s_w, found.s_r, found.dz_w, found.tan_gamma)

    def second_contacts(self, u: Reals, alpha: Reals, first: Contacts) -> SecondContacts:
        """Second patches beside the first contacts [m], arrays of shape (n,); the gap is as in :meth:`contacts`."""
        offset = self.settings.half_spacing - self.crown_offset
        datum = find_contacts(self.wheel, self.canted_rail, offset, 0.0, 0.0).gap
        found = find_second_contacts(
            self.wheel, self.canted_rail, offset, u, alpha, replace(first, gap=first.gap + datum)
        )
        return replace(found, at=replace(found.at, gap=found.at.gap - datum))


def build_contact_table(wheel: Profile, rail: Profile, settings: ContactSettings) -> ContactTable:
    """Tabulate the contact of a wheel and a rail.

    Args:
        wheel: Wheel profile.
        rail: Rail profile; it is canted here unless flagged as canted.
        settings: Placement, material, range and smoothing.

    Returns:
        The table; the same bits for the same input.

    Raises:
        InputError: Profiles that do not reach as far as the range of u and alpha, or too short for the gauge.
    """
    pair = WheelRailPair(wheel, rail, settings)
    u, alpha = settings.axis("u"), settings.axis("alpha")
    origin = np.argmin(np.abs(u)), np.argmin(np.abs(alpha))
    if settings.patches == 1:
        geometry = _smoothed_geometry(pair, u, alpha)
        values = _columns(geometry, None, geometry[0][origin], settings)
    else:
        slots, shares, gap = _slots(pair, u, alpha)
        columns = [_columns(slots[k], shares[k], gap[origin], settings) for k in range(2)]
        values = np.concatenate(columns, axis=-1)
    return ContactTable(
        u_min=float(u[0]),
        du=settings.du,
        alpha_min=float(alpha[0]),
        dalpha=settings.dalpha,
        values=np.ascontiguousarray(values),
        crown_offset=pair.crown_offset,
        settings=settings,
    )


def _columns(geometry: Reals, share: Reals | None, datum: float, settings: ContactSettings) -> Reals:
    """Columns of one patch, shape (n_u, n_alpha, 10).

    A share p of the forces N = K delta^1.5, f11 N^-2/3 = c11 and so on is that of p K, p^1/3 c11, p^1/3 c22, c23,
    p^-1/3 c33, so that the kernels need not know it.

    Args:
        geometry: See :func:`_smoothed_geometry`.
        share: Shares of the forces, shape (n_u, n_alpha); None for 1 throughout.
        datum: Gap at (0, 0) [m].
        settings: Radius and material.
    """
    gap, s_w, s_r, dz_w, tan_gamma, B = geometry
    r_c = settings.wheel_radius + dz_w
    creep = _creep_columns(tan_gamma, r_c, B, settings)
    if share is not None:
        part = np.cbrt(share)
        spin = 1.0 / np.cbrt(np.maximum(share, SPIN_SHARE))
        creep = creep * np.stack([share, part, part, np.ones_like(share), spin], axis=-1)
    return np.concatenate([np.stack([gap - datum, s_w, s_r, r_c, tan_gamma], axis=-1), creep], axis=-1)


def _fine_axis(settings: ContactSettings, u: Reals) -> tuple[Reals, int, Reals]:
    """Shifts at which contacts are searched [m], of which every so many is a node, and the weights of the smoothing.

    They reach beyond the ends of u by the Gaussian's reach.
    """
    sigma, du = settings.smoothing, settings.du
    finer = max(1, int(np.ceil(du * STEPS_PER_SIGMA / sigma - 1e-9))) if sigma > 0.0 else 1
    step = du / finer
    reach = int(np.ceil(GAUSSIAN_REACH * sigma / step))
    fine = u[0] + step * np.arange(-reach, (u.size - 1) * finer + reach + 1)
    kernel = np.exp(-0.5 * (step * np.arange(-reach, reach + 1) / sigma) ** 2) if reach > 0 else np.ones(1)
    return fine, finer, kernel / kernel.sum()


def _slots(pair: WheelRailPair, u: Reals, alpha: Reals) -> tuple[Reals, Reals, Reals]:
    """Geometry of both slots, as :func:`_smoothed_geometry` has it, their shares, and the gap of the lower minimum."""
    fine, finer, kernel = _fine_axis(pair.settings, u)
    shift, tilt = (grid.ravel() for grid in np.meshgrid(fine, alpha, indexing="ij"))
    first = pair.contacts(shift, tilt)
    geometry, share = raw_slots(
        first,
        pair.second_contacts(shift, tilt, first),
        lambda at: transverse_curvature(pair.wheel, pair.canted_rail, at, pair.settings.curvature_span),
    )
    geometry[:, 5] = np.maximum(geometry[:, 5], SMALLEST_CURVATURE)
    grid = (fine.size, alpha.size)
    smooth, shares, gap = smoothed_slots(
        geometry.reshape(2, 6, *grid), share.reshape(2, *grid), first.gap.reshape(grid), kernel
    )
    reach = len(kernel) // 2
    inside = slice(reach, fine.size - reach, finer)
    return smooth[:, :, inside], shares[:, inside], gap[inside]


def _smoothed_geometry(pair: WheelRailPair, u: Reals, alpha: Reals) -> Reals:
    """Gap, s_w, s_r, radius less r0, tan gamma, transverse curvature on the nodes, (6, n_u, n_alpha)."""
    fine, finer, kernel = _fine_axis(pair.settings, u)
    reach = len(kernel) // 2
    found = pair.contacts(fine[:, None], alpha[None, :])
    flat = Contacts(*(part.ravel() for part in (found.gap, found.s_w, found.s_r, found.dz_w, found.tan_gamma)))
    B = transverse_curvature(pair.wheel, pair.canted_rail, flat, pair.settings.curvature_span)
    B = np.maximum(B, SMALLEST_CURVATURE).reshape(found.gap.shape)
    raw = np.stack([found.gap, found.s_w, found.s_r, found.dz_w, found.tan_gamma, B])
    if reach == 0:
        return raw
    smooth: Reals = correlate1d(raw, kernel, axis=1)
    return smooth[:, reach : raw.shape[1] - reach : finer]


def _creep_columns(tan_gamma: Reals, r_c: Reals, B: Reals, settings: ContactSettings) -> Reals:
    """Hertz stiffness and the creep coefficients per power of N, shape (n_u, n_alpha, 5)."""
    A = 0.5 / (r_c * np.hypot(1.0, tan_gamma))  # cos(gamma)/(2 r_c)
    a, b, approach = hertz(A, B, settings.E, settings.nu)
    if settings.hertz != "exact":
        approach = np.broadcast_to(zhai_G(settings.hertz, settings.wheel_radius), a.shape)
    C11, C22, C23, C33 = np.moveaxis(kalker(a / b, settings.nu), -1, 0)
    shear = settings.E / (2.0 * (1.0 + settings.nu))
    ab = a * b
    return np.stack(
        [approach**-1.5, shear * ab * C11, shear * ab * C22, shear * ab**1.5 * C23, shear * ab**2 * C33],
        axis=-1,
    )


def _taps(x: Reals, nodes: int) -> tuple[NDArray[np.intp], Reals]:
    """Indices and Catmull-Rom weights of the four nodes around each position x, shape (..., 4) each."""
    x = np.clip(x, 1.0, nodes - 2.0)
    cell = np.minimum(np.floor(x).astype(np.intp), nodes - 3)
    t = x - cell
    weights = 0.5 * np.stack(
        [
            t * (t * (2.0 - t) - 1.0),
            2.0 + t**2 * (3.0 * t - 5.0),
            t * (1.0 + t * (4.0 - 3.0 * t)),
            t**2 * (t - 1.0),
        ],
        axis=-1,
    )
    return cell[..., None] + np.arange(-1, 3), weights
