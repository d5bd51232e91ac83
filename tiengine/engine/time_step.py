"""Set-up of a run: the longest time step that is stable, and the model at that step."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import lru_cache

from tiengine.engine import backend
from tiengine.engine.stability import TOLERATED_GROWTH, energy_growth
from tiengine.engine.state import State
from tiengine.engine.stepper import Chunk, Stepper
from tiengine.irregularity.irregularity import IrregularityParams, check_step, shortest_wavelength
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import Ingredients, Model, build_model
from tiengine.model.newmark import Newmark
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario, check_wavelength, load_scenario, to_toml
from tiengine.scenario.tables import Output

__all__ = ["AUTO_STEPS", "prepare"]

AUTO_STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5)
"""Steps that "auto" tries, the longest first: 2e-4 s keeps wheel forces within 0.3 % of their peak (README)."""


def prepare(scenario: Scenario, public_launch: bool = False, trains: int = 1) -> tuple[Model, float]:
    """Build the model of a scenario with a stable time step.

    Args:
        scenario: Checked scenario of one train.
        public_launch: Public Taichi calls only.
        trains: How many of them are advanced together; the step does not depend on it.

    Returns:
        The model, and the wall time of compiling the step's kernels [s].

    Raises:
        InputError: The step asked for is unstable or too long for the irregularity, or none is short enough.
    """
    backend.start(scenario.numerics.threads)
    asked = scenario.numerics.time_step
    V = scenario.train.speed.at(scenario.rear + scenario.centre_in_window)[0]
    fastest = scenario.train.speed.fastest
    jit = 0.0
    shortest = shortest_wavelength(scenario.irregularity)
    for dt in AUTO_STEPS if asked == "auto" else (float(asked),):
        try:
            check_wavelength(scenario, dt)
            check_step(shortest, fastest, dt)
        except InputError:
            if asked == "auto" and dt != AUTO_STEPS[-1]:
                continue
            raise
        given = replace(_ingredients(_without_speed(scenario)), newmark=Newmark(dt))
        model = build_model(given, fastest)
        if jit == 0.0:
            jit = Stepper(model, State.at_rest(model), Chunk.empty(model, 1, 1, 1), public=public_launch).compile()
        growth = energy_growth(model, fastest)
        if growth <= TOLERATED_GROWTH:
            if trains > 1:
                model = build_model(replace(given, trains=trains), V)
            elif V != fastest:
                model.refactor(V)
            return model, jit
    raise InputError(
        f"numerics.time_step = {asked}: unstable; free vibration of the track grows by a factor {growth:.3g} within"
        " 80 steps; choose a shorter step, more passes or fewer modes_per_metre"
    )


def _without_speed(scenario: Scenario) -> str:
    """A scenario as text, less what the ingredients of a model do not depend on."""
    update = {
        "train": scenario.train.model_copy(update={"speed_kmh": 100.0}),
        "numerics": scenario.numerics.model_copy(update={"time_step": "auto"}),
        "irregularity": IrregularityParams(spectrum="none"),
        "output": Output(),
        "gauges": (),
    }
    return to_toml(scenario.model_copy(update=update))


@lru_cache(maxsize=2)
def _ingredients(toml: str) -> Ingredients:
    """Ingredients at some time step; kept, since the contact table takes seconds and outlives a change of speed."""
    return ingredients(load_scenario(tomllib.loads(toml)), AUTO_STEPS[0])
