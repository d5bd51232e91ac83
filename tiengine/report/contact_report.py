"""Contact geometry of a wheel on a rail, for ``tiengine contact``: rolling radii, conicity, contact points.

Where the right wheel has a second patch beside its contact, that is stated and drawn too. The left wheel and its rail
may differ from the right ones.

The wheelset is shifted laterally on straight track (:mod:`tiengine.contact.conicity`). Conicity is that of harmonic
linearisation, with the wheelset's roll, or that of EN 15302, by integrating the motion without roll.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tiengine.contact.conicity import (
    UnequalSides,
    en15302_conicity,
    equivalent_conicity,
    unrolled_position,
    wheelset_position,
)
from tiengine.contact.profile import Profile
from tiengine.contact.table import ContactSettings, WheelRailPair
from tiengine.contact.unequal_conicity import rolling_shift, unequal_conicity
from tiengine.figures.palette import BLUE, GREEN, ORANGE, VERMILION
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["METHODS", "ContactReport", "Method", "contact_report", "draw"]

Method = Literal["harmonic", "en15302"]
METHODS = {
    "harmonic": (wheelset_position, equivalent_conicity, "harmonic linearisation, with roll"),
    "en15302": (unrolled_position, en15302_conicity, "EN 15302, without roll"),
}
"""Position of the wheelset, equivalent conicity and description of each method."""

LIFT = 14.0
"""Distance by which a wheel is drawn above its rail [mm]."""
REFERENCE_AMPLITUDE = 3e-3
"""Amplitude at which conicities are compared [m], EN 15302."""
LARGEST_DIFFERENCE = 10e-3
"""Largest difference of the radii of a wheelset [m], as in a scenario."""
SHIFT_STEP = 0.05e-3
"""Step of the lateral shift [m]."""


@dataclass(frozen=True, eq=False)
class ContactReport:
    """Contact of a wheelset over its lateral shift to the right.

    Attributes:
        pair: Wheel and rail, of the right side if the left one differs.
        shift: Shifts y [m], shape (n,), from the largest one to the left to the largest one to the right.
        radius_difference: Right less left rolling radius [m], shape (n,).
        roll: Roll, right-handed about x forward [rad], shape (n,).
        wheel_station: Contact on the right wheel, outward from the tape circle [m], shape (n,).
        rail_station: Contact on the right rail, outward from its crown [m], shape (n,).
        contact_angle: Inclination of the right contact, positive where the rail falls inward [rad], shape (n,).
        second_depth: Penetration of the right contact from which a second patch touches [m], NaN for none, shape (n,).
        second_wheel_station, second_rail_station: Place of that patch [m], NaN likewise.
        amplitude: Amplitudes A [m], shape (k,).
        conicity: Equivalent conicity at A, shape (k,).
        method: How conicity is computed, a key of :data:`METHODS`.
        left: Pair of the left side, with its contacts (wheel, rail, angle), if it differs; None otherwise.
        larger_left: Radius of the left wheel less that of the right one [m].
        rolling_shift: Shift at which the rolling radii are equal [m], NaN for none; 0 if the sides are alike.
    """

    pair: WheelRailPair
    shift: Reals
    radius_difference: Reals
    roll: Reals
    wheel_station: Reals
    rail_station: Reals
    contact_angle: Reals
    second_depth: Reals
    second_wheel_station: Reals
    second_rail_station: Reals
    amplitude: Reals
    conicity: Reals
    method: Method = "harmonic"
    left: tuple[WheelRailPair, Reals, Reals, Reals] | None = None
    larger_left: float = 0.0
    rolling_shift: float = 0.0

    @property
    def reference_conicity(self) -> float:
        """Equivalent conicity at 3 mm."""
        return float(self.conicity[np.argmin(np.abs(self.amplitude - REFERENCE_AMPLITUDE))])

    def rows(self) -> list[tuple[str, str]]:
        """Return names and values of the table on screen."""
        rows = [("equivalent conicity at 3 mm", f"{self.reference_conicity:.4f}"), ("method", METHODS[self.method][2])]
        for A, conicity in zip(self.amplitude[1::2], self.conicity[1::2], strict=False):
            difference = float(np.interp(A, self.shift, self.radius_difference))
            value = f"rolling-radius difference {difference * 1e3:.3f} mm, conicity {conicity:.4f}"
            rows.append((f"{A * 1e3:g} mm", value))
        if self.left is not None:
            there = f"{self.rolling_shift * 1e3:.3f} mm" if np.isfinite(self.rolling_shift) else "at none of the shifts"
            rows.insert(1, ("equal rolling radii at", there))
        two = np.flatnonzero(np.isfinite(self.second_depth) & (self.shift > 0.0))
        if two.size:
            low, high = self.shift[two[[0, -1]]] * 1e3
            easiest = two[np.argmin(self.second_depth[two])]
            rows.append((
                "second patch",
                f"right wheel, y = {low:.2f} to {high:.2f} mm; at {self.shift[easiest] * 1e3:.2f} mm both touch"
                f" from {self.second_depth[easiest] * 1e6:.0f} um on,"
                f" {abs(self.second_wheel_station[easiest] - self.wheel_station[easiest]) * 1e3:.1f} mm apart",
            ))  # fmt: skip
        return rows

    def to_json(self) -> str:
        """Return all numbers, in SI units, as JSON."""
        placement = {"gauge", "gauge_depth", "cant", "half_spacing", "wheel_radius"}
        settings = self.pair.settings.model_dump(include=placement)
        content: dict[str, Any] = {
            "wheel": self.pair.wheel.name,
            "rail": self.pair.rail.name,
            "settings": settings,
            "units": {"length": "m", "angle": "rad", "conicity": "-"},
            "method": self.method,
            "conicity_at_3mm": self.reference_conicity if np.isfinite(self.reference_conicity) else None,
        }
        names = ("shift", "radius_difference", "roll", "wheel_station", "rail_station", "contact_angle")
        content |= {name: getattr(self, name).tolist() for name in (*names, "amplitude")}
        content["conicity"] = [None if np.isnan(value) else value for value in self.conicity.tolist()]
        if self.left is not None:
            pair, *contacts = self.left
            content |= {"left_wheel": pair.wheel.name, "left_rail": pair.rail.name, "larger_left": self.larger_left}
            content["rolling_shift"] = self.rolling_shift if np.isfinite(self.rolling_shift) else None
            places = ("left_wheel_station", "left_rail_station", "left_contact_angle")
            content |= {name: values.tolist() for name, values in zip(places, contacts, strict=True)}
        for name in ("second_depth", "second_wheel_station", "second_rail_station"):
            content[name] = [None if np.isnan(value) else value for value in getattr(self, name).tolist()]
        return json.dumps(content, indent=1)


def contact_report(
    wheel: Profile,
    rail: Profile,
    settings: ContactSettings,
    largest: float = 8e-3,
    method: Method = "harmonic",
    *,
    left_wheel: Profile | None = None,
    left_rail: Profile | None = None,
    larger_left: float = 0.0,
) -> ContactReport:
    """Compute the contact geometry.

    Args:
        wheel: Wheel profile, of the right wheel if the left one differs.
        rail: Rail profile, likewise.
        settings: Gauge, cant, spacing of the tape circles, wheel radius.
        largest: Largest shift and amplitude [m].
        method: How conicity is computed, a key of :data:`METHODS`.
        left_wheel: Profile of the left wheel if it differs.
        left_rail: Profile of the left rail if it differs.
        larger_left: Radius of the left wheel less that of the right one [m].

    Raises:
        InputError: ``largest`` is not between 3 and 20 mm, a profile ends before the shift is reached, or sides differ
            by too much or with a method that does not know it.
    """
    if not REFERENCE_AMPLITUDE <= largest <= 20e-3:
        raise InputError(f"largest shift = {largest * 1e3:g} mm: must be 3 to 20 mm")
    pair = WheelRailPair(wheel, rail, settings)
    half = round(largest / SHIFT_STEP)
    shift: Reals = SHIFT_STEP * np.arange(-half, half + 1, dtype=np.float64)
    take_position, conicity, _ = METHODS[method]
    amplitude: Reals = 0.5e-3 * np.arange(1, int(largest / 0.5e-3 + 1e-9) + 1, dtype=np.float64)
    alike = left_wheel is None and left_rail is None and larger_left == 0.0
    if alike:
        position, values, rolling = take_position(pair, shift), conicity(pair, amplitude), 0.0
    else:
        _check_sides(larger_left, method)
        sides = UnequalSides(WheelRailPair(left_wheel or wheel, left_rail or rail, settings), pair, larger_left)
        position, values = wheelset_position(sides, shift), unequal_conicity(sides, amplitude, largest)
        rolling = rolling_shift(sides, largest)
    radius = settings.wheel_radius - 0.5 * larger_left
    second = pair.second_contacts(shift - radius * position.roll, position.roll, position.right)
    there = np.where(second.share > 0.0, 1.0, np.nan)
    return ContactReport(
        pair=pair,
        shift=shift,
        radius_difference=position.right.dz_w - position.left.dz_w - larger_left,
        roll=position.roll,
        wheel_station=position.right.s_w,
        rail_station=position.right.s_r,
        contact_angle=np.arctan(position.right.tan_gamma),
        second_depth=there * (second.at.gap - position.right.gap),
        second_wheel_station=there * second.at.s_w,
        second_rail_station=there * second.at.s_r,
        amplitude=amplitude,
        conicity=values,
        method=method,
        left=None if alike else (sides.left, position.left.s_w, position.left.s_r, np.arctan(position.left.tan_gamma)),
        larger_left=larger_left,
        rolling_shift=rolling,
    )


def _check_sides(larger_left: float, method: Method) -> None:
    """Refuse differences between the sides that the report cannot deal with [m]."""
    if not abs(larger_left) <= LARGEST_DIFFERENCE:
        raise InputError(
            f"left wheel larger by {larger_left * 1e3:g} mm in radius: must be at most {LARGEST_DIFFERENCE * 1e3:g} mm"
        )
    if method != "harmonic":
        raise InputError(f"method = {method!r}: must be 'harmonic' where left and right differ")


def draw(report: ContactReport, path: Path) -> None:
    """Draw rolling-radius difference, conicity, and the profiles with lines between contact points.

    Args:
        report: The contact geometry.
        path: Path of the figure; the suffix selects the format.

    Raises:
        InputError: The suffix is not a figure format, or the file cannot be written.
    """
    from matplotlib.figure import Figure

    from tiengine.figures.style import check_suffix, save

    check_suffix(path)
    rows = 3 if report.left is None else 4
    figure = Figure(figsize=(8.0, 8.4 + 3.6 * (rows - 3)), layout="constrained")
    grid = figure.add_gridspec(rows, 2, height_ratios=(1.0, 1.0, 1.5, 1.5)[:rows])
    _draw_difference(figure.add_subplot(grid[0, 0]), report)
    _draw_conicity(figure.add_subplot(grid[0, 1]), report)
    _draw_stations(figure.add_subplot(grid[1, 0]), report)
    _draw_angle(figure.add_subplot(grid[1, 1]), report)
    axes = figure.add_subplot(grid[rows - 1, :])
    _draw_profiles(axes, report, report.pair, report.wheel_station, report.rail_station, "right")
    _draw_second(axes, report)
    if report.left is not None:
        pair, wheels, rails, _ = report.left
        _draw_profiles(figure.add_subplot(grid[2, :]), report, pair, wheels, rails, "left")
    settings = report.pair.settings
    figure.suptitle(
        f"{_pair_names(report)}cant {_cant(settings.cant)}, gauge"
        f" {settings.gauge * 1e3:g} mm, tape circles {2e3 * settings.half_spacing:g} mm apart,"
        f" radius {settings.wheel_radius * 1e3:g} mm",
        fontsize="medium",
    )
    save(figure, path)


def _pair_names(report: ContactReport) -> str:
    """Names of wheel and rail, of both sides if they differ."""
    from tiengine.figures.style import plain

    right = f"{plain(report.pair.wheel.name)} on {plain(report.pair.rail.name)}"
    if report.left is None:
        return f"{right}, "
    pair = report.left[0]
    larger = f", left radius larger by {1e3 * report.larger_left:g} mm" if report.larger_left else ""
    return f"left {plain(pair.wheel.name)} on {plain(pair.rail.name)}, right {right}{larger}\n"


def _cant(cant: float) -> str:
    return f"1:{1.0 / cant:g}" if cant > 0.0 else "0"


def _draw_difference(axes: Axes, report: ContactReport) -> None:
    axes.plot(report.shift * 1e3, report.radius_difference * 1e3, color=BLUE)
    axes.set(xlabel="shift y to the right [mm]", ylabel="rolling-radius difference [mm]")
    axes.grid(alpha=0.3)


def _draw_conicity(axes: Axes, report: ContactReport) -> None:
    value = report.reference_conicity
    axes.plot(report.amplitude * 1e3, report.conicity, color=BLUE, marker="o", markersize=3)
    axes.plot(3.0, value, "s", color=VERMILION, label=f"{value:.4f} at 3 mm")
    axes.set(xlabel="amplitude [mm]", ylabel="equivalent conicity [-]", xlim=(0.0, None), ylim=(0.0, None))
    axes.set_title(METHODS[report.method][2], fontsize="small")
    axes.grid(alpha=0.3)
    axes.legend()


def _draw_stations(axes: Axes, report: ContactReport) -> None:
    axes.plot(report.shift * 1e3, report.wheel_station * 1e3, color=BLUE, label="wheel, from the tape circle")
    axes.plot(report.shift * 1e3, report.rail_station * 1e3, color=ORANGE, ls="--", label="rail, from the crown")
    axes.set(xlabel="shift y to the right [mm]", ylabel="contact, outward [mm]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")


def _draw_angle(axes: Axes, report: ContactReport) -> None:
    axes.plot(report.shift * 1e3, np.degrees(report.contact_angle), color=GREEN)
    axes.set(xlabel="shift y to the right [mm]", ylabel="contact angle, right [deg]")
    axes.grid(alpha=0.3)


def _draw_profiles(
    axes: Axes, report: ContactReport, pair: WheelRailPair, wheels: Reals, rails: Reals, side: str
) -> None:
    """Draw the wheel of a side lifted off its rail, to scale, with lines between contact points every millimetre."""
    lift = LIFT
    offset = (pair.settings.half_spacing - pair.crown_offset) * 1e3
    s, o = np.linspace(*pair.wheel.span, 600), np.linspace(*pair.canted_rail.span, 600)
    axes.plot(offset + s * 1e3, pair.wheel.height(s) * 1e3 - lift, color=BLUE)
    axes.plot(o * 1e3, pair.canted_rail.height(o) * 1e3, color=ORANGE)
    labelled = np.inf
    middle, every = report.shift.size // 2, round(1e-3 / SHIFT_STEP)
    for i in range(middle % every, report.shift.size, every):
        wheel, rail = wheels[i], rails[i]
        ends = [offset + wheel * 1e3, rail * 1e3]
        heights = [float(pair.wheel.height(wheel)) * 1e3 - lift, float(pair.canted_rail.height(rail)) * 1e3]
        axes.plot(ends, heights, "o-", color=VERMILION, markersize=3, linewidth=0.8)
        if abs(ends[0] - labelled) > 2.5 or i == middle:  # otherwise the labels overlap
            labelled = ends[0]
            label = f"{report.shift[i] * 1e3:.0f}"
            axes.annotate(label, (ends[0], heights[0]), (0, 5), textcoords="offset points", ha="center", fontsize=7)
    axes.set(xlabel="outward from the rail's crown [mm]", ylabel="down [mm]", aspect="equal")
    axes.set_title(f"{side} wheel, drawn above its rail; contacts at shifts y [mm]", fontsize="small")
    axes.invert_yaxis()
    axes.grid(alpha=0.3)


def _draw_second(axes: Axes, report: ContactReport) -> None:
    """Draw second patches of the right wheel at every shift at which there is one."""
    pair, lift = report.pair, LIFT
    offset = (pair.settings.half_spacing - pair.crown_offset) * 1e3
    two = np.isfinite(report.second_depth)
    if two.any():
        wheels, rails = report.second_wheel_station[two], report.second_rail_station[two]
        ends_y = np.stack([offset + wheels * 1e3, rails * 1e3])
        ends_z = np.stack([pair.wheel.height(wheels) * 1e3 - lift, pair.canted_rail.height(rails) * 1e3])
        axes.plot(ends_y, ends_z, "o-", color=GREEN, markersize=1.5, linewidth=0.4)
        axes.plot([], [], color=GREEN, label="second patch")
        axes.legend(fontsize="small")
