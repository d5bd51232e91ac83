"""Runs of the engine that several cases share: each is made once a session and kept in memory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.scenario import load_scenario
from tiengine.simulate import run

__all__ = ["Forces", "simulate"]

Reals = NDArray[np.float64]


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
        scenario: Its name.
        overrides: ``"train.speed_kmh=300"`` and the like.
        public: Public Taichi calls only.
    """
    with run(load_scenario(scenario, ['output.precision="double"', *overrides]), public_launch=public) as result:
        wheel, facts = result.wheel(), result.attributes
    return Forces(
        time=wheel["time"],
        position=wheel["position"],
        normal=wheel["normal_force"],
        vertical=wheel["vertical_force"],
        lateral=wheel["lateral_force"],
        creep=wheel["lateral_creep_force"],
        facts=facts,
    )
