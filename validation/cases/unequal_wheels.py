"""Wheels of unequal radii on one axle: a free wheelset rolls beside the middle, where its cones make up for them.

A wagon of ``klingel`` at 30 km/h, its wheelsets free to steer, on cones of 1:40 or 1:20 over round railheads. Square to
the track and without creep, both wheels roll on the same radius: r_L - slope y = r_R + slope y, whatever the rails. The
axle is level then but for the rails: off the middle, one carries y/b0 more and sinks 1 mm times that deeper, which
rolls the wheelset and moves it by r0 1 mm/b0^2 = 8e-4 of y.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tiengine.engine import backend
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import state_at_rest
from tiengine.engine.state import DISPLACEMENT, State
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import Model, build_model
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from validation.cases.klingel import FREE, KMH, cone, round_head, wagon
from validation.frame.case import Case

__all__ = ["CASES", "free_wagon", "rolling"]

PAIRS = ((0.025, 1e-4), (0.05, 2e-4), (0.05, 1e-3))
"""Slope, and left less right radius [m]; the last are diameters of 2 mm apart, as 920 and 918 mm."""


def free_wagon(slope: float, difference: float, trial_functions: str = "splines") -> dict[str, Any]:
    """Scenario of a wagon whose wheelsets steer freely, the left wheels larger by a difference of the radii [m]."""
    free = wagon(FREE)  # to yaw; across, the car goes with its wheelsets
    free["spring"] = tuple({**spring, "ky": 1e6} for spring in free["spring"])
    radii = (
        {"side": "left", "radius_difference": 0.5 * difference},
        {"side": "right", "radius": 0.43 - 0.5 * difference},
    )
    return {
        "train": {
            "vehicles": (free,),
            "wheel_profile": cone(slope),
            "wheel_profiles": radii,
            "speed_kmh": KMH,
            "distance": 10.0,
        },
        "track": {"rail_profile": round_head(), "friction": 1.0},
        "numerics": {"trial_functions": trial_functions},
    }


def rolling(tables: dict[str, Any]) -> tuple[Model, State]:
    """Model and start in steady rolling of such a scenario."""
    backend.start(1)
    model = build_model(ingredients(load_scenario(tables), 1e-3), KMH / 3.6)
    state = state_at_rest(model)
    equilibrium(model, state, 100.0, KMH / 3.6)
    return model, state


def _offsets() -> Reals:
    """Offset of the leading wheelset for each pair of slope and difference [mm]."""
    found = []
    for slope, difference in PAIRS:
        model, state = rolling(free_wagon(slope, difference))
        lateral = state.part(0, "vehicles")[DISPLACEMENT][model.ingredients.train.wheelset_dof[0, 0]]
        found.append(1e3 * float(lateral))
    return np.array(found)


CASES = (
    Case(
        name="unequal-wheels",
        kind="verification",
        quantity="offset of a free wheelset, radii 0.1, 0.2, 1 mm apart on cones of 1:40, 1:20, 1:20 [mm]",
        source="equal rolling radii: (r_L - r_R)/(2 slope)",
        reference=tuple(1e3 * difference / (2.0 * slope) for slope, difference in PAIRS),
        rtol=3.5e-3,
        why="the rails sink unevenly, 8e-4, and terms of second order in the slope, 2.5e-3",
        compute=_offsets,
    ),
)
