"""Steps without the run's loop: models at any time step or number of trains, every step recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium, release
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import State
from tiengine.engine.stepper import Stepper
from tiengine.irregularity.irregularity import make_irregularity
from tiengine.kernels import layout as at
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import Ingredients, Model, build_model
from tiengine.model.newmark import Newmark
from tiengine.scenario.scenario import Scenario, load_scenario

KMH = 1.0 / 3.6
CHUNK = 500


@cache
def scenario(name: str, *overrides: str) -> Scenario:
    """A built-in scenario with changes, loaded once."""
    return load_scenario(name, overrides)


@cache
def _given(name: str, overrides: tuple[str, ...]) -> Ingredients:
    return ingredients(scenario(name, *overrides), 1e-4)


def model_of(name: str, *overrides: str, dt: float, **changes: Any) -> Model:
    """Model of a built-in scenario at a step of one's own; ``changes`` replace ingredients."""
    given = replace(_given(name, overrides), newmark=Newmark(dt), **changes)
    return build_model(given, scenario(name, *overrides).train.speed.at(0.0)[0])


@dataclass(eq=False)
class History:
    """Record of every step.

    Attributes:
        model, state: After the last step.
        time: Ends of the steps [s], shape (n,).
        wheel: Wheel output of every step, shape (n, W, 2, N_WHEEL), first train.
        body: Displacement, velocity, acceleration of every step, shape (n, 3, 5 bodies), first train.
    """

    model: Model
    state: State
    time: NDArray[np.float64]
    wheel: NDArray[np.float64]
    body: NDArray[np.float64]

    @property
    def vertical(self) -> NDArray[np.float64]:
        """Vertical wheel forces [N], shape (n, W, 2)."""
        return self.wheel[..., at.VERTICAL_FORCE]

    @property
    def lateral(self) -> NDArray[np.float64]:
        """Lateral wheel forces [N], shape (n, W, 2)."""
        return self.wheel[..., at.LATERAL_FORCE]


def run_steps(
    name: str,
    *overrides: str,
    dt: float,
    duration: float,
    start: str = "equilibrium",
    each: Callable[[int, Stepper], None] | None = None,
    model: Model | None = None,
    **options: Any,
) -> History:
    """Advance a scenario at constant speed and keep every step; the window's rear end begins at chainage zero.

    Args:
        name: Built-in scenario.
        overrides: Changes to it.
        dt: Time step [s].
        duration: Simulated time [s].
        start: "equilibrium" or "zero".
        each: Called after every step with its number from 0 and the stepper.
        model: To be used instead of the scenario's own.
        options: For the stepper.
    """
    given = scenario(name, *overrides)
    V = given.train.speed.at(0.0)[0]
    model = model or model_of(name, *overrides, dt=dt)
    state = state_at_rest(model)
    if start == "equilibrium":
        equilibrium(model, state, 0.0, V)
    else:
        release(model, state, 0.0)
    track = make_irregularity(given.irregularity, float(model.ingredients.wheel_s.max()))
    chunk = Chunk.empty(model.ingredients, CHUNK, CHUNK)
    stepper = make_stepper(model, state, chunk, **options)
    steps = round(duration / dt)
    wheels, bodies = [], []
    with threadpool_limits(1):
        for first in range(0, steps, CHUNK):
            count = min(CHUNK, steps - first)
            X = V * dt * np.arange(first + 1, first + count + 1)
            irregularity = track.sample(X[:, None] + model.ingredients.wheel_s)
            stepper.load(X, np.full(count, V), np.zeros(count), irregularity[None])
            for i in range(count):
                stepper.step(i, i, i)
                if each is not None:
                    each(first + i, stepper)
            wheels.append(chunk.wheel[0, :count].copy())
            bodies.append(chunk.body[0, :count].copy())
    time = dt * np.arange(1, steps + 1)
    return History(model, state, time, np.concatenate(wheels), np.concatenate(bodies))
