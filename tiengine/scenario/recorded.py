"""Scenario stored in a result file."""

from __future__ import annotations

from functools import lru_cache

from tiengine.parameters.input_files import parse_toml
from tiengine.result_files.reader import Reader
from tiengine.scenario.scenario import Scenario, load_scenario

__all__ = ["recorded_scenario"]


def recorded_scenario(result: Reader) -> Scenario:
    """Scenario of a result file, all trains of its ensemble together.

    Args:
        result: An open file.

    Raises:
        InputError: The text is missing, damaged, or breaks a rule.
    """
    return _loaded(result.scenario_toml, result.name)


@lru_cache(maxsize=2)
def _loaded(text: str, name: str) -> Scenario:
    """Load a text once: a report draws ten figures, and the trains of a large ensemble take seconds to build."""
    return load_scenario(parse_toml(text, f"{name}: scenario"))
