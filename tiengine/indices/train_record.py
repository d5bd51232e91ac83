"""What figures read: groups and channels of one train, in slices, and the train's own scenario."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
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

__all__ = ["AbsentError", "Samples", "Train"]

SLICE = 2**15  # samples in memory at a time
SETTLING = 10.0  # periods of the cut-off that a filter needs at either end of a slice; it forgets within one


class AbsentError(InputError):
    """The file lacks what a figure needs; the message names the key to set."""


class Samples:
    """A group that is sampled over time, read slice by slice.

    Attributes:
        group: The HDF5 group.
    """

    def __init__(self, group: Any, where: str, channels: Sequence[str], key: str) -> None:
        """Check that the channels are there.

        Args:
            group: The HDF5 group.
            where: File and train, for messages.
            channels: Names of the channels.
            key: Key of the scenario that names the channels to be written.

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
            raise AbsentError(f"{where} has {len(self)} sample(s): too short to draw")

    def __len__(self) -> int:
        """Number of samples."""
        return int(self.group["time"].shape[0])

    @property
    def interval(self) -> float:
        """Between samples [s]."""
        time = self.group["time"]
        return float(time[-1] - time[0]) / (len(self) - 1)

    @property
    def way(self) -> tuple[float, float]:
        """Chainage of the first vehicle's centre at the first and at the last sample [m]."""
        position = self.group["position"]
        return float(position[0]), float(position[-1])

    def at(self, chainage: float) -> int:
        """Index of the first sample at or behind a chainage of the first vehicle's centre [m]."""
        position = self.group["position"]
        low, high = 0, len(self)
        while low < high:  # bisection in the file
            middle = (low + high) // 2
            if position[middle] < chainage:
                low = middle + 1
            else:
                high = middle
        return low

    def after(self, way: float) -> int:
        """Index of the first sample at which the train has run a way [m]."""
        return self.at(self.way[0] + way)

    def slices(self, begin: int = 0, end: int | None = None) -> Iterator[tuple[Reals, dict[str, Reals]]]:
        """Positions [m], shape (n,), and channels, shape (n, ...), of some samples, piece after piece."""
        end = len(self) if end is None else end
        for start in range(begin, end, SLICE):
            yield self.read(start, min(start + SLICE, end))

    def low_passed(self, cut_off: float, ahead: float = 0.0) -> Iterator[tuple[int, Reals, dict[str, Reals]]]:
        """Channels behind a low pass, piece after piece; the same as if filtered in one.

        Args:
            cut_off: Frequency [Hz].
            ahead: Way beyond the piece's own samples that comes with it [m].

        Yields:
            Number of the piece's own samples, positions, channels.
        """
        margin = int(np.ceil(SETTLING / cut_off / self.interval))
        for start in range(0, len(self), SLICE):
            end = min(start + SLICE, len(self))
            behind = self.at(float(self.group["position"][end - 1]) + ahead) + 1 if ahead else end
            first, last = max(start - margin, 0), min(behind + margin, len(self))
            position, channels = self.read(first, last)
            own = slice(start - first, min(behind, len(self)) - first)
            smooth = {name: low_pass(values, self.interval, cut_off)[own] for name, values in channels.items()}
            yield end - start, position[own], smooth

    def read(self, start: int, end: int) -> tuple[Reals, dict[str, Reals]]:
        """Positions [m] and channels of the samples from ``start`` up to ``end``, in double precision."""
        channels = {name: self.group[name][start:end].astype(np.float64) for name in self._channels}
        return np.asarray(self.group["position"][start:end]), channels


class Train:
    """One train of a result file and the scenario that it ran.

    Attributes:
        result: The open file.
        number: The train's number.
        caption: File, scenario and train, for a figure's head.
    """

    def __init__(self, result: Reader, number: int = 0) -> None:
        """Look at a train; nothing is read yet.

        Raises:
            InputError: There is no such train.
        """
        if not 0 <= number < result.trains:
            raise InputError(f"{result.name}: train = {number}: must be from 0 to {result.trains - 1}")
        self.result, self.number = result, number
        self._group = result[f"trains/{number:03d}"]
        several = f", train {number} of {result.trains}" if result.trains > 1 else ""
        self.caption = f"{Path(result.name).name}{several}"

    @cached_property
    def scenario(self) -> Scenario:
        """The train's own."""
        return recorded_scenario(self.result).members[self.number]

    @cached_property
    def model(self) -> TrainModel:
        """Matrices of the vehicles."""
        return assemble(self.scenario.parts.vehicles, self.scenario.parts.centres)

    @cached_property
    def static_loads(self) -> Reals:
        """Wheel loads at rest [N], shape (wheelsets, 2)."""
        loads: Reals = static_wheel_loads(self.model)
        return loads

    def samples(self, name: str, *channels: str) -> Samples:
        """A group that is sampled over time.

        Raises:
            AbsentError: The group or a channel is not in the file.
        """
        key = f"output.{name}_channels"
        return Samples(self.group(name, key), f"{self._where}: {name}", channels, key)

    def group(self, name: str, key: str) -> Any:
        """A group of the train.

        Args:
            name: Its name.
            key: Key of the scenario without which it is not written.

        Raises:
            AbsentError: It is not in the file.
        """
        if name not in self._group or not len(self._group[name]):
            raise AbsentError(f"{self._where} has no {name}; set {key} and run again")
        return self._group[name]

    def way_end(self) -> float:
        """Chainage of the first vehicle's centre where the train's run ended [m].

        Raises:
            AbsentError: The file holds no samples over time at all.
        """
        for group in self._group.values():
            if "position" in group and len(group["position"]):
                return float(group["position"][-1])
        raise AbsentError(f"{self._where} holds no samples over time; set output.wheel_channels and run again")

    @property
    def _where(self) -> str:
        several = f": train {self.number}" if self.result.trains > 1 else ""
        return f"{Path(self.result.name).name}{several}"
