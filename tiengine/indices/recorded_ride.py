"""One train of a result file as a ride.

Floor points lie over the running gears and in the middle of every car body (:mod:`tiengine.vehicle.running_gear`), 1
m to either side of the centre line, 1.25 m above the rail. Each belongs to the car that it lies on; over a bogie that
two cars share both have one. At (X, Y, Z) from the car's centre of gravity (x forward, y right, z down) the
accelerations are

    lateral   y'' + X yaw'' - Z roll'',      vertical   z'' - X pitch'' + Y roll''.

The contribution of gravity to the reading of a tilted accelerometer is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tiengine.indices.ride import FloorPoint, Ride, Times, even_interval
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.scenario.recorded import recorded_scenario
from tiengine.vehicle.connector import VehicleClass
from tiengine.vehicle.running_gear import Car, RunningGear, cars
from tiengine.vehicle.train import TrainModel, assemble, static_wheel_loads, wheelset_lag

if TYPE_CHECKING:
    from tiengine.result_files.reader import Reader
    from tiengine.scenario.scenario import Scenario

__all__ = ["RecordedRide"]

FLOOR_HEIGHT = 1.25  # m above the rail: height of high-speed platforms; vehicle data do not give it
FLOOR_OFFSET = 1.0  # m from the centre line, as in GB/T 5599


class RecordedRide(Ride):
    """One train of a result."""

    wheel_times: Times
    body_times: Times

    def __init__(
        self,
        result: Reader,
        train: int = 0,
        scenario: Scenario | None = None,
        vehicle_class: VehicleClass | None = None,
    ) -> None:
        """Check the file; only times and positions are read yet.

        Args:
            result: An open file.
            train: Number of the train.
            scenario: Scenario of this train if known; read from the file if None.
            vehicle_class: Class of all vehicles, instead of what their data state.

        Raises:
            InputError: The file lacks what the indices need, the sampling is too coarse, or the run is too short.
        """
        self.where = f"{result.name}: train {train}"
        scenario = scenario or recorded_scenario(result).members[train]
        self._parts, self._class = scenario.parts, vehicle_class
        self._vehicle_read, self._forces_read = -1, list[Reals]()
        self._wheel = self._group(result[f"trains/{train:03d}"], "wheel", ("lateral_force", "vertical_force"))
        self._body = self._group(result[f"trains/{train:03d}"], "body", ("acceleration",))
        self._patch = result[f"trains/{train:03d}"].get("patch")
        self.speed = scenario.train.speed.fastest
        self.line, self.friction = scenario.track.line, scenario.track.friction
        angles = {id(profile): profile.flange_angle for pair in scenario.parts.wheel_profiles for profile in pair}
        self._flange_angles = [[angles[id(profile)] for profile in pair] for pair in scenario.parts.wheel_profiles]
        self.wheel_times = self._times(self._wheel, "wheel", scenario.output.run_in)
        self.body_times = self._times(self._body, "body", scenario.output.run_in)
        self.check_distance()
        names = list(self._body["body"].asstr()[:])
        if missing := [name for name in self._model.body_names if name not in names]:
            raise InputError(f"{self.where}: no body {missing[0]!r}")

    def flange_angle_of(self, wheelset: int, side: int) -> float | None:
        """Return the steepest angle of a wheel's flange [rad]; ``side`` is 0 for the left one."""
        return self._flange_angles[wheelset][side]

    @property
    def vehicle_classes(self) -> tuple[VehicleClass | None, ...]:
        """Class of each vehicle, the leading one first; None where it is not stated."""
        return tuple(self._class or vehicle.vehicle_class for vehicle in self._parts.vehicles)

    def wheelsets(self, vehicle: int) -> list[int]:
        """Return the wheelsets of a vehicle, numbered through the train from 0."""
        return [int(i) for i in np.flatnonzero(self._model.wheelset_vehicle == vehicle)]

    def vehicle_of(self, wheelset: int) -> int:
        """Return the vehicle of a wheelset; both are numbered from 0."""
        return int(self._model.wheelset_vehicle[wheelset])

    def offset(self, wheelset: int) -> float:
        """Return the place of a wheelset ahead of the chainage of the signals, the first vehicle's centre [m]."""
        return float(self._model.wheelset_x[wheelset])

    def wear_number(self, wheelset: int) -> tuple[Reals, Reals] | None:
        """Return chainages [m] after the run-in and the wear number of both wheels [N], None without its channels."""
        number = self._of_patches(wheelset) if self._patch is not None else self._of_wheels(wheelset)
        if number is None:
            return None
        keep = self._from_same_chainage(self.wheel_times, self.vehicle_of(wheelset)).used()
        return self.wheel_times.position[keep], number[keep]

    def _of_patches(self, wheelset: int) -> Reals:
        """Wear number of both wheels [N], shape (n, 2): the sum over their patches, which slip differently."""
        return np.asarray(self._patch["wear_number"][:, wheelset].astype(np.float64).sum(axis=-1))

    def _of_wheels(self, wheelset: int) -> Reals | None:
        """Wear number of both wheels with one patch [N], shape (n, 2), None without its channels."""
        pairs = [(f"{name}_creepage", f"{name}_creep_force") for name in ("longitudinal", "lateral")]
        if any(name not in self._wheel for pair in pairs for name in pair):
            return None
        slip, force = (np.stack([self._wheel[pair[i]][:, wheelset] for pair in pairs]) for i in range(2))
        return np.asarray(np.abs(slip.astype(np.float64) * force).sum(axis=0))

    def lag(self, vehicle: int) -> float:
        """Return the distance of a vehicle's leading wheelset behind that of the first one [m]."""
        return float(wheelset_lag(self._model)[self.wheelsets(vehicle)[0]])

    def raw_forces(self, wheelset: int) -> tuple[Reals, Reals, Reals]:
        """Read Y and Q of a wheelset [N], shape (n, 2), and its static wheel loads [N], shape (2,)."""
        vehicle = self.vehicle_of(wheelset)
        first, last = self.wheelsets(vehicle)[0], self.wheelsets(vehicle)[-1]
        if vehicle != self._vehicle_read:  # its wheelsets share the chunks of the file
            self._forces_read = [self._wheel[name][:, first : last + 1] for name in ("lateral_force", "vertical_force")]
            self._vehicle_read = vehicle
        Y, Q = (values[:, wheelset - first].astype(np.float64) for values in self._forces_read)
        return Y, Q, self._static[wheelset]

    def floor(self, vehicle: int) -> list[FloorPoint]:
        """Compute the accelerations of a vehicle's floor points.

        Raises:
            InputError: The vehicle consists of wheelsets only.
        """
        coach = self._parts.vehicles[vehicle]
        found = cars(coach)
        if not found:
            raise InputError(f"{self.where}: {coach.name}: there is no car body")
        prefix = f"v{vehicle + 1} " if len(self._parts.vehicles) > 1 else ""
        rows = list(self._body["body"].asstr()[:])
        points = []
        for car in found:
            motion = self._body["acceleration"][:, rows.index(f"{prefix}{car.body.name}"), :].astype(np.float64)
            of = f" of {car.body.name}" if len(found) > 1 else ""
            for place, x in _stations(car):
                for side, offset in (("left", -FLOOR_OFFSET), ("right", FLOOR_OFFSET)):
                    name = f"floor{of} {place} {side}"
                    points.append(_point(car, name, place != "middle", (x, offset, FLOOR_HEIGHT), motion))
        return points

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
                    f"{self.where}: no {name}/{channel}; the indices need it: name it in output.{name}_channels"
                )
        return train[name]

    def _times(self, group: Any, name: str, run_in: float) -> Times:
        interval = even_interval(group["time"][:], f"{self.where}: output.{name}_interval")
        return Times(np.asarray(group["position"][:], np.float64), interval, run_in)


def _point(car: Car, name: str, over_bogie: bool, place: tuple[float, float, float], motion: Reals) -> FloorPoint:
    """Accelerations at a place (x, y, height) of the vehicle [m] from those of its car, shape (n, 5)."""
    X, Y, Z = car.body.local(place)
    y, z, roll, pitch, yaw = motion.T
    acceleration = {"lateral": y + X * yaw - Z * roll, "vertical": z - X * pitch + Y * roll}
    return FloorPoint(name, over_bogie, acceleration)  # type: ignore[arg-type]


def _stations(car: Car) -> Iterator[tuple[str, float]]:
    """Names and places along the vehicle of a car's floor points, forward of the vehicle's centre [m]."""
    places = [(_gear_name(car, i), gear.centre) for i, gear in enumerate(car.gears)]
    yield from places[:1]
    yield "middle", car.middle
    yield from places[1:]


def _gear_name(car: Car, number: int) -> str:
    gear: RunningGear = car.gears[number]
    kind = "bogie" if len(gear.axles) > 1 else "wheelset"
    ends = {0: "front ", len(car.gears) - 1: "rear "} if len(car.gears) == 2 else {}
    if len(car.gears) == 1:
        return f"over {kind}"
    return f"over {ends[number]}{kind}" if ends else f"over {kind} {number + 1}"
