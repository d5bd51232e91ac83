"""Wind on car bodies: coefficients over the angle of attack, a wind over chainage or time, a gust (MODEL §14).

With wind speed U blowing at angle beta to the track (90 degrees: across, from left to right) on a car at speed V:

    V_a^2 = (V + U cos beta)^2 + (U sin beta)^2,    angle of attack = atan2(U sin beta, V + U cos beta)

and with q = rho V_a^2/2, area A, length L: side force q A c_side to the lee, lift q A c_lift upwards, and moments
q A L c about the point of the track's centre line at the top of the rail below the car's centre of gravity. A wind from
the other side mirrors them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import PchipInterpolator

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Name, Params, Q, Source
from tiengine.vehicle.given_loads import GivenLoads, no_loads
from tiengine.vehicle.train import TrainModel
from tiengine.vehicle.wind_gust import PASSING_POINTS, gust_share

__all__ = ["Aerodynamics", "Wind", "WindLoads", "WindyCar"]

Y, Z, ROLL, PITCH, YAW = range(5)
FORCES = ("side", "lift", "roll", "pitch", "yaw")
Coefficients = Annotated[tuple[Annotated[float, Q("-", ge=-100, le=100)], ...], Field(min_length=2, max_length=1000)]
Row = tuple[Annotated[float, Q("m", ge=-1e7, le=1e7)], Annotated[float, Q("m/s", ge=-100, le=100)]]


class Aerodynamics(Params):
    """Coefficients of a car body over the angle of attack, interpolated by monotone cubics.

    Side force to the lee, lift upwards; roll towards the lee, pitch (nose up) and yaw (nose to the lee) about the top
    of the rail below the centre of gravity. Moments are made by `area` times `length`.
    """

    name: Name = "car"
    source: Source = ""
    area: Annotated[float, Q("m^2", "reference area", gt=0, le=1e3)] = 10.0
    length: Annotated[float, Q("m", "reference length of the moments", gt=0, le=100)] = 3.0
    yaw_angle: Annotated[
        tuple[Annotated[float, Q("degrees", ge=0, le=180)], ...],
        Field(description="angles of attack [degrees], rising from 0", min_length=2, max_length=1000),
    ]
    side: Annotated[Coefficients, Field(description="side force")]
    lift: Annotated[Coefficients | None, Field(description="lift")] = None
    roll: Annotated[Coefficients | None, Field(description="roll moment")] = None
    pitch: Annotated[Coefficients | None, Field(description="pitch moment")] = None
    yaw: Annotated[Coefficients | None, Field(description="yaw moment")] = None

    @model_validator(mode="after")
    def _check(self) -> Aerodynamics:
        angle = self.yaw_angle
        if angle[0] != 0.0 or any(b <= a for a, b in pairwise(angle)):
            raise InputError(f"{self.name}.yaw_angle = {list(angle)[:5]}: must rise from 0 from angle to angle")
        for key in FORCES:
            given = getattr(self, key)
            if given is not None and len(given) != len(angle):
                raise InputError(
                    f"{self.name}.{key}: {len(given)} coefficients; must be {len(angle)}, one per yaw_angle"
                )
        return self

    def coefficients(self, angle: Reals) -> Reals:
        """Coefficients (side, lift, roll, pitch, yaw) at angles of attack of any sign [rad], shape (..., 5).

        Beyond the last angle the last coefficients hold.
        """
        degrees = np.minimum(np.degrees(np.abs(angle)), self.yaw_angle[-1])
        found = np.zeros((*np.shape(angle), len(FORCES)))
        for i, key in enumerate(FORCES):
            if (values := getattr(self, key)) is not None:
                found[..., i] = PchipInterpolator(self.yaw_angle, values)(degrees)
        lee = np.where(angle < 0.0, -1.0, 1.0)
        for i in (0, 2, 4):
            found[..., i] *= lee
        return found


class Wind(Params):
    """Wind over chainage or time, and the gust on it; the scenario's table adds the coefficients."""

    speed: Annotated[
        Annotated[float, Q("m/s", ge=-100, le=100)] | tuple[Row, ...] | None,
        Field(
            description="a number, or rows [chainage in m or time in s, m/s]; positive from left to right",
            json_schema_extra={"unit": "m/s"},
        ),
    ] = None
    over: Annotated[Literal["chainage", "time"], Field(description="first number of the rows of `speed`")] = "chainage"
    angle: Annotated[
        float,
        Q("degrees", "of the wind to the direction of travel; 90 across, below 90 against the train", gt=0, lt=180),
    ] = 90.0
    gust: Annotated[Literal["none", "en14067"], Field(description="gust on the mean wind")] = "none"
    gust_at: Annotated[float | None, Q("m", "chainage of the gust's top", ge=0, le=1e7)] = None
    density: Annotated[float, Q("kg/m^3", "of the air", gt=0, le=2)] = 1.225
    vehicles: Annotated[
        tuple[Annotated[int, Q("-", "number", ge=1, le=64)], ...] | Literal["all"],
        Field(description="vehicles in the wind, counted from the front from 1"),
    ] = "all"
    body: Annotated[str, Field(description="their body that it blows on", max_length=200)] = "car"

    @model_validator(mode="after")
    def _check(self) -> Wind:
        if isinstance(self.speed, tuple):
            first = [row[0] for row in self.speed]
            if len(first) < 2 or any(b <= a for a, b in pairwise(first)):
                raise InputError(
                    f"wind.speed = {list(self.speed)[:3]}: must be two rows or more, the first numbers rising"
                )
        if self.gust != "none" and (self.gust_at is None or isinstance(self.speed, tuple)):
            raise InputError(f'wind.gust = "{self.gust}": needs wind.gust_at and one number as wind.speed')
        if self.speed is None and self.model_fields_set - {"speed"} and self != type(self)():
            raise InputError("wind.speed: missing; a value is required")
        return self

    def at(self, x: Reals, time: Reals, length: float) -> Reals:
        """Wind speed at a car [m/s].

        Args:
            x: Chainage of its middle [m], shape (n,).
            time: Since the start [s], shape (n,).
            length: Of the car [m].
        """
        if isinstance(self.speed, tuple):
            first, values = np.array(self.speed, np.float64).T
            place = np.clip(x if self.over == "chainage" else time, first[0], first[-1])
            return np.asarray(PchipInterpolator(first, values)(place), np.float64)
        mean = float(self.speed or 0.0)
        if self.gust_at is None:
            return np.full(np.shape(x), mean)
        along = length * (np.arange(PASSING_POINTS) + 0.5) / PASSING_POINTS - 0.5 * length
        distance = np.abs(x[:, None] + along - self.gust_at)
        rise = gust_share(distance, abs(mean), float(np.radians(self.angle))).mean(axis=1)
        return np.asarray(mean * (1.0 + rise), np.float64)


class WindyCar(NamedTuple):
    """A car body in the wind.

    Attributes:
        dof: Its first coordinate in the train.
        x: Its middle relative to the first vehicle's centre, forward [m].
        length: Of its vehicle [m].
        height: Of its centre of gravity above the rails [m].
    """

    dof: int
    x: float
    length: float
    height: float


class WindLoads:
    """Given loads of a train in the wind.

    Attributes:
        sets: 1: the same for all trains that are advanced together.
    """

    sets = 1

    def __init__(self, wind: Wind, shape: Aerodynamics, train: TrainModel, cars: Sequence[WindyCar]) -> None:
        """Keep wind and cars."""
        self._wind, self._shape, self._train, self._cars = wind, shape, train, tuple(cars)

    def __call__(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> GivenLoads:
        """Forces and moments about the centres of gravity."""
        loads = no_loads(self._train, len(x))
        beta = np.radians(self._wind.angle)
        for car in self._cars:
            U = self._wind.at(x + car.x, time, car.length)
            ahead, across = V + np.abs(U) * np.cos(beta), U * np.sin(beta)
            q = 0.5 * self._wind.density * (ahead**2 + across**2) * self._shape.area
            side, lift, roll, pitch, yaw = np.moveaxis(self._shape.coefficients(np.arctan2(across, ahead)), -1, 0)
            force: Any = loads.force[0]
            force[:, car.dof + Y] += q * side
            force[:, car.dof + Z] -= q * lift
            force[:, car.dof + ROLL] += q * (self._shape.length * roll - car.height * side)
            force[:, car.dof + PITCH] += q * self._shape.length * pitch
            force[:, car.dof + YAW] += q * self._shape.length * yaw
        return loads
