"""Writer of result files: streams a run to HDF5 (format version 2).

::

    /                                   attributes: format, format_version, versions, scenario (TOML), ...
    /trains/000                         attributes vehicles, seed, status, ...
    /trains/000/wheel                   and other groups of channels, see result_files.layout
    /trains/000/gauges/NAME             one group per gauge; attributes on, chainage, side or y
    /trains/000/events                  table of events, see result_files.event_table

Every group holds its own coordinates as dimension scales: ``time`` [s], ``position`` [m] (chainage of the first
vehicle's centre) and its labels; ``seats`` and ``slabs`` have their index and ``chainage`` [m] instead. Groups sampled
together share ``time`` and ``position`` by hard links. No coordinate stands above these groups: in a
tree of xarray, the groups below would have to share it. Times and chainages are float64, channels float32 or float64.

The root attribute ``status`` is "running" until the run has ended.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
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
from tiengine.result_files.growing_dataset import GrowingDataset
from tiengine.result_files.layout import CHUNK, DTYPES, Axis, Block, GroupSpec, TrainLabels
from tiengine.result_files.output_file import DISK_ERRORS, OutputFile, header
from tiengine.result_files.reader import FORMAT_VERSION, Reader

__all__ = ["Writer"]

CHECKED = {"fletcher32": True}  # a checksum for every chunk, so that damaged numbers are detected


class Writer:
    """Result file that is being written.

    Use as a context manager: leaving it by an exception, or without :meth:`close`, keeps the committed data if they
    include samples (the run can then be resumed from its checkpoints), and removes the file otherwise.
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
            path: Path of the file; None keeps it in memory.
            scenario_toml: Resolved scenario as TOML.
            attributes: Root attributes known at the beginning.
            trains: Labels of the trains; more may be added later.
            groups: Groups of every train; a group must follow the one whose times it shares.
            precision: ``"single"`` or ``"double"`` for channels; time and position are double.
            force: Replace an existing file.

        Raises:
            InputError: The file cannot be written.
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
        """Reopen the file of an unfinished run; see :meth:`rewind`.

        Args:
            path: Path of the file.
            groups: Groups as given when the file was created.
            precision: Precision as given when the file was created.

        Raises:
            InputError: The file is not an unfinished result, or another run is writing it.
        """
        writer = cls.__new__(cls)
        writer._take(OutputFile.resume(path), groups, precision)
        writer._samples_kept = True
        try:
            _upgrade(writer._file)
        except BaseException:
            writer.leave()
            raise
        return writer

    def _take(self, output: OutputFile, groups: Mapping[str, GroupSpec], precision: str) -> None:
        self._output, self._file, self._path = output, output.h5, output.path
        self._finished = self._samples_written = self._samples_kept = False
        self._specs = dict(groups)
        self._columns: dict[tuple[int, str], dict[str, GrowingDataset]] = {}
        self._events: dict[int, int] = {}
        self._dtype = DTYPES[precision]

    def __enter__(self) -> Writer:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release the file unless it was closed; convert errors of the disk and of HDF5 to InputError."""
        self.leave()
        if isinstance(error, OSError) and error.errno in DISK_ERRORS:
            raise InputError(f"output = '{self._path}': cannot be written ({error})") from None
        if (words := unreadable(error, trace)) is not None:
            raise InputError(f"{self._path}: {words}") from error

    def add(self, train: int, labels: TrainLabels | None, attributes: Mapping[str, Any] | None = None) -> None:
        """Add a train to the file, or restart one that exists.

        Args:
            train: Number of the train.
            labels: Labels of the train; None for one without samples.
            attributes: Attributes of the train known at the beginning.
        """
        node = self._file.require_group(f"trains/{train:03d}")
        if labels is not None:
            if "vehicles" not in node.attrs:
                self._create_train(node, labels)
            self.rewind(train, {})
        node.attrs.update(attributes or {})

    def rewind(self, train: int, rows: Mapping[str, int]) -> None:
        """Continue writing after an earlier sample of a train; later samples stay until they are overwritten.

        Args:
            train: Number of the train.
            rows: Number of samples to keep in each group, as from :meth:`rows`; missing groups keep none.

        Raises:
            InputError: The file holds fewer samples.
        """
        node = self._file[f"trains/{train:03d}"]
        for name, spec in self._specs.items():
            grow = (*spec.channels, *(() if spec.times_of else (spec.axis.name, spec.axis.chainage)))
            kept = rows.get(name, 0)
            datasets = {key: node[f"{name}/{key}"] for key in grow}
            if any(dataset.shape[0] < kept for dataset in datasets.values()):
                raise InputError(
                    f"{self._path}: train {train} has fewer samples than its checkpoint states; run the scenario again"
                )
            self._columns[train, name] = {key: GrowingDataset(dataset, kept) for key, dataset in datasets.items()}
        self._events[train] = rows.get(EVENTS, 0)

    def rows(self, train: int) -> dict[str, int]:
        """Number of samples of each group of a train written so far."""
        samples = {name: next(iter(self._columns[train, name].values())).length for name in self._specs}
        return samples | {EVENTS: self._events[train]}

    def describe(self, train: int, attributes: Mapping[str, Any]) -> None:
        """Add attributes to a train."""
        self._file[f"trains/{train:03d}"].attrs.update(attributes)

    def facts(self) -> dict[int, dict[str, Any]]:
        """Attributes of all trains in the file."""
        return {int(name): dict(node.attrs) for name, node in self._file["trains"].items()}

    def add_events(self, train: int, events: Sequence[Event]) -> None:
        """Append events to a train.

        Args:
            train: Number of the train.
            events: Events in order.
        """
        group = self._file[f"trains/{train:03d}/{EVENTS}"]
        start = self._events[train]
        self._events[train] = end = start + len(events)
        for name, column in event_columns(events, start).items():
            if group[name].shape[0] < end:
                group[name].resize(end, axis=0)
            group[name][start:end] = column

    def write(self, train: int, blocks: Mapping[str, Block]) -> None:
        """Append samples to the groups of one train.

        Args:
            train: Index of the train.
            blocks: Samples by group.

        Raises:
            InputError: The disk is full or has failed.
        """
        for group, block in blocks.items():
            self.append(train, group, block.along, block.chainage, block.channels)

    def append(
        self, train: int, group: str, along: NDArray[Any], chainage: Reals, channels: Mapping[str, NDArray[Any]]
    ) -> None:
        """Append samples to one group of one train.

        Args:
            train: Index of the train.
            group: Name of the group.
            along: Times [s], or indices of seats or slabs, shape (n,); ignored if the group shares those of another.
            chainage: Chainages [m], shape (n,); ignored likewise.
            channels: All channels of the group, each of shape (n, *dimensions).

        Raises:
            ValueError: A channel is missing, unknown, or of the wrong shape.
            InputError: The disk is full or has failed.
        """
        self._samples_written = True
        columns = self._columns[train, group]
        spec = self._specs[group]
        if set(channels) != set(spec.channels):
            differing = sorted(set(channels) ^ set(spec.channels))
            raise ValueError(f"group {group!r}: channels missing or unknown: {', '.join(differing)}")
        values: dict[str, NDArray[Any]] = dict(channels)
        if spec.times_of is None:
            values |= {spec.axis.name: along, spec.axis.chainage: chainage}
        for name, value in values.items():
            expected = (len(along), *columns[name].sample_shape)
            if value.shape != expected:
                raise ValueError(f"{group}/{name}: shape {value.shape}, expected {expected}")
        with self._disk_errors():
            for name, value in values.items():
                columns[name].extend(value)

    def commit(self) -> None:
        """Make all written data permanent; readers see them from now on.

        Raises:
            InputError: The disk is full or has failed.
        """
        self._flush()
        self._output.commit()
        self._samples_kept |= self._samples_written

    def close(self, attributes: Mapping[str, Any]) -> Reader:
        """Complete the file.

        Args:
            attributes: Root attributes known at the end: degrees of freedom, time step, wall times.

        Returns:
            The finished result, open for reading.

        Raises:
            InputError: The file cannot be completed; it holds the last commit.
        """
        self._flush()
        result = self._output.complete(attributes)
        self._finished = True
        return result

    def leave(self) -> None:
        """Release a file that was not closed: keep its last commit, or remove it if that holds no samples."""
        if not self._finished:
            self._finished = True
            self._output.leave(keep=self._samples_kept)

    def _flush(self) -> None:
        """Hand all samples that still wait in memory to HDF5."""
        with self._disk_errors():
            for columns in self._columns.values():
                for column in columns.values():
                    column.flush()

    @contextmanager
    def _disk_errors(self) -> Iterator[None]:
        """Convert errors of the disk."""
        try:
            yield
        except OSError as error:
            raise InputError(f"output = '{self._path}': cannot be written ({error})") from None

    def _create_train(self, train: Any, labels: TrainLabels) -> None:
        """Create the groups, scales and empty channels of one train."""
        train.attrs["vehicles"] = list(labels.vehicles)
        for name, spec in self._specs.items():
            group = train.create_group(name)
            group.attrs.update(spec.attributes)
            axis = spec.axis
            if spec.times_of is None:
                _create_axis(group, axis)
            else:
                for dataset in (axis.name, axis.chainage):
                    group[dataset] = train[f"{spec.times_of}/{dataset}"]
            coordinates = [axis.chainage]
            for dimension, (values, meaning) in labels.scales(spec.dimensions).items():
                _describe(group.create_dataset(dimension, data=values), meaning).make_scale(dimension)
                coordinates += _create_auxiliary(group, dimension, labels)
            scales = [group[dimension] for dimension in (axis.name, *spec.dimensions)]
            for channel, meaning in spec.channels.items():
                dataset = self._create_channel(group, channel, [scale.shape[0] for scale in scales[1:]], spec.chunk)
                _describe(dataset, meaning).attrs["coordinates"] = " ".join(coordinates)
                for dimension, scale in zip(dataset.dims, scales, strict=True):
                    dimension.attach_scale(scale)
        create_events(train.create_group(EVENTS))

    def _create_channel(self, group: Any, name: str, sample: Sequence[int], chunk: int) -> Any:
        """Create an empty channel for samples of a shape, stored by so many."""
        return group.create_dataset(
            name, (0, *sample), self._dtype, maxshape=(None, *sample), chunks=(chunk, *sample), **CHECKED
        )


def _upgrade(file: Any) -> None:
    """Convert a file of format version 1, which has a dataset ``time`` in every train, to the current version."""
    for train in file["trains"].values():
        if "time" in train:
            del train["time"]
    file.attrs["format_version"] = FORMAT_VERSION


def _create_axis(group: Any, axis: Axis) -> None:
    """Create the empty scale of the growing dimension and its dataset of chainages."""
    scale = group.create_dataset(axis.name, (0,), axis.dtype, maxshape=(None,), chunks=(CHUNK,), **CHECKED)
    _describe(scale, axis.meaning).make_scale(axis.name)
    chainage = group.create_dataset(axis.chainage, (0,), "f8", maxshape=(None,), chunks=(CHUNK,), **CHECKED)
    _describe(chainage, axis.chainage_meaning)
    chainage.dims[0].attach_scale(scale)


def _create_auxiliary(group: Any, dimension: str, labels: TrainLabels) -> list[str]:
    """Create the auxiliary coordinates along a dimension and return their names."""
    found = labels.auxiliary(dimension)
    for name, (values, meaning) in found.items():
        _describe(group.create_dataset(name, data=values), meaning).dims[0].attach_scale(group[dimension])
    return list(found)


def _describe(dataset: Any, meaning: Channel) -> Any:
    """Set unit and long name of a dataset and return it."""
    dataset.attrs["units"] = meaning.units
    dataset.attrs["long_name"] = meaning.long_name
    return dataset
