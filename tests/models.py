"""Models of built-in scenarios for the tests, built once a session: the contact table takes seconds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.kernels import layout as at
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import Ingredients, Model, build_model
from tiengine.model.newmark import Newmark
from tiengine.model.spline_model import SplineModel, build_spline_model
from tiengine.scenario.scenario import load_scenario

V350 = 350.0 / 3.6
"""m/s: the paper's speed."""


@cache
def _base(overrides: tuple[str, ...], name: str = "paper") -> Ingredients:
    return ingredients(load_scenario(name, overrides), 1e-4)


def paper_model(*overrides: str, V: float = V350, dt: float = 1e-4, **changes: Any) -> Model:
    """Model of the scenario ``paper``.

    Args:
        overrides: Keys of the scenario, ``"numerics.passes=3"``.
        V: Speed [m/s].
        dt: Time step [s].
        changes: Fields of ``Ingredients`` that replace the scenario's.
    """
    return build_model(replace(_base(overrides), newmark=Newmark(dt), **changes), V)


def default_model(*overrides: str, V: float = V350, dt: float = 2e-4, **changes: Any) -> SplineModel:
    """Model of the scenario ``default``, whose rails are splines; arguments as for :func:`paper_model`."""
    return build_spline_model(replace(_base(overrides, "default"), newmark=Newmark(dt), **changes), V)


class Run:
    """A state advanced at constant speed, every step recorded."""

    def __init__(self, model: Model, V: float, X: float = 0.0, steps: int = 1000, start: bool = True) -> None:
        """Put the train into steady rolling at chainage X of the window's rear end [m]."""
        self.model, self.V, self.X = model, V, X
        self.state = state_at_rest(model)
        if start:
            equilibrium(model, self.state, X, V)
        self.chunk = Chunk.empty(model.ingredients, steps, steps)
        self.stepper = make_stepper(model, self.state, self.chunk)

    def advance(self, steps: int, irregularity: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
        """Advance; returns the wheels' output, shape (steps, W, 2, N_WHEEL)."""
        X = self.X + self.V * self.model.ingredients.newmark.dt * np.arange(1, steps + 1)
        trains, wheelsets = self.state.iterations.shape
        if irregularity is None:
            irregularity = np.zeros((trains, steps, wheelsets, at.N_IRREGULARITY))
        self.stepper.load(X, np.full(steps, self.V), np.zeros(steps), irregularity)
        for i in range(steps):
            self.stepper.step(i, i, i)
        self.X = float(X[-1])
        return self.chunk.wheel[0, :steps].copy()
