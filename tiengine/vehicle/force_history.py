"""Given forces on bodies over time or chainage, from a file or rows of the scenario."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import LARGEST_TRACK, numbers_of, read_text_file
from tiengine.parameters.quantity import Params, Q
from tiengine.vehicle.given_loads import GivenLoads, no_loads
from tiengine.vehicle.train import MOTIONS, TrainModel

__all__ = ["BodyForce", "ForceLoads"]

Row = tuple[Annotated[float, Q("s", ge=-1e7, le=1e7)], Annotated[float, Q("N", ge=-1e9, le=1e9)]]


class BodyForce(Params):
    """Force or moment on a body over time or chainage, linear between rows; the first and last hold beyond them.

    `y` to the right, `z` down, about the centre of gravity; moments turn right-handed about x forward (`roll`), y
    (`pitch`) and z (`yaw`). A file has two columns, time [s] or chainage [m] and force [N] or moment [N m]
    (docs/files.md).
    """

    vehicle: Annotated[int, Q("-", "vehicle, counted from the front from 1", ge=1, le=64)] = 1
    body: Annotated[str, Field(description="name of its body", max_length=200)] = "car"
    motion: Annotated[Literal["y", "z", "roll", "pitch", "yaw"], Field(description="coordinate that it acts on")]
    over: Annotated[
        Literal["time", "chainage"], Field(description="first column: time since the start, or chainage of the body")
    ] = "time"
    rows: Annotated[
        tuple[Row, ...], Field(description="rows [s or m, N or N m], instead of a file", max_length=100_000)
    ] = ()
    file: Annotated[str | None, Field(description="file of such rows, relative to the scenario", max_length=4096)] = (
        None
    )
    scale: Annotated[float, Q("-", "factor on all forces", ge=-1e6, le=1e6)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> BodyForce:
        if bool(self.rows) == (self.file is not None):
            raise InputError("train.forces.rows: must be given, or train.forces.file, and not both")
        if self.rows:
            check_rows(np.array(self.rows, np.float64), "train.forces.rows")
        return self

    def table(self, where: str) -> Reals:
        """Rows, shape (n, 2), from the scenario or the file.

        Args:
            where: Names the entry in messages.

        Raises:
            InputError: The file breaks a rule.
        """
        if self.file is None:
            return np.array(self.rows, np.float64)
        name = f"{where}.file = {self.file!r}"
        rows: list[list[float]] = []
        for number, line in enumerate(read_text_file(self.file, name, LARGEST_TRACK).splitlines(), start=1):
            cells = line.replace(",", " ").replace(";", " ").split()
            if not cells or cells[0].startswith(("#", "%")):
                continue
            values = numbers_of(cells)
            if values is None and not rows:
                continue  # heads
            if values is None or len(values) != 2 or not np.isfinite(values).all():
                raise InputError(f"{name}: line {number}: must be two numbers")
            rows.append(list(values))
        table = np.array(rows, np.float64).reshape(-1, 2)
        check_rows(table, name)
        return table


def check_rows(table: Reals, where: str) -> None:
    """Refuse fewer than two rows, and first numbers that do not rise.

    Args:
        table: Shape (n, 2).
        where: Names it in messages.
    """
    if len(table) < 2:
        raise InputError(f"{where}: {len(table)} rows; must be two or more")
    falls = np.flatnonzero(np.diff(table[:, 0]) <= 0.0)
    if falls.size:
        raise InputError(f"{where}: first number {table[falls[0] + 1, 0]:g} must be larger than that of the row before")


class ForceLoads:
    """Given loads from histories of forces.

    Attributes:
        sets: 1: the same for all trains that are advanced together.
    """

    sets = 1

    def __init__(self, forces: Sequence[BodyForce], places: Sequence[tuple[int, float]], train: TrainModel) -> None:
        """Read all files.

        Args:
            forces: Entries of the scenario.
            places: First coordinate of each body in the train, and its x from the first vehicle's centre [m].
            train: The train.

        Raises:
            InputError: A file breaks a rule.
        """
        self._train = train
        self._histories = [
            (dof + MOTIONS.index(force.motion), x, force.over, force.scale, force.table(f"train.forces[{i}]"))
            for i, (force, (dof, x)) in enumerate(zip(forces, places, strict=True))
        ]

    def __call__(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> GivenLoads:
        """Forces at the moments."""
        loads = no_loads(self._train, len(x))
        for dof, offset, over, scale, table in self._histories:
            loads.force[0, :, dof] += scale * np.interp(time if over == "time" else x + offset, *table.T)
        return loads
