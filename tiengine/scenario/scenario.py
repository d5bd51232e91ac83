"""A scenario: train, track, irregularity and numerics of a run, from TOML to frozen parameters.

A part (vehicle, rail, slab, fastening, profile) is given by the name of a preset, by the path of a file
(relative to the scenario's), or as a table; a table may start from a preset: ``{like = "ACE2021",
vertical_stiffness = 5e7}``. Loading copies every preset used into ``presets``, so that the text written by
:func:`to_toml` is complete and loads back equal on any machine.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tomli_w
from pydantic import Field

from tiengine.irregularity.irregularity import IrregularityParams
from tiengine.irregularity.track_checks import check_wave
from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import InputError
from tiengine.parameters.html_rows import html_rows
from tiengine.parameters.input_files import load_toml, to_tuples
from tiengine.parameters.presets import find_preset, library_folder
from tiengine.parameters.quantity import Params, PlainName, Source, build
from tiengine.scenario.ensemble import Ensemble
from tiengine.scenario.event_policy import Events
from tiengine.scenario.file_paths import absolute_files, absolute_vary
from tiengine.scenario.gauges import Gauge, check_gauges
from tiengine.scenario.overrides import Overrides, apply_overrides
from tiengine.scenario.parts import Parts, build_parts, collect_presets
from tiengine.scenario.shape_checks import check_shapes
from tiengine.scenario.tables import BlowingWind, Contact, Numerics, Output, Track, Train
from tiengine.track.defects import check_defects
from tiengine.track.fastening import check_baseplate
from tiengine.track.knots import Grading, graded_knots
from tiengine.track.seat_points import seat_points
from tiengine.track.sines import Sines
from tiengine.track.slab_warp import check_slab_warps
from tiengine.track.splines import Splines
from tiengine.vehicle.train import centre_in_window

__all__ = ["Scenario", "check_wavelength", "duration", "load_scenario", "to_toml"]

WINDOW_MARGIN = 8.0  # m beyond the outer wheels at either end of the window "auto", see Numerics
WINDOW_MARGIN_LEAST = 2.0  # m: closer window ends or absorbing zones change the outer wheels' forces
LONGEST_RUN = 1e6  # s: the longest distance at 1 m/s
LONGEST_WINDOW = 2000.0  # m
MOST_MODES = 3000  # sines of each rail field: the matrices of a rail then take 2 GB
MOST_KNOTS = 20_000
STEEPEST_TILT = 0.3  # unbalanced lateral acceleration over g: trains tip over beyond 0.4
MOST_SPANS_OF_SEAT = 3  # that the points of a seat may reach over: a seat then touches seven splines


class Scenario(Params):
    """Complete description of a run.

    Attributes:
        presets: Tables of the presets used, by kind and name; they take precedence over the library's.
    """

    name: PlainName = "unnamed"
    source: Source = ""
    train: Train
    track: Track = Track()
    irregularity: IrregularityParams = IrregularityParams()
    contact: Contact = Contact()
    wind: BlowingWind = BlowingWind()
    numerics: Numerics = Numerics()
    output: Output = Output()
    gauges: Annotated[tuple[Gauge, ...], Field(max_length=1000)] = ()
    events: Events = Events()
    ensemble: Ensemble = Ensemble()
    presets: dict[str, dict[str, dict[str, Any]]] = Field(default_factory=dict)

    def _repr_html_(self) -> str:
        """Table for notebooks: what the scenario states itself."""
        rows = [("scenario", self.name)]
        for key in ("train", "track", "irregularity", "contact", "numerics", "output", "ensemble"):
            stated = getattr(self, key).model_dump(exclude_defaults=True)
            rows += [(f"{key}.{name}", str(value)) for name, value in stated.items()]
        return html_rows(rows)

    @cached_property
    def members(self) -> tuple[Scenario, ...]:
        """Scenario of each train of the ensemble; only this one without an ensemble."""
        return _members(self)

    @cached_property
    def parts(self) -> Parts:
        """Parts that the scenario refers to, built and checked once."""
        return build_parts(self.train, self.track, self.wind, self.presets)

    @property
    def slabs_may_lift(self) -> bool:
        """Whether slabs may lift off their bed with rails that follow: a bed without tension, rails in splines."""
        return self.parts.mortar.no_tension and self.numerics.trial_functions == "splines"

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
        return centre_in_window(self.window_length, self.parts.wheelset_positions)

    @property
    def grading(self) -> Grading:
        """Grading of the splines' knots on this track."""
        track = self.track
        # of factor 1 without a gap they are sound
        failed = any(row.gap or row.factor != 1.0 for row in track.failed_fastenings)
        defects = failed or track.slab_warps or any(void.gap or void.factor != 1.0 for void in track.mortar_voids)
        return self.numerics.knots.at_defects() if defects else self.numerics.knots

    @cached_property
    def trial_functions(self) -> Splines | Sines:
        """Trial functions of the rails."""
        length = self.window_length
        if self.numerics.trial_functions == "sines":
            return Sines(length, self.numerics.modes(length))
        wheels = self.centre_in_window + self.parts.wheelset_positions
        return Splines(graded_knots(length, wheels, self.grading))


def load_scenario(source: str | Path | dict[str, Any] | Scenario, overrides: Overrides = ()) -> Scenario:
    """Read a scenario, change keys, check everything.

    Args:
        source: Name of a built-in scenario, path of a TOML file, tables, or a scenario.
        overrides: ``{"train.speed_kmh": 300.0}`` or ``["train.speed_kmh=300"]`` (:mod:`tiengine.scenario.overrides`).

    Returns:
        The scenario with its presets copied into it and its parts built.

    Raises:
        InputError: The first value that breaks a rule: key, value, rule.
    """
    folder = None
    if isinstance(source, Scenario):
        tables = to_tuples(source.model_dump(exclude_none=True))
    elif isinstance(source, dict):
        tables = to_tuples(source)
    else:
        path = find_preset("scenarios", str(source), called="scenario")
        tables = load_toml(path)
        folder = path.parent
        if folder == library_folder("scenarios"):  # its own files lie there, those of the overrides do not
            tables, folder = absolute_files(tables, folder), None
        tables.setdefault("name", path.stem)
    tables = absolute_files(apply_overrides(tables, overrides, Scenario), folder)
    scenario = build(Scenario, tables)
    ensemble = absolute_vary(scenario.ensemble, folder)
    presets = collect_presets(scenario.train, scenario.track, scenario.wind, scenario.presets, folder)
    if ensemble.vary:
        for i in range(ensemble.different):
            train = _changed(tables, ensemble, i)
            presets |= collect_presets(train.train, train.track, train.wind, presets, folder)
    scenario = scenario.model_copy(update={"presets": presets, "ensemble": ensemble})
    _check(scenario)
    _check_members(scenario)
    return scenario


def _changed(tables: dict[str, Any], ensemble: Ensemble, train: int) -> Scenario:
    """Scenario of one train, from the tables of the ensemble."""
    try:
        return build(Scenario, apply_overrides({**tables, "ensemble": {}}, ensemble.changes(train), Scenario))
    except InputError as error:
        raise InputError(f"train {train} of the ensemble: {error}") from None


def _members(scenario: Scenario) -> tuple[Scenario, ...]:
    """Scenario of each train of an ensemble; trains that differ only in their seed share parts."""
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
            _ = made[key].parts  # kept with the scenario and in its copies
        train = made[key]
        if "irregularity.seed" not in ensemble.vary:
            seeded = train.irregularity.model_copy(update={"seed": ensemble.seed(i, first)})
            train = train.model_copy(update={"irregularity": seeded})
        members.append(train)
    return tuple(members)


def _check_members(scenario: Scenario) -> None:
    """Check the rules of every train of an ensemble."""
    if scenario.ensemble.seeds and not any(_is_random(train.irregularity) for train in scenario.members):
        raise InputError("ensemble.seeds: must be left out where no train has a random irregularity")
    if scenario.irregularity.seed + scenario.ensemble.size > 2**63:
        raise InputError(f"irregularity.seed = {scenario.irregularity.seed}: seeds of all trains must be below 2^63")
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
    return track.short_wave or track.has_spectrum


def to_toml(scenario: Scenario) -> str:
    """Write the resolved scenario as TOML: every default and every preset used; it loads back equal.

    Args:
        scenario: Result of :func:`load_scenario`.
    """
    return tomli_w.dumps(scenario.model_dump(mode="python", exclude_none=True), multiline_strings=True)


def _check(scenario: Scenario) -> None:
    """Check the rules that join several keys of one train."""
    parts, window = scenario.parts, scenario.window_length
    least = parts.wheel_span + 2.0 * WINDOW_MARGIN_LEAST
    if window < least:
        raise InputError(
            f"numerics.window = {window:g}: window shorter than the train; must be at least {least:g} m"
            f" (wheels over {parts.wheel_span:g} m and {WINDOW_MARGIN_LEAST:g} m at either end)"
        )
    _check_trial_functions(scenario)
    places = parts.wheelset_positions
    lead = scenario.rear + scenario.centre_in_window + float(places.max())
    check_shapes(scenario.track, scenario.train, scenario.numerics, len(places), lead, parts.mortar.no_tension)
    duration = scenario.train.distance / min(scenario.train.speed.speed)
    if duration > LONGEST_RUN:
        raise InputError(
            f"train.speed_kmh: {scenario.train.distance:g} m take up to {duration:.3g} s;"
            f" must be at most {LONGEST_RUN:g} s"
        )
    begin = scenario.rear + scenario.centre_in_window
    adhesion = _largest_effort(scenario, begin) / GRAVITY
    if scenario.train.effort == "wheels" and adhesion >= scenario.track.friction:
        raise InputError(
            f"train.speed_kmh: needs an adhesion of {adhesion:.3g}; must be below track.friction ="
            f" {scenario.track.friction:g} for wheels that brake or drive (train.effort)"
        )
    zone, widest = scenario.numerics.absorbing_zone, 0.5 * (window - least)
    if zone > widest + 1e-9:
        raise InputError(
            f"numerics.absorbing_zone = {zone:g}: must be at most {widest:g} m in this window"
            f" (it must keep {WINDOW_MARGIN_LEAST:g} m from the outer wheels)"
        )
    if scenario.rear < 0.0:
        raise InputError(
            f"train.start = {scenario.train.start}: must be at least {scenario.centre_in_window:g} m,"
            " so that the window begins at or beyond chainage zero"
        )
    step = scenario.numerics.time_step
    if step != "auto":
        check_wavelength(scenario, float(step))
    check_baseplate(parts.slab, parts.fastening.baseplate)
    _check_alignment(scenario, begin)
    check_defects(
        scenario.track.failed_fastenings,
        scenario.track.mortar_voids,
        end=scenario.rear + scenario.train.distance + window,
        slab=parts.slab,
    )
    last_slab = int((scenario.rear + scenario.train.distance + window) / parts.slab.pitch)
    check_slab_warps(scenario.track.slab_warps, last_slab)
    check_gauges(
        scenario.gauges,
        begin=scenario.rear,
        end=scenario.rear + scenario.train.distance + window,
        slab=parts.slab,
        slabs_may_lift=scenario.slabs_may_lift,
    )


def _largest_effort(scenario: Scenario, begin: float) -> float:
    """Largest force on the train per unit mass that its wheels brake or drive with [m/s^2]; an upper bound."""
    end = begin + scenario.train.distance
    effort, line = scenario.train.speed.largest_acceleration(begin, end), scenario.track.line
    if line is None:
        return effort
    rear = begin + float(scenario.parts.wheelset_positions.min())
    places = np.concatenate([[rear, end], line.x[(line.x > rear) & (line.x < end)]])
    return effort + GRAVITY * float(np.abs(line.lines[2](places)).max())


def _check_alignment(scenario: Scenario, begin: float) -> None:
    """Check that the line is read and that the tilted train stays on it."""
    track, line = scenario.track, scenario.track.line
    if track.alignment_file is not None or "track.alignment_file" in scenario.ensemble.vary:
        raise InputError("track.alignment_file: must be the same for all trains; give track.alignment_rows instead")
    if line is None:
        return
    end = begin + scenario.train.distance
    x = np.linspace(begin, end, 400)
    V = np.array([scenario.train.speed.at(float(here))[0] for here in x])
    tilt = np.abs(line.lateral_acceleration(x, V, GRAVITY))
    if tilt.max() > STEEPEST_TILT * GRAVITY:
        i = int(np.argmax(tilt))
        raise InputError(
            f"train.speed_kmh: {3.6 * V[i]:.4g} km/h at chainage {x[i]:.5g} m give an unbalanced acceleration of"
            f" {tilt[i]:.3g} m/s^2; must be at most {STEEPEST_TILT * GRAVITY:.3g} m/s^2 in a curve (track.alignment)"
        )


def _check_trial_functions(scenario: Scenario) -> None:
    """Check how many trial functions describe a rail, and that seats do not reach over too many of them."""
    window, numerics = scenario.window_length, scenario.numerics
    sines = numerics.trial_functions == "sines"
    if numerics.threads > 1 and not sines:
        raise InputError(
            f"numerics.threads = {numerics.threads}: must be 1 with splines, whose step has one thread; several trains"
            " share the cores by worker processes (--workers)"
        )
    if numerics.truncation == "static" and not sines:
        raise InputError(
            'numerics.truncation = "static": must be "local" or "none" with splines, which lack nothing between wheels'
            " and seats that would count"
        )
    most, fewer = (MOST_MODES, "numerics.modes_per_metre") if sines else (MOST_KNOTS, "density of numerics.knots")
    count = numerics.modes(window) if sines else int(window / numerics.knots.finest)
    if window > LONGEST_WINDOW or count > most:
        raise InputError(
            f"numerics.window: {window:g} m with {count} functions a field: must be at most {LONGEST_WINDOW:g} m and"
            f" {most} functions; choose a shorter train or a smaller {fewer}"
        )
    functions, length = scenario.trial_functions, scenario.parts.fastening.length
    if isinstance(functions, Splines):
        spans = functions.spans_within(float(np.ptp(seat_points(length)[0])))
        if spans > MOST_SPANS_OF_SEAT:
            raise InputError(
                f"track.fastening.length = {length:g}: the points of a seat reach over {spans} knots, must reach over"
                f" {MOST_SPANS_OF_SEAT} at most; choose a larger numerics.knots.finest"
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
    if irregularity.has_spectrum:
        shortest["wavelength_min"] = irregularity.wavelength_min
    if irregularity.short_wave:
        shortest["short_wave_min"] = irregularity.short_wave_min
    for key, wavelength in shortest.items():
        check_wave(f"irregularity.{key}", wavelength, scenario.train.speed.fastest, step)


def duration(train: Scenario) -> float:
    """Time one train takes to cover its distance [s].

    Args:
        train: Its scenario.
    """
    start = train.rear + train.centre_in_window
    x = np.linspace(start, start + train.train.distance, 200)
    slowness = np.array([1.0 / train.train.speed.at(float(here))[0] for here in x])
    return float(np.trapezoid(slowness, x))
