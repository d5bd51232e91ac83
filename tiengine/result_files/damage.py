"""Whether a train of a result file is what the writer makes: looked at before anything is read.

A damaged or forged file may claim 1e15 samples, lead into other files by its links, or lack what its channels refer to;
what HDF5 itself finds wrong while it reads is turned into one sentence by :func:`readable`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import Any

import h5py

from tiengine.parameters.errors import InputError

__all__ = ["check_train", "readable", "unreadable"]

LARGEST_CHUNK = 2**28  # bytes that HDF5 holds at a time; the writer's have some 100 kB
LARGEST_RATIO = 1100  # of repacked files: deflate makes at most 1032 bytes of one
MOST_DIMENSIONS = 4
DEEPEST = 2  # groups below a train: gauges/NAME
READERS = ("h5py", "h5netcdf")
LAYOUT = {
    "wheel": ("time", "wheelset", "side"),
    "irregularity": ("time", "wheelset", "side"),
    "body": ("time", "body", "dof"),
    "mortar": ("time", "slot"),
    "seats": ("seat", "side"),
    "slabs": ("slab",),
    "deflection": ("time", "side", "point"),
    "events": ("event",),
}
"""Dimensions of each group's channels; each has a dataset of its labels."""
PLACES = {"time": "position", "seat": "chainage", "slab": "chainage"}
"""Chainages beside the labels of a dimension."""
DETAILS = {"wheelset_vehicle": "wheelset", "wheelset_offset": "wheelset", "offset": "point"}
"""What else is known along a dimension."""


@contextmanager
def readable(name: str) -> Iterator[None]:
    """What HDF5 finds wrong with a file becomes one sentence.

    Args:
        name: Path of the file.

    Raises:
        InputError: It cannot be read.
    """
    try:
        yield
    except Exception as error:
        if (words := unreadable(error, error.__traceback__)) is None:
            raise
        raise InputError(f"{name}: {words}") from error


def unreadable(error: BaseException | None, trace: TracebackType | None) -> str | None:
    """What HDF5 says of a file; None for errors that it did not raise.

    Args:
        error: What was raised: h5py knows OSError, RuntimeError, KeyError, ValueError, TypeError and others.
        trace: From where.
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
    """Refuse a train that is not as the writer makes them.

    Args:
        train: Its group, or whatever is in its place.
        where: File and train, for messages.

    Raises:
        InputError: Says which dataset is wrong and what is.
    """
    if not isinstance(train, h5py.Group):
        raise InputError(f"{where}: damaged: must be a group")
    _check_group(train, where, 0)


def _check_group(group: Any, where: str, depth: int) -> None:
    """Every child of a group, and of those below it."""
    path = ["", *str(group.name).split("/")]
    holds_channels = path[-1] in LAYOUT or path[-2] == "gauges"
    shapes: dict[str, tuple[int, ...]] = {}
    for name in group:
        here = f"{where}/{name}"
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise InputError(f"{here}: leads to another place or file; a result holds all of its data itself")
        child = group[name]
        if isinstance(child, h5py.Group) and depth < DEEPEST and not holds_channels:
            _check_group(child, here, depth + 1)
        elif isinstance(child, h5py.Dataset):
            _check_dataset(child, here)
            shapes[name] = child.shape
        else:
            raise InputError(f"{here}: damaged: must be a dataset")
    if holds_channels:
        of_gauge = ("time", "direction") if "direction" in shapes else ("time",)
        _check_shapes(shapes, LAYOUT.get(path[-1], of_gauge), where)


def _check_shapes(shapes: Mapping[str, tuple[int, ...]], dimensions: tuple[str, ...], where: str) -> None:
    """Labels of every dimension, and channels of all of them."""
    place = PLACES.get(dimensions[0])
    for name in (*dimensions, *([place] if place else [])):
        if len(shapes.get(name, ())) != 1:
            raise InputError(f"{where}/{name}: damaged: missing, or more than a row of labels")
    along = {name: name for name in dimensions} | DETAILS
    if place:
        along[place] = dimensions[0]
    for name, shape in shapes.items():
        own = (along[name],) if along.get(name) in dimensions else dimensions
        wanted = tuple(shapes[dimension][0] for dimension in own)
        if shape != wanted:
            raise InputError(f"{where}/{name}: damaged: shape {shape}; {wanted} expected")


def _check_dataset(dataset: Any, where: str) -> None:
    """Kind and size of what it holds."""
    if not 1 <= dataset.ndim <= MOST_DIMENSIONS:
        raise InputError(f"{where}: damaged: {dataset.ndim} dimensions; 1 to {MOST_DIMENSIONS} expected")
    if dataset.dtype.kind not in "fiu" and h5py.check_string_dtype(dataset.dtype) is None:
        raise InputError(f"{where}: damaged: holds {dataset.dtype}; numbers or texts expected")
    if dataset.is_virtual or dataset.external:
        raise InputError(f"{where}: lies in another file; a result holds all of its data itself")
    item = dataset.dtype.itemsize
    chunk = item
    for length in dataset.chunks or ():
        chunk *= int(length)
    if chunk > LARGEST_CHUNK:
        raise InputError(f"{where}: chunks of {chunk / 1e6:g} MB; at most {LARGEST_CHUNK / 1e6:g} MB expected")
    claimed = item
    for length in dataset.shape:
        claimed *= int(length)
    held = int(dataset.id.get_storage_size())
    ratio = LARGEST_RATIO if dataset.compression is not None else 1
    if claimed > held * ratio:
        raise InputError(f"{where}: damaged: claims {claimed / 1e6:g} MB of samples, the file holds {held / 1e6:g} MB")
