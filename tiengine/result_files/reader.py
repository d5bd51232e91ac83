"""Reader of result files: lazy datasets of h5py or NumPy arrays.

The files are plain HDF5; docs/results.md describes them and how to read them without this package.
"""

from __future__ import annotations

import re
import zlib
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import is_file
from tiengine.result_files.damage import check_train, readable, unreadable
from tiengine.result_files.file_lock import complete_commit
from tiengine.result_files.journal import journal_of

__all__ = ["COMPLETE", "FORMAT", "FORMAT_VERSION", "RUNNING", "Reader", "open_file", "open_reader"]

FORMAT = "tiengine"
FORMAT_VERSION = 2
"""Version of the files that are written. In version 1 a train had a dataset ``time``, that of its group ``wheel``."""
READABLE_VERSIONS = (1, 2)
COMPLETE = "complete"
"""Status of a train that has run its whole distance."""
RUNNING = "running"
"""Status of a train that is running, or was when the program ended."""
TRAIN = re.compile(r"trains/\d+(?=/|$)", flags=re.ASCII)
CHECKSUM = "scenario_crc32"
LARGEST_SCENARIO = 100_000_000  # characters
OPTIONAL = {
    "seats": "output.envelopes = true",
    "slabs": "output.envelopes = true",
    "deflection": "output.deflection_interval, 0.1 for example,",
    "gauges": "a table [[gauges]]",
}
"""Groups of a train that are optional, and the key of the scenario that adds each."""


class Reader:
    """Result file, open for reading; use as a context manager or :meth:`close` it.

    Attributes:
        file: Open HDF5 file.
        name: Path of the file, for messages.
    """

    def __init__(self, file: Any, name: str) -> None:
        """Take over an open file from :func:`open_file` or a writer.

        Args:
            file: Open HDF5 file.
            name: Path of the file, for messages.
        """
        self.file = file
        self.name = name
        self._checked: set[str] = set()

    def __enter__(self) -> Self:
        """Return the result itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file; convert errors of HDF5 to InputError."""
        self.close()
        if (words := unreadable(error, trace)) is not None:
            raise InputError(f"{self.name}: {words}") from error

    def __getitem__(self, path: str) -> Any:
        """Dataset or group, as in ``result["trains/000/wheel/normal_force"][:1000]``; data are read on indexing.

        Raises:
            InputError: The path does not exist; the message names the nearest path, or the key of the scenario that
                adds the group. Or the train is damaged.
        """
        with readable(self.name):
            return self._at(path)

    def _at(self, path: str) -> Any:
        if (found := TRAIN.match(path.strip("/"))) is not None and found[0] not in self._checked:
            if found[0] in self.file:
                check_train(self.file[found[0]], f"{self.name}: {found[0]}")
            self._checked.add(found[0])
        if path in self.file:
            return self.file[path]
        trains, train, group = (*path.strip("/").split("/"), "", "", "")[:3]
        if group in OPTIONAL and f"{trains}/{train}" in self.file and f"{trains}/{train}/{group}" not in self.file:
            raise InputError(f"{self.name}: no {group!r}; set {OPTIONAL[group]} in the scenario and run it again")
        known: list[str] = []
        self.file.visit(known.append)
        raise InputError(f"{self.name}: no {path!r}{nearest(path.strip('/'), known)}")

    def __repr__(self) -> str:
        """Path and number of trains."""
        return f"<tiengine result {self.name!r}, {self.trains} train(s)>"

    @property
    def trains(self) -> int:
        """Number of trains."""
        return len(self._names)

    @property
    def _names(self) -> list[str]:
        """Names of the trains."""
        with readable(self.name):
            found = self["trains"]
            if not isinstance(found, h5py.Group):
                raise InputError(f"{self.name}: trains: damaged: must be a group")
            names = list(found)
            if odd := [name for name in names if not TRAIN.fullmatch(f"trains/{name}")]:
                raise InputError(f"{self.name}: trains/{odd[0]}: damaged: must be the number of a train")
            return names

    @property
    def attributes(self) -> dict[str, Any]:
        """Root attributes: versions, scenario, degrees of freedom, time step, wall times."""
        with readable(self.name):
            return {key: _plain(value) for key, value in self.file.attrs.items()}

    @property
    def scenario_toml(self) -> str:
        """Resolved scenario as TOML.

        Raises:
            InputError: The text is missing, damaged, or too large.
        """
        with readable(self.name):
            text = str(self.file.attrs["scenario"])
            has_checksum = CHECKSUM in set(self.file.attrs)  # "get" would return None for a damaged one
            checksum = self.file.attrs[CHECKSUM] if has_checksum else None
        if len(text) > LARGEST_SCENARIO:
            raise InputError(
                f"{self.name}: scenario: {len(text) / 1e6:g} MB, larger than {LARGEST_SCENARIO / 1e6:g} MB"
            )
        if checksum is not None and zlib.crc32(text.encode("utf-8", "surrogateescape")) != checksum:
            raise InputError(f"{self.name}: scenario: damaged: its checksum does not match")
        return text

    def check(self) -> None:
        """Check the structure of all trains, which is otherwise checked at the first access to each.

        Raises:
            InputError: A train is damaged.
        """
        with readable(self.name):
            for train in self._names:
                self._at(f"trains/{train}")

    def status(self, train: int = 0) -> str:
        """Status of a train: ``"complete"``, ``"running"``, or the reason of its failure.

        Args:
            train: Index of the train.
        """
        return str(self.facts(train).get("status", self.attributes.get("status", "")))

    @property
    def finished(self) -> bool:
        """Whether the run has ended, successfully or not; an unfinished run can be resumed."""
        return bool(self.attributes.get("status") != RUNNING)

    @property
    def failures(self) -> dict[int, str]:
        """Reasons of failure by the index of the train."""
        found = {train: self.status(train) for train in range(self.trains)}
        return {train: why for train, why in found.items() if why not in (COMPLETE, RUNNING)}

    def facts(self, train: int = 0) -> dict[str, Any]:
        """Attributes of one train: vehicles, seed, degrees of freedom, time step, status, simulated time.

        Args:
            train: Index of the train.

        Raises:
            InputError: There is no such train.
        """
        with readable(self.name):
            if (path := f"trains/{train:03d}") in self.file:  # the attributes can be read without the structure check
                return {key: _plain(value) for key, value in self.file[path].attrs.items()}
        return dict(self[path].attrs)  # raises an error that names the nearest path

    def group(self, name: str, train: int = 0) -> dict[str, NDArray[Any]]:
        """Read a whole group into memory.

        Args:
            name: Name of the group, for example ``"wheel"``, ``"seats"`` or ``"gauges/bridge"``.
            train: Index of the train.

        Returns:
            Arrays by name: ``time`` [s] (n,), ``position`` [m] (n,), labels, and channels (n, ...); in the envelopes
            ``seat`` or ``slab`` (n,) and ``chainage`` [m] (n,) instead of time and position.

        Raises:
            InputError: There is no such train or group.
        """
        with readable(self.name):
            return {key: _array(dataset) for key, dataset in self[f"trains/{train:03d}/{name}"].items()}

    def wheel(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Contact quantities of all wheels; channels have shape (time, wheelset, side)."""
        return self.group("wheel", train)

    def patch(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Patches of all wheels if ``contact.patches`` is 2; channels have shape (time, wheelset, side, patch)."""
        return self.group("patch", train)

    def body(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Motion of all bodies; channels have shape (time, body, dof)."""
        return self.group("body", train)

    def irregularity(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Irregularity under all wheels; channels have shape (time, wheelset, side)."""
        return self.group("irregularity", train)

    def seats(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Extreme forces of all fastenings; channels have shape (seat, side)."""
        return self.group("seats", train)

    def slabs(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Extremes of all slabs; channels have shape (slab,)."""
        return self.group("slabs", train)

    def deflection(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Deflection of rails and slabs along the window; channels have shape (time, side, point)."""
        return self.group("deflection", train)

    def gauges(self, train: int = 0) -> dict[str, dict[str, NDArray[Any]]]:
        """All gauges by name; channels have shape (time, direction) or, on a fastening, (time,)."""
        return {name: self.group(f"gauges/{name}", train) for name in self[f"trains/{train:03d}/gauges"]}

    def close(self) -> None:
        """Close the file; arrays read before remain valid."""
        self.file.close()


def open_reader(path: Path | str) -> Reader:
    """Open a result file for reading; see :func:`open_file`."""
    return Reader(open_file(path), str(path))


def open_file(path: Path | str) -> h5py.File:
    """Open the HDF5 file of a result and check its header.

    Args:
        path: Result file.

    Returns:
        The open file; only its header has been read.

    Raises:
        InputError: The file does not exist, is not a result of this program, or has an unknown format version.
    """
    if not is_file(Path(path)):
        raise InputError(f"{path}: no such file")
    complete_commit(Path(path))
    try:
        file = h5py.File(path, "r")
    except OSError:
        if journal_of(Path(path)).exists():
            raise InputError(
                f"{path}: its last commit was interrupted by a crash; it will be completed from the journal as soon as"
                " the file and its folder are writable"
            ) from None
        raise InputError(f"{path}: not a tiengine result (not an HDF5 file, or damaged)") from None
    try:
        with readable(str(path)):
            _check_header(file.attrs, path)
    except InputError:
        file.close()
        raise
    return file


def _check_header(attributes: Any, path: Path | str) -> None:
    """Refuse files of other programs and of unknown format versions."""
    name, version = _plain(attributes.get("format")), _plain(attributes.get("format_version"))
    if not isinstance(name, str) or name != FORMAT:
        raise InputError(f"{path}: not a tiengine result (HDF5, but its attribute format is not {FORMAT!r})")
    if not isinstance(version, int) or version not in READABLE_VERSIONS:
        known = " and ".join(map(str, READABLE_VERSIONS))
        raise InputError(
            f"{path}: format_version = {version}: this program reads {known}; read it with the version of"
            f" tiengine that wrote it ({attributes.get('tiengine_version', 'unknown')}), or run its scenario again"
        )


def _array(dataset: Any) -> NDArray[Any]:
    """Contents of a dataset, with strings as Python strings."""
    if h5py.check_string_dtype(dataset.dtype):
        return np.array(dataset.asstr()[()])
    return np.array(dataset[()])


def _plain(value: Any) -> Any:
    """Attribute as a Python value; bytes that are not valid text become question marks."""
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode()
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value
