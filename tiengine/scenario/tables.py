"""Tables of a scenario: train, track, contact, numerics, output.

Speeds are in km/h at this edge only.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from tiengine.parameters.quantity import Params, Q
from tiengine.result_files.channels import BODY, IRREGULARITY, WHEEL
from tiengine.scenario.key_checks import channel_names, check_speed, number_or
from tiengine.scenario.part import Part
from tiengine.track.defects import FailedFastenings
from tiengine.track.mortar import MortarVoid
from tiengine.vehicle.assembly import Effort
from tiengine.vehicle.speed_programme import SpeedProfile

__all__ = ["Contact", "Numerics", "Output", "Track", "Train"]

MOST_DEFECTS = 10_000  # of each kind


class Train(Params):
    """What runs and how fast; for parts see below."""

    vehicles: Annotated[
        tuple[Part, ...], Field(min_length=1, max_length=64, description="parts, the leading one first")
    ]
    coupler_pitch: Annotated[
        float | tuple[float, ...] | None,
        Field(
            description="between the centres of neighbours, one number or one a coupling; without it by the vehicles'"
            " lengths over couplers",
            json_schema_extra={"unit": "m"},
        ),
    ] = None
    speed_kmh: Annotated[
        float | tuple[tuple[float, float], ...],
        BeforeValidator(check_speed),
        Field(
            description="a number, or rows [chainage of the first vehicle's centre in m, km/h] between which"
            " the kinetic energy runs smoothly; above 0, at most 1000",
            json_schema_extra={"unit": "km/h"},
        ),
    ]
    distance: Annotated[float, Q("m", "way of the train", gt=0, le=1e6)]
    start: Annotated[
        float | Literal["auto"],
        number_or("auto", "m", 0.0, 1e7),
        Field(
            description="chainage of the first vehicle's centre at t = 0; \"auto\" puts the window's rear end at zero"
        ),
    ] = "auto"
    wheel_profile: Annotated[Part, Field(description="part, of all wheels")] = "LMA"
    series_springs: Annotated[
        bool, Field(description="springs in series with dampers (k_series) count; a vehicle may ask for it alone")
    ] = False

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
        if isinstance(self.speed_kmh, tuple):
            return SpeedProfile.table(*zip(*((x, v / 3.6) for x, v in self.speed_kmh), strict=True))
        return SpeedProfile.constant(self.speed_kmh / 3.6)


class Track(Params):
    """The track, its contact with the wheel, and its defects."""

    rail: Annotated[Part, Field(description="part: section and material")] = "CHN60"
    rail_profile: Annotated[Part, Field(description="part: surface of the railhead")] = "CHN60"
    slab: Annotated[Part, Field(description="part: slab and its bed")] = "CRTS_III"
    fastening: Annotated[Part, Field(description="part: spring and damper of a seat")] = "ACE2021"
    friction: Annotated[float, Q("-", "coefficient of friction", gt=0, le=1)] = 0.3
    gauge: Annotated[float, Q("m", "between the gauge faces", ge=0.6, le=2.0)] = 1.435
    gauge_depth: Annotated[float, Q("m", "below the top of the rail, where gauge is measured", gt=0, le=0.03)] = 0.016
    cant: Annotated[float, Q("-", "inward inclination of the rail", ge=0, le=0.1)] = 0.025
    mortar_no_tension: Annotated[
        bool, Field(description="the bed does not pull; the slab's dead weight counts as pressure")
    ] = False
    failed_fastenings: Annotated[
        tuple[FailedFastenings, ...], Field(description="tables, see below", max_length=MOST_DEFECTS)
    ] = ()
    mortar_voids: Annotated[
        tuple[MortarVoid, ...], Field(description="tables, see below", max_length=MOST_DEFECTS)
    ] = ()


class Contact(Params):
    """How wheel and rail touch."""

    hertz: Annotated[
        Literal["exact", "zhai_worn", "zhai_cone"],
        Field(description="approach by Hertz from the curvatures, or by Zhai's formulas for worn or conical treads"),
    ] = "exact"
    smoothing: Annotated[
        float, Q("m", "standard deviation of a Gaussian over the wheel's lateral shift", ge=0, le=2e-3)
    ] = 1e-4
    cross_level_rolls_rails: Annotated[
        bool, Field(description="a cross level turns the railheads with the track; if not, they are only shifted")
    ] = True


class Numerics(Params):
    """How it is computed.

    The defaults are the cheapest settings whose wheel forces are within 1 % of their peak from the converged ones for
    99 % of the time (``validation/report/convergence.md``). Point supports excite the rail at multiples of the
    seat-passing frequency; the j-th needs 2 j / 0.63 m modes a metre, so that errors fall in steps, and 6.5 lie just
    beyond the second. They lend the wheels the static compliance of the modes left out. A window of 4 m beyond the
    outer wheels (MODEL §1 names 8 m) changes forces by 0.04 % vertically and 0.2 % laterally, four decay lengths of a
    rail on its fastenings. The source paper has 1.7 modes a metre and 8 m.

    The blow that ends a wheel's flight sends waves of 1 to 3 kHz along the rail, at the speed of shear, 2030 m/s; the
    window's pinned ends send them back. An ``absorbing_zone`` at either end, with springs and dampers from rail to
    ground up to as strong as the fastenings', swallows most of them: with 6 m in a window of 36 m the largest echo,
    0.27 % of the peak force, falls to 0.14 %. It must keep 2 m from the wheels, hence there is none in the default's
    shorter window.
    """

    modes_per_metre: Annotated[float, Q("1/m", "trial functions per field and metre of window", ge=0.2, le=20)] = 6.5
    window: Annotated[
        float | Literal["auto"],
        number_or("auto", "m", 1.0, 2000.0),
        Field(description='length of rail that moves with the train; "auto": span of the wheels and 4 m at either end'),
    ] = "auto"
    time_step: Annotated[
        float | Literal["auto"],
        number_or("auto", "s", 1e-6, 1e-3),
        Field(
            description='"auto": the longest of 2e-4, 1e-4, 5e-5, 2.5e-5 s that is stable and follows the irregularity'
        ),
    ] = "auto"
    passes: Annotated[int, Q("-", "passes of the explicit half per step", ge=1, le=20)] = 2
    start: Annotated[
        Literal["equilibrium", "zero"], Field(description="steady rolling, or everything unloaded at the first step")
    ] = "equilibrium"
    mortar: Annotated[
        Literal["implicit", "explicit"], Field(description="where the bed stands; the answer is the same")
    ] = "implicit"
    truncation: Annotated[
        Literal["none", "local"],
        Field(description="whether the modes left out lend the wheels their static compliance"),
    ] = "local"
    absorbing_zone: Annotated[float, Q("m", "at either end of the window, see above", ge=0)] = 0.0
    slab_count: Annotated[
        Literal["cover", "paper"], Field(description="slabs under the whole window, or the source paper's count")
    ] = "cover"
    threads: Annotated[int, Q("-", "of Taichi's loop over trains; one train alone runs on one", ge=1, le=1024)] = 1

    def modes(self, window: float) -> int:
        """Trial functions of each rail field in a window of the given length [m]."""
        return max(1, round(self.modes_per_metre * window))


class Output(Params):
    """What is written, and how often; intervals are rounded to whole steps. The channels: docs/results.md."""

    wheel_interval: Annotated[
        float | Literal["step"],
        number_or("step", "s", 1e-6, 10.0),
        Field(description="between samples of wheels, irregularity and gauges"),
    ] = "step"
    body_interval: Annotated[
        float | Literal["step"],
        number_or("step", "s", 1e-6, 10.0),
        Field(description="between samples of bodies, mortar and slabs"),
    ] = 1e-3
    wheel_channels: Annotated[tuple[str, ...], channel_names(WHEEL), Field(description='names, or "all"')] = tuple(
        WHEEL
    )
    body_channels: Annotated[tuple[str, ...], channel_names(BODY), Field(description='names, or "all"')] = tuple(BODY)
    irregularity_channels: Annotated[
        tuple[str, ...], channel_names(IRREGULARITY), Field(description='names, or "all"')
    ] = tuple(IRREGULARITY)
    envelopes: Annotated[bool, Field(description="extremes of every seat and slab, groups seats and slabs")] = True
    deflection_interval: Annotated[
        float | Literal["none"],
        number_or("none", "s", 1e-6, 10.0),
        Field(description="between samples of rail and slab all along the window, group deflection"),
    ] = 0.1
    precision: Annotated[Literal["single", "double"], Field(description="of the channels in the file")] = "single"
    run_in: Annotated[float, Q("m", "way that statistics leave out", ge=0)] = 50.0
