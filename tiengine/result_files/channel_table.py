"""Channels of a result as the columns of a table, for CSV and Parquet, read in pieces.

A column is named by group, channel and labels, joined by points, with the unit in brackets:
``wheel.vertical_force.1.left [N]``, ``body.acceleration.frame_1.z [m/s^2]``. The rows follow
the first dimension of the channels, usually time; its coordinates are the first columns: ``time [s]``,
``position [m]``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import h5py
from numpy.typing import NDArray

from tiengine.parameters.errors import InputError, nearest
from tiengine.result_files.reader import OPTIONAL

if TYPE_CHECKING:
    from tiengine.result_files.reader import Reader

__all__ = ["ChannelTable", "Column", "channel_table", "labels_of", "select_channels"]

DEFAULT = ("wheel",)


@dataclass(frozen=True)
class Column:
    """Heading of one column.

    Attributes:
        name: Group, channel and labels, joined by points.
        unit: SI unit, ``"1"`` for none.
        long_name: Description of the channel.
    """

    name: str
    unit: str
    long_name: str

    @property
    def heading(self) -> str:
        """Name and unit."""
        return self.name if self.unit in ("1", "") else f"{self.name} [{self.unit}]"


@dataclass(frozen=True, eq=False)
class ChannelTable:
    """Datasets with common rows, divided into columns.

    Attributes:
        rows: Number of rows.
        columns: Headings of the columns.
        datasets: Sources of the columns, in the same order; all have the same first dimension.
    """

    rows: int
    columns: tuple[Column, ...]
    datasets: tuple[Any, ...]

    def pieces(self, values: int) -> Iterator[list[NDArray[Any]]]:
        """All columns, in pieces of consecutive rows.

        Args:
            values: Largest number of values in a piece; a piece holds at least one row.

        Yields:
            One array per column, in the precision of the file, shape (rows of the piece,).
        """
        step = max(1, values // len(self.columns))
        for first in range(0, self.rows, step):
            blocks = [dataset[first : first + step] for dataset in self.datasets]
            yield [column for block in blocks for column in block.reshape(len(block), -1).T]


def select_channels(result: Reader, train: int, names: Sequence[str]) -> dict[str, Any]:
    """Select channels of one train by name.

    Args:
        result: Open result.
        train: Index of the train.
        names: Groups or channels, for example ``"body"`` or ``"wheel/vertical_force"``; the group ``wheel`` if empty.

    Returns:
        Datasets by their path within the train, in the order of the names and, within a group, in that of the file.

    Raises:
        InputError: There is no such train, group or channel.
    """
    result.facts(train)
    node = result[f"trains/{train:03d}"]
    known = {path: dataset for path, dataset in _datasets(node) if "coordinates" in dataset.attrs}
    found: dict[str, Any] = {}
    for name in names or DEFAULT:
        wanted = name.strip("/")
        matches = {path: known[path] for path in known if path == wanted or path.startswith(f"{wanted}/")}
        if not matches:
            if wanted.partition("/")[0] in OPTIONAL:
                _ = result[f"trains/{train:03d}/{wanted}"]  # a missing group: its error names the key
            groups = {path.rpartition("/")[0] for path in known}
            raise InputError(f"{result.name}: no channel {name!r}{nearest(wanted, [*known, *sorted(groups)])}")
        found |= matches
    return found


def channel_table(result: Reader, train: int = 0, names: Sequence[str] = ()) -> ChannelTable:
    """Table of channels of one train.

    Args:
        result: Open result.
        train: Index of the train.
        names: Groups or channels, as in :func:`select_channels`.

    Returns:
        The table; only labels have been read.

    Raises:
        InputError: There is no such train or channel, or the channels do not have the same rows.
    """
    datasets = select_channels(result, train, names)
    paths = list(datasets)
    rows = _row_scale(datasets[paths[0]])
    for path, dataset in datasets.items():
        if _row_scale(dataset) != rows:
            raise InputError(
                f"{result.name}: {paths[0]} and {path} have different rows ({_describe_rows(datasets[paths[0]])},"
                f" {_describe_rows(dataset)}); the channels of a table must have the same rows, export them separately"
            )
    coordinates = {_name(rows): rows, **_row_coordinates(datasets[paths[0]].parent, rows)}
    columns = [Column(name, *_meaning(dataset)) for name, dataset in coordinates.items()]
    for path, dataset in datasets.items():
        columns += _columns(path, dataset)
    return ChannelTable(rows.shape[0], tuple(columns), (*coordinates.values(), *datasets.values()))


def labels_of(dataset: Any, axis: int) -> list[str]:
    """Labels along one dimension of a channel, as strings without blanks.

    Args:
        dataset: Channel.
        axis: Index of the dimension.
    """
    scales = dataset.dims[axis].values()
    if not scales:
        return [str(i) for i in range(dataset.shape[axis])]
    scale = scales[0]
    group = dataset.parent
    if _name(scale) == "point" and "offset" in group:  # the offset in metres is more informative than the index
        return [f"{offset:g}" for offset in group["offset"][:]]
    values = scale.asstr()[:] if h5py.check_string_dtype(scale.dtype) else scale[:]
    return [str(value).replace(" ", "_") for value in values]


def _datasets(node: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Datasets below a group, each with its path."""
    for name, child in node.items():
        if isinstance(child, h5py.Group):
            yield from _datasets(child, f"{prefix}{name}/")
        else:
            yield prefix + name, child


def _row_scale(dataset: Any) -> Any:
    """Dimension scale of the rows; groups sampled together share it."""
    return dataset.dims[0][0]


def _row_coordinates(group: Any, rows: Any) -> dict[str, Any]:
    """Coordinates of a group with one value per row, the scale of the rows excepted."""
    return {
        name: child
        for name, child in group.items()
        if isinstance(child, h5py.Dataset)
        and "coordinates" not in child.attrs
        and child.ndim == 1
        and len(child.dims[0]) > 0
        and child.dims[0][0] == rows
        and child != rows
    }


def _columns(path: str, dataset: Any) -> Iterator[Column]:
    unit, long_name = _meaning(dataset)
    labels = [labels_of(dataset, axis) for axis in range(1, dataset.ndim)]
    units = unit.split(", ")
    stem = path.replace("/", ".")
    for index in product(*(range(len(names)) for names in labels)):
        name = ".".join([stem, *(names[i] for names, i in zip(labels, index, strict=True))])
        by_last = len(units) > 1 and len(units) == len(labels[-1])  # one unit per degree of freedom
        yield Column(name, units[index[-1]] if by_last else unit, long_name)


def _meaning(dataset: Any) -> tuple[str, str]:
    return str(dataset.attrs.get("units", "1")), str(dataset.attrs.get("long_name", ""))


def _name(scale: Any) -> str:
    return str(scale.name).rpartition("/")[2]


def _describe_rows(dataset: Any) -> str:
    return f"{dataset.shape[0]} of {_name(_row_scale(dataset))}"
