"""One train of a result file as the standards see it: wheel forces by wheelset, accelerations at points of the floor.

Floor points lie over the bogies' centres (the mean of the axles of either half of the vehicle) and in the middle of the
car, 1 m to either side of its centre line, 1.25 m above the rail. With (X, Y, Z) from the car's centre of gravity (x
forward, y right, z down) a point is accelerated by

    lateral   y'' + X yaw'' - Z roll'',      vertical   z'' - X pitch'' + Y roll''.

What gravity adds to the reading of a tilted accelerometer is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tiengine.indices.filters import low_pass
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.scenario.recorded import recorded_scenario
from tiengine.vehicle.train import TrainModel, assemble, static_wheel_loads

if TYPE_CHECKING:
    from tiengine.result_files.reader import Reader
    from tiengine.scenario.scenario import Scenario
    from tiengine.vehicle.vehicle import Vehicle

__all__ = ["FORCE_CUT_OFF", "FloorPoint", "Forces", "Ride"]

FLOOR_HEIGHT = 1.25  # m above the rail: that of high-speed platforms; vehicle data do not give it
FLOOR_OFFSET = 1.0  # m beside the centre line, as GB/T 5599 has it
FORCE_CUT_OFF = 20.0  # Hz
LEAST_RATE = 200.0  # Hz: that of EN 14363, and twice the upper band limit of the weightings
LEAST_WAY = 10.0  # m behind the run-in
UNLOADED = 0.01  # of the static load: a wheel off the rail has no quotient, one that hardly touches no meaningful one


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces of a wheelset on the rails behind the run-in, low pass of 20 Hz.

    Attributes:
        position: Chainage of the train [m], shape (n,).
        Y: Lateral, left and right, positive to the right [N], shape (n, 2).
        Q: Vertical, positive down [N], shape (n, 2).
        static: Load of the left and the right wheel at rest [N], shape (2,).
    """

    position: Reals
    Y: Reals
    Q: Reals
    static: Reals

    @property
    def quotient(self) -> Reals:
        """Y/Q, outward positive, shape (n, 2); a wheel that has lifted off counts with 1 % of its static load."""
        return np.array([-1.0, 1.0]) * self.Y / np.maximum(self.Q, UNLOADED * self.static)


@dataclass(frozen=True, eq=False)
class FloorPoint:
    """Accelerations of a point of a car's floor over the whole run, run-in included.

    Attributes:
        name: Where it is.
        over_bogie: Whether it lies over a bogie.
        lateral: [m/s^2], shape (n,).
        vertical: [m/s^2], shape (n,).
    """

    name: str
    over_bogie: bool
    lateral: Reals
    vertical: Reals


class Ride:
    """One train of a result.

    Attributes:
        way: Way behind the run-in [m].
        speed: Largest speed [m/s].
    """

    def __init__(self, result: Reader, train: int = 0, scenario: Scenario | None = None) -> None:
        """Check what is there; nothing but times is read yet.

        Args:
            result: An open file.
            train: Index of the train.
            scenario: The train's own, for who has it already; read from the file if None.

        Raises:
            InputError: The file lacks what the indices need, is sampled too rarely, or the run is too short.
        """
        self._where = f"{result.name}: train {train}"
        scenario = scenario or recorded_scenario(result).members[train]
        self._wheel = self._group(result[f"trains/{train:03d}"], "wheel", ("lateral_force", "vertical_force"))
        self._body = self._group(result[f"trains/{train:03d}"], "body", ("acceleration",))
        self._parts = scenario.parts
        self._run_in = scenario.output.run_in
        self.speed = scenario.train.speed.fastest
        self.wheel_interval = self._interval(self._wheel["time"][:], "wheel_interval")
        self.body_interval = self._interval(self._body["time"][:], "body_interval")
        position = self._body["position"][:]
        self._begin = float(position[0]) + self._run_in
        self.way = float(position[-1]) - self._begin
        if self.way < LEAST_WAY:
            raise InputError(
                f"{self._where}: {position[-1] - position[0]:.4g} m are too short: output.run_in = {self._run_in:g}"
                f" must leave {LEAST_WAY:g} m"
            )
        self._keep_body = position >= self._begin
        names = list(self._body["body"].asstr()[:])
        if missing := [name for name in self._model.body_names if name not in names]:
            raise InputError(f"{self._where}: no body {missing[0]!r}")

    @property
    def vehicles(self) -> tuple[Vehicle, ...]:
        """The vehicles, the leading one first."""
        return self._parts.vehicles

    @property
    def duration(self) -> float:
        """Time behind the run-in [s]."""
        return float(self._keep_body.sum()) * self.body_interval

    def wheelsets(self, vehicle: int) -> list[int]:
        """Wheelsets of a vehicle, numbered through the train from 0."""
        return [int(i) for i in np.flatnonzero(self._model.wheelset_vehicle == vehicle)]

    def forces(self, wheelset: int) -> Forces:
        """Forces of one wheelset."""
        position = self._wheel["position"][:]
        keep = position >= self._begin
        Y, Q = (
            low_pass(self._wheel[name][:, wheelset, :].astype(np.float64), self.wheel_interval, FORCE_CUT_OFF)[keep]
            for name in ("lateral_force", "vertical_force")
        )
        return Forces(position[keep], Y, Q, self._static[wheelset])

    def floor(self, vehicle: int) -> list[FloorPoint]:
        """Points of a car's floor.

        Raises:
            InputError: The vehicle is made of wheelsets alone.
        """
        coach = self.vehicles[vehicle]
        bodies = [body for body in coach.body if not body.wheelset]
        if not bodies:
            raise InputError(f"{self._where}: {coach.name}: there is no car body")
        car = max(bodies, key=lambda body: body.mass)
        prefix = f"v{vehicle + 1} " if len(self.vehicles) > 1 else ""
        row = list(self._body["body"].asstr()[:]).index(f"{prefix}{car.name}")
        y, z, roll, pitch, yaw = self._body["acceleration"][:, row, :].astype(np.float64).T
        points = []
        for where, x in _stations(coach).items():
            for side, offset in (("left", -FLOOR_OFFSET), ("right", FLOOR_OFFSET)):
                X, Y, Z = car.local((x, offset, FLOOR_HEIGHT))
                lateral, vertical = y + X * yaw - Z * roll, z - X * pitch + Y * roll
                points.append(FloorPoint(f"floor {where} {side}", where != "middle", lateral, vertical))
        return points

    def behind_run_in(self, series: Reals) -> Reals:
        """Samples of the bodies that statistics use."""
        kept: Reals = series[self._keep_body]
        return kept

    @cached_property
    def body_position(self) -> Reals:
        """Chainage of the bodies' samples behind the run-in [m]."""
        return np.asarray(self._body["position"][:][self._keep_body])

    @cached_property
    def _model(self) -> TrainModel:
        return assemble(self._parts.vehicles, self._parts.centres)

    @cached_property
    def _static(self) -> Reals:
        loads: Reals = static_wheel_loads(self._model)
        return loads

    def _group(self, train: Any, name: str, channels: tuple[str, ...]) -> Any:
        for channel in channels:
            if name not in train or channel not in train[name]:
                raise InputError(
                    f"{self._where}: no {name}/{channel}; the indices need it: name it in output.{name}_channels"
                )
        return train[name]

    def _interval(self, time: Reals, key: str) -> float:
        """Time between samples [s]."""
        if len(time) < 2:
            raise InputError(f"{self._where}: output.{key}: too short, {len(time)} sample(s)")
        steps = np.diff(time)
        interval = float(np.median(steps))
        if np.ptp(steps) > 1e-6 * interval:
            raise InputError(f"{self._where}: output.{key}: samples must be evenly spaced for the filters")
        if interval * LEAST_RATE > 1.0 + 1e-9:
            raise InputError(
                f"{self._where}: output.{key} = {interval:.4g}: too coarse for the filters, must be at most"
                f" {1.0 / LEAST_RATE:g} s"
            )
        return interval


def _stations(coach: Vehicle) -> dict[str, float]:
    """Places along the car, forward of its middle [m]."""
    axles = coach.axle_positions
    half = (len(axles) + 1) // 2
    return {
        "over front bogie": float(axles[:half].mean()),
        "middle": 0.0,
        "over rear bogie": float(axles[-half:].mean()),
    }
