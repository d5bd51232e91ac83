"""Structure check of a train in a result file, before any of its data is read.

A damaged or forged file may declare 1e15 samples, link to other files, or lack datasets to which its channels refer.
Errors that HDF5 raises while reading become one-line messages by :func:`readable`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import Any

import h5py

from tiengine.parameters.errors import InputError
from tiengine.result_files.event_table import EVENT, EVENTS
from tiengine.result_files.layout import AUXILIARY, AXES, DIMENSIONS, GAUGE_DIMENSIONS, GAUGES

__all__ = ["check_train", "readable", "unreadable"]

LARGEST_CHUNK = 2**28  # bytes that HDF5 reads at once; chunks of the writer have about 100 kB
LARGEST_RATIO = 1100  # of repacked files: one byte of a deflate stream expands to at most 1032
MOST_DIMENSIONS = 4
DEEPEST = 2  # levels of groups below a train: gauges/NAME
READERS = ("h5py", "h5netcdf")
EXPECTED = DIMENSIONS | {EVENTS: (EVENT,)}
"""Dimensions of the channels of each group; each dimension has a dataset of labels."""


@contextmanager
def readable(name: str) -> Iterator[None]:
    """Convert errors of HDF5 while it reads a file into one-line messages.

    Args:
        name: Path of the file.

    Raises:
        InputError: The file cannot be read.
    """
    try:
        yield
    except Exception as error:
        if (words := unreadable(error, error.__traceback__)) is None:
            raise
        raise InputError(f"{name}: {words}") from error


def unreadable(error: BaseException | None, trace: TracebackType | None) -> str | None:
    """Message for an error raised by HDF5; None for errors raised elsewhere.

    Args:
        error: The exception; h5py raises OSError, RuntimeError, KeyError, ValueError, TypeError and others.
        trace: Its traceback.
    """
    if not isinstance(error, Exception) or isinstance(error, InputError) or trace is None:
        return None
    while trace.tb_next is not None:
        trace = trace.tb_next
    parts = trace.tb_frame.f_code.co_filename.replace("\\", "/").split("/")
    if not any(reader in parts for reader in READERS):
        return None
    return f"cannot be read, it is damaged or incomplete ({' '.join(str(error).split())})"


def check_train(train: Any, where: str) -> None:
    """Refuse a train whose structure differs from the layout.

    Args:
        train: Group of the train, or any other object at its path.
        where: File and train, for messages.

    Raises:
        InputError: The message names the dataset and the fault.
    """
    if not isinstance(train, h5py.Group):
        raise InputError(f"{where}: damaged: must be a group")
    _check_group(train, where, 0)


def _check_group(group: Any, where: str, depth: int) -> None:
    """Check all children of a group, recursively."""
    path = ["", *str(group.name).split("/")]
    holds_channels = path[-1] in EXPECTED or path[-2] == GAUGES
    shapes: dict[str, tuple[int, ...]] = {}
    for name in group:
        here = f"{where}/{name}"
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise InputError(f"{here}: is a link to another place or file; a result must hold all of its data itself")
        child = group[name]
        if isinstance(child, h5py.Group) and depth < DEEPEST and not holds_channels:
            _check_group(child, here, depth + 1)
        elif isinstance(child, h5py.Dataset):
            _check_dataset(child, here)
            shapes[name] = child.shape
        else:
            raise InputError(f"{here}: damaged: must be a dataset")
    if holds_channels:
        gauge = GAUGE_DIMENSIONS["motion" if "direction" in shapes else "force"]
        _check_shapes(shapes, EXPECTED.get(path[-1], gauge), where)


def _check_shapes(shapes: Mapping[str, tuple[int, ...]], dimensions: tuple[str, ...], where: str) -> None:
    """Check the labels of every dimension and the shapes of the channels."""
    chainage = AXES[dimensions[0]].chainage if dimensions[0] in AXES else None
    for name in (*dimensions, *([chainage] if chainage else [])):
        if len(shapes.get(name, ())) != 1:
            raise InputError(f"{where}/{name}: damaged: missing, or not a one-dimensional list of labels")
    along = {name: name for name in dimensions} | AUXILIARY
    if chainage:
        along[chainage] = dimensions[0]
    for name, shape in shapes.items():
        own = (along[name],) if along.get(name) in dimensions else dimensions
        wanted = tuple(shapes[dimension][0] for dimension in own)
        if shape != wanted:
            raise InputError(f"{where}/{name}: damaged: shape {shape}; {wanted} expected")


def _check_dataset(dataset: Any, where: str) -> None:
    """Check the data type, the storage and the size of a dataset."""
    if not 1 <= dataset.ndim <= MOST_DIMENSIONS:
        raise InputError(f"{where}: damaged: {dataset.ndim} dimensions; 1 to {MOST_DIMENSIONS} expected")
    if dataset.dtype.kind not in "fiu" and h5py.check_string_dtype(dataset.dtype) is None:
        raise InputError(f"{where}: damaged: holds {dataset.dtype}; numbers or strings expected")
    if dataset.is_virtual or dataset.external:
        raise InputError(f"{where}: stored in another file; a result must hold all of its data itself")
    item = dataset.dtype.itemsize
    chunk = item
    for length in dataset.chunks or ():
        chunk *= int(length)
    if chunk > LARGEST_CHUNK:
        raise InputError(f"{where}: chunks of {chunk / 1e6:g} MB; at most {LARGEST_CHUNK / 1e6:g} MB expected")
    declared = item
    for length in dataset.shape:
        declared *= int(length)
    held = int(dataset.id.get_storage_size())
    ratio = LARGEST_RATIO if dataset.compression is not None else 1
    if declared > held * ratio:
        size = f"{declared / 1e6:g} MB of samples, the file holds {held / 1e6:g} MB"
        raise InputError(f"{where}: damaged: declares {size}")
