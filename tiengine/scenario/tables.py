"""Tables of a scenario: train, track, contact, numerics, output.

Speeds are in km/h here only; inside they are in m/s.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from tiengine.irregularity.base_motion import BaseMotion
from tiengine.irregularity.ground import Ground
from tiengine.irregularity.rail_shapes import RailShape
from tiengine.irregularity.wheel_shapes import WheelShape
from tiengine.parameters.quantity import Params, Q
from tiengine.result_files.channels import BODY, IRREGULARITY, WHEEL
from tiengine.scenario.key_checks import channel_names, check_speed, number_or
from tiengine.scenario.part import Part
from tiengine.scenario.wheel_profiles import WheelProfile
from tiengine.track.alignment import Alignment
from tiengine.track.alignment_elements import AlignmentElement, AlignmentRows, alignment_of
from tiengine.track.alignment_file import MOST_ROWS
from tiengine.track.defects import FailedFastenings
from tiengine.track.knots import Grading
from tiengine.track.mortar import MortarVoid
from tiengine.track.slab_warp import SlabWarp
from tiengine.vehicle.assembly import Effort
from tiengine.vehicle.force_history import BodyForce
from tiengine.vehicle.speed_programme import SpeedProfile
from tiengine.vehicle.wind import Wind

__all__ = ["BlowingWind", "Contact", "Numerics", "Output", "Track", "Train"]

MOST_DEFECTS = 10_000  # of each kind
MOST_SHAPES = 1000  # of rails, of wheels


class Coupled(Params):
    """Coupling of neighbouring vehicles, a part; several entries for the same vehicles add."""

    part: Annotated[Part, Field(description="part: springs, dampers and stops between two vehicles")]
    behind: Annotated[
        tuple[Annotated[int, Q("-", "number", ge=1, le=64)], ...] | Literal["all"],
        Field(description="vehicles behind which it lies, counted from the front from 1"),
    ] = "all"


class Train(Params):
    """Vehicles, speed and distance of the train; parts are explained below."""

    vehicles: Annotated[
        tuple[Part, ...], Field(min_length=1, max_length=64, description="parts, the leading one first")
    ]
    coupler_pitch: Annotated[
        float | tuple[float, ...] | None,
        Field(
            description="distance between centres of neighbours, one number or one per coupling; by default from the"
            " vehicles' lengths over couplers",
            json_schema_extra={"unit": "m"},
        ),
    ] = None
    speed_kmh: Annotated[
        float | tuple[tuple[float, float], ...],
        BeforeValidator(check_speed),
        Field(
            description="a number, or rows [chainage of the first vehicle's centre in m, km/h] between which"
            " the kinetic energy is interpolated smoothly; above 0, at most 1000",
            json_schema_extra={"unit": "km/h"},
        ),
    ]
    distance: Annotated[float, Q("m", "distance the train covers", gt=0, le=1e6)]
    start: Annotated[
        float | Literal["auto"],
        number_or("auto", "m", 0.0, 1e7),
        Field(
            description="chainage of the first vehicle's centre at t = 0; \"auto\": the window's rear end is at zero"
        ),
    ] = "auto"
    wheel_profile: Annotated[Part, Field(description="part: profile of all wheels that have no other")] = "LMA"
    wheel_profiles: Annotated[
        tuple[WheelProfile, ...], Field(description="tables, see below", max_length=MOST_SHAPES)
    ] = ()
    series_springs: Annotated[
        bool,
        Field(description="springs in series with dampers (k_series) are modelled; a vehicle may also set this itself"),
    ] = False
    couplings: Annotated[tuple[Coupled, ...], Field(description="tables, see below", max_length=100)] = ()
    wheel_shapes: Annotated[tuple[WheelShape, ...], Field(description="tables, see below", max_length=MOST_SHAPES)] = ()
    forces: Annotated[tuple[BodyForce, ...], Field(description="tables, see below", max_length=1000)] = ()
    effort: Annotated[
        Effort,
        Field(
            description='where the force that changes the speed acts: "wheels", braked or driven, so that creep forces'
            ' carry it; "axles", as from a linear motor'
        ),
    ] = "wheels"

    @property
    def speed(self) -> SpeedProfile:
        """Speed [m/s] over the chainage of the first vehicle's centre [m]."""
        return _speed_profile(self.speed_kmh)


@lru_cache(maxsize=64)
def _speed_profile(speed_kmh: float | tuple[tuple[float, float], ...]) -> SpeedProfile:
    """Build a profile once per value; ``Train.speed`` is read several times per chunk of steps."""
    if isinstance(speed_kmh, tuple):
        return SpeedProfile.table(*zip(*((x, v / 3.6) for x, v in speed_kmh), strict=True))
    return SpeedProfile.constant(speed_kmh / 3.6)


class Track(Params):
    """Track, friction and defects."""

    rail: Annotated[Part, Field(description="part: section and material")] = "CHN60"
    rail_profile: Annotated[Part, Field(description="part: surface of the railheads")] = "CHN60"
    rail_profile_left: Annotated[Part | None, Field(description="part: surface of the left railhead if another")] = None
    rail_profile_right: Annotated[Part | None, Field(description="part: surface of the right railhead if another")] = (
        None
    )
    slab: Annotated[Part, Field(description="part: slab and its bed")] = "CRTS_III"
    fastening: Annotated[Part, Field(description="part: spring and damper of a seat")] = "ACE2021"
    friction: Annotated[float, Q("-", "coefficient of friction", gt=0, le=1)] = 0.3
    gauge: Annotated[float, Q("m", "distance between the gauge faces", ge=0.6, le=2.0)] = 1.435
    gauge_depth: Annotated[float, Q("m", "depth below the top of the rail where gauge is measured", gt=0, le=0.03)] = (
        0.016
    )
    cant: Annotated[float, Q("-", "inward inclination of the rail", ge=0, le=0.1)] = 0.025
    alignment: Annotated[
        tuple[AlignmentElement, ...],
        Field(description="tables, see below; straight and level without them", max_length=MOST_DEFECTS),
    ] = ()
    alignment_file: Annotated[
        str | None,
        Field(description="the line as CSV (docs/files.md), relative to the scenario; read once", max_length=4096),
    ] = None
    alignment_rows: Annotated[
        AlignmentRows,
        Field(
            description="the line as rows [chainage in m, curvature in 1/m, cant in mm, gradient in permille], linear"
            " between them; made from alignment_file",
            max_length=MOST_ROWS,
        ),
    ] = ()
    alignment_rounding: Annotated[
        float, Q("m", "length over which the ends of transitions and vertical curves are rounded", ge=1, le=100)
    ] = 10.0
    mortar_no_tension: Annotated[
        bool, Field(description="the bed transmits no tension; the slab's dead weight counts as pressure")
    ] = False
    failed_fastenings: Annotated[
        tuple[FailedFastenings, ...], Field(description="tables, see below", max_length=MOST_DEFECTS)
    ] = ()
    mortar_voids: Annotated[
        tuple[MortarVoid, ...], Field(description="tables, see below", max_length=MOST_DEFECTS)
    ] = ()
    rail_shapes: Annotated[tuple[RailShape, ...], Field(description="tables, see below", max_length=MOST_SHAPES)] = ()
    base_motion: Annotated[BaseMotion, Field(description="table, see below")] = BaseMotion()
    ground: Annotated[tuple[Ground, ...], Field(description="tables, see below", max_length=MOST_SHAPES)] = ()
    slab_warps: Annotated[tuple[SlabWarp, ...], Field(description="tables, see below", max_length=1000)] = ()

    @property
    def line(self) -> Alignment | None:
        """Curvature, cant and gradient over chainage; None if there are none."""
        return _line(self.alignment, self.alignment_rows, self.alignment_rounding)


@lru_cache(maxsize=16)
def _line(
    elements: tuple[AlignmentElement, ...], rows: tuple[tuple[float, float, float, float], ...], rounding: float
) -> Alignment | None:
    """Line once per value; ``Track.line`` is read many times."""
    return alignment_of(elements, rows, rounding)


class BlowingWind(Wind):
    """Wind on car bodies; absent without its `speed`.

    `speed` is a number, or rows between which it is interpolated smoothly: over the chainage of each car's middle, or
    over time; the first and last hold beyond them. With a `gust` it is the speed of the mean wind, and the gust of
    EN 14067-6 ("Chinese hat") stands at `gust_at`: its top is 1.6946 times the mean wind, and it is averaged over the
    length of each car. Numbers of the gust are from memory.
    """

    aerodynamics: Annotated[Part, Field(description="part: coefficients of the car bodies")] = "EMU_lead"


def _not_a_bool(value: object) -> object:
    """Refuse true and false, which equal 1 and 0."""
    if isinstance(value, bool):
        raise ValueError("must be 1 or 2")
    return value


class Contact(Params):
    """Wheel-rail contact."""

    patches: Annotated[
        Literal[1, 2],
        BeforeValidator(_not_a_bool),
        Field(description="contact patches a wheel can have; 2 lets tread and flange carry load at the same time"),
    ] = 1

    hertz: Annotated[
        Literal["exact", "zhai_worn", "zhai_cone"],
        Field(description="approach by Hertz from the curvatures, or by Zhai's formulas for worn or conical treads"),
    ] = "exact"
    smoothing: Annotated[
        float, Q("m", "standard deviation of a Gaussian over the wheel's lateral shift", ge=0, le=2e-3)
    ] = 1e-4
    cross_level_rolls_rails: Annotated[
        bool, Field(description="a cross level rotates the railheads with the track; otherwise it only shifts them")
    ] = True


class Numerics(Params):
    """Discretisation and time integration.

    The rails are described by cubic splines on knots that travel with the window, close together under the wheels and
    further apart away from them (``[numerics.knots]``), or by the sines of the source paper over the whole window.
    Splines touch their neighbours only, so that the cost of a step grows in proportion to the train; with sines it
    grows with the square of the window. A fastening acts on the rail over a length (``length`` of the fastening): with
    seats that are points the forces do not converge below 1 % of their peak, whatever the trial functions. With seats
    of 0.15 m the default splines keep wheel forces within 0.4 % of their peak, 0.2 % for 99 % of the time.

    The static compliance that the trial functions lack under a wheel is added in series with its contact. The window
    ends 8 m beyond the outer wheels, eight decay lengths of a rail on its fastenings.

    The impact after a wheel's lift-off sends waves of 1 to 3 kHz along the rail at the shear wave speed, 2030 m/s; the
    window's pinned ends reflect them. An ``absorbing_zone`` at either end, with springs and dampers from rail to
    ground up to as strong as the fastenings', absorbs most of them: with 6 m in a window of 36 m the largest
    reflection, 0.27 % of the peak force, falls to 0.14 %. The zone must keep 2 m from the wheels.
    """

    trial_functions: Annotated[
        Literal["splines", "sines"], Field(description="functions that describe the rails in the window")
    ] = "splines"
    knots: Annotated[Grading, Field(description="knots of the splines")] = Grading()
    modes_per_metre: Annotated[float, Q("1/m", "sines per field and metre of window", ge=0.2, le=20)] = 6.5
    window: Annotated[
        float | Literal["auto"],
        number_or("auto", "m", 1.0, 2000.0),
        Field(description='length of the moving window; "auto": span of the wheels and 8 m at either end'),
    ] = "auto"
    time_step: Annotated[
        float | Literal["auto"],
        number_or("auto", "s", 1e-6, 1e-3),
        Field(
            description='"auto": the longest of 2e-4, 1e-4, 5e-5, 2.5e-5 s that is stable and follows the irregularity'
        ),
    ] = "auto"
    passes: Annotated[int, Q("-", "passes of the explicit part per step", ge=1, le=20)] = 2
    start: Annotated[
        Literal["equilibrium", "zero"], Field(description="steady rolling, or all parts unloaded and at rest")
    ] = "equilibrium"
    mortar: Annotated[
        Literal["implicit", "explicit"],
        Field(description="part of the integration that holds the mortar bed; results are the same"),
    ] = "implicit"
    truncation: Annotated[
        Literal["none", "local", "static"],
        Field(
            description="static compliance that the trial functions lack: left out, added under the wheels, or"
            ' ("static", sines only) added under the wheels, at the seats and between them'
        ),
    ] = "local"
    absorbing_zone: Annotated[float, Q("m", "length at either end of the window, see above", ge=0)] = 0.0
    slab_count: Annotated[
        Literal["cover", "paper"], Field(description="slabs under the whole window, or the source paper's count")
    ] = "cover"
    threads: Annotated[int, Q("-", "threads of Taichi's loop over trains; 1 with splines", ge=1, le=1024)] = 1

    def modes(self, window: float) -> int:
        """Sines of each rail field in a window of the given length [m]."""
        return max(1, round(self.modes_per_metre * window))


class Output(Params):
    """Channels and sampling intervals of the result file; intervals are rounded to whole steps (docs/results.md)."""

    wheel_interval: Annotated[
        float | Literal["step"],
        number_or("step", "s", 1e-6, 10.0),
        Field(description="interval between samples of wheels, irregularity and gauges"),
    ] = "step"
    body_interval: Annotated[
        float | Literal["step"],
        number_or("step", "s", 1e-6, 10.0),
        Field(description="interval between samples of bodies, mortar and slabs"),
    ] = 1e-3
    wheel_channels: Annotated[tuple[str, ...], channel_names(WHEEL), Field(description='names, or "all"')] = tuple(
        WHEEL
    )
    body_channels: Annotated[tuple[str, ...], channel_names(BODY), Field(description='names, or "all"')] = tuple(BODY)
    irregularity_channels: Annotated[
        tuple[str, ...], channel_names(IRREGULARITY), Field(description='names, or "all"')
    ] = tuple(IRREGULARITY)
    envelopes: Annotated[
        bool, Field(description="whether extremes of every seat and slab are written, groups seats and slabs")
    ] = True
    deflection_interval: Annotated[
        float | Literal["none"],
        number_or("none", "s", 1e-6, 10.0),
        Field(description="interval between samples of rail and slab along the whole window, group deflection"),
    ] = 0.1
    precision: Annotated[
        Literal["single", "double"], Field(description="floating-point format of the channels in the file")
    ] = "single"
    run_in: Annotated[
        float,
        Q(
            "m",
            "initial distance excluded from statistics; vehicles behind the first one leave it at the same chainage",
            ge=0,
        ),
    ] = 50.0
