"""Files of a data set: Zarr groups that xarray opens lazily, or Parquet files with one row a window."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.conventions import SIDES
from tiengine.parameters.optional_packages import needed_by

__all__ = ["ParquetSink", "Sink", "ZarrSink"]

CHUNK_BYTES = 4_000_000  # of an array: a chunk is what a reader loads at once
LONGEST_LABEL = 64  # characters

Arrays = Mapping[str, NDArray[np.float32]]
Labels = Mapping[str, Any]


class Sink(Protocol):
    """Data set that is being written."""

    def add(self, split: str, arrays: Arrays, labels: Labels) -> None:
        """Append the windows of one train.

        Args:
            split: Split that the train belongs to.
            arrays: Values by name, shape (windows, samples) or (windows, samples, wheelset, side).
            labels: Numbers and texts that hold for all of these windows.
        """

    def close(self) -> None:
        """Complete the files."""


class ZarrSink:
    """One Zarr group a split, with arrays along the dimensions window, sample, wheelset, side."""

    def __init__(self, path: Path) -> None:
        """Create the store.

        Args:
            path: Folder to create.

        Raises:
            InputError: zarr is missing.
        """
        with needed_by("data set"):
            import zarr
        self._zarr = zarr
        self._root = zarr.open_group(str(path), mode="w", zarr_format=2)  # read by other programs too
        self._path = path

    def add(self, split: str, arrays: Arrays, labels: Labels) -> None:
        """Append windows; see :class:`Sink`."""
        group = self._root.require_group(split)
        count = len(next(iter(arrays.values())))
        for name, values in arrays.items():
            dimensions = ["window", "sample", "wheelset", "side"][: values.ndim]
            chunk = max(CHUNK_BYTES // max(values[:1].nbytes, 1), 1)
            self._append(group, name, values, dimensions, (chunk, *values.shape[1:]))
        for name, value in labels.items():
            kind = f"<U{LONGEST_LABEL}" if isinstance(value, str) else np.float64
            self._append(group, name, np.full(count, value, kind), ["window"], (1024,))

    def _append(
        self, group: Any, name: str, values: NDArray[Any], dimensions: list[str], chunks: tuple[int, ...]
    ) -> None:
        """Append to an array, created at the first call."""
        if name not in group:
            empty = (0, *values.shape[1:])
            fill = "" if values.dtype.kind == "U" else np.nan  # a reader takes the fill value for missing
            array = group.create_array(name, shape=empty, chunks=chunks, dtype=values.dtype, fill_value=fill)
            array.attrs["_ARRAY_DIMENSIONS"] = dimensions
        group[name].append(values, axis=0)

    def close(self) -> None:
        """Collect the metadata, so that a reader finds all arrays at once."""
        self._zarr.consolidate_metadata(str(self._path))


class ParquetSink:
    """One Parquet file a split, one row a window, its samples as lists."""

    def __init__(self, path: Path) -> None:
        """Create the folder.

        Args:
            path: Folder to create.

        Raises:
            InputError: pyarrow is missing.
        """
        with needed_by("data set"):
            import pyarrow
            from pyarrow import parquet
        self._arrow, self._parquet = pyarrow, parquet
        path.mkdir()
        self._path = path
        self._writers: dict[str, Any] = {}

    def add(self, split: str, arrays: Arrays, labels: Labels) -> None:
        """Append windows; see :class:`Sink`."""
        count = len(next(iter(arrays.values())))
        columns: dict[str, Any] = {name: self._arrow.array([value] * count) for name, value in labels.items()}
        for name, values in arrays.items():
            if values.ndim == 2:
                columns[name] = self._lists(values)
                continue
            for w in range(values.shape[2]):
                for s, side in enumerate(SIDES):
                    columns[f"{name}_{w + 1}_{side}"] = self._lists(values[:, :, w, s])
        table = self._arrow.table(columns)
        if split not in self._writers:
            self._writers[split] = self._parquet.ParquetWriter(self._path / f"{split}.parquet", table.schema)
        self._writers[split].write_table(table)

    def _lists(self, values: NDArray[np.float32]) -> Any:
        """Column of lists of equal length."""
        flat = self._arrow.array(np.ascontiguousarray(values).reshape(-1))
        return self._arrow.FixedSizeListArray.from_arrays(flat, values.shape[1])

    def close(self) -> None:
        """Write the ends of the files."""
        for writer in self._writers.values():
            writer.close()
