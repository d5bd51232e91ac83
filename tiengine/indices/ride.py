"""One train of a result file as the standards require it: forces by wheelset, accelerations at floor points.

Floor points lie over the bogie centres (the mean of the axles in each half of the vehicle) and in the middle of the
car, 1 m to either side of its centre line, 1.25 m above the rail. At (X, Y, Z) from the car's centre of gravity (x
forward, y right, z down) the accelerations are

    lateral   y'' + X yaw'' - Z roll'',      vertical   z'' - X pitch'' + Y roll''.

The contribution of gravity to the reading of a tilted accelerometer is left out.
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

FLOOR_HEIGHT = 1.25  # m above the rail: height of high-speed platforms; vehicle data do not give it
FLOOR_OFFSET = 1.0  # m from the centre line, as in GB/T 5599
FORCE_CUT_OFF = 20.0  # Hz
LEAST_RATE = 200.0  # Hz: as in EN 14363, and twice the upper band limit of the weightings
LEAST_DISTANCE = 10.0  # m after the run-in
UNLOADED = 0.01  # of the static load, least Q in a quotient: that of a wheel that hardly touches means nothing


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces of a wheelset on the rails after the run-in, low pass of 20 Hz.

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
        over_bogie: Whether it lies over a bogie.
        lateral: Lateral acceleration [m/s^2], shape (n,).
        vertical: Vertical acceleration [m/s^2], shape (n,).
    """

    name: str
    over_bogie: bool
    lateral: Reals
    vertical: Reals


class Ride:
    """One train of a result.

    Attributes:
        distance: Distance after the run-in [m].
        speed: Largest speed [m/s].
    """

    def __init__(self, result: Reader, train: int = 0, scenario: Scenario | None = None) -> None:
        """Check the file; only times and positions are read yet.

        Args:
            result: An open file.
            train: Number of the train.
            scenario: Scenario of this train if known; read from the file if None.

        Raises:
            InputError: The file lacks what the indices need, the sampling is too coarse, or the run is too short.
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
        self.distance = float(position[-1]) - self._begin
        if self.distance < LEAST_DISTANCE:
            raise InputError(
                f"{self._where}: {position[-1] - position[0]:.4g} m are too short: output.run_in = {self._run_in:g}"
                f" must leave {LEAST_DISTANCE:g} m"
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
        """Time after the run-in [s]."""
        return float(self._keep_body.sum()) * self.body_interval

    def wheelsets(self, vehicle: int) -> list[int]:
        """Return the wheelsets of a vehicle, numbered through the train from 0."""
        return [int(i) for i in np.flatnonzero(self._model.wheelset_vehicle == vehicle)]

    def forces(self, wheelset: int) -> Forces:
        """Read and filter the forces of one wheelset."""
        position = self._wheel["position"][:]
        keep = position >= self._begin
        Y, Q = (
            low_pass(self._wheel[name][:, wheelset, :].astype(np.float64), self.wheel_interval, FORCE_CUT_OFF)[keep]
            for name in ("lateral_force", "vertical_force")
        )
        return Forces(position[keep], Y, Q, self._static[wheelset])

    def floor(self, vehicle: int) -> list[FloorPoint]:
        """Compute the accelerations of a vehicle's floor points.

        Raises:
            InputError: The vehicle consists of wheelsets only.
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

    def after_run_in(self, series: Reals) -> Reals:
        """Select the samples after the run-in of a series of the bodies, shape (n,)."""
        kept: Reals = series[self._keep_body]
        return kept

    @cached_property
    def body_position(self) -> Reals:
        """Chainages of the bodies' samples after the run-in [m], shape (n,)."""
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
        """Time between samples [s], which must be constant."""
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
    """Places of floor points along the car, forward of its middle [m], by name."""
    axles = coach.axle_positions
    half = (len(axles) + 1) // 2
    return {
        "over front bogie": float(axles[:half].mean()),
        "middle": 0.0,
        "over rear bogie": float(axles[-half:].mean()),
    }
