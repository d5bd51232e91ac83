"""Tidy table of a study: one row a train, with its factors, its key figures, and the reason if it failed."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.optional_packages import needed_by
from tiengine.result_files.export import replacing
from tiengine.result_files.output_file import check_output
from tiengine.result_files.reader import COMPLETE
from tiengine.study.folder import Folder

__all__ = ["Table", "read_table"]

SUFFIXES = (".csv", ".parquet")


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of the trains that are done, in the order of their numbers.

    Attributes:
        factors: Names of the factors, which are columns.
        figures: Names of the key figures, which are columns of numbers; NaN where a train has none.
        columns: Columns by name, each of shape (trains,).
    """

    factors: tuple[str, ...]
    figures: tuple[str, ...]
    columns: dict[str, NDArray[Any]]

    def __len__(self) -> int:
        """Number of trains that are done."""
        return len(self.columns["train"])

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Column.

        Raises:
            InputError: There is no such column; the message names the nearest one.
        """
        if name not in self.columns:
            raise InputError(f"table: no column {name!r}{nearest(name, list(self.columns))}")
        return self.columns[name]

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Whether each train has run its whole distance, shape (trains,)."""
        return np.asarray(self.columns["status"] == COMPLETE)

    def values(self, figure: str) -> Reals:
        """Values of a key figure of the trains that have one, shape (trains,).

        Args:
            figure: Its name.

        Raises:
            InputError: There is no such figure, or no train has it.
        """
        if figure not in self.figures:
            raise InputError(f"table: no key figure {figure!r}{nearest(figure, list(self.figures))}")
        found = self.columns[figure][self.complete]
        found = found[np.isfinite(found)]
        if not len(found):
            raise InputError(f"table: no train has a value of {figure!r}")
        return np.asarray(found, np.float64)

    def write(self, path: Path | str) -> None:
        """Write the table to a file, which it replaces.

        Args:
            path: Ends in ``.csv`` or ``.parquet``.

        Raises:
            InputError: The suffix is another one, a package is missing, or the file cannot be written.
        """
        path = Path(path)
        if path.suffix not in SUFFIXES:
            raise InputError(f"output = '{path}': must end in {', '.join(SUFFIXES)}")
        check_output(path, force=True)
        if path.suffix == ".parquet":
            with needed_by(f"output = '{path}'"):
                import pyarrow as pa
                from pyarrow import parquet
            columns = {name: pa.array(_plain(column)) for name, column in self.columns.items()}
            with replacing(path) as temporary:
                parquet.write_table(pa.table(columns), temporary)
            return
        with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self.columns)
            rows = zip(*(_plain(column) for column in self.columns.values()), strict=True)
            writer.writerows(["" if value is None else value for value in row] for row in rows)


def read_table(folder: Folder) -> Table:
    """Table of a study, also of one that is not complete yet.

    Args:
        folder: Its folder.
    """
    design = folder.design
    rows: list[dict[str, Any]] = []
    for record in folder.records():
        for place, train in enumerate(record["trains"]):
            member = design.members[train["member"]]
            rows.append(
                {
                    "train": member.number,
                    "point": member.point,
                    "seed": member.seed,
                    **design.values(member.number),
                    "status": train["status"],
                    "part": record["task"],
                    "train_in_part": place,
                    "simulated_time_s": train.get("simulated_time"),
                    "wall_time_of_part_s": record["wall"],
                    **{f"\0{name}": value for name, value in train["figures"].items()},
                }
            )
    rows.sort(key=lambda row: row["train"])
    own = ["train", "point", "seed", *design.factors, "status", "part", "train_in_part", "simulated_time_s"]
    figures = list(dict.fromkeys(name for row in rows for name in row if name.startswith("\0")))
    columns = {name: _column([row.get(name) for row in rows]) for name in (*own, "wall_time_of_part_s")}
    columns |= {name[1:]: np.array([_real(row.get(name)) for row in rows]) for name in figures}
    return Table(tuple(design.factors), tuple(name[1:] for name in figures), columns)


def _column(values: Sequence[Any]) -> NDArray[Any]:
    """Numbers where all values are numbers, otherwise objects."""
    if values and all(isinstance(value, bool) for value in values):
        return np.array(values, np.bool_)
    if values and all(isinstance(value, int) and not isinstance(value, bool) for value in values):
        return np.array(values, np.int64)
    if values and all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return np.array(values, np.float64)
    found = np.empty(len(values), object)
    found[:] = values
    return found


def _real(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _plain(column: NDArray[Any]) -> list[Any]:
    """Python values; texts where kinds are mixed, None where there is no number."""
    if column.dtype != object:
        return [None if value != value else value for value in column.tolist()]
    kinds = {type(value) for value in column if value is not None}
    return [value if value is None or len(kinds) == 1 else str(value) for value in column]
