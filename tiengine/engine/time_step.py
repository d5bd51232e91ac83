"""Longest stable time step of a scenario, and the model at that step."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

from tiengine.engine import backend
from tiengine.engine.chunk import Chunk
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.stability import of_trains, step_growth, with_stiffest_seats
from tiengine.engine.vector_mode import lanes_for
from tiengine.irregularity.irregularity import IrregularityParams, check_step, shortest_wavelength
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import Ingredients, Model, build_model
from tiengine.model.newmark import Newmark
from tiengine.model.spline_model import DivergingPassesError
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario, check_wavelength, to_toml
from tiengine.scenario.tables import Output
from tiengine.track.defects import largest_factor

__all__ = ["AUTO_STEPS", "prepare"]

AUTO_STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5)
"""Steps that "auto" tries [s], the longest first: 2e-4 s keeps wheel forces within 0.3 % of their peak (README)."""

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
    reason = ""
    for dt in AUTO_STEPS if wanted == "auto" else (float(wanted),):
        try:
            check_wavelength(scenario, dt)
            check_step(shortest, fastest, dt)
        except InputError:
            if wanted == "auto" and dt != AUTO_STEPS[-1]:
                continue
            raise
        parts = replace(_ingredients(_Key.of(scenario)), newmark=Newmark(dt))
        model, reason = _tried(scenario, parts, trains)
        if model is not None:
            model = of_trains(model, trains) if V == fastest else build_model(replace(parts, trains=trains), V)
            state = state_at_rest(model, lanes_for(trains))
            return model, make_stepper(model, state, Chunk.empty(parts, 1, 1, 1), public=public_launch).compile()
    raise InputError(f"numerics.time_step = {wanted}: unstable; {reason}; {_advice(scenario, parts, trains)}")


def _tried(scenario: Scenario, parts: Ingredients, trains: int) -> tuple[Model | None, str]:
    """Model for the largest speed if its step stands the trial, else how it fails."""
    V, stiffest = scenario.train.speed.fastest, largest_factor(scenario.track.failed_fastenings)
    steps = scenario.train.distance / (V * parts.newmark.dt)
    try:
        model = build_model(parts, V)
        tried = model if stiffest == 1.0 else build_model(with_stiffest_seats(parts, stiffest), V)
    except DivergingPassesError as error:
        return None, str(error)
    growth = step_growth(tried, V, steps, lanes_for(trains))
    if growth.tolerable(steps):
        return model, ""
    return None, f"an oscillation grows by a factor {growth.over(100):.3g} within 100 steps"


def _advice(scenario: Scenario, parts: Ingredients, trains: int) -> str:
    """The longest shorter step and the least more passes that stand the trial."""
    dt, passes = parts.newmark.dt, parts.passes
    steps = ((f"numerics.time_step = {d:g}", replace(parts, newmark=Newmark(d))) for d in AUTO_STEPS if d < 0.9 * dt)
    more = ((f"numerics.passes = {n}", replace(parts, passes=n)) for n in range(passes + 1, passes + 1 + MORE_PASSES))
    stable = [
        next((words for words, changed in changes if _tried(scenario, changed, trains)[0]), None)
        for changes in (steps, more)
    ]
    found = " or ".join(words for words in stable if words)
    return f"{found} is stable" if found else "choose fewer trial functions or softer fastenings"


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
