"""One train of a result file: its groups and channels, read in slices, and its scenario."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tiengine.indices.filters import low_pass
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.scenario.recorded import recorded_scenario
from tiengine.vehicle.train import TrainModel, assemble, static_wheel_loads, wheelset_lag

if TYPE_CHECKING:
    from tiengine.result_files.reader import Reader
    from tiengine.scenario.scenario import Scenario

__all__ = ["AbsentError", "Samples", "Train"]

SLICE = 2**15  # samples of one coach read at a time
SHORTEST_SLICE = 2**13  # of longer trains: several times what a filter needs beyond either end
COACH_VALUES = 8  # wheels of one coach
SETTLING = 10.0  # periods of the cut-off by which a slice is extended for its filter, which decays within one


class AbsentError(InputError):
    """The file lacks what was requested; the message names the key to set."""


class Samples:
    """A group sampled over time, read slice by slice.

    Attributes:
        group: The HDF5 group.
    """

    def __init__(self, group: Any, where: str, channels: Sequence[str], key: str) -> None:
        """Check that the channels exist.

        Args:
            group: The HDF5 group.
            where: File and train, for messages.
            channels: Names of the channels.
            key: Key of the scenario that selects the channels to be written.

        Raises:
            AbsentError: A channel is missing, or there are fewer than two samples.
        """
        for channel in channels:
            if channel not in group:
                raise AbsentError(f"{where} has no {channel}; name it in {key}")
        self.group = group
        self._where = where
        self._channels = channels
        if len(self) < 2:
            raise AbsentError(f"{where} has {len(self)} sample(s), two are needed")

    def __len__(self) -> int:
        """Number of samples."""
        return int(self.group["time"].shape[0])

    @property
    def slice_length(self) -> int:
        """Number of samples read at a time; fewer for long trains, so that the memory is that of one coach."""
        width = max(math.prod(self.group[name].shape[1:]) for name in self._channels)
        return int(np.clip(SLICE * COACH_VALUES // width, SHORTEST_SLICE, SLICE))

    @property
    def interval(self) -> float:
        """Time between samples [s]."""
        time = self.group["time"]
        return float(time[-1] - time[0]) / (len(self) - 1)

    @property
    def chainage_range(self) -> tuple[float, float]:
        """Chainage of the first vehicle's centre at the first and at the last sample [m]."""
        position = self.group["position"]
        return float(position[0]), float(position[-1])

    @property
    def distance(self) -> float:
        """Distance between the first and the last sample [m]."""
        begin, end = self.chainage_range
        return end - begin

    def at(self, chainage: float) -> int:
        """Return the index of the first sample at or beyond a chainage of the first vehicle's centre [m]."""
        position = self.group["position"]
        low, high = 0, len(self)
        while low < high:  # bisection, so that the positions need not be read
            middle = (low + high) // 2
            if position[middle] < chainage:
                low = middle + 1
            else:
                high = middle
        return low

    def after(self, distance: float) -> int:
        """Return the index of the first sample after the train has run a distance [m]."""
        return self.at(self.chainage_range[0] + distance)

    def slices(self, begin: int = 0, end: int | None = None) -> Iterator[tuple[Reals, dict[str, Reals]]]:
        """Yield positions [m], shape (n,), and channels, shape (n, ...), of a range of samples, slice by slice."""
        end = len(self) if end is None else end
        for start in range(begin, end, self.slice_length):
            yield self.read(start, min(start + self.slice_length, end))

    def low_passed(self, cut_off: float, ahead: float = 0.0) -> Iterator[tuple[int, Reals, dict[str, Reals]]]:
        """Apply a low pass to the channels, slice by slice, with the same result as in one piece.

        Args:
            cut_off: Cut-off frequency [Hz].
            ahead: Distance by which the samples of a slice reach into the next one [m].

        Yields:
            Number of samples without those ahead, positions [m], shape (n,), and channels, shape (n, ...).
        """
        margin = int(np.ceil(SETTLING / cut_off / self.interval))
        for start in range(0, len(self), self.slice_length):
            end = min(start + self.slice_length, len(self))
            reach = self.at(float(self.group["position"][end - 1]) + ahead) + 1 if ahead else end
            first, last = max(start - margin, 0), min(reach + margin, len(self))
            position, channels = self.read(first, last)
            kept = slice(start - first, min(reach, len(self)) - first)
            filtered = {name: low_pass(values, self.interval, cut_off)[kept] for name, values in channels.items()}
            yield end - start, position[kept], filtered

    def read(self, start: int, end: int, columns: slice | None = None) -> tuple[Reals, dict[str, Reals]]:
        """Read positions [m] and channels of the samples from ``start`` up to ``end``, in double precision.

        Args:
            start: First sample.
            end: Sample after the last one.
            columns: Wheelsets or bodies to be read; all if None.
        """
        part = (slice(start, end),) if columns is None else (slice(start, end), columns)
        channels = {name: self.group[name][part].astype(np.float64) for name in self._channels}
        return np.asarray(self.group["position"][start:end]), channels


class Train:
    """One train of a result file and its scenario.

    Attributes:
        result: The open file.
        number: Number of the train.
        caption: File and train, for the head of a figure.
    """

    def __init__(self, result: Reader, number: int = 0) -> None:
        """Select a train; nothing is read yet.

        Raises:
            InputError: There is no such train.
        """
        if not 0 <= number < result.trains:
            raise InputError(f"{result.name}: train = {number}: must be from 0 to {result.trains - 1}")
        self.result, self.number = result, number
        self._group = result[f"trains/{number:03d}"]
        which = f", train {number} of {result.trains}" if result.trains > 1 else ""
        self.caption = f"{Path(result.name).name}{which}"

    @cached_property
    def scenario(self) -> Scenario:
        """Scenario of this train."""
        return recorded_scenario(self.result).members[self.number]

    @cached_property
    def model(self) -> TrainModel:
        """Matrices of the vehicles."""
        return assemble(self.scenario.parts.vehicles, self.scenario.parts.centres)

    @cached_property
    def static_loads(self) -> Reals:
        """Static wheel loads [N], shape (wheelsets, 2)."""
        loads: Reals = static_wheel_loads(self.model)
        return loads

    @cached_property
    def wheelset_lag(self) -> Reals:
        """Distance of each wheelset's vehicle behind the first one [m], shape (wheelsets,)."""
        return wheelset_lag(self.model)

    def samples(self, name: str, *channels: str) -> Samples:
        """Return a group sampled over time.

        Raises:
            AbsentError: The group or a channel is not in the file.
        """
        key = f"output.{name}_channels"
        return Samples(self.group(name, key), f"{self._where}: {name}", channels, key)

    def group(self, name: str, key: str) -> Any:
        """Return a group of the train.

        Args:
            name: Name of the group.
            key: Key of the scenario that has it written.

        Raises:
            AbsentError: The group is not in the file.
        """
        if name not in self._group or not len(self._group[name]):
            raise AbsentError(f"{self._where} has no {name}; set {key} and run again")
        return self._group[name]

    def last_chainage(self) -> float:
        """Return the chainage of the first vehicle's centre at the end of the run [m].

        Raises:
            AbsentError: The file holds no samples over time.
        """
        for group in self._group.values():
            if "position" in group and len(group["position"]):
                return float(group["position"][-1])
        raise AbsentError(f"{self._where} holds no samples over time; set output.wheel_channels and run again")

    @property
    def _where(self) -> str:
        which = f": train {self.number}" if self.result.trains > 1 else ""
        return f"{Path(self.result.name).name}{which}"
