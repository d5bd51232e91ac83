"""Contents of the parts of a study, for comparison bit by bit."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import h5py

__all__ = ["bits", "of_train"]


def bits(folder: Path) -> dict[str, str]:
    """Digest of the data of every part.

    Args:
        folder: Folder of a study.
    """
    found = {}
    for path in sorted((folder / "parts").glob("*.h5")):
        with h5py.File(path, "r") as file:
            found[path.name] = "".join(of_train(train) for train in file["trains"].values())
    return found


def of_train(train: Any) -> str:
    """Digest of the numbers of one train.

    Args:
        train: Its HDF5 group.
    """
    digest = hashlib.sha256()

    def add(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and node.dtype.kind in "fiu":
            digest.update(name.encode() + node[()].tobytes())

    train.visititems(add)
    return digest.hexdigest()[:16]
