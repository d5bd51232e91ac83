"""A short study: seven trains of three metres in four tasks, and what its parts hold."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import h5py

PLAN: dict[str, Any] = {
    "scenario": "default",
    "set": {
        "train.distance": 3.0,
        "numerics.time_step": 2e-4,
        "output.precision": "double",
        "output.run_in": 0.0,
        "irregularity.taper": 1.0,
    },
    "seeds": 2,
    "factors": [
        {"key": "train.speed_kmh", "name": "speed", "values": [300.0, 320.0]},
        {"key": "irregularity.scale", "values": [0.5, 1.0]},
    ],
    "constraints": ["speed < 310 or scale > 0.7"],
}
"""Points 300/0.5, 300/1.0, 320/1.0 with two seeds each: tasks of four and of two trains."""


def bits(folder: Path) -> dict[str, str]:
    """Digest of all data of every part."""
    found = {}
    for path in sorted((folder / "parts").glob("*.h5")):
        digest = hashlib.sha256()

        def add(name: str, node: Any, digest: Any = digest) -> None:
            if isinstance(node, h5py.Dataset) and node.dtype.kind in "fiu":
                digest.update(name.encode() + node[()].tobytes())

        with h5py.File(path, "r") as file:
            file["trains"].visititems(add)
        found[path.name] = digest.hexdigest()
    return found
