"""A ride as the standards require it: forces by wheelset, accelerations at floor points.

Run-in and the ends at which filters settle are left out. A vehicle behind the first one leaves its run-in where the
first one did, so that all vehicles are evaluated from the same chainage on. Derived classes know where the signals come
from: a result file (:mod:`tiengine.indices.recorded_ride`) or a table of measured signals
(:mod:`tiengine.indices.measured_ride`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tiengine.indices.filters import low_pass, low_pass_settling
from tiengine.indices.zones import ZONES, stretches
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.track.alignment import Alignment
from tiengine.vehicle.connector import VehicleClass

__all__ = ["FORCE_CUT_OFF", "LEAST_DISTANCE", "Direction", "FloorPoint", "Forces", "Ride", "Times", "even_interval"]

Direction = Literal["lateral", "vertical"]

FORCE_CUT_OFF = 20.0  # Hz
LEAST_RATE = 200.0  # Hz: as in EN 14363, and twice the upper band limit of the weightings
LEAST_DISTANCE = 10.0  # m after the run-in
MEAN = 2.0  # m, length of the sliding means of forces
UNLOADED = 0.01  # of the static load, least Q in a quotient: that of a wheel that hardly touches means nothing


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces of a wheelset on the rails, low pass of 20 Hz, without run-in and filter ends.

    Attributes:
        position: Chainages of the train [m], shape (n,).
        Y: Lateral forces, left and right, positive to the right [N], shape (n, 2).
        Q: Vertical forces, left and right, positive down [N], shape (n, 2).
        static: Static loads of the left and the right wheel [N], shape (2,).
    """

    position: Reals
    Y: Reals
    Q: Reals
    static: Reals

    @property
    def quotient(self) -> Reals:
        """Y/Q, outward positive, shape (n, 2); Q of an unloaded wheel is taken as 1 % of its static load."""
        return np.array([-1.0, 1.0]) * self.Y / np.maximum(self.Q, UNLOADED * self.static)


@dataclass(frozen=True, eq=False)
class FloorPoint:
    """Accelerations of a floor point over the whole run, run-in included.

    Attributes:
        name: Name of its place.
        over_bogie: Whether it lies over a running gear.
        acceleration: Series by direction [m/s^2], shape (n,); a direction that was not measured is missing.
    """

    name: str
    over_bogie: bool
    acceleration: Mapping[Direction, Reals]


@dataclass(frozen=True, eq=False)
class Times:
    """Sampling of a group of signals.

    Attributes:
        position: Chainages of the train [m], shape (n,).
        interval: Time between samples [s].
        run_in: Distance at the start that is left out [m].
    """

    position: Reals
    interval: float
    run_in: float

    def used(self, settling: float = 0.0) -> NDArray[np.bool_]:
        """Select the samples after the run-in and at least a time [s] from either end, shape (n,)."""
        margin = int(np.ceil(settling / self.interval - 1e-9))
        keep: NDArray[np.bool_] = self.position >= self.position[0] + self.run_in
        keep[:margin] = False
        keep[max(len(keep) - margin, 0) :] = False
        return keep

    def duration(self, settling: float = 0.0) -> float:
        """Return the duration of the samples selected [s]."""
        return float(self.used(settling).sum()) * self.interval


class Ride(ABC):
    """Signals of one train.

    Attributes:
        where: File and train, for messages.
        speed: Largest speed [m/s].
        wheel_times: Sampling of the wheel forces; None without them.
        body_times: Sampling of the accelerations; None without them.
        line: Curvature and cant of the track; None where it is straight and level.
        flange_angle: Steepest angle of the wheels' flanges [rad]; None where it is not known.
        friction: Coefficient of friction between wheel and rail.
    """

    where: str
    speed: float
    wheel_times: Times | None
    body_times: Times | None
    line: Alignment | None = None
    flange_angle: float | None = None
    friction: float = 0.3

    def flange_angle_of(self, wheelset: int, side: int) -> float | None:
        """Return the steepest angle of a wheel's flange [rad]; ``side`` is 0 for the left one; None if not known."""
        return self.flange_angle

    @property
    @abstractmethod
    def vehicle_classes(self) -> tuple[VehicleClass | None, ...]:
        """Class of each vehicle, the leading one first; None where it is not stated."""

    @abstractmethod
    def wheelsets(self, vehicle: int) -> list[int]:
        """Return the wheelsets of a vehicle, numbered through the train from 0."""

    @abstractmethod
    def raw_forces(self, wheelset: int) -> tuple[Reals, Reals, Reals]:
        """Return Y and Q of a wheelset [N], shape (n, 2), and its static wheel loads [N], shape (2,)."""

    @abstractmethod
    def floor(self, vehicle: int) -> list[FloorPoint]:
        """Return the accelerations of a vehicle's floor points."""

    def vehicle_of(self, wheelset: int) -> int:
        """Return the vehicle of a wheelset; both are numbered from 0."""
        return 0

    def offset(self, wheelset: int) -> float:
        """Return the place of a wheelset ahead of the chainage of the signals [m]."""
        return 0.0

    def wear_number(self, wheelset: int) -> tuple[Reals, Reals] | None:
        """Return chainages of the train [m] and the wear number of both wheels [N], shape (n, 2); None if unknown."""
        return None

    def straight_forces(self, wheelset: int) -> Forces:
        """Filter the forces of one wheelset and keep the longest stretch of straight track, all without curves."""
        forces = self.forces(wheelset)
        if self.line is None or not len(forces.position):
            return forces
        own = forces.position + self.offset(wheelset)
        straight = [s for s in stretches(self.line, float(own[0]), float(own[-1])) if s.zone is ZONES[0]]
        if not straight:
            return Forces(own[:0], forces.Y[:0], forces.Q[:0], forces.static)
        longest = max(straight, key=lambda stretch: stretch.end - stretch.begin)
        kept = (own >= longest.begin) & (own <= longest.end)
        return Forces(forces.position[kept], forces.Y[kept], forces.Q[kept], forces.static)

    def lag(self, vehicle: int) -> float:
        """Return the distance of a vehicle behind the first one [m]."""
        return 0.0

    def acceleration_times(self, vehicle: int) -> Times:
        """Return the sampling of a vehicle's accelerations, which a ride with floor points has."""
        assert self.body_times is not None, "a ride without accelerations has no floor points"
        return self._from_same_chainage(self.body_times, vehicle)

    def distance(self, vehicle: int = 0) -> float:
        """Return the distance that a vehicle covers after its run-in [m]."""
        times = self.body_times or self.wheel_times
        return float(times.position[-1] - times.position[0]) - times.run_in - self.lag(vehicle) if times else 0.0

    def is_long_enough(self, vehicle: int) -> bool:
        """Whether a vehicle covers enough distance after its run-in for any index."""
        filtered = np.array([0.0, MEAN])
        if self.wheel_times:
            times = self._from_same_chainage(self.wheel_times, vehicle)
            filtered = times.position[times.used(low_pass_settling(FORCE_CUT_OFF))]
        return self.distance(vehicle) >= LEAST_DISTANCE and len(filtered) > 0 and filtered[-1] - filtered[0] >= MEAN

    def forces(self, wheelset: int) -> Forces:
        """Filter the forces of one wheelset."""
        assert self.wheel_times is not None, "a ride without wheel forces has no wheelsets"
        times = self._from_same_chainage(self.wheel_times, self.vehicle_of(wheelset))
        *raw, static = self.raw_forces(wheelset)
        keep = times.used(low_pass_settling(FORCE_CUT_OFF))
        Y, Q = (low_pass(series, times.interval, FORCE_CUT_OFF)[keep] for series in raw)
        return Forces(times.position[keep], Y, Q, static)

    def check_distance(self) -> None:
        """Refuse a run that is too short for any index.

        Raises:
            InputError: The distance after the run-in is too short.
        """
        if self.is_long_enough(0):
            return
        times = self.body_times or self.wheel_times
        length = float(times.position[-1] - times.position[0]) if times else 0.0
        run_in = times.run_in if times else 0.0
        raise InputError(
            f"{self.where}: {length:.4g} m are too short: output.run_in = {run_in:g} must leave {LEAST_DISTANCE:g} m,"
            f" and {MEAN:g} m without {low_pass_settling(FORCE_CUT_OFF):g} s at either end"
        )

    def _from_same_chainage(self, times: Times, vehicle: int) -> Times:
        """Lengthen the run-in by the distance of a vehicle behind the first one."""
        return replace(times, run_in=times.run_in + self.lag(vehicle))


def even_interval(time: Reals, where: str) -> float:
    """Return the time between samples [s].

    Args:
        time: Times of the samples [s], shape (n,).
        where: Names them in messages.

    Raises:
        InputError: There are fewer than two samples, or they are not evenly spaced or too coarse for the filters.
    """
    if len(time) < 2:
        raise InputError(f"{where}: too short, {len(time)} sample(s)")
    steps = np.diff(time)
    interval = float(np.median(steps))
    if np.ptp(steps) > 1e-6 * interval:
        raise InputError(f"{where}: samples must be evenly spaced for the filters")
    if interval * LEAST_RATE > 1.0 + 1e-9:
        raise InputError(
            f"{where} = {interval:.4g}: too coarse for the filters, must be at most {1.0 / LEAST_RATE:g} s"
        )
    return interval
