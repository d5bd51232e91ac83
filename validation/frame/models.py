"""Models of the paper's case that several files use without running them."""

from __future__ import annotations

from functools import cache

from tiengine.model.from_scenario import ingredients
from tiengine.model.model import Model, build_model
from tiengine.scenario.scenario import load_scenario

__all__ = ["paper_model"]


@cache
def paper_model(*overrides: str, dt: float = 2e-4) -> Model:
    """Build the model of the paper's case with changes, at a time step dt [s] and the speed of the start."""
    scenario = load_scenario("paper", overrides)
    return build_model(ingredients(scenario, dt), scenario.train.speed.at(0.0)[0])
