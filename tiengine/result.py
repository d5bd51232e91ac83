"""Public class of a result file: reader, scenario, indices and xarray datasets.

Scenarios, indices and xarray are imported when first used: opening a file needs none of them.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from tiengine.result_files.reader import Reader, open_file

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from tiengine.indices.metrics import Metrics
    from tiengine.scenario.scenario import Scenario
    from tiengine.vehicle.connector import VehicleClass

__all__ = ["Result", "open"]


class Result(Reader):
    """A result file, open for reading; use as a context manager or :meth:`close` it."""

    @classmethod
    def of(cls, reader: Reader) -> Result:
        """Result that takes over the open file of a reader.

        Args:
            reader: Reader returned by a writer; must not be used afterwards.
        """
        return cls(reader.file, reader.name)

    def _repr_html_(self) -> str:
        """Table for notebooks: size, times and failures of the run."""
        from tiengine.parameters.html_rows import html_rows
        from tiengine.result_files.summary import summary

        rows = [("result", self.name), ("status", str(self.attributes.get("status", ""))), *summary(self.attributes)]
        return html_rows([*rows, *((f"train {train}", why) for train, why in list(self.failures.items())[:20])])

    def plot(self, kind: str, train: int = 0, *, other: Result | None = None) -> Figure:
        """Draw a figure, which a notebook shows; its ``savefig`` writes it to a file.

        Args:
            kind: Kind of figure, as of ``tiengine plot``: ``"forces"``, ``"envelopes"``, ``"waterfall"``, ...
            train: Index of the train.
            other: Second result, for the kind ``"compare"``.

        Raises:
            InputError: There is no such kind, or the file lacks what it shows.
        """
        catalogue = import_module("tiengine.figures.catalogue")  # figures stand above results, which only name them
        arguments = (train,) if other is None else (other, train)
        figure: Figure = catalogue.kind_named(kind).draw(self, *arguments)
        return figure

    @property
    def scenario(self) -> Scenario:
        """Scenario that was run."""
        from tiengine.scenario.recorded import recorded_scenario

        return recorded_scenario(self)

    def scenario_of(self, train: int) -> Scenario:
        """Scenario of one train of an ensemble.

        Args:
            train: Index of the train.
        """
        return self.scenario.members[train]

    def to_xarray(self, group: str = "wheel", train: int | None = 0) -> xarray.Dataset:
        """Group as an xarray dataset with coordinates, units and names.

        Args:
            group: Name of the group, for example ``"wheel"``, ``"body"`` or ``"gauges/bridge"``.
            train: Index of the train; channels are read on access, while this result is open. None stacks all trains
                in memory along the dimension ``train``.

        Raises:
            InputError: There is no such train or group, the trains cannot be stacked, or xarray is missing.
        """
        from tiengine.result_files.xarray_datasets import open_dataset, stacked_dataset

        if train is None:
            return stacked_dataset(self, self.file, group)
        return open_dataset(self, self.file, group, train)

    def metrics(self, train: int | None = None, *, vehicle_class: VehicleClass | None = None) -> Metrics:
        """Indices defined by standards (docs/indices.md).

        Args:
            train: Index of one train; None evaluates all.
            vehicle_class: ``"coach"``, ``"locomotive"`` or ``"freight"``, instead of what the vehicles' data state.

        Raises:
            InputError: There is no such train, or the file lacks channels that the indices need.
        """
        from tiengine.indices.metrics import evaluate

        return evaluate(self, train, vehicle_class)


def open(path: Path | str) -> Result:
    """Open a result file.

    Args:
        path: Result file.

    Returns:
        The open result; only its header has been read.

    Raises:
        InputError: The file does not exist, is not a result of this program, or has an unknown format version.
    """
    return Result(open_file(path), str(path))
