"""All indices of a result, train by train, as values and as JSON; docs/indices.md explains them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Any

from tiengine.indices import comfort, curves, en14363, gb5599
from tiengine.indices.index import Index, worst
from tiengine.indices.recorded_ride import RecordedRide
from tiengine.indices.ride import Ride
from tiengine.parameters.errors import InputError
from tiengine.scenario.recorded import recorded_scenario

if TYPE_CHECKING:
    from tiengine.result_files.reader import Reader
    from tiengine.vehicle.connector import VehicleClass

__all__ = ["Metrics", "Spread", "TrainMetrics", "evaluate", "train_metrics"]

FORMAT, FORMAT_VERSION = "tiengine-metrics", 1
METHODS = (
    en14363.wheel_indices,
    curves.wheel_indices,
    en14363.body_indices,
    gb5599.wheel_indices,
    gb5599.body_indices,
    comfort.en12299_indices,
    comfort.iso2631_indices,
)


@dataclass(frozen=True)
class TrainMetrics:
    """Indices of one train.

    Attributes:
        train: Number in the file.
        distance: Distance evaluated, without the run-in [m].
        indices: Indices, vehicle by vehicle.
        left_out: Numbers of the vehicles that the run is too short for, 1 for the leading one.
    """

    train: int
    distance: float
    indices: tuple[Index, ...]
    left_out: tuple[int, ...] = ()


@dataclass(frozen=True)
class Spread:
    """One index over all trains.

    Attributes:
        worst: The worst of all trains.
        train: Number of the train that it belongs to.
        median: Median over the trains that have a value; None if none has.
        over: Number of trains over the limit.
        trains: Number of trains with a value.
    """

    worst: Index
    train: int
    median: float | None
    over: int
    trains: int


@dataclass(frozen=True)
class Metrics:
    """Indices of a result.

    Attributes:
        name: Path of the file.
        trains: Indices of the trains evaluated.
        failed: Reasons why other trains did not complete their run, by number.
    """

    name: str
    trains: tuple[TrainMetrics, ...]
    failed: dict[int, str]

    def spread(self, *, by_vehicle: bool = True) -> tuple[Spread, ...]:
        """Collect every index over all trains.

        Args:
            by_vehicle: Vehicle by vehicle of the train; otherwise the worst vehicle stands for each train.
        """
        groups: dict[tuple[str, str, int], dict[int, list[Index]]] = {}
        for train in self.trains:
            for index in train.indices:
                key = (index.standard, index.name, index.vehicle if by_vehicle else 0)
                groups.setdefault(key, {}).setdefault(train.train, []).append(index)
        return tuple(_spread([(i, worst(found)) for i, found in trains.items()]) for trains in groups.values())

    @property
    def vehicles(self) -> int:
        """Number of vehicles, with those left out."""
        return max(max((*(i.vehicle for i in t.indices), *t.left_out), default=1) for t in self.trains)

    def to_json(self) -> str:
        """Return JSON text with a format version."""
        tables: dict[str, Any] = {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "file": self.name,
            "trains": [
                {
                    "train": t.train,
                    "way_m": t.distance,
                    "vehicles_left_out": list(t.left_out),
                    "indices": [index.to_dict() for index in t.indices],
                }
                for t in self.trains
            ],
            "failed": {str(train): why for train, why in self.failed.items()},
        }
        return json.dumps(tables, indent=2)


def evaluate(result: Reader, train: int | None = None, vehicle_class: VehicleClass | None = None) -> Metrics:
    """Compute the indices of a result.

    Args:
        result: An open file.
        train: Number of one train; all if None.
        vehicle_class: Class of all vehicles, instead of what their data state.

    Raises:
        InputError: There is no such train, no train completed its run, channels are missing, the sampling is too coarse
            or the run too short.
    """
    if train is not None and not 0 <= train < result.trains:
        raise InputError(f"{result.name}: train = {train}: must be from 0 to {result.trains - 1}")
    selected = range(result.trains) if train is None else [train]
    failed = {i: why for i, why in result.failures.items() if i in selected}
    complete = [i for i in selected if i not in failed]
    if not complete:
        raise InputError(f"{result.name}: no train completed its run: {next(iter(failed.values()), 'there is none')}")
    members = recorded_scenario(result).members
    rides = ((i, RecordedRide(result, i, members[i], vehicle_class)) for i in complete)
    return Metrics(result.name, tuple(train_metrics(ride, i) for i, ride in rides), failed)


def train_metrics(ride: Ride, train: int = 0) -> TrainMetrics:
    """Compute the indices of one ride.

    Args:
        ride: Signals of the train.
        train: Number of the train.
    """
    vehicles = range(len(ride.vehicle_classes))
    evaluated = [v for v in vehicles if ride.is_long_enough(v)]
    indices = tuple(index for v in evaluated for method in METHODS for index in method(ride, v))
    return TrainMetrics(train, ride.distance(), indices, tuple(v + 1 for v in vehicles if v not in evaluated))


def _spread(entries: Sequence[tuple[int, Index]]) -> Spread:
    train, index = max(entries, key=lambda entry: entry[1].severity)
    values = [entry.value for _, entry in entries if entry.value is not None]
    over = sum(entry.verdict == "over" for _, entry in entries)
    return Spread(index, train, median(values) if values else None, over, len(values))
