"""Measured signals of one vehicle as a ride, so that their indices are computed as those of a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tiengine.indices.ride import Direction, FloorPoint, Ride, Times, even_interval
from tiengine.indices.signal_table import read_signals
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.vehicle.connector import VehicleClass

__all__ = ["QUANTITIES", "MeasuredRide", "measured_ride"]

ACCELERATIONS: dict[str, Direction] = {"lateral_acceleration": "lateral", "vertical_acceleration": "vertical"}
FORCES = ("lateral_force_left", "lateral_force_right", "vertical_force_left", "vertical_force_right")
QUANTITIES = (*ACCELERATIONS, *FORCES, "time", "position")
"""Quantities that a column may hold."""


class MeasuredRide(Ride):
    """Signals of one vehicle: accelerations at floor points over its bogies, forces of its wheelsets, or both."""

    def __init__(
        self,
        where: str,
        times: Times,
        speed: float,
        accelerations: Mapping[str, Mapping[Direction, Reals]],
        forces: Mapping[int, tuple[Reals, Reals]],
        static_load: float | None,
        vehicle_class: VehicleClass | None,
    ) -> None:
        """Take over signals.

        Args:
            where: Where they come from, for messages.
            times: Their sampling.
            speed: Largest speed [m/s].
            accelerations: By place and direction [m/s^2], shape (n,).
            forces: Y and Q by number of the wheelset from 0 [N], shape (n, 2); Y positive to the right.
            static_load: Static wheel load [N]; needed with forces.
            vehicle_class: Class of the vehicle; None for the limits of all vehicles only.

        Raises:
            InputError: The signals are too short, or the static load is missing.
        """
        self.where, self.speed = where, speed
        self.wheel_times = times if forces else None
        self.body_times = times if accelerations else None
        self._accelerations, self._forces, self._class = accelerations, forces, vehicle_class
        if forces and (static_load is None or not static_load > 0.0):
            raise InputError(f"{where}: wheel forces need the static wheel load, in kN: --static-load")
        self._static = np.full(2, static_load or 0.0)
        self.check_distance()

    @property
    def vehicle_classes(self) -> tuple[VehicleClass | None, ...]:
        """Class of the one vehicle."""
        return (self._class,)

    def wheelsets(self, vehicle: int) -> list[int]:
        """Return the numbers of the wheelsets whose forces were measured, from 0."""
        return sorted(self._forces)

    def raw_forces(self, wheelset: int) -> tuple[Reals, Reals, Reals]:
        """Return Y and Q of a wheelset [N], shape (n, 2), and its static wheel loads [N], shape (2,)."""
        return *self._forces[wheelset], self._static

    def floor(self, vehicle: int) -> list[FloorPoint]:
        """Return the measured floor points; those whose name begins with "middle" do not lie over a bogie."""
        return [
            FloorPoint(place, not place.startswith("middle"), series) for place, series in self._accelerations.items()
        ]


def measured_ride(
    path: Path,
    columns: Mapping[str, str],
    *,
    rate: float | None = None,
    speed: float | None = None,
    run_in: float = 0.0,
    static_load: float | None = None,
    vehicle_class: VehicleClass | None = None,
) -> MeasuredRide:
    """Read measured signals from a text file (:mod:`tiengine.indices.signal_table`).

    Args:
        path: The file.
        columns: Name of the column of each signal, ``quantity`` or ``place:quantity``, with quantities of
            :data:`QUANTITIES`; the place is a floor point, or ``wheelset N`` for forces. Empty: every column that is
            called after a signal.
        rate: Samples per second [Hz]; from the time column if None.
        speed: Constant speed [m/s]; from the position column if None.
        run_in: Distance at the start that is left out [m].
        static_load: Static wheel load [N]; needed with forces.
        vehicle_class: Class of the vehicle.

    Raises:
        InputError: The file, a column, rate, speed or static load is missing or breaks a rule.
    """
    table = read_signals(path)
    columns = columns or {name: name for name in table.names if name.rpartition(":")[2] in QUANTITIES}
    signals = {_signal(path, name): table.column(column) for name, column in columns.items()}
    accelerations: dict[str, dict[Direction, Reals]] = {}
    forces: dict[int, dict[str, Reals]] = {}
    for (place, quantity), series in signals.items():
        if quantity in ACCELERATIONS:
            accelerations.setdefault(place or "floor", {})[ACCELERATIONS[quantity]] = series
        elif quantity in FORCES:
            forces.setdefault(_wheelset(path, place), {})[quantity] = series
    if not accelerations and not forces:
        wanted = ", ".join((*ACCELERATIONS, *FORCES))
        raise InputError(f"{path}: no signal: name columns by --column SIGNAL=COLUMN, with signals {wanted}")
    count = len(next(iter(signals.values())))
    pairs = {wheelset: _pair(path, wheelset, found) for wheelset, found in forces.items()}
    times, fastest = _times(path, signals, count, rate, speed, run_in)
    return MeasuredRide(str(path), times, fastest, accelerations, pairs, static_load, vehicle_class)


def _signal(path: Path, name: str) -> tuple[str, str]:
    """Place and quantity that a signal's name stands for."""
    place, _, quantity = name.rpartition(":")
    if quantity not in QUANTITIES:
        known = ", ".join(QUANTITIES)
        raise InputError(f"{path}: no signal {quantity!r}{nearest(quantity, QUANTITIES)}; there are: {known}")
    return place.strip(), quantity


def _wheelset(path: Path, place: str) -> int:
    """Number of a wheelset from 0; the first one without a place."""
    number = place.removeprefix("wheelset").strip() if place else "1"
    if not (number.isascii() and number.isdecimal() and int(number) > 0):
        raise InputError(f"{path}: {place!r}: forces belong to a wheelset: 'wheelset 1:vertical_force_left'")
    return int(number) - 1


def _pair(path: Path, wheelset: int, found: Mapping[str, Reals]) -> tuple[Reals, Reals]:
    """Y and Q of a wheelset, shape (n, 2) each."""
    if missing := [name for name in FORCES if name not in found]:
        raise InputError(f"{path}: wheelset {wheelset + 1}: no {missing[0]}; all of {', '.join(FORCES)} are needed")
    Y, Q = (np.stack([found[name] for name in FORCES[i : i + 2]], axis=1) for i in (0, 2))
    return Y, Q


def _times(
    path: Path,
    signals: Mapping[tuple[str, str], Reals],
    count: int,
    rate: float | None,
    speed: float | None,
    run_in: float,
) -> tuple[Times, float]:
    """Sampling, and the largest speed [m/s]."""
    if rate is not None:
        time = np.asarray(np.arange(count) / rate, np.float64)
    elif ("", "time") in signals:
        time = signals["", "time"]
    else:
        raise InputError(f"{path}: neither --rate nor a column time")
    interval = even_interval(time, f"{path}: time between samples")
    if ("", "position") in signals:
        position = signals["", "position"]
    elif speed is not None:
        position = np.asarray(speed * interval * np.arange(count), np.float64)
    else:
        raise InputError(f"{path}: neither --speed nor a column position")
    if not (np.diff(position) > 0.0).all():
        raise InputError(f"{path}: position must rise from row to row")
    fastest = speed if speed is not None else float(np.gradient(position, interval).max())
    return Times(position, interval, run_in), fastest
