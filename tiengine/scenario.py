"""A scenario: what runs over which track, and how it is computed. TOML outside, frozen parameters inside.

A part (vehicle, rail, slab, fastening, profile) is given by the name of a preset, by the path of a file
(relative to the scenario's), or as a table; a table may start from a preset: ``{like = "ACE2021",
vertical_stiffness = 5e7}``. Loading copies every preset used into ``presets``, so that the text written by
:func:`to_toml` says all that was run and loads back equal wherever it is read.

Speeds are in km/h at this edge only.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import BeforeValidator, Field

from tiengine.channels import BODY, IRREGULARITY, WHEEL
from tiengine.defects import FailedFastenings, MortarDefect, check_defects
from tiengine.ensemble import Ensemble
from tiengine.fields import channel_names, check_speed, number_or
from tiengine.irregularity import IrregularityParams
from tiengine.mortar import MortarVoid
from tiengine.overrides import Overrides, apply_overrides
from tiengine.parts import Part, Parts, build_parts, collect_presets
from tiengine.presets import find_preset, load_toml, to_tuples
from tiengine.quantity import InputError, Params, Q, build
from tiengine.speed import SpeedProfile

__all__ = ["Scenario", "check_wavelength", "load_scenario", "to_toml"]

WINDOW_MARGIN = 4.0  # m beyond the outer wheels, either end, of the window "auto", see Numerics
WINDOW_MARGIN_LEAST = 2.0  # m: below this the window's fixed ends, or an absorbing zone, are felt by the outer wheels
STEPS_PER_WAVE = 8.0  # the shortest wave must be passed in no fewer steps (MODEL §6)


class Train(Params):
    """What runs and how fast.

    ``start`` is the chainage of the first vehicle's centre at t = 0; "auto" puts the window's rear end at zero.
    """

    vehicles: Annotated[tuple[Part, ...], Field(min_length=1)]
    coupler_pitch: float | tuple[float, ...] | None = Field(None, json_schema_extra={"unit": "m"})
    speed_kmh: Annotated[float | tuple[tuple[float, float], ...], BeforeValidator(check_speed)]
    distance: Annotated[float, Q("m", "way of the train", gt=0, le=1e6)]
    start: Annotated[float | Literal["auto"], number_or("auto", "m", 0.0, 1e7)] = "auto"
    wheel_profile: Part = "LMA"
    series_springs: bool = False

    @property
    def speed(self) -> SpeedProfile:
        """Speed [m/s] over the chainage of the first vehicle's centre [m]."""
        if isinstance(self.speed_kmh, tuple):
            return SpeedProfile.table(*zip(*((x, v / 3.6) for x, v in self.speed_kmh), strict=True))
        return SpeedProfile.constant(self.speed_kmh / 3.6)


class Track(Params):
    """The track, its contact with the wheel, and its defects."""

    rail: Part = "CHN60"
    rail_profile: Part = "CHN60"
    slab: Part = "CRTS_III"
    fastening: Part = "ACE2021"
    friction: Annotated[float, Q("-", "coefficient of friction", gt=0, le=1)] = 0.3
    gauge: Annotated[float, Q("m", ge=0.6, le=2.0)] = 1.435
    gauge_depth: Annotated[float, Q("m", "below the top of the rail, where gauge is measured", gt=0, le=0.03)] = 0.016
    cant: Annotated[float, Q("-", "inward inclination of the rail", ge=0, le=0.1)] = 0.025
    mortar_no_tension: bool = False
    failed_fastenings: tuple[FailedFastenings, ...] = ()
    mortar_voids: tuple[MortarDefect, ...] = ()


class Contact(Params):
    """How wheel and rail touch."""

    hertz: Literal["exact", "zhai_worn", "zhai_cone"] = "exact"
    smoothing: Annotated[float, Q("m", "Gaussian in the lateral shift", ge=0, le=2e-3)] = 1e-4
    cross_level_rolls_rails: bool = True


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
    window: Annotated[float | Literal["auto"], number_or("auto", "m", 1.0, 2000.0)] = "auto"
    time_step: Annotated[float | Literal["auto"], number_or("auto", "s", 1e-6, 1e-3)] = "auto"
    passes: Annotated[int, Q("-", "passes of the explicit half per step", ge=1, le=20)] = 2
    start: Literal["equilibrium", "zero"] = "equilibrium"
    mortar: Literal["implicit", "explicit"] = "implicit"
    truncation: Literal["none", "local"] = "local"
    absorbing_zone: Annotated[float, Q("m", "at either end of the window", ge=0)] = 0.0
    slab_count: Literal["cover", "paper"] = "cover"
    threads: Annotated[int, Q("-", "of Taichi's loop over trains; one train alone runs on one", ge=1, le=1024)] = 1

    def modes(self, window: float) -> int:
        """Trial functions of each rail field in a window of the given length [m]."""
        return max(1, round(self.modes_per_metre * window))


class Output(Params):
    """What is written, and how often; intervals are rounded to whole steps."""

    wheel_interval: Annotated[float | Literal["step"], number_or("step", "s", 1e-6, 10.0)] = "step"
    body_interval: Annotated[float | Literal["step"], number_or("step", "s", 1e-6, 10.0)] = 1e-3
    wheel_channels: Annotated[tuple[str, ...], channel_names(WHEEL)] = tuple(WHEEL)
    body_channels: Annotated[tuple[str, ...], channel_names(BODY)] = tuple(BODY)
    irregularity_channels: Annotated[tuple[str, ...], channel_names(IRREGULARITY)] = tuple(IRREGULARITY)
    precision: Literal["single", "double"] = "single"
    run_in: Annotated[float, Q("m", "way that statistics leave out", ge=0)] = 50.0


class Scenario(Params):
    """All that a run needs to know.

    Attributes:
        presets: Tables of the presets used, by kind and name; they come before the library's.
    """

    name: str = "unnamed"
    source: str = ""
    train: Train
    track: Track = Track()
    irregularity: IrregularityParams = IrregularityParams()
    contact: Contact = Contact()
    numerics: Numerics = Numerics()
    output: Output = Output()
    ensemble: Ensemble = Ensemble()
    presets: dict[str, dict[str, dict[str, Any]]] = Field(default_factory=dict)

    @cached_property
    def members(self) -> tuple[Scenario, ...]:
        """The scenario of every train of the ensemble, by itself; this one if it is alone."""
        return _members(self)

    @cached_property
    def parts(self) -> Parts:
        """The parts that the scenario names, built and checked once."""
        return build_parts(self.train, self.track, self.presets)

    @property
    def mortar_voids(self) -> tuple[MortarVoid, ...]:
        """Voids of the whole track, as the slab's matrices want them."""
        return tuple(void.rectangle for void in self.track.mortar_voids)

    @cached_property
    def window_length(self) -> float:
        """Length of the moving window [m]."""
        if self.numerics.window != "auto":
            return float(self.numerics.window)
        return self.parts.wheel_span + 2.0 * WINDOW_MARGIN

    @cached_property
    def rear(self) -> float:
        """Chainage of the window's rear end at t = 0 [m]."""
        if self.train.start == "auto":
            return 0.0
        return float(self.train.start) - self.centre_in_window

    @cached_property
    def centre_in_window(self) -> float:
        """Centre of the first vehicle from the window's rear end [m]: the wheels stand in its middle."""
        x = self.parts.wheelset_positions
        return self.window_length / 2.0 - 0.5 * float(x.max() + x.min())

    @cached_property
    def modes(self) -> int:
        """Trial functions of each rail field."""
        return self.numerics.modes(self.window_length)


def load_scenario(source: str | Path | dict[str, Any] | Scenario, overrides: Overrides = ()) -> Scenario:
    """Read a scenario, change keys, check everything.

    Args:
        source: Name of a built-in scenario, path of a TOML file, tables, or a scenario.
        overrides: ``{"train.speed_kmh": 300.0}`` or ``["train.speed_kmh=300"]`` (:mod:`tiengine.overrides`).

    Returns:
        The scenario with its presets copied into it and its parts built.

    Raises:
        InputError: The first thing that breaks a rule: key, value, rule.
    """
    folder = None
    if isinstance(source, Scenario):
        tables = to_tuples(source.model_dump(exclude_none=True))
    elif isinstance(source, dict):
        tables = to_tuples(source)
    else:
        path = find_preset("scenarios", str(source), called="scenario")
        folder, tables = path.parent, load_toml(path)
        tables.setdefault("name", path.stem)
    tables = _absolute(apply_overrides(tables, overrides), folder)
    scenario = build(Scenario, tables)
    ensemble = _absolute_vary(scenario.ensemble, folder)
    presets = collect_presets(scenario.train, scenario.track, scenario.presets, folder)
    if ensemble.vary:
        for i in range(ensemble.size):
            train = _changed(tables, ensemble, i)
            presets |= collect_presets(train.train, train.track, presets, folder)
    scenario = scenario.model_copy(update={"presets": presets, "ensemble": ensemble})
    _check(scenario)
    _check_members(scenario)
    return scenario


def _changed(tables: dict[str, Any], ensemble: Ensemble, train: int) -> Scenario:
    """One train of an ensemble, from the tables of the whole."""
    try:
        return build(Scenario, apply_overrides({**tables, "ensemble": {}}, ensemble.changes(train)))
    except InputError as error:
        raise InputError(f"train {train} of the ensemble: {error}") from None


def _members(scenario: Scenario) -> tuple[Scenario, ...]:
    """Every train of an ensemble; trains that differ in their seed alone share parts."""
    ensemble, first = scenario.ensemble, scenario.irregularity.seed
    if ensemble == Ensemble():
        return (scenario,)
    tables = to_tuples(scenario.model_dump(exclude_none=True))
    made: dict[str, Scenario] = {}
    members = []
    for i in range(ensemble.size):
        key = repr(ensemble.changes(i))
        if key not in made:
            made[key] = _changed(tables, ensemble, i)
        train = made[key]
        if "irregularity.seed" not in ensemble.vary:
            seeded = train.irregularity.model_copy(update={"seed": ensemble.seed(i, first)})
            train = train.model_copy(update={"irregularity": seeded})
        members.append(train)
    return tuple(members)


def _check_members(scenario: Scenario) -> None:
    """Rules for every train of an ensemble."""
    if scenario.ensemble.seeds and not any(_is_random(train.irregularity) for train in scenario.members):
        raise InputError("ensemble.seeds: make no difference to a measured irregularity or to none; leave them out")
    if scenario.irregularity.seed + scenario.ensemble.size > 2**63:
        raise InputError(f"irregularity.seed = {scenario.irregularity.seed}: leaves no seeds for all trains")
    checked: set[str] = set()
    for i, train in enumerate(scenario.members):
        changes = repr(scenario.ensemble.changes(i))
        if changes not in checked:
            checked.add(changes)
            try:
                _check(train)
            except InputError as error:
                raise InputError(f"train {i} of the ensemble: {error}") from None


def _is_random(track: IrregularityParams) -> bool:
    """Whether a seed makes a difference."""
    return track.short_wave or (track.file is None and track.spectrum != "none")


def _absolute_vary(ensemble: Ensemble, folder: Path | None) -> Ensemble:
    """The ensemble with the paths of measured irregularities made absolute."""
    files = ensemble.vary.get("irregularity.file")
    if files is None:
        return ensemble
    found = tuple(_absolute({"irregularity": {"file": file}}, folder)["irregularity"]["file"] for file in files)
    return ensemble.model_copy(update={"vary": {**ensemble.vary, "irregularity.file": found}})


def _absolute(tables: dict[str, Any], folder: Path | None) -> dict[str, Any]:
    """The tables with the path of a measured irregularity made absolute, since it is read at every run."""
    irregularity = tables.get("irregularity")
    if not isinstance(irregularity, dict) or not isinstance(irregularity.get("file"), str):
        return tables
    path = ((folder or Path()) / Path(irregularity["file"]).expanduser()).resolve()
    return {**tables, "irregularity": {**irregularity, "file": str(path)}}


def to_toml(scenario: Scenario) -> str:
    """The resolved scenario as TOML: every default, every preset used; loads back equal.

    Args:
        scenario: What :func:`load_scenario` returned.
    """
    return tomli_w.dumps(scenario.model_dump(mode="python", exclude_none=True), multiline_strings=True)


def _check(scenario: Scenario) -> None:
    """Rules that join several keys of one train."""
    parts, window = scenario.parts, scenario.window_length
    least = parts.wheel_span + 2.0 * WINDOW_MARGIN_LEAST
    if window < least:
        raise InputError(
            f"numerics.window = {window:g}: window shorter than the train; must be at least {least:g} m"
            f" (wheels over {parts.wheel_span:g} m and {WINDOW_MARGIN_LEAST:g} m at either end)"
        )
    zone, widest = scenario.numerics.absorbing_zone, 0.5 * (window - least)
    if zone > widest + 1e-9:
        raise InputError(
            f"numerics.absorbing_zone = {zone:g}: must be at most {widest:g} m in this window"
            f" ({WINDOW_MARGIN_LEAST:g} m clear of the outer wheels)"
        )
    if scenario.rear < 0.0:
        raise InputError(
            f"train.start = {scenario.train.start}: must be at least {scenario.centre_in_window:g} m,"
            " where the window begins at chainage zero"
        )
    step = scenario.numerics.time_step
    if step != "auto":
        check_wavelength(scenario, float(step))
    check_defects(
        scenario.track.failed_fastenings,
        scenario.track.mortar_voids,
        end=scenario.rear + scenario.train.distance + window,
        slab=parts.slab,
    )


def check_wavelength(scenario: Scenario, step: float) -> None:
    """Refuse irregularity that a step cannot follow.

    Args:
        scenario: Gives the speed and the shortest wave.
        step: Time step [s].

    Raises:
        InputError: The shortest wave is passed in fewer than eight steps (MODEL §6).
    """
    irregularity = scenario.irregularity
    shortest = {}
    if irregularity.spectrum != "none" and irregularity.file is None:
        shortest["wavelength_min"] = irregularity.wavelength_min
    if irregularity.short_wave:
        shortest["short_wave_min"] = irregularity.short_wave_min
    least = STEPS_PER_WAVE * scenario.train.speed.fastest * step
    for key, wavelength in shortest.items():
        if wavelength < least:
            raise InputError(
                f"irregularity.{key} = {wavelength:g}: must be at least 8 V dt = {least:.4g} m"
                f" at a time step of {step:g} s; choose a smaller step or a longer wave"
            )
