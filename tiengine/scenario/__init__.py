"""Scenarios: validated description of a run."""

from tiengine.scenario.scenario import Scenario, load_scenario

__all__ = ["Scenario", "load_scenario"]
