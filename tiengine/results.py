"""Reading result files: lazily, as NumPy arrays.

The files are plain HDF5 and open as well with
``xarray.open_dataset(FILE, group="trains/000/wheel", engine="h5netcdf")``.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tiengine.presets import nearest
from tiengine.quantity import InputError

if TYPE_CHECKING:
    from tiengine.metrics import Metrics
    from tiengine.scenario import Scenario

__all__ = ["COMPLETE", "FORMAT", "FORMAT_VERSION", "Result", "open"]

FORMAT = "tiengine"
FORMAT_VERSION = 1
COMPLETE = "complete"
"""Status of a train that has run to the end of its way."""


class Result:
    """A result file, open for reading; use as a context manager or :meth:`close` it.

    Attributes:
        name: Path of the file, for messages.
    """

    def __init__(self, file: Any, name: str) -> None:
        """Take over an open file, as :func:`open` and the writer do.

        Args:
            file: The open HDF5 file.
            name: Its path.
        """
        self._file = file
        self.name = name

    def __enter__(self) -> Result:
        """The result itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self.close()

    def __getitem__(self, path: str) -> Any:
        """A dataset or group, as in ``result["trains/000/wheel/normal_force"][:1000]``; nothing is read yet.

        Raises:
            InputError: There is nothing at that path; the message names the nearest.
        """
        if path in self._file:
            return self._file[path]
        known: list[str] = []
        self._file.visit(known.append)
        raise InputError(f"{self.name}: no {path!r}{nearest(path.strip('/'), known)}")

    def __repr__(self) -> str:
        """Path and number of trains."""
        return f"<tiengine result {self.name!r}, {self.trains} train(s)>"

    @property
    def trains(self) -> int:
        """Number of trains."""
        return len(self["trains"])

    @property
    def attributes(self) -> dict[str, Any]:
        """Root attributes: versions, scenario, DOFs, step, wall times."""
        return {key: _plain(value) for key, value in self._file.attrs.items()}

    @property
    def scenario_toml(self) -> str:
        """The resolved scenario as text."""
        return str(self._file.attrs["scenario"])

    @property
    def scenario(self) -> Scenario:
        """The scenario that was run."""
        from tiengine.scenario import load_scenario  # Taichi comes with it: not for those who only read

        return load_scenario(tomllib.loads(self.scenario_toml))

    def status(self, train: int = 0) -> str:
        """``"complete"``, or why the train failed.

        Args:
            train: Index of the train.
        """
        return str(self.facts(train).get("status", self.attributes.get("status", "")))

    @property
    def failures(self) -> dict[int, str]:
        """Why trains failed, by their index."""
        found = {train: self.status(train) for train in range(self.trains)}
        return {train: why for train, why in found.items() if why != COMPLETE}

    def facts(self, train: int = 0) -> dict[str, Any]:
        """Attributes of one train: vehicles, seed, DOFs, step, status, simulated time.

        Args:
            train: Index of the train.

        Raises:
            InputError: There is no such train.
        """
        return {key: _plain(value) for key, value in self[f"trains/{train:03d}"].attrs.items()}

    def scenario_of(self, train: int) -> Scenario:
        """The scenario of one train of an ensemble, by itself.

        Args:
            train: Index of the train.
        """
        return self.scenario.members[train]

    def group(self, name: str, train: int = 0) -> dict[str, NDArray[Any]]:
        """All of one group in memory.

        Args:
            name: ``"wheel"``, ``"body"``, ``"irregularity"``.
            train: Index of the train.

        Returns:
            Arrays by name: ``time`` [s] (n,), ``position`` [m] (n,), labels, and channels (n, ...).

        Raises:
            InputError: There is no such train or group.
        """
        return {key: _array(dataset) for key, dataset in self[f"trains/{train:03d}/{name}"].items()}

    def wheel(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Contact of every wheel; channels have shape (time, wheelset, side)."""
        return self.group("wheel", train)

    def body(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Motion of every body; channels have shape (time, body, dof)."""
        return self.group("body", train)

    def irregularity(self, train: int = 0) -> dict[str, NDArray[Any]]:
        """Irregularity as felt at every wheel; channels have shape (time, wheelset, side)."""
        return self.group("irregularity", train)

    def metrics(self, train: int | None = None) -> Metrics:
        """Indices of the standards (docs/indices.md).

        Args:
            train: Index of one train; all if None.

        Raises:
            InputError: No such train, or the file lacks what the indices need.
        """
        from tiengine.metrics import evaluate  # filters and vehicles: not for those who only read

        return evaluate(self, train)

    def close(self) -> None:
        """Close the file; arrays taken from it stay."""
        self._file.close()


def open(path: Path | str) -> Result:
    """Open a result file.

    Args:
        path: The file.

    Returns:
        The result; nothing but its header has been read.

    Raises:
        InputError: There is no such file, it is not a result of this program, or its format is another one.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file")
    try:
        file = h5py.File(path, "r")
    except OSError:
        raise InputError(f"{path}: not a tiengine result (not an HDF5 file, or damaged)") from None
    if file.attrs.get("format") != FORMAT:
        file.close()
        raise InputError(f"{path}: not a tiengine result (HDF5, but its attribute format is not {FORMAT!r})")
    version = file.attrs.get("format_version")
    if version != FORMAT_VERSION:
        file.close()
        raise InputError(f"{path}: format_version = {version}: this program reads {FORMAT_VERSION}")
    return Result(file, str(path))


def _array(dataset: Any) -> NDArray[Any]:
    """Contents of a dataset, texts as Python strings."""
    if h5py.check_string_dtype(dataset.dtype):
        return np.array(dataset.asstr()[()])
    return np.array(dataset[()])


def _plain(value: Any) -> Any:
    """An attribute as a Python value."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value
