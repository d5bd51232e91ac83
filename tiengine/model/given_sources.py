"""Given loads of a scenario's train."""

from __future__ import annotations

from tiengine.irregularity.base_motion import GroundRecord
from tiengine.model.base_motion_loads import BaseMotionLoads
from tiengine.model.curve_loads import CurveLoads
from tiengine.scenario.scenario import Scenario
from tiengine.vehicle.force_history import ForceLoads
from tiengine.vehicle.given_loads import LoadSource
from tiengine.vehicle.train import TrainModel
from tiengine.vehicle.wind import WindLoads, WindyCar

__all__ = ["given_sources"]


def given_sources(scenario: Scenario, train: TrainModel) -> tuple[LoadSource, ...]:
    """Sources of given loads: a line that is not straight and level, moving ground, wind, forces; files are read.

    Args:
        scenario: Checked scenario.
        train: Its train.

    Raises:
        InputError: A file breaks a rule.
    """
    parts, forces = scenario.parts, scenario.train.forces
    bodies = [
        (vehicle, x, body) for vehicle, x in zip(parts.vehicles, parts.centres, strict=True) for body in vehicle.body
    ]
    line = scenario.track.line
    found: list[LoadSource] = [] if line is None else [CurveLoads(line, train)]
    if scenario.track.base_motion.file is not None:
        found.append(BaseMotionLoads(GroundRecord(scenario.track.base_motion), train))
    if parts.aerodynamics is not None:
        found.append(WindLoads(scenario.wind, parts.aerodynamics, train, _windy_cars(scenario)))
    if forces:
        places = [(5 * i, float(bodies[i][1]) + bodies[i][2].x) for i in parts.forced]
        found.append(ForceLoads(forces, places, train))
    return tuple(found)


def _windy_cars(scenario: Scenario) -> list[WindyCar]:
    """Car bodies that the wind blows on."""
    parts, wind, first, cars = scenario.parts, scenario.wind, 0, []
    for k, (vehicle, x) in enumerate(zip(parts.vehicles, parts.centres, strict=True)):
        names = [body.name for body in vehicle.body]
        if wind.vehicles == "all" or k + 1 in wind.vehicles:
            body = vehicle.body[names.index(wind.body)]
            cars.append(WindyCar(5 * (first + names.index(wind.body)), float(x) + body.x, vehicle.length, body.height))
        first += len(names)
    return cars
