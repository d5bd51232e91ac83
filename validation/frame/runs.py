"""Runs of the engine that several cases share: each is made once per session and kept in memory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

from tiengine.parameters.arrays import Reals
from tiengine.result import Result
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from validation.msm.simulate import FullLength, run_full_length

__all__ = ["Forces", "full_length", "simulate"]

DOUBLE = 'output.precision="double"'


@dataclass(frozen=True, eq=False)
class Forces:
    """Wheel forces of a run.

    Attributes:
        time: End of each sample's step [s], shape (n,).
        position: Chainage of the vehicle's centre [m], shape (n,).
        normal: N [N], shape (n, wheelsets, 2), left and right.
        vertical: Q [N], positive down.
        lateral: Y [N], positive right.
        creep: Lateral creep force on the wheels [N].
        facts: Attributes of the result.
    """

    time: Reals
    position: Reals
    normal: Reals
    vertical: Reals
    lateral: Reals
    creep: Reals
    facts: dict[str, Any]


@cache
def simulate(scenario: str, *overrides: str, public: bool = False) -> Forces:
    """Run a built-in scenario with changes, in double precision.

    Args:
        scenario: Name of the scenario.
        overrides: ``"train.speed_kmh=300"`` and the like.
        public: Whether to use public Taichi calls only.
    """
    with run(load_scenario(scenario, [DOUBLE, *overrides]), public_launch=public) as result:
        return _forces(result)


@cache
def full_length(scenario: str, numerics: FullLength, *overrides: str) -> Forces:
    """Run a built-in scenario with changes in the traditional full-length model, in double precision.

    Args:
        scenario: Name of the scenario.
        numerics: Rail, modes, step.
        overrides: ``"train.speed_kmh=300"`` and the like.
    """
    with run_full_length(load_scenario(scenario, [DOUBLE, *overrides]), numerics) as result:
        return _forces(result)


def _forces(result: Result) -> Forces:
    wheel = result.wheel()
    return Forces(
        time=wheel["time"],
        position=wheel["position"],
        normal=wheel["normal_force"],
        vertical=wheel["vertical_force"],
        lateral=wheel["lateral_force"],
        creep=wheel["lateral_creep_force"],
        facts=result.attributes,
    )
