"""Checkpoints: state of the trains of one task between two chunks of steps, from which a run resumes bit for bit.

A checkpoint is a small file next to the result file, one per task, put in place by an atomic rename: a SHA-256 digest
followed by an npz archive of plain arrays and one JSON text of scalar values. Its contents are never executed. The
track is not stored: the irregularity is a function of seed and chainage.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import LARGEST_CHECKPOINT, check_regular
from tiengine.result_files.journal import atomic_write

__all__ = ["Checkpoint", "checkpoint_path", "checkpoint_paths", "sealed"]

MAGIC = b"tiengine checkpoint\n"
DIGEST = hashlib.sha256().digest_size

VERSION = 1
FACTS = "facts"
NUMBERS = {"done": int, "position": float, "loop": float, "speed": float, "first_seat": int, "first_slab": int}
"""Numeric facts and their types; all are non-negative."""

MAKERS = ("tiengine", "numpy", "scipy", "taichi")
"""Packages whose versions can change the bits of a run."""


def checkpoint_path(result: Path, task: int) -> Path:
    """Path of the checkpoint of a task.

    Args:
        result: Result file.
        task: Number of the task.
    """
    return result.with_name(f".{result.name}.{task:04d}.checkpoint")


def checkpoint_paths(result: Path) -> list[Path]:
    """Paths of the existing checkpoints of a result file."""
    prefix, suffix = f".{result.name}.", ".checkpoint"
    return sorted(
        path
        for path in result.parent.iterdir()
        if path.name.startswith(prefix)
        and path.name.endswith(suffix)
        and path.name[len(prefix) : -len(suffix)].isdigit()
    )


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """State of the trains of a task between two chunks of steps.

    Attributes:
        task: Number of the task.
        facts: Scalar values: completed steps, speed at the last factorisation, samples written, ...
        arrays: State arrays by name.
    """

    task: int
    facts: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]]

    def write(self, result: Path) -> None:
        """Write the checkpoint next to a result file, replacing the previous one.

        Args:
            result: Result file.

        Raises:
            OSError: The disk is full or has failed; the previous checkpoint is kept.
        """
        made_by = {package: metadata.version(package) for package in MAKERS}
        text = json.dumps({"version": VERSION, "made_by": made_by, "task": self.task, **self.facts})
        content = io.BytesIO()
        facts = np.frombuffer(text.encode(), dtype=np.uint8)
        np.savez(content, allow_pickle=False, **{FACTS: facts, **self.arrays})
        atomic_write(checkpoint_path(result, self.task), sealed(content.getvalue()))

    @classmethod
    def read(cls, path: Path) -> Checkpoint:
        """Read a checkpoint.

        Args:
            path: Checkpoint file.

        Raises:
            InputError: The file is damaged or has another format.
        """
        where = str(path)
        check_regular(path, where, LARGEST_CHECKPOINT)
        try:
            archived = _unsealed(path.read_bytes())
            with zipfile.ZipFile(io.BytesIO(archived)) as archive:
                members = archive.infolist()
                if any(member.compress_type != zipfile.ZIP_STORED for member in members):
                    raise ValueError("compressed")
                if sum(member.file_size for member in members) > len(archived):
                    raise ValueError("declares more data than the file holds")
                arrays = {member.filename.removesuffix(".npy"): _array(archive, member) for member in members}
            facts = json.loads(arrays.pop(FACTS).tobytes())
            version, task = facts["version"], int(facts["task"])
        except Exception as error:  # zipfile, numpy and json raise about fifteen types
            raise InputError(
                f"{where}: not a checkpoint, or damaged ({error or type(error).__name__});"
                " remove it to run its trains from the beginning"
            ) from None
        if version != VERSION:
            raise InputError(
                f"{path}: checkpoint version = {version}: this program reads {VERSION}; remove it to run its"
                " trains from the beginning"
            )
        return cls(task, facts, arrays)

    def check(self, where: str) -> None:
        """Refuse values from which no run can resume.

        Args:
            where: Name of the file, for messages.

        Raises:
            InputError: A value is missing or out of range; the message names it.
        """
        for name, kind in NUMBERS.items():
            value: Any = self.facts.get(name)
            is_number = type(value) is int or (kind is float and type(value) is float)
            if not is_number or not 0 <= value < 2**63:
                rule = f"must be a {'whole ' * (kind is int)}number >= 0"
                raise InputError(f"{where}: damaged: {name} = {str(value)[:80]}: {rule}")
        rows = self.facts.get("rows")
        if not isinstance(rows, dict) or not all(_is_rows(each) for each in rows.values()):
            raise InputError(f"{where}: damaged: rows: must be numbers of samples by train and group")

    @property
    def foreign(self) -> list[str]:
        """Packages whose versions differ from those that wrote the checkpoint: the bits may differ."""
        made_by = self.facts.get("made_by", {})
        return [f"{name} {made_by.get(name)}" for name in MAKERS if made_by.get(name) != metadata.version(name)]


def sealed(archived: bytes) -> bytes:
    """Archive preceded by its digest, because the checksums of a zip file do not cover its directory.

    Args:
        archived: Bytes of the npz archive.
    """
    return MAGIC + hashlib.sha256(archived).digest() + archived


def _unsealed(content: bytes) -> bytes:
    """Archive without its digest.

    Raises:
        ValueError: The digest does not match.
    """
    start = len(MAGIC) + DIGEST
    if not content.startswith(MAGIC):
        raise ValueError("no checkpoint header")
    if hashlib.sha256(content[start:]).digest() != content[len(MAGIC) : start]:
        raise ValueError("digest does not match")
    return content[start:]


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    """Read one array, after comparing its declared size with the bytes that the file holds.

    Raises:
        ValueError: The declared size is larger, or the array holds objects.
    """
    with archive.open(member) as file:
        major = np.lib.format.read_magic(file)
        read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[major]
        shape, _, dtype = read(file)
        if dtype.hasobject or math.prod(shape) * dtype.itemsize > member.file_size:
            raise ValueError(f"{member.filename}: shape {shape} of {dtype}")
    with archive.open(member) as file:
        return np.asarray(np.lib.format.read_array(file, allow_pickle=False))


def _is_rows(rows: Any) -> bool:
    return isinstance(rows, dict) and all(type(count) is int and 0 <= count < 2**63 for count in rows.values())
