"""Longest stable time step of a scenario, and the model at that step."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

from tiengine.engine import backend
from tiengine.engine.chunk import Chunk
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.stability import of_trains, step_growth, with_gaps_closed, with_stiffest_seats
from tiengine.engine.vector_mode import lanes_for
from tiengine.irregularity.base_motion import GroundRecord, check_record
from tiengine.irregularity.irregularity import IrregularityParams
from tiengine.irregularity.rail_shapes import RailShapes
from tiengine.irregularity.track_checks import check_step, check_wave, shortest_wavelength
from tiengine.irregularity.wheel_shapes import WheelTables, wheel_tables
from tiengine.model.from_scenario import ingredients
from tiengine.model.given_sources import given_sources
from tiengine.model.model import Ingredients, Model, build_model
from tiengine.model.newmark import Newmark
from tiengine.model.spline_model import DivergingPassesError, SplineModel
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario, check_wavelength, to_toml
from tiengine.scenario.tables import Output
from tiengine.track.defects import largest_factor

__all__ = ["AUTO_STEPS", "prepare"]

AUTO_STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5)
"""Steps that "auto" tries [s], the longest first: 2e-4 s keeps wheel forces within 0.3 % of their peak (README)."""

LAG = 0.2
"""Largest :attr:`tiengine.track.seat_passes.SeatPasses.lag` with a step that "auto" selects: wheel forces are within
0.3 % of their peak (0.64 % at 0.27, 1.8 % at 0.47; two passes, seats stiffened by 3 to 10)."""

_passed: set[tuple[str, float, int, float, int]] = set()
"""Trials that steps have stood in this process; the tasks of an ensemble share them."""

MORE_PASSES = 2
"""Passes that advice tries beyond those of the scenario."""


def prepare(scenario: Scenario, public_launch: bool = False, trains: int = 1) -> tuple[Model, float]:
    """Build the model of a scenario with a stable time step.

    Args:
        scenario: Checked scenario of one train.
        public_launch: Public Taichi calls only.
        trains: Trains advanced together; the step does not depend on their number.

    Returns:
        The model, and the wall time of compiling the step's kernels [s].

    Raises:
        InputError: The scenario's step is unstable or too long for the irregularity, or none is short enough.
    """
    backend.start(scenario.numerics.threads)
    wanted = scenario.numerics.time_step
    V = scenario.train.speed.at(scenario.rear + scenario.centre_in_window)[0]
    fastest = scenario.train.speed.fastest
    shortest = shortest_wavelength(scenario.irregularity)
    round_tables = _wheel_tables(scenario)
    waves = _waves_of_shapes(scenario, round_tables)
    moving = scenario.track.base_motion
    record = None if moving.file is None else GroundRecord(moving)
    jit, reason = 0.0, ""
    for dt in AUTO_STEPS if wanted == "auto" else (float(wanted),):
        try:
            check_wavelength(scenario, dt)
            check_step(scenario.irregularity, shortest, fastest, dt)
            for name, wavelength in waves:
                check_wave(name, wavelength, fastest, dt)
            if record is not None:
                check_record(record, fastest, dt)
        except InputError:
            if wanted == "auto" and dt != AUTO_STEPS[-1]:
                continue
            raise
        kept = _ingredients(_Key.of(scenario))
        given = given_sources(scenario, kept.train)  # files are read anew
        parts = replace(kept, newmark=Newmark(dt), out_of_round=round_tables, given=given)
        lanes = lanes_for(trains)
        try:
            model = build_model(parts, fastest)
        except DivergingPassesError as error:
            reason = str(error)
            continue
        if wanted == "auto" and dt != AUTO_STEPS[-1] and isinstance(model, SplineModel) and model.seats.lag > LAG:
            continue
        if jit == 0.0:
            chunk = Chunk.empty(parts, 1, 1)
            jit = make_stepper(model, state_at_rest(model, lanes), chunk, public=public_launch).compile()
        reason = _instability(scenario, model, lanes)
        if not reason:
            if V == fastest:
                return of_trains(model, trains), jit
            return build_model(replace(parts, trains=trains), V), jit
    raise InputError(f"numerics.time_step = {wanted}: unstable; {reason}; {_advice(scenario, parts, lanes)}")


def _wheel_tables(scenario: Scenario) -> WheelTables | None:
    """Tables of wheels out of round, their files read anew; None where all are round."""
    shapes = scenario.train.wheel_shapes
    return wheel_tables(shapes, scenario.parts.wheel_radii) if shapes else None


def _waves_of_shapes(scenario: Scenario, tables: WheelTables | None) -> list[tuple[str, float]]:
    """Name and length [m] of the shortest wave of every shape of rails and wheels."""
    shapes = scenario.track.rail_shapes
    found = [
        (f"track.rail_shapes[{i}]: shortest wave of the {shape.kind}", wave)
        for i, (shape, wave) in enumerate(zip(shapes, RailShapes(shapes).waves, strict=True))
    ]
    if tables is not None:
        names = [f"{tables.name(table)}, of order {order}," for table, (_, order) in enumerate(tables.waves)]
        waves = [wave for wave, _ in tables.waves]
        found += [(f"train.wheel_shapes: shortest wave of {name}", w) for name, w in zip(names, waves, strict=True)]
    return found


def _instability(scenario: Scenario, model: Model, lanes: int) -> str:
    """How the step of a model fails the trials over the scenario's run: as it is, gaps closed, on stiffest seats."""
    V, stiffest = scenario.train.speed.fastest, largest_factor(scenario.track.failed_fastenings)
    trial = (_Key.of(scenario).text, model.ingredients.newmark.dt, model.ingredients.passes, V, lanes)
    if trial in _passed:
        return ""
    steps = scenario.train.distance / (V * model.ingredients.newmark.dt)
    tracks, g = [("", model)], model.ingredients
    if g.dead is not None and g.dead.uneven:
        tracks.append((" with gaps closed", replace(model, ingredients=with_gaps_closed(g))))
    if stiffest > 1.0:
        stiffened = with_stiffest_seats(g, stiffest)
        tracks.append((f" on seats stiffened by {stiffest:g}", build_model(stiffened, V)))
    for words, tried in tracks:
        growth = step_growth(tried, V, steps, lanes)
        if not growth.tolerable(steps):
            return f"an oscillation{words} grows by a factor {growth.over(100):.3g} in 100 steps"
    _passed.add(trial)
    return ""


def _advice(scenario: Scenario, parts: Ingredients, lanes: int) -> str:
    """The longest shorter step and the least more passes that stand the trial."""
    steps = [(f"numerics.time_step = {dt:g}", replace(parts, newmark=Newmark(dt))) for dt in AUTO_STEPS]
    more = [
        (f"numerics.passes = {n}", replace(parts, passes=n))
        for n in range(parts.passes + 1, parts.passes + 1 + MORE_PASSES)
    ]
    shorter = [(words, changed) for words, changed in steps if changed.newmark.dt < 0.9 * parts.newmark.dt]
    found = [words for changes in (shorter, more) if (words := _first_stable(scenario, changes, lanes))]
    if found:
        return f"{' or '.join(found)} is stable"
    stiffened = largest_factor(scenario.track.failed_fastenings) > 1.0
    return f"choose {'smaller factors in track.failed_fastenings' if stiffened else 'fewer trial functions'}"


def _first_stable(scenario: Scenario, changes: list[tuple[str, Ingredients]], lanes: int) -> str:
    """Words of the first change that stands the trial; empty if none does."""
    for words, changed in changes:
        try:
            model = build_model(changed, scenario.train.speed.fastest)
        except DivergingPassesError:
            continue
        if not _instability(scenario, model, lanes):
            return words
    return ""


@dataclass(frozen=True)
class _Key:
    """A scenario without the keys that the ingredients of a model do not depend on; compared by its text.

    Attributes:
        text: The scenario as TOML.
        scenario: The scenario itself.
    """

    text: str
    scenario: Scenario = field(compare=False)

    @classmethod
    def of(cls, scenario: Scenario) -> _Key:
        """Key of a scenario."""
        update = {
            "train": scenario.train.model_copy(update={"speed_kmh": 100.0}),
            "numerics": scenario.numerics.model_copy(update={"time_step": "auto"}),
            "irregularity": IrregularityParams(spectrum="none"),
            "output": Output(),
            "gauges": (),
        }
        reduced = scenario.model_copy(update=update)
        return cls(to_toml(reduced), reduced)


@lru_cache(maxsize=2)
def _ingredients(key: _Key) -> Ingredients:
    """Ingredients at the first time step; cached, since the contact table takes seconds and holds for all speeds."""
    return ingredients(key.scenario, AUTO_STEPS[0])
