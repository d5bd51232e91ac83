"""Running gears and car bodies of a vehicle, found from its bodies and what joins them.

A vehicle is a list of bodies and connectors; nothing in it says which body is the car and which a bogie frame. A car
body is the heaviest suspended body, and any other of a quarter of its mass or more that lies ahead of or behind those
found before, such as the cars of an articulated unit; a transformer below a floor is none. A running gear is a group of
wheelsets that are joined with each other by bodies other than cars: a bogie of two or three axles, side frames and
bolster included, or a single wheelset below a car.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tiengine.vehicle.connector import Body
from tiengine.vehicle.vehicle import Vehicle

__all__ = ["Car", "RunningGear", "cars", "running_gears"]

LEAST_MASS = 0.25  # of the heaviest car: frames and bolsters are lighter
OVERLAP = 0.25  # of the shorter one: cars that share a bogie may reach into each other as far as its springs do


@dataclass(frozen=True)
class RunningGear:
    """Wheelsets that carry the vehicle together.

    Attributes:
        axles: Wheelsets' x forward of the vehicle's centre, the leading one first [m].
        bodies: Names of its bodies, wheelsets included.
    """

    axles: tuple[float, ...]
    bodies: frozenset[str]

    @property
    def centre(self) -> float:
        """Mean of its axles, forward of the vehicle's centre [m]."""
        return float(np.mean(self.axles))


@dataclass(frozen=True)
class Car:
    """A car body.

    Attributes:
        body: The body.
        reach: From the rearmost to the foremost point that a connector holds, forward of the vehicle's centre [m].
        gears: The running gears that it rests on, the leading one first.
    """

    body: Body
    reach: tuple[float, float]
    gears: tuple[RunningGear, ...]

    @property
    def middle(self) -> float:
        """Between its outermost running gears, or the middle of its reach without two of them [m]."""
        if len(self.gears) > 1:
            return 0.5 * (self.gears[0].centre + self.gears[-1].centre)
        return 0.5 * (self.reach[0] + self.reach[1])


def cars(vehicle: Vehicle) -> tuple[Car, ...]:
    """Find the car bodies of a vehicle, the leading one first; empty if it consists of wheelsets only."""
    found = _car_bodies(vehicle)
    gears = running_gears(vehicle)
    neighbours = _neighbours(vehicle)
    rows = [
        Car(body, _reach(vehicle, body), tuple(gear for gear in gears if gear.bodies & neighbours[body.name]))
        for body in found
    ]
    return tuple(sorted(rows, key=lambda car: -car.middle))


def running_gears(vehicle: Vehicle) -> tuple[RunningGear, ...]:
    """Find the running gears of a vehicle, the leading one first."""
    excluded = {body.name for body in _car_bodies(vehicle)}
    neighbours = _neighbours(vehicle)
    wheelsets = {body.name: body.x for body in vehicle.body if body.wheelset}
    gears, seen = [], set()
    for name in sorted(wheelsets, key=lambda each: -wheelsets[each]):
        if name in seen:
            continue
        group = _connected(name, neighbours, excluded)
        seen |= group
        axles = sorted((wheelsets[each] for each in group & wheelsets.keys()), reverse=True)
        gears.append(RunningGear(tuple(axles), frozenset(group)))
    return tuple(gears)


def _car_bodies(vehicle: Vehicle) -> list[Body]:
    suspended = sorted((body for body in vehicle.body if not body.wheelset), key=lambda body: -body.mass)
    found: list[Body] = []
    for body in suspended:
        apart = all(_overlap(_reach(vehicle, body), _reach(vehicle, other)) <= OVERLAP for other in found)
        if not found or (body.mass >= LEAST_MASS * found[0].mass and apart):
            found.append(body)
    return found


def _reach(vehicle: Vehicle, body: Body) -> tuple[float, float]:
    places = [body.x]
    for joint in (*vehicle.spring, *vehicle.damper, *vehicle.stop):
        places += [point[0] for end, point in ((joint.a, joint.point_a), (joint.b, joint.point_b)) if end == body.name]
    return min(places), max(places)


def _overlap(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Common length of two reaches over the shorter one; 1 for a point within the other."""
    common = min(first[1], second[1]) - max(first[0], second[0])
    shorter = min(first[1] - first[0], second[1] - second[0])
    return common / shorter if shorter > 0.0 else float(common >= 0.0)


def _neighbours(vehicle: Vehicle) -> dict[str, set[str]]:
    """Names of the bodies that each body is joined with."""
    found: dict[str, set[str]] = {body.name: set() for body in vehicle.body}
    for joint in (*vehicle.spring, *vehicle.damper, *vehicle.stop):
        found[joint.a].add(joint.b)
        found[joint.b].add(joint.a)
    return found


def _connected(start: str, neighbours: dict[str, set[str]], excluded: Iterable[str]) -> set[str]:
    """Names of the bodies that can be reached from one without passing excluded ones."""
    excluded = set(excluded)
    group, waiting = {start}, [start]
    while waiting:
        for name in neighbours[waiting.pop()] - group - excluded:
            group.add(name)
            waiting.append(name)
    return group
