"""Longest stable time step of a scenario, and the model at that step."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

from tiengine.engine import backend
from tiengine.engine.chunk import Chunk
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.stability import TOLERATED_GROWTH, energy_growth
from tiengine.engine.vector_mode import lanes_for
from tiengine.irregularity.irregularity import IrregularityParams
from tiengine.irregularity.track_checks import check_step, shortest_wavelength
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import Ingredients, Model, build_model
from tiengine.model.newmark import Newmark
from tiengine.model.spline_model import DivergingPassesError
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario, check_wavelength, to_toml
from tiengine.scenario.tables import Output

__all__ = ["AUTO_STEPS", "prepare"]

AUTO_STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5)
"""Steps that "auto" tries [s], the longest first: 2e-4 s keeps wheel forces within 0.3 % of their peak (README)."""


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
    jit, growth = 0.0, ""
    shortest = shortest_wavelength(scenario.irregularity)
    for dt in AUTO_STEPS if wanted == "auto" else (float(wanted),):
        try:
            check_wavelength(scenario, dt)
            check_step(scenario.irregularity, shortest, fastest, dt)
        except InputError:
            if wanted == "auto" and dt != AUTO_STEPS[-1]:
                continue
            raise
        parts, lanes = replace(_ingredients(_Key.of(scenario)), newmark=Newmark(dt)), lanes_for(trains)
        try:
            model = build_model(parts, fastest)
        except DivergingPassesError as error:
            growth = str(error)
            continue
        if jit == 0.0:
            chunk = Chunk.empty(parts, 1, 1, 1)
            jit = make_stepper(model, state_at_rest(model, lanes), chunk, public=public_launch).compile()
        found = energy_growth(model, fastest, lanes)
        if found <= TOLERATED_GROWTH:
            if trains > 1 or V != fastest:
                model = build_model(replace(parts, trains=trains), V)
            return model, jit
        growth = f"free vibration of the track grows by a factor {found:.3g} within 80 steps"
    raise InputError(
        f"numerics.time_step = {wanted}: unstable; {growth}; choose a shorter step, more passes or fewer"
        " trial functions"
    )


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
