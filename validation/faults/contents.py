"""Contents of a result file, bit by bit, and the files next to it."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

__all__ = ["Contents", "contents", "differing", "holds", "litter", "reads", "start_of"]

VOLATILE = ("wall_time", "real_time_factor", "peak_memory", "workers", "platform")
"""Beginnings of the names of attributes that describe the computation, not the result."""

PATIENCE = 3
"""Time after which a file counts as unreadable [s]; reading takes about 50 ms."""

Contents = dict[str, tuple[tuple[int, ...], bytes]]
"""Shape and bytes of every dataset and attribute, by path."""


def contents(path: Path) -> Contents:
    """Contents of a file, without the attributes that describe the computation.

    Args:
        path: The file.

    Raises:
        OSError: It does not open.
    """
    found: Contents = {}

    def visit(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            found[name] = (node.shape, _bytes(node[()]))
        for key, value in node.attrs.items():
            if not key.startswith(VOLATILE) and key not in ("DIMENSION_LIST", "REFERENCE_LIST"):
                found[f"{name}@{key}"] = (np.shape(value), _bytes(value))

    with h5py.File(path, "r") as file:
        visit("", file)
        file.visititems(visit)
    return found


def reads(path: Path, right: Callable[[Contents], bool]) -> bool:
    """Whether plain h5py reads a file that may be torn, and its contents are right.

    It reads in a copy of this process, since HDF5 may loop endlessly in tables of which one half is older.

    Args:
        path: The file.
        right: Whether contents are right.
    """
    pid = os.fork()
    if pid:
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 0
    good = False
    try:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(PATIENCE)
        good = right(contents(path))
    finally:
        os._exit(0 if good else 1)
    return good


def differing(a: Contents, b: Contents) -> list[str]:
    """Paths whose contents differ in any bit."""
    return sorted(name for name in {*a, *b} if a.get(name) != b.get(name))


def start_of(part: Contents, whole: Contents) -> list[str]:
    """Datasets of an unfinished file that are not the beginning of those of the complete one."""
    bad = []
    for name, (shape, data) in part.items():
        if "@" in name:
            continue
        whole_shape, whole_data = whole.get(name, ((), b""))
        if shape[1:] != whole_shape[1:] or not whole_data.startswith(data):
            bad.append(name)
    return bad


def holds(part: Contents, rows: Mapping[str, Mapping[str, int]]) -> bool:
    """Whether a file holds at least the given rows.

    Args:
        part: The file.
        rows: Numbers of rows by train and group, logged by the run at its last commit.
    """
    for train, groups in rows.items():
        for group, count in groups.items():
            grown = [shape[0] for name, (shape, _) in part.items() if _grows(name, f"trains/{int(train):03d}/{group}")]
            if max(grown, default=0) < count:
                return False
    return True


def litter(path: Path) -> list[str]:
    """Files next to a complete result that belong to it."""
    return sorted(each.name for each in path.parent.iterdir() if path.name in each.name and each != path)


def _grows(name: str, group: str) -> bool:
    return name.startswith(f"{group}/") and "@" not in name and "/" not in name[len(group) + 1 :]


def _bytes(value: Any) -> bytes:
    array = np.asarray(value)
    return b"".join(f"{each!r}\n".encode() for each in array.ravel()) if array.dtype.kind in "OUS" else array.tobytes()
