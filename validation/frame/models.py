"""Models that several files use without running them: of the paper's case in sines, of the default scenario."""

from __future__ import annotations

from functools import cache

from tiengine.model.from_scenario import ingredients
from tiengine.model.sine_model import SineModel, build_sine_model
from tiengine.model.spline_model import SplineModel, build_spline_model
from tiengine.scenario.scenario import load_scenario

__all__ = ["default_model", "paper_model"]


@cache
def paper_model(*overrides: str, dt: float = 2e-4) -> SineModel:
    """Build the model of the paper's case with changes, at a time step dt [s] and the speed of the start."""
    scenario = load_scenario("paper", overrides)
    return build_sine_model(ingredients(scenario, dt), scenario.train.speed.at(0.0)[0])


@cache
def default_model(*overrides: str, dt: float = 2e-4) -> SplineModel:
    """Build the model of the default scenario with changes, at a time step dt [s] and the speed of the start."""
    scenario = load_scenario("default", overrides)
    return build_spline_model(ingredients(scenario, dt), scenario.train.speed.at(0.0)[0])
