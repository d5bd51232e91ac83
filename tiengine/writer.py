"""Streaming a run to HDF5 (layout: format version 1).

::

    /                                   attributes: format, format_version, versions, scenario (TOML), ...
    /trains/000                         attributes vehicles, seed, status, ...; time -> wheel/time
    /trains/000/wheel                   channels (time, wheelset, side), see tiengine.channels
    /trains/000/body                    channels (time, body, dof)
    /trains/000/irregularity            channels (time, wheelset, side)
    /trains/000/mortar                  channels (time, slot)

Every group holds its own coordinates as dimension scales: ``time`` [s], ``position`` [m] (chainage of the
first vehicle's centre) and its labels. Groups sampled together share their times by hard links. Time and
position are float64, channels float32 or float64.

The file grows under a temporary name beside its target and gets its name when it is complete, so a run that
fails leaves nothing behind.
"""

from __future__ import annotations

import os
import platform
import uuid
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import h5py
import numpy as np
from numpy.typing import NDArray

from tiengine.channels import DOFS, GROUPS, SIDES, Channel
from tiengine.column import Column
from tiengine.quantity import InputError
from tiengine.results import FORMAT, FORMAT_VERSION, Result

__all__ = ["DTYPES", "Block", "GroupSpec", "TrainLabels", "Writer", "check_output"]

Reals = NDArray[np.float64]

CHUNK = 1000  # samples along time: a chunk of a coach's channel is 32 kB
DTYPES = {"single": np.float32, "double": np.float64}
PACKAGES = ("numpy", "scipy", "taichi", "h5py", "pydantic")


@dataclass(frozen=True)
class TrainLabels:
    """Labels of one train.

    Attributes:
        vehicles: Names of the vehicles.
        bodies: Names of the bodies, unique in the train.
        wheelset_vehicle: Vehicle of each wheelset, from 0, shape (wheelsets,).
        wheelset_offset: Wheelset relative to the first vehicle's centre [m], shape (wheelsets,).
        slots: Slabs in the window.
    """

    vehicles: Sequence[str]
    bodies: Sequence[str]
    wheelset_vehicle: NDArray[np.integer[Any]]
    wheelset_offset: Reals
    slots: int = 0

    def scales(self, dimensions: Sequence[str]) -> dict[str, tuple[Any, Channel]]:
        """Values and meaning of the labels along some dimensions."""
        known: dict[str, tuple[Any, Channel]] = {
            "wheelset": (
                np.arange(1, len(self.wheelset_offset) + 1, dtype=np.int32),
                Channel("1", "wheelset, 1 leads"),
            ),
            "side": (list(SIDES), Channel("1", "side of the track, looking forward")),
            "body": (list(self.bodies), Channel("1", "body of the train")),
            "dof": (list(DOFS), Channel("1", "degree of freedom of a body")),
            "slot": (np.arange(self.slots, dtype=np.int32), Channel("1", "place of a slab in memory")),
        }
        return {name: known[name] for name in dimensions}


@dataclass(frozen=True)
class GroupSpec:
    """What a group of channels holds.

    Attributes:
        dimensions: Dimensions after time, such as ``("wheelset", "side")``.
        channels: Units and meaning by name.
        times_of: Group that is sampled at the same times and whose coordinates are linked; None for its own.
    """

    dimensions: tuple[str, ...]
    channels: Mapping[str, Channel]
    times_of: str | None = None

    @classmethod
    def standard(cls, group: str, names: Sequence[str], times_of: str | None = None) -> GroupSpec:
        """Some channels of one of the groups of :mod:`tiengine.channels`."""
        dimensions = {"body": ("body", "dof"), "mortar": ("slot",)}.get(group, ("wheelset", "side"))
        return cls(dimensions, {name: GROUPS[group][name] for name in names}, times_of)


@dataclass(frozen=True, eq=False)
class Block:
    """Samples of one group of one train.

    Attributes:
        time: Times [s], shape (n,); ignored where the group shares another one's.
        position: Chainages of the first vehicle's centre [m], shape (n,); likewise.
        channels: Every channel of the group, shape (n, *dimensions).
    """

    time: Reals
    position: Reals
    channels: Mapping[str, NDArray[Any]]


def check_output(path: Path, force: bool = False) -> None:
    """Refuse a path that cannot become a result file, before anything is computed.

    Args:
        path: Where the file shall be.
        force: Whether an existing file may be replaced.

    Raises:
        InputError: The path is a folder, exists already, or lies in no folder that can be written.
    """
    if path.is_dir():
        raise InputError(f"output = '{path}': must be a file, not a folder")
    if path.exists() and not force:
        raise InputError(f"output = '{path}': exists already; choose another name or --force")
    if not path.parent.is_dir():
        raise InputError(f"output = '{path}': there is no folder '{path.parent}'")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"output = '{path}': the folder '{path.parent}' cannot be written to")


class Writer:
    """A result file that is being written.

    Use as a context manager: leaving it by an exception, or without :meth:`close`, removes the file.
    """

    def __init__(
        self,
        path: Path | None,
        scenario_toml: str,
        attributes: Mapping[str, Any],
        trains: Sequence[TrainLabels],
        groups: Mapping[str, GroupSpec],
        precision: Literal["single", "double"] = "single",
        *,
        force: bool = False,
    ) -> None:
        """Create the file, its groups and its empty channels.

        Args:
            path: Where the file shall be; None keeps it in memory.
            scenario_toml: Resolved scenario.
            attributes: Root attributes that are known at the beginning.
            trains: Labels of every train; more may be added later.
            groups: What each train records; a group comes after the one whose times it shares.
            precision: ``"single"`` or ``"double"`` for channels; time and position are double.
            force: Replace an existing file.

        Raises:
            InputError: The path cannot be written.
        """
        self._finished = False
        self._path = path
        self._specs = dict(groups)
        self._columns: dict[tuple[int, str], dict[str, Column]] = {}
        self._dtype = DTYPES[precision]
        self._temporary = None if path is None else path.with_name(f".{path.name}.{os.getpid()}.part")
        self._file = self._create(force)
        try:
            self._file.attrs.update(_header(scenario_toml))
            self._file.attrs.update(attributes)
            for i, labels in enumerate(trains):
                self.add(i, labels)
        except BaseException:
            self.discard()
            raise

    def __enter__(self) -> Writer:
        """The writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Remove the file unless it was closed."""
        self.discard()

    def add(self, train: int, labels: TrainLabels | None, attributes: Mapping[str, Any] | None = None) -> None:
        """Add a train to the file.

        Args:
            train: Its number.
            labels: Its labels; None for one of which there is nothing to write.
            attributes: Known at its beginning.
        """
        node = self._file.require_group(f"trains/{train:03d}")
        if labels is not None:
            self._create_train(node, labels)
            for name, spec in self._specs.items():
                grow = (*spec.channels, *(() if spec.times_of else ("time", "position")))
                self._columns[train, name] = {key: Column(node[f"{name}/{key}"]) for key in grow}
        node.attrs.update(attributes or {})

    def describe(self, train: int, attributes: Mapping[str, Any]) -> None:
        """Add attributes to a train of the file."""
        self._file[f"trains/{train:03d}"].attrs.update(attributes)

    def write(self, train: int, blocks: Mapping[str, Block]) -> None:
        """Add samples to the groups of one train.

        Args:
            train: Index of the train.
            blocks: Samples by group.

        Raises:
            InputError: The disk is full or gone.
        """
        for group, block in blocks.items():
            self.append(train, group, block.time, block.position, block.channels)

    def append(
        self, train: int, group: str, time: Reals, position: Reals, channels: Mapping[str, NDArray[Any]]
    ) -> None:
        """Add samples to one group of one train.

        Args:
            train: Index of the train.
            group: Name of the group.
            time: Times [s], shape (n,); ignored where the group shares another one's.
            position: Chainages of the first vehicle's centre [m], shape (n,); likewise.
            channels: Every channel of the group, shape (n, *dimensions).

        Raises:
            ValueError: A channel is missing, unknown, or of the wrong shape.
            InputError: The disk is full or gone.
        """
        columns = self._columns[train, group]
        spec = self._specs[group]
        if set(channels) != set(spec.channels):
            odd = sorted(set(channels) ^ set(spec.channels))
            raise ValueError(f"group {group!r}: channels missing or unknown: {', '.join(odd)}")
        values: dict[str, NDArray[Any]] = dict(channels)
        if spec.times_of is None:
            values |= {"time": time, "position": position}
        for name, value in values.items():
            expected = (len(time), *columns[name].rest)
            if value.shape != expected:
                raise ValueError(f"{group}/{name}: shape {value.shape}, expected {expected}")
            try:
                columns[name].extend(value)
            except OSError as error:
                raise InputError(f"output = '{self._path}': cannot be written ({error})") from None

    def close(self, attributes: Mapping[str, Any]) -> Result:
        """Complete the file and give it its name.

        Args:
            attributes: Root attributes known at the end: DOFs, step, wall times.

        Returns:
            The finished result, open for reading.

        Raises:
            InputError: The file could not be completed or moved to its place.
        """
        if self._path is None or self._temporary is None:
            self._file.attrs.update(attributes)
            self._finished = True
            return Result(self._file, "in memory")
        try:
            self._file.attrs.update(attributes)
            self._file.close()
            os.replace(self._temporary, self._path)
        except (OSError, RuntimeError) as error:  # h5py says RuntimeError when the disk is full
            self.discard()
            raise InputError(f"output = '{self._path}': cannot be completed ({error})") from None
        self._finished = True
        return Result(h5py.File(self._path, "r"), str(self._path))

    def discard(self) -> None:
        """Remove what was written, unless it was closed."""
        if self._finished:
            return
        with suppress(OSError, RuntimeError):  # a full disk once more
            self._file.close()
        if self._temporary is not None:
            self._temporary.unlink(missing_ok=True)

    def _create(self, force: bool) -> Any:
        if self._path is None or self._temporary is None:
            name = f"tiengine-{uuid.uuid4()}"  # HDF5 refuses two open files of one name, in memory too
            return h5py.File(name, "w", driver="core", backing_store=False, rdcc_nbytes=0)
        check_output(self._path, force)
        try:
            return h5py.File(self._temporary, "w", rdcc_nbytes=0)  # else every open dataset holds 1 MB
        except OSError as error:
            raise InputError(f"output = '{self._path}': cannot be written ({error})") from None

    def _create_train(self, train: Any, labels: TrainLabels) -> None:
        """Groups, scales and empty channels of one train."""
        train.attrs["vehicles"] = list(labels.vehicles)
        for name, spec in self._specs.items():
            group = train.create_group(name)
            if spec.times_of is None:
                self._create_times(group)
            else:
                group["time"] = train[f"{spec.times_of}/time"]
                group["position"] = train[f"{spec.times_of}/position"]
            scales = labels.scales(spec.dimensions)
            for scale, (values, meaning) in scales.items():
                _describe(group.create_dataset(scale, data=values), meaning).make_scale(scale)
            coordinates = ["position"]
            if "wheelset" in spec.dimensions:
                coordinates += _create_wheelset_labels(group, labels)
            for channel, meaning in spec.channels.items():
                self._create_channel(group, channel, meaning, spec, coordinates)
        if "wheel" in self._specs:
            train["time"] = train["wheel/time"]

    def _create_times(self, group: Any) -> None:
        time = group.create_dataset("time", (0,), "f8", maxshape=(None,), chunks=(CHUNK,))
        _describe(time, Channel("s", "time")).make_scale("time")
        position = group.create_dataset("position", (0,), "f8", maxshape=(None,), chunks=(CHUNK,))
        _describe(position, Channel("m", "chainage of the first vehicle's centre"))
        position.dims[0].attach_scale(time)

    def _create_channel(
        self, group: Any, name: str, meaning: Channel, spec: GroupSpec, coordinates: Sequence[str]
    ) -> None:
        """One empty channel with its scales."""
        rest = tuple(group[dimension].shape[0] for dimension in spec.dimensions)
        dataset = group.create_dataset(name, (0, *rest), self._dtype, maxshape=(None, *rest), chunks=(CHUNK, *rest))
        _describe(dataset, meaning).attrs["coordinates"] = " ".join(coordinates)
        for axis, dimension in enumerate(("time", *spec.dimensions)):
            dataset.dims[axis].attach_scale(group[dimension])


def _create_wheelset_labels(group: Any, labels: TrainLabels) -> list[str]:
    """Vehicle and place of every wheelset; the names of the two datasets."""
    rows = {
        "wheelset_vehicle": (
            np.asarray(labels.wheelset_vehicle, np.int32),
            Channel("1", "vehicle of the wheelset, 0 leads"),
        ),
        "wheelset_offset": (
            np.asarray(labels.wheelset_offset, np.float64),
            Channel("m", "wheelset forward of the first vehicle's centre"),
        ),
    }
    for name, (values, meaning) in rows.items():
        _describe(group.create_dataset(name, data=values), meaning).dims[0].attach_scale(group["wheelset"])
    return list(rows)


def _describe(dataset: Any, meaning: Channel) -> Any:
    dataset.attrs["units"] = meaning.units
    dataset.attrs["long_name"] = meaning.long_name
    return dataset


def _header(scenario_toml: str) -> dict[str, Any]:
    """Root attributes of every file."""
    versions = {f"{package}_version": metadata.version(package) for package in PACKAGES}
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "tiengine_version": metadata.version("tiengine"),
        "scenario": scenario_toml,
        "python_version": platform.python_version(),
        "platform": platform.platform(),
        **versions,
    }
