"""Streaming a run to HDF5 (layout: format version 1).

::

    /                                   attributes: format, format_version, versions, scenario (TOML), ...
    /trains/000                         attributes vehicles, seed, status, ...; time -> wheel/time
    /trains/000/wheel                   channels (time, wheelset, side), see tiengine.channels
    /trains/000/body                    channels (time, body, dof)
    /trains/000/irregularity            channels (time, wheelset, side)
    /trains/000/mortar                  channels (time, slot)
    /trains/000/seats                   channels (seat, side)
    /trains/000/slabs                   channels (slab,)
    /trains/000/deflection              channels (time, side, point)
    /trains/000/events                  what went wrong: (event,), see tiengine.event_table
    /trains/000/gauges/NAME             channels (time, direction) or (time,); attributes on, chainage, side or y

Every group holds its own coordinates as dimension scales: ``time`` [s], ``position`` [m] (chainage of the
first vehicle's centre) and its labels; ``seats`` and ``slabs`` their index and ``chainage`` [m] instead of time.
Groups sampled together share their times by hard links. Times and chainages are float64, channels float32 or float64.

Attribute ``status`` of the root is "running" until the run has come to its end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.result_files.channels import Channel
from tiengine.result_files.damage import unreadable
from tiengine.result_files.event_table import EVENTS, create_events, event_columns
from tiengine.result_files.events import Event
from tiengine.result_files.growing_dataset import Column
from tiengine.result_files.layout import CHUNK, DTYPES, Axis, Block, GroupSpec, TrainLabels
from tiengine.result_files.output_file import DISK_ERRORS, OutputFile, header
from tiengine.result_files.reader import Reader

__all__ = ["Block", "GroupSpec", "TrainLabels", "Writer"]

CHECKED = {"fletcher32": True}  # a checksum with every chunk: a damaged number is found out, not taken for one


class Writer:
    """A result file that is being written.

    Use as a context manager: leaving it by an exception, or without :meth:`close`, keeps what was committed if samples
    are in it (the run can be resumed from its checkpoints), and removes the file otherwise.
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
        replaces = path is not None and path.exists()
        self._take(OutputFile.create(path, force), groups, precision)
        try:
            self._file.attrs.update(header(scenario_toml))
            self._file.attrs.update(attributes)
            self._file.create_group("trains")
            for i, labels in enumerate(trains):
                self.add(i, labels)
            if not replaces:
                self._output.commit()
        except BaseException:
            self.leave()
            raise

    @classmethod
    def resume(
        cls, path: Path, groups: Mapping[str, GroupSpec], precision: Literal["single", "double"] = "single"
    ) -> Writer:
        """Go on with a file that a run has left unfinished; see :meth:`rewind`.

        Args:
            path: The file.
            groups: As given when it was created.
            precision: Likewise.

        Raises:
            InputError: It is not an unfinished result, or another run writes it.
        """
        writer = cls.__new__(cls)
        writer._take(OutputFile.resume(path), groups, precision)
        writer._samples_kept = True
        return writer

    def _take(self, output: OutputFile, groups: Mapping[str, GroupSpec], precision: str) -> None:
        self._output, self._file, self._path = output, output.h5, output.path
        self._finished = self._samples_written = self._samples_kept = False
        self._specs = dict(groups)
        self._columns: dict[tuple[int, str], dict[str, Column]] = {}
        self._events: dict[int, int] = {}
        self._dtype = DTYPES[precision]

    def __enter__(self) -> Writer:
        """The writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the file as it is, or remove an empty one, unless it was closed; say what HDF5 could not read."""
        self.leave()
        if isinstance(error, OSError) and error.errno in DISK_ERRORS:
            raise InputError(f"output = '{self._path}': cannot be written ({error})") from None
        if (words := unreadable(error, trace)) is not None:
            raise InputError(f"{self._path}: {words}") from error

    def add(self, train: int, labels: TrainLabels | None, attributes: Mapping[str, Any] | None = None) -> None:
        """Add a train to the file, or begin one anew that is in it.

        Args:
            train: Its number.
            labels: Its labels; None for one of which there is nothing to write.
            attributes: Known at its beginning.
        """
        node = self._file.require_group(f"trains/{train:03d}")
        if labels is not None:
            if "vehicles" not in node.attrs:
                self._create_train(node, labels)
            self.rewind(train, {})
        node.attrs.update(attributes or {})

    def rewind(self, train: int, rows: Mapping[str, int]) -> None:
        """Write on from an earlier sample of a train; what the file holds beyond it stays until it is overwritten.

        Args:
            train: Its number.
            rows: Samples of each group that stay, as from :meth:`rows`; none where not given.

        Raises:
            InputError: The file holds fewer.
        """
        node = self._file[f"trains/{train:03d}"]
        for name, spec in self._specs.items():
            grow = (*spec.channels, *(() if spec.times_of else (spec.axis.name, spec.axis.place)))
            kept = rows.get(name, 0)
            if any(node[f"{name}/{key}"].shape[0] < kept for key in grow):
                raise InputError(f"{self._path}: train {train} holds less than its checkpoint says; run it anew")
            self._columns[train, name] = {key: Column(node[f"{name}/{key}"], kept) for key in grow}
        self._events[train] = rows.get(EVENTS, 0)

    def rows(self, train: int) -> dict[str, int]:
        """Samples of each group of a train written so far."""
        samples = {name: next(iter(self._columns[train, name].values())).length for name in self._specs}
        return samples | {EVENTS: self._events[train]}

    def describe(self, train: int, attributes: Mapping[str, Any]) -> None:
        """Add attributes to a train of the file."""
        self._file[f"trains/{train:03d}"].attrs.update(attributes)

    def facts(self) -> dict[int, dict[str, Any]]:
        """Attributes of every train in the file."""
        return {int(name): dict(node.attrs) for name, node in self._file["trains"].items()}

    def note(self, train: int, events: Sequence[Event]) -> None:
        """Add events to a train of the file.

        Args:
            train: Its number.
            events: What happened, in order.
        """
        group = self._file[f"trains/{train:03d}/{EVENTS}"]
        start = self._events[train]
        self._events[train] = end = start + len(events)
        for name, column in event_columns(events, start).items():
            if group[name].shape[0] < end:
                group[name].resize(end, axis=0)
            group[name][start:end] = column

    def write(self, train: int, blocks: Mapping[str, Block]) -> None:
        """Add samples to the groups of one train.

        Args:
            train: Index of the train.
            blocks: Samples by group.

        Raises:
            InputError: The disk is full or gone.
        """
        for group, block in blocks.items():
            self.append(train, group, block.along, block.place, block.channels)

    def append(
        self, train: int, group: str, along: NDArray[Any], place: Reals, channels: Mapping[str, NDArray[Any]]
    ) -> None:
        """Add samples to one group of one train.

        Args:
            train: Index of the train.
            group: Name of the group.
            along: Times [s], or indices of seats or slabs, shape (n,); ignored where the group shares another one's.
            place: Chainages that belong to them [m], shape (n,); likewise.
            channels: Every channel of the group, shape (n, *dimensions).

        Raises:
            ValueError: A channel is missing, unknown, or of the wrong shape.
            InputError: The disk is full or gone.
        """
        self._samples_written = True
        columns = self._columns[train, group]
        spec = self._specs[group]
        if set(channels) != set(spec.channels):
            odd = sorted(set(channels) ^ set(spec.channels))
            raise ValueError(f"group {group!r}: channels missing or unknown: {', '.join(odd)}")
        values: dict[str, NDArray[Any]] = dict(channels)
        if spec.times_of is None:
            values |= {spec.axis.name: along, spec.axis.place: place}
        for name, value in values.items():
            expected = (len(along), *columns[name].rest)
            if value.shape != expected:
                raise ValueError(f"{group}/{name}: shape {value.shape}, expected {expected}")
            try:
                columns[name].extend(value)
            except OSError as error:
                raise InputError(f"output = '{self._path}': cannot be written ({error})") from None

    def commit(self) -> None:
        """Make what was written permanent; the file can be read with it from now on, whatever happens.

        Raises:
            InputError: The disk is full or gone.
        """
        self._output.commit()
        self._samples_kept |= self._samples_written

    def close(self, attributes: Mapping[str, Any]) -> Reader:
        """Complete the file.

        Args:
            attributes: Root attributes known at the end: DOFs, step, wall times.

        Returns:
            The finished result, open for reading.

        Raises:
            InputError: The file could not be completed; it is as of the last commit.
        """
        result = self._output.complete(attributes)
        self._finished = True
        return result

    def leave(self) -> None:
        """Leave a file that was not closed as of its last commit; remove it if it held no samples then."""
        if not self._finished:
            self._finished = True
            self._output.leave(keep=self._samples_kept)

    def _create_train(self, train: Any, labels: TrainLabels) -> None:
        """Groups, scales and empty channels of one train."""
        train.attrs["vehicles"] = list(labels.vehicles)
        for name, spec in self._specs.items():
            group = train.create_group(name)
            group.attrs.update(spec.attributes)
            axis = spec.axis
            if spec.times_of is None:
                _create_axis(group, axis)
            else:
                for dataset in (axis.name, axis.place):
                    group[dataset] = train[f"{spec.times_of}/{dataset}"]
            coordinates = [axis.place]
            for dimension, (values, meaning) in labels.scales(spec.dimensions).items():
                _describe(group.create_dataset(dimension, data=values), meaning).make_scale(dimension)
                coordinates += _create_details(group, dimension, labels)
            for channel, meaning in spec.channels.items():
                self._create_channel(group, channel, meaning, spec, coordinates)
        if "wheel" in self._specs:
            train["time"] = train["wheel/time"]
        create_events(train.create_group(EVENTS))

    def _create_channel(
        self, group: Any, name: str, meaning: Channel, spec: GroupSpec, coordinates: Sequence[str]
    ) -> None:
        """One empty channel with its scales."""
        rest = tuple(group[dimension].shape[0] for dimension in spec.dimensions)
        chunks = (spec.chunk, *rest)
        dataset = group.create_dataset(name, (0, *rest), self._dtype, maxshape=(None, *rest), chunks=chunks, **CHECKED)
        _describe(dataset, meaning).attrs["coordinates"] = " ".join(coordinates)
        for i, dimension in enumerate((spec.axis.name, *spec.dimensions)):
            dataset.dims[i].attach_scale(group[dimension])


def _create_axis(group: Any, axis: Axis) -> None:
    """Empty scale of the dimension along which a group grows, and the chainages that go with it."""
    scale = group.create_dataset(axis.name, (0,), axis.dtype, maxshape=(None,), chunks=(CHUNK,), **CHECKED)
    _describe(scale, axis.meaning).make_scale(axis.name)
    place = group.create_dataset(axis.place, (0,), "f8", maxshape=(None,), chunks=(CHUNK,), **CHECKED)
    _describe(place, axis.place_meaning)
    place.dims[0].attach_scale(scale)


def _create_details(group: Any, dimension: str, labels: TrainLabels) -> list[str]:
    """What else is known along a dimension; the names of the datasets."""
    rows = labels.details(dimension)
    for name, (values, meaning) in rows.items():
        _describe(group.create_dataset(name, data=values), meaning).dims[0].attach_scale(group[dimension])
    return list(rows)


def _describe(dataset: Any, meaning: Channel) -> Any:
    dataset.attrs["units"] = meaning.units
    dataset.attrs["long_name"] = meaning.long_name
    return dataset
