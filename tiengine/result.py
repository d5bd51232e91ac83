"""Results as a user holds them: the reader of a file with its scenario, its indices and xarray datasets.

Scenarios, indices and xarray are imported when first used: opening a file needs none of them.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tiengine.result_files.reader import Reader, open_file

if TYPE_CHECKING:
    import xarray

    from tiengine.indices.metrics import Metrics
    from tiengine.scenario.scenario import Scenario
    from tiengine.vehicle.connector import VehicleClass

__all__ = ["Result", "open"]


class Result(Reader):
    """A result file, open for reading; use as a context manager or :meth:`close` it."""

    @classmethod
    def of(cls, reader: Reader) -> Result:
        """Take over the open file of a reader, as a writer leaves it.

        Args:
            reader: Not to be used any more.
        """
        return cls(reader.file, reader.name)

    @property
    def scenario(self) -> Scenario:
        """The scenario that was run."""
        from tiengine.scenario.recorded import recorded_scenario

        return recorded_scenario(self)

    def scenario_of(self, train: int) -> Scenario:
        """The scenario of one train of an ensemble, by itself.

        Args:
            train: Index of the train.
        """
        return self.scenario.members[train]

    def to_xarray(self, group: str = "wheel", train: int | None = 0) -> xarray.Dataset:
        """One group as an xarray dataset with its coordinates, units and names.

        Args:
            group: ``"wheel"``, ``"body"``, ``"gauges/bridge"``.
            train: Index of the train: channels are read when asked for, while this result is open. None stacks all
                trains in memory, along the dimension ``train``.

        Raises:
            InputError: No such train or group, trains that cannot be stacked, or xarray is missing.
        """
        from tiengine.result_files.xarray_datasets import open_dataset, stacked_dataset

        if train is None:
            return stacked_dataset(self, self.file, group)
        return open_dataset(self, self.file, group, train)

    def metrics(self, train: int | None = None, *, vehicle_class: VehicleClass | None = None) -> Metrics:
        """Indices of the standards (docs/indices.md).

        Args:
            train: Index of one train; all if None.
            vehicle_class: ``"coach"``, ``"locomotive"`` or ``"freight"``, instead of what the vehicles' data state.

        Raises:
            InputError: No such train, or the file lacks what the indices need.
        """
        from tiengine.indices.metrics import evaluate

        return evaluate(self, train, vehicle_class)


def open(path: Path | str) -> Result:
    """Open a result file.

    Args:
        path: The file.

    Returns:
        The result; nothing but its header has been read.

    Raises:
        InputError: There is no such file, it is not a result of this program, or its format is another one.
    """
    return Result(open_file(path), str(path))
