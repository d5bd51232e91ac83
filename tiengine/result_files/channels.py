"""Names, units and meaning of the channels of a result file; their dimensions are in :mod:`.layout`.

The names are a public interface: scripts of users rely on them. Forces act from the wheel on the rail, in the
track frame (x forward, y right, z down): vertical positive down, lateral positive to the right.
"""

from __future__ import annotations

from typing import NamedTuple

__all__ = [
    "BODY", "DEFLECTION", "DIRECTIONS", "DOFS", "GAUGE_FORCE", "GAUGE_MOTION", "GAUGE_OPENING", "GROUPS",
    "IRREGULARITY", "MORTAR", "OPENINGS", "PATCH", "SEATS", "SLABS", "WHEEL", "Channel",
]  # fmt: skip


class Channel(NamedTuple):
    """One recorded quantity.

    Attributes:
        units: SI unit; one per degree of freedom, separated by commas, where they differ.
        long_name: Description.
    """

    units: str
    long_name: str


DOFS = ("y", "z", "roll", "pitch", "yaw")
DIRECTIONS = ("y", "z")

WHEEL = {
    "normal_force": Channel("N", "normal contact force, zero when the wheel has lifted off"),
    "vertical_force": Channel("N", "vertical force of the wheel on the rail, positive down"),
    "lateral_force": Channel("N", "lateral force of the wheel on the rail, positive to the right"),
    "longitudinal_creepage": Channel("1", "longitudinal creepage"),
    "lateral_creepage": Channel("1", "lateral creepage in the contact plane"),
    "spin_creepage": Channel("1/m", "spin creepage"),
    "penetration": Channel("m", "elastic approach along the contact normal, negative when lifted"),
    "contact_position_wheel": Channel("m", "contact position on the wheel, outward from the tape circle"),
    "contact_position_rail": Channel("m", "contact position on the rail, outward from the crown"),
    "rolling_radius": Channel("m", "rolling radius at the contact"),
    "rail_deflection": Channel("m", "vertical deflection of the rail under the wheel, positive down"),
    "longitudinal_creep_force": Channel("N", "longitudinal creep force on the wheel"),
    "lateral_creep_force": Channel("N", "lateral creep force on the wheel, in the contact plane"),
    "spin_moment": Channel("N m", "spin creep moment on the wheel about the contact normal"),
}

PATCH = {
    "normal_force": Channel("N", "normal force of the patch"),
    "share": Channel(
        "1", "part of the wheel's normal force that the patch carries, zero when the wheel has lifted off"
    ),
    "contact_position_wheel": Channel("m", "position of the patch on the wheel, outward from the tape circle"),
    "contact_position_rail": Channel("m", "position of the patch on the rail, outward from the crown"),
    "contact_angle": Channel(
        "rad", "inclination of the patch to the track's plane, positive where the rail falls inward"
    ),
    "longitudinal_creepage": Channel("1", "longitudinal creepage in the patch"),
    "lateral_creepage": Channel("1", "lateral creepage in the plane of the patch"),
    "spin_creepage": Channel("1/m", "spin creepage in the patch"),
    "longitudinal_creep_force": Channel("N", "longitudinal creep force of the patch on the wheel"),
    "lateral_creep_force": Channel("N", "lateral creep force of the patch on the wheel, in the plane of the patch"),
    "wear_number": Channel("N", "T gamma of the patch: creep forces times creepages, along and across, without spin"),
}
"""Channels of the two patches of a wheel, with ``contact.patches = 2``; those of a patch that does not touch hold the
geometry and creepages it would have, with zero forces."""

BODY = {
    "displacement": Channel("m, m, rad, rad, rad", "displacement of the body: y, z, roll, pitch, yaw"),
    "velocity": Channel("m/s, m/s, rad/s, rad/s, rad/s", "velocity of the body: y, z, roll, pitch, yaw"),
    "acceleration": Channel(
        "m/s^2, m/s^2, rad/s^2, rad/s^2, rad/s^2", "acceleration of the body: y, z, roll, pitch, yaw"
    ),
}

IRREGULARITY = {
    "vertical": Channel("m", "vertical irregularity under the wheel, positive down"),
    "lateral": Channel("m", "lateral irregularity under the wheel, positive to the right"),
}

MORTAR = {
    "slab": Channel("1", "index of the slab in each slot of the window, from chainage 0"),
    "largest_pressure": Channel("Pa", "largest pressure of the mortar under the slab, dead weight included"),
    "smallest_pressure": Channel("Pa", "smallest pressure of the mortar under the slab, dead weight included"),
}
"""Channels of the slabs in the window, each in the slot given by its index modulo the number of slots."""

SEATS = {
    "largest_vertical_force": Channel("N", "largest vertical force of the rail on the fastening, positive down"),
    "smallest_vertical_force": Channel("N", "smallest vertical force of the rail on the fastening, negative is uplift"),
    "largest_lateral_force": Channel("N", "largest lateral force of the rail on the fastening, positive to the right"),
    "smallest_lateral_force": Channel("N", "smallest lateral force of the rail on the fastening"),
    "factor": Channel("1", "factor of the defects on the fastening's stiffness, 1 sound, 0 failed or hanging"),
}
"""Extremes over all time steps."""

SLABS = {
    "largest_pressure": Channel("Pa", "largest pressure of the mortar, dead weight included"),
    "smallest_pressure": Channel("Pa", "smallest pressure of the mortar, dead weight included"),
    "largest_deflection": Channel("m", "largest deflection of the slab beyond its own weight, positive down"),
    "smallest_deflection": Channel("m", "smallest deflection of the slab"),
    "largest_moment_x": Channel("N m/m", "largest bending moment along the track, positive with tension below"),
    "smallest_moment_x": Channel("N m/m", "smallest bending moment along the track"),
    "largest_moment_y": Channel("N m/m", "largest bending moment across the track, positive with tension below"),
    "smallest_moment_y": Channel("N m/m", "smallest bending moment across the track"),
    "mortar_factor": Channel(
        "1", "smallest factor of the voids under the slab on its bed, 0 with a gap, 1 without voids"
    ),
}
"""Extremes over the area of the slab and over the samples of the bodies."""

OPENINGS = {
    "opening_at_rest": Channel("m", "largest opening between slab and bed before the train comes"),
    "largest_opening": Channel("m", "largest opening between slab and bed anywhere under the slab"),
    "smallest_opening": Channel(
        "m", "smallest opening at the place where it is largest at rest, 0 if the gap closes there"
    ),
    "closings": Channel("1", "times that the gap closed at that place"),
}
"""Further extremes of slabs on a bed without tension, with splines; 0 for slabs that are sound among sound ones."""

DEFLECTION = {
    "rail": Channel("m", "vertical deflection of the rail, positive down"),
    "slab": Channel("m", "vertical deflection of the slab under the rail, positive down; NaN over joints"),
}

GAUGE_MOTION = {
    "displacement": Channel("m", "displacement at the gauge: y right, z down"),
    "velocity": Channel("m/s", "velocity at the gauge: y right, z down"),
    "acceleration": Channel("m/s^2", "acceleration at the gauge: y right, z down"),
}
"""Channels of a gauge on a rail or a slab."""

GAUGE_FORCE = {
    "vertical_force": Channel("N", "vertical force of the rail on the fastening, positive down"),
    "lateral_force": Channel("N", "lateral force of the rail on the fastening, positive to the right"),
}
"""Channels of a gauge on a fastening."""

GAUGE_OPENING = {"opening": Channel("m", "opening between slab and bed, 0 in contact; NaN over a void without bed")}
"""Channel of a gauge in a gap."""

GROUPS = {
    "wheel": WHEEL,
    "patch": PATCH,
    "body": BODY,
    "irregularity": IRREGULARITY,
    "mortar": MORTAR,
    "seats": SEATS,
    "slabs": SLABS | OPENINGS,
    "deflection": DEFLECTION,
}
