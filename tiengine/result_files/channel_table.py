"""Channels of a result as columns: what CSV and Parquet take, read piece by piece.

A column is named after group, channel and labels, joined by points, with the unit in brackets:
``wheel.vertical_force.1.left [N]``, ``body.acceleration.frame_1.z [m/s^2]``. The rows are those of the channels' first
dimension, mostly time; what is known along it comes first: ``time [s]``, ``position [m]``.
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

__all__ = ["ChannelTable", "Column", "channel_table", "chosen", "labels_of"]

DEFAULT = ("wheel",)


@dataclass(frozen=True)
class Column:
    """Head of one column.

    Attributes:
        name: Group, channel and labels, joined by points.
        unit: SI unit, ``"1"`` for none.
        long_name: What the channel is, in words.
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
    """Datasets of common rows, cut into columns.

    Attributes:
        rows: Number of rows.
        columns: Heads of the columns.
        datasets: What the columns are taken from, in their order; all have the same first dimension.
    """

    rows: int
    columns: tuple[Column, ...]
    datasets: tuple[Any, ...]

    def pieces(self, values: int) -> Iterator[list[NDArray[Any]]]:
        """All columns, so many rows at a time that a piece holds about so many numbers.

        Args:
            values: Numbers in memory at a time.

        Yields:
            One array a column, in the precision of the file, shape (rows of the piece,).
        """
        step = max(1, values // len(self.columns))
        for first in range(0, self.rows, step):
            blocks = [dataset[first : first + step] for dataset in self.datasets]
            yield [column for block in blocks for column in block.reshape(len(block), -1).T]


def chosen(result: Reader, train: int, names: Sequence[str]) -> dict[str, Any]:
    """Datasets of some channels.

    Args:
        result: Open result.
        train: Index of the train.
        names: Groups or channels, ``"body"``, ``"wheel/vertical_force"``; the wheels' if empty.

    Returns:
        Datasets by path within the train, in the order of the names and, within a group, of the file.

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
                _ = result[f"trains/{train:03d}/{wanted}"]  # says which key to set, if the whole group is missing
            groups = {path.rpartition("/")[0] for path in known}
            raise InputError(f"{result.name}: no channel {name!r}{nearest(wanted, [*known, *sorted(groups)])}")
        found |= matches
    return found


def channel_table(result: Reader, train: int = 0, names: Sequence[str] = ()) -> ChannelTable:
    """Some channels of one train as a table.

    Args:
        result: Open result.
        train: Index of the train.
        names: Groups or channels, as of :func:`chosen`.

    Returns:
        The table; nothing has been read but labels.

    Raises:
        InputError: There is no such train or channel, or the channels have no common rows.
    """
    datasets = chosen(result, train, names)
    paths = list(datasets)
    rows = _row_scale(datasets[paths[0]])
    for path, dataset in datasets.items():
        if _row_scale(dataset) != rows:
            raise InputError(
                f"{result.name}: {paths[0]} and {path} have different rows ({_rows_in_words(datasets[paths[0]])},"
                f" {_rows_in_words(dataset)}); a table holds one kind, export them one by one"
            )
    along = {_name(rows): rows, **_known_along(datasets[paths[0]].parent, rows)}
    columns = [Column(name, *_meaning(dataset)) for name, dataset in along.items()]
    for path, dataset in datasets.items():
        columns += _columns(path, dataset)
    return ChannelTable(rows.shape[0], tuple(columns), (*along.values(), *datasets.values()))


def labels_of(dataset: Any, axis: int) -> list[str]:
    """Labels along one dimension of a channel, as texts without blanks.

    Args:
        dataset: Channel.
        axis: Its dimension.
    """
    scales = dataset.dims[axis].values()
    if not scales:
        return [str(i) for i in range(dataset.shape[axis])]
    scale = scales[0]
    group = dataset.parent
    if _name(scale) == "point" and "offset" in group:  # metres ahead of the train say more than a number
        return [f"{offset:g}" for offset in group["offset"][:]]
    values = scale.asstr()[:] if h5py.check_string_dtype(scale.dtype) else scale[:]
    return [str(value).replace(" ", "_") for value in values]


def _datasets(node: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every dataset below a group, with its path."""
    for name, child in node.items():
        if isinstance(child, h5py.Group):
            yield from _datasets(child, f"{prefix}{name}/")
        else:
            yield prefix + name, child


def _row_scale(dataset: Any) -> Any:
    """Scale of the first dimension; groups sampled together share it."""
    return dataset.dims[0][0]


def _known_along(group: Any, rows: Any) -> dict[str, Any]:
    """Coordinates of a group that have one number a row."""
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
        by_last = len(units) > 1 and len(units) == len(labels[-1])  # one unit a degree of freedom
        yield Column(name, units[index[-1]] if by_last else unit, long_name)


def _meaning(dataset: Any) -> tuple[str, str]:
    return str(dataset.attrs.get("units", "1")), str(dataset.attrs.get("long_name", ""))


def _name(scale: Any) -> str:
    return str(scale.name).rpartition("/")[2]


def _rows_in_words(dataset: Any) -> str:
    return f"{dataset.shape[0]} of {_name(_row_scale(dataset))}"
