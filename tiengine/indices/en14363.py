"""EN 14363, running behaviour of a vehicle on straight track (zone 1), normal method.

Curves of the line are left out here; :mod:`tiengine.indices.curves` has their zones.

Quantities: the quotient Y/Q and the sum of the lateral forces Y of a wheelset, low pass of 20 Hz, means over 2 m every
0.5 m; the wheel force Q, low pass of 20 Hz; accelerations of floor points over the bogies, 0.4 to 10 Hz. The value of a
series is the greater in magnitude of its percentiles 0.15 and 99.85, for Q the upper one.

A zone has sections of 250 m, above 220 km/h of 500 m, at least 25 of them and 10 km in total. Then the estimated
maximum is mean + k standard deviation of the sections' values, k = 3.0 for running safety and 2.2 otherwise: an
assessment. Over a shorter distance the percentiles are taken over the whole run: an index.

Limits of Y/Q and Q hold for all vehicles, others only for the classes that :data:`AXLE_FACTORS` and
:data:`ACCELERATION_LIMITS` list; a value without a limit for its class is given without one.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

import numpy as np

from tiengine.indices.filters import band_pass, band_pass_settling, sliding_mean
from tiengine.indices.index import Index, no_limit, worst, worst_of
from tiengine.indices.ride import MEAN, Direction, FloorPoint, Ride
from tiengine.parameters.arrays import Reals
from tiengine.vehicle.connector import VehicleClass

__all__ = [
    "ACCELERATION_LIMITS",
    "BAND",
    "QUOTIENT_LIMIT",
    "axle_force_limit",
    "body_indices",
    "extreme",
    "shortfall",
    "wheel_force_limit",
    "wheel_indices",
]

STANDARD = "EN 14363:2016"
SAFETY, OTHER = 3.0, 2.2  # k for running safety; for track loading and ride characteristics
QUOTIENT_LIMIT = 0.8
AXLE_FACTORS: dict[VehicleClass | None, float] = {"coach": 1.0, "locomotive": 1.0, "freight": 0.85}
"""Factor k1 of the limit of the sum of Y by class."""
ACCELERATION_LIMITS: dict[VehicleClass | None, float] = {"coach": 2.5}
"""Limit of floor accelerations by class [m/s^2]."""
BAND = (0.4, 10.0)  # Hz
FAST = 220.0 / 3.6  # m/s, above which sections are longer
SECTIONS, ZONE = 25, 10e3  # least number of sections, least length of a zone [m]
Q_SPEEDS = (160.0, 200.0, 250.0, 300.0)  # km/h
Q_CAPS = (200.0, 190.0, 180.0, 170.0, 160.0)  # kN, up to each speed and above the last one


def section_length(speed: float) -> float:
    """Return the length of a section [m] at a speed [m/s]."""
    return 500.0 if speed > FAST + 1e-9 else 250.0


def shortfall(distance: float, speed: float) -> str:
    """Say why a distance [m] at a speed [m/s] is too short for a zone; empty if it is long enough."""
    length = section_length(speed)
    needed = max(SECTIONS * length, ZONE)
    if distance >= needed - 1e-6:
        return ""
    return (
        f"the run covers only {distance:.0f} m, a zone has {SECTIONS} sections of {length:g} m, {needed / 1e3:g} km at"
        " least"
    )


def extreme(position: Reals, series: Reals, speed: float, k: float, *, signed: bool = False) -> float:
    """Estimate the maximum of a series by the method of the standard.

    Args:
        position: Chainages [m], shape (n,).
        series: Samples, shape (n,).
        speed: Speed of the train [m/s].
        k: Factor of the standard deviation.
        signed: Use the upper percentile with its sign only.

    Returns:
        The value [unit of the series].
    """
    if shortfall(float(position[-1] - position[0]), speed):
        return _percentile(series, signed)
    length = section_length(speed)
    edges = np.arange(position[0], position[-1] - length + 1e-6, length)
    starts, ends = np.searchsorted(position, edges - 1e-9), np.searchsorted(position, edges + length - 1e-9)
    sections = [_percentile(series[i:j], signed) for i, j in zip(starts, ends, strict=True)]
    return float(np.mean(sections) + k * np.std(sections, ddof=1))


def _percentile(series: Reals, signed: bool) -> float:
    low, high = np.percentile(series, (0.15, 99.85))
    return float(high) if signed else float(max(abs(low), abs(high)))


def wheel_force_limit(static: float, speed: float) -> float:
    """Return the limit of Q [kN]: 90 kN above the static load, capped by speed for the sake of the track.

    Args:
        static: Static wheel load [kN].
        speed: Speed of the train [m/s].
    """
    return min(90.0 + static, Q_CAPS[bisect_left(Q_SPEEDS, 3.6 * speed - 1e-6)])


def axle_force_limit(static: float, vehicle_class: VehicleClass | None) -> float | None:
    """Return the limit of the sum of Y of a wheelset [kN], k1 (10 + static/3); None for a class without one.

    Args:
        static: Static load of the wheelset, both wheels [kN].
        vehicle_class: Class of the vehicle; None if it is not stated.
    """
    factor = AXLE_FACTORS.get(vehicle_class)
    return None if factor is None else factor * (10.0 + static / 3.0)


def wheel_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield Y/Q, sum of Y and Q of the worst wheel or wheelset of a vehicle."""
    found: dict[str, list[Index]] = {}
    for w in ride.wheelsets(vehicle):
        for index in _wheelset_indices(ride, vehicle, w):
            found.setdefault(index.name, []).append(index)
    yield from map(worst, found.values())


def _wheelset_indices(ride: Ride, vehicle: int, wheelset: int) -> Iterator[Index]:
    forces, speed, vehicle_class = ride.straight_forces(wheelset), ride.speed, ride.vehicle_classes[vehicle]
    if len(forces.position) < 2 or forces.position[-1] - forces.position[0] < MEAN:
        return  # no straight track
    reason = _shortfall(ride, vehicle, forces.position)

    def index(name: str, place: str, value: float, unit: str, limit: float | None, clause: str) -> Index:
        place = f"wheelset {wheelset + 1}{place}"
        return Index(
            standard=STANDARD, name=name, vehicle=vehicle + 1, place=place, value=value, unit=unit, limit=limit,
            clause=clause, shortfall=reason, note=no_limit(vehicle_class) if limit is None else "",
        )  # fmt: skip

    for i, side in enumerate((" left", " right")):
        value = extreme(*sliding_mean(forces.position, forces.quotient[:, i]), speed, SAFETY)
        yield index("Y/Q, 2 m mean", side, value, "-", QUOTIENT_LIMIT, "7.5.2 running safety")
        value = 1e-3 * extreme(forces.position, forces.Q[:, i], speed, OTHER, signed=True)
        limit = wheel_force_limit(1e-3 * forces.static[i], speed)
        yield index("wheel force Q", side, value, "kN", limit, "7.5.3 track loading")
    value = 1e-3 * extreme(*sliding_mean(forces.position, forces.Y.sum(axis=1)), speed, SAFETY)
    axle_limit = axle_force_limit(1e-3 * float(forces.static.sum()), vehicle_class)
    yield index("sum of Y, 2 m mean", "", value, "kN", axle_limit, "7.5.2 running safety")


def body_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield lateral and vertical acceleration at the worst floor point over a running gear."""
    points = [point for point in ride.floor(vehicle) if point.over_bogie]
    directions: tuple[Direction, ...] = ("lateral", "vertical")
    for direction in directions:
        yield from worst_of(
            _acceleration_at(ride, vehicle, point, direction) for point in points if direction in point.acceleration
        )


def _acceleration_at(ride: Ride, vehicle: int, point: FloorPoint, direction: Direction) -> Index:
    times, vehicle_class = ride.acceleration_times(vehicle), ride.vehicle_classes[vehicle]
    limit = ACCELERATION_LIMITS.get(vehicle_class)
    settling = band_pass_settling(*BAND)
    position = times.position[times.used(settling)]
    value, note = (
        None,
        f"run shorter than a period of 0.4 Hz, 2.5 s, and {2.0 * settling:g} s of settling of the filter",
    )
    if times.duration(settling) * BAND[0] >= 1.0:
        series = band_pass(point.acceleration[direction], times.interval, *BAND)[times.used(settling)]
        value, note = extreme(position, series, ride.speed, OTHER), no_limit(vehicle_class) if limit is None else ""
    return Index(
        standard=STANDARD,
        name=f"{direction} acceleration",
        vehicle=vehicle + 1,
        place=point.name,
        value=value,
        unit="m/s^2",
        limit=limit,
        clause="7.5.4 ride characteristics",
        shortfall=_shortfall(ride, vehicle, position),
        note=note,
    )


def _shortfall(ride: Ride, vehicle: int, position: Reals) -> str:
    """Shortfall of a vehicle's distance, or of the chainages [m] that the settling of filters leaves, shape (n,)."""
    used = float(position[-1] - position[0]) if len(position) else 0.0
    return shortfall(ride.distance(vehicle), ride.speed) or shortfall(used, ride.speed)
