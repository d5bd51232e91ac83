"""Compact form of a vehicle: a coach on two bogies, in the terms of vehicle data sheets.

Stiffness and damping are per axle box (8) and per air spring (4); there are two yaw and two lateral
dampers per bogie. :func:`expand` turns it into the bodies car, frame 1 and 2, wheelset 1 ... 4 and the connectors
between them. Where a data sheet omits the heights of the ends of an element, its class states the default.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field, model_validator

from tiengine.parameters.conventions import SIDES
from tiengine.parameters.quantity import Name, Params, Q, Source
from tiengine.vehicle.connector import (
    Body,
    Damper,
    Damping,
    Forces,
    RollStiffness,
    SeriesSprings,
    Spring,
    Stiffness,
    Stop,
    VehicleClass,
    check_damper,
    check_stop,
)

__all__ = ["Coach", "expand"]

_Span = Annotated[float, Q("m", gt=0, le=100)]
_Height = Annotated[float, Q("m", "above the rail", gt=0, le=10)]
_Rates = tuple[Annotated[float, Q("m/s", ge=0)], ...]
_SIDES = ((-1.0, SIDES[0]), (1.0, SIDES[1]))


class Geometry(Params):
    """Main dimensions; spans are lateral, from the centre line.

    Attributes:
        wheel_radius: At the tape circle.
        half_bogie_centres: Half the distance of the bogies' centres.
        half_wheelbase: Half the distance of a bogie's axles.
        half_span_primary: Of the primary springs.
        half_span_secondary: Of the secondary springs.
        half_span_contact: Of the tape circles.
        length_over_couplers: Pitch of the vehicles of a train.
        height_frame_cg: Centre of gravity of a frame above the rail.
        height_car_cg: Centre of gravity of the car body above the rail.
    """

    wheel_radius: Annotated[float, Q("m", gt=0, le=1.5)]
    half_bogie_centres: _Span
    half_wheelbase: _Span
    half_span_primary: _Span
    half_span_secondary: _Span
    half_span_contact: _Span
    length_over_couplers: _Span
    height_frame_cg: _Height
    height_car_cg: _Height
    H_tw: Annotated[float, Q("m", "primary upper plane below the frame's centre of gravity")]
    H_Bt: Annotated[float, Q("m", "secondary lower plane above the frame's centre of gravity")]
    H_cB: Annotated[float, Q("m", "secondary upper plane below the car's centre of gravity")]


class Inertia(Params):
    """Mass and moments of inertia of a body.

    Attributes:
        mass: Mass.
        Jx: Roll inertia.
        Jy: Pitch inertia; of a wheelset its spin inertia.
        Jz: Yaw inertia.
    """

    mass: Annotated[float, Q("kg", gt=0)]
    Jx: Annotated[float, Q("kg m^2", gt=0)]
    Jy: Annotated[float, Q("kg m^2", gt=0)]
    Jz: Annotated[float, Q("kg m^2", gt=0)]


class Suspension(Params):
    """Spring and damper in parallel, per axle box or per air spring.

    Attributes:
        kx: Longitudinal stiffness.
        ky: Lateral stiffness.
        kz: Vertical stiffness.
        cx: Longitudinal damping.
        cy: Lateral damping.
        cz: Vertical damping.
    """

    kx: Stiffness
    ky: Stiffness
    kz: Stiffness
    cx: Damping = 0.0
    cy: Damping = 0.0
    cz: Damping = 0.0


class Secondary(Suspension):
    """Air or coil spring with its own bending stiffness."""

    k_bending: Annotated[float, Q("N m/rad", "roll and pitch, per spring", ge=0)] = 0.0


class PrimaryNode(Params):
    """Bush of the axle-box arm, in parallel with the primary spring, per axle box.

    Attributes:
        x_from_bogie_centre: Along the track.
        kx: Longitudinal stiffness.
        ky: Lateral stiffness.
    """

    x_from_bogie_centre: _Span
    height: _Height
    kx: Stiffness
    ky: Stiffness


class Curve(Params):
    """Damper table: slopes c from the rates v on, or points (v, F).

    Attributes:
        v: Rates.
        c: Slopes from these rates on.
        F: Forces at these rates.
        k_series: Stiffness of the spring of its ends, 0 for none.
    """

    v: _Rates = (0.0,)
    c: tuple[Damping, ...] = ()
    F: Forces = ()
    k_series: Stiffness = 0.0

    @model_validator(mode="after")
    def _check_curve(self) -> Curve:
        check_damper(self.v, self.c, self.F)
        return self

    @property
    def law(self) -> dict[str, Any]:
        """Keys shared with :class:`~tiengine.vehicle.connector.Damper`."""
        return {"v": self.v, "c": self.c, "F": self.F, "k_series": self.k_series}


class PrimaryDamper(Curve):
    """Vertical damper, per axle box.

    Attributes:
        x_from_bogie_centre: Along the track; default: over the axle.
    """

    x_from_bogie_centre: _Span | None = None


class YawDamper(Curve):
    """Longitudinal damper, one per side and bogie.

    Attributes:
        half_span: Lateral, from the centre line.
        height_frame: Above the rail; default: the lower plane of the secondary springs.
        height_car: Above the rail; default: the upper plane of the secondary springs.
    """

    half_span: _Span
    height_frame: _Height | None = None
    height_car: _Height | None = None


class LateralDamper(Curve):
    """Lateral damper, two per bogie, at +x and -x.

    Attributes:
        x_from_bogie_centre: Along the track.
        height_frame: Above the rail; default: the lower plane of the secondary springs.
        height_car: Above the rail; default: the upper plane of the secondary springs.
    """

    x_from_bogie_centre: Annotated[float, Q("m", ge=0)] = 0.0
    height_frame: _Height | None = None
    height_car: _Height | None = None


class LateralStop(Params):
    """Bump stop between car and frame at the bogie's centre, points (x, F) of either side.

    Attributes:
        x: Elongations.
        F: Forces at these elongations.
    """

    height: _Height
    x: tuple[Annotated[float, Q("m", ge=0)], ...]
    F: Forces

    @model_validator(mode="after")
    def _check(self) -> LateralStop:
        check_stop(self.x, self.F)
        return self


class TractionRod(Params):
    """Longitudinal spring at the bogie's centre.

    Attributes:
        kx: Longitudinal stiffness.
    """

    kx: Stiffness
    height_frame: _Height
    height_car: _Height


class AntiRoll(Params):
    """Torsion bar between car and frame, per bogie.

    Attributes:
        k: Stiffness against roll.
    """

    k: RollStiffness


class Coach(Params):
    """Coach on two two-axle bogies, with optional parts in the general form.

    Attributes:
        body: Additional bodies.
        spring: Additional springs.
        damper: Additional dampers.
        stop: Additional stops.
    """

    name: Name
    source: Source = ""
    vehicle_class: Annotated[VehicleClass, Field(description="selects the limits of indices")] = "coach"
    series_springs: SeriesSprings = False
    geometry: Geometry
    car: Inertia
    frame: Inertia
    wheelset: Inertia
    primary: Suspension
    primary_node: PrimaryNode | None = None
    primary_damper: PrimaryDamper | None = None
    secondary: Secondary
    yaw_damper: YawDamper | None = None
    lateral_damper: LateralDamper | None = None
    lateral_stop: LateralStop | None = None
    traction_rod: TractionRod | None = None
    anti_roll: AntiRoll | None = None
    body: tuple[Body, ...] = ()
    spring: tuple[Spring, ...] = ()
    damper: tuple[Damper, ...] = ()
    stop: tuple[Stop, ...] = ()

    @property
    def secondary_planes(self) -> tuple[float, float]:
        """Heights of the secondary springs' upper and lower ends [m]."""
        geometry = self.geometry
        return geometry.height_car_cg - geometry.H_cB, geometry.height_frame_cg + geometry.H_Bt


def expand(coach: Coach) -> dict[str, Any]:
    """Expand a coach to bodies and connectors.

    Args:
        coach: The compact form.

    Returns:
        Fields of :class:`tiengine.vehicle.vehicle.Vehicle`.
    """
    geometry = coach.geometry
    parts = [*_axle_box_parts(coach), *_bogie_parts(coach)]
    return {
        "name": coach.name,
        "source": coach.source,
        "vehicle_class": coach.vehicle_class,
        "series_springs": coach.series_springs,
        "wheel_radius": geometry.wheel_radius,
        "half_span_contact": geometry.half_span_contact,
        "length_over_couplers": geometry.length_over_couplers,
        "body": (*_bodies(coach), *coach.body),
        "spring": (*(part for part in parts if isinstance(part, Spring)), *coach.spring),
        "damper": (*(part for part in parts if isinstance(part, Damper)), *coach.damper),
        "stop": (*(part for part in parts if isinstance(part, Stop)), *coach.stop),
    }


def _bogies(coach: Coach) -> Iterator[tuple[str, float]]:
    """Name of the frame and x of the bogie's centre [m], the leading one first."""
    for k, sign in enumerate((1.0, -1.0)):
        yield f"frame {k + 1}", sign * coach.geometry.half_bogie_centres


def _axles(coach: Coach) -> Iterator[tuple[str, str, float, float]]:
    """Frame, wheelset, x of the bogie's centre [m] and sign of the axle's x from it, leading first."""
    for i, (frame, centre) in enumerate(_bogies(coach)):
        for k, sign in enumerate((1.0, -1.0)):
            yield frame, f"wheelset {2 * i + k + 1}", centre, sign


def _bodies(coach: Coach) -> Iterator[Body]:
    geometry = coach.geometry
    yield Body(name="car", height=geometry.height_car_cg, **coach.car.model_dump())
    for name, x in _bogies(coach):
        yield Body(name=name, x=x, height=geometry.height_frame_cg, **coach.frame.model_dump())
    for _, name, centre, sign in _axles(coach):
        x = centre + sign * geometry.half_wheelbase
        inertia = coach.wheelset.model_dump()
        yield Body(name=name, x=x, height=geometry.wheel_radius, wheelset=True, **inertia)


def _axle_box_parts(coach: Coach) -> Iterator[Spring | Damper]:
    """Primary spring, arm bush and damper of every axle box."""
    geometry, node, damper = coach.geometry, coach.primary_node, coach.primary_damper
    upper, lower = geometry.height_frame_cg - geometry.H_tw, geometry.wheel_radius
    for frame, axle, centre, sign in _axles(coach):
        over_axle = centre + sign * geometry.half_wheelbase
        for side, word in _SIDES:
            y, name = side * geometry.half_span_primary, f"{axle} {word} primary"
            ends = _ends(frame, axle, over_axle, y, upper, lower)
            yield Spring(name=f"{name} spring", **ends, **coach.primary.model_dump())
            if node:
                x = centre + sign * node.x_from_bogie_centre
                ends = _ends(frame, axle, x, y, node.height, node.height)
                yield Spring(name=f"{name} node", kx=node.kx, ky=node.ky, **ends)
            if damper:
                x = centre + sign * (damper.x_from_bogie_centre or geometry.half_wheelbase)
                ends = _ends(frame, axle, x, y, upper, lower)
                yield Damper(name=f"{name} damper", direction="z", **ends, **damper.law)


def _bogie_parts(coach: Coach) -> Iterator[Spring | Damper | Stop]:
    """Springs, dampers and stops between the car and each frame."""
    for frame, centre in _bogies(coach):
        yield from _secondary(coach, frame, centre)
        yield from _secondary_dampers(coach, frame, centre)
        yield from _centre_parts(coach, frame, centre)


def _ends(a: str, b: str, x: float, y: float, upper: float, lower: float) -> dict[str, Any]:
    """Bodies and ends of a connector, one end above the other."""
    return {"a": a, "b": b, "point_a": (x, y, upper), "point_b": (x, y, lower)}


def _secondary(coach: Coach, frame: str, centre: float) -> Iterator[Spring]:
    laws = coach.secondary.model_dump(exclude={"k_bending"})
    bending = coach.secondary.k_bending
    for side, word in _SIDES:
        y = side * coach.geometry.half_span_secondary
        ends = _ends("car", frame, centre, y, *coach.secondary_planes)
        yield Spring(name=f"{frame} {word} air spring", k_roll=bending, k_pitch=bending, **ends, **laws)


def _secondary_dampers(coach: Coach, frame: str, centre: float) -> Iterator[Damper]:
    yaw, lateral = coach.yaw_damper, coach.lateral_damper
    upper, lower = coach.secondary_planes
    for side, word in _SIDES:
        if yaw:
            heights = yaw.height_car or upper, yaw.height_frame or lower
            ends = _ends("car", frame, centre, side * yaw.half_span, *heights)
            yield Damper(name=f"{frame} {word} yaw damper", direction="x", **ends, **yaw.law)
        if lateral:
            # force and elongation do not depend on y: one damper ahead of the bogie centre, one behind it
            heights = lateral.height_car or upper, lateral.height_frame or lower
            ends = _ends("car", frame, centre - side * lateral.x_from_bogie_centre, 0.0, *heights)
            yield Damper(name=f"{frame} {word} lateral damper", direction="y", **ends, **lateral.law)


def _centre_parts(coach: Coach, frame: str, centre: float) -> Iterator[Spring | Stop]:
    stop, rod, bar = coach.lateral_stop, coach.traction_rod, coach.anti_roll
    if stop:
        ends = _ends("car", frame, centre, 0.0, stop.height, stop.height)
        yield Stop(name=f"{frame} lateral stop", direction="y", x=stop.x, F=stop.F, **ends)
    if rod:
        ends = _ends("car", frame, centre, 0.0, rod.height_car, rod.height_frame)
        yield Spring(name=f"{frame} traction rod", kx=rod.kx, **ends)
    if bar:
        ends = _ends("car", frame, centre, 0.0, *coach.secondary_planes)
        yield Spring(name=f"{frame} anti-roll bar", k_roll=bar.k, **ends)
