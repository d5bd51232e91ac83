"""Table of a train by vehicle: the worst wheelset or floor point of each one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from tiengine.indices import comfort, en14363
from tiengine.indices.index import Verdict
from tiengine.indices.metrics import Spread
from tiengine.indices.wheel_extremes import ForceExtreme, WheelExtremes
from tiengine.parameters.conventions import SIDES

__all__ = ["Cell", "Column", "by_car"]

COLUMNS = (
    ("Y/Q", en14363.STANDARD, "Y/Q, 2 m mean"),
    ("ΣY", en14363.STANDARD, "sum of Y, 2 m mean"),
    ("lateral acceleration", en14363.STANDARD, "lateral acceleration"),
    ("vertical acceleration", en14363.STANDARD, "vertical acceleration"),
    ("mean comfort", comfort.EN, "mean comfort N_MV"),
    ("weighted rms", comfort.ISO, "weighted rms, total"),
)
"""Heading, standard and name of the indices in the table."""


@dataclass(frozen=True)
class Cell:
    """Worst value of one vehicle.

    Attributes:
        value: Value; None if there is none.
        place: Wheelset, wheel or floor point.
        verdict: Verdict of an index.
        is_worst: Whether no other vehicle is worse.
    """

    value: float | None = None
    place: str = ""
    verdict: Verdict = "none"
    is_worst: bool = False


@dataclass(frozen=True)
class Column:
    """One quantity of all vehicles.

    Attributes:
        heading: Name of the quantity.
        unit: Unit.
        cells: Vehicle by vehicle from the leading one.
    """

    heading: str
    unit: str
    cells: tuple[Cell, ...]


def by_car(vehicles: int, spread: Iterable[Spread], extremes: Sequence[WheelExtremes] = ()) -> list[Column]:
    """Arrange the worst values by vehicle; quantities that no vehicle has are left out.

    Args:
        vehicles: Number of vehicles.
        spread: Indices over all trains, vehicle by vehicle.
        extremes: Extremes of the wheel forces of each train, of which the worst is taken.
    """
    found = [
        _force("largest Q", vehicles, extremes, [each.largest for each in extremes], 1.0),
        _force("smallest Q", vehicles, extremes, [each.smallest for each in extremes], -1.0),
        _force("largest |Y|", vehicles, extremes, [each.lateral for each in extremes], 1.0),
    ]
    indices = {(each.worst.standard, each.worst.name, each.worst.vehicle): each.worst for each in spread}
    for heading, standard, name in COLUMNS:
        rows = [indices.get((standard, name, v + 1)) for v in range(vehicles)]
        unit = next((index.unit for index in rows if index), "")
        cells = [Cell(i.value, i.place, i.verdict) if i and i.value is not None else Cell() for i in rows]
        found.append(_marked(heading, unit, cells, 1.0))
    return [column for column in found if any(cell.value is not None for cell in column.cells)]


def _force(
    heading: str, vehicles: int, extremes: Sequence[WheelExtremes], forces: Sequence[ForceExtreme], sign: float
) -> Column:
    """Largest (sign 1) or smallest (sign -1) force of each vehicle over all trains [kN]."""
    cells = [Cell()] * vehicles
    for each, force in zip(extremes, forces, strict=True):
        for v in range(vehicles):
            wheelsets = np.flatnonzero(each.vehicle == v)
            if not len(wheelsets):  # a shorter train of the ensemble
                continue
            values = sign * np.nan_to_num(force.value[wheelsets], nan=-sign * np.inf)
            w, side = np.unravel_index(int(np.argmax(values)), values.shape)
            known, value = cells[v].value, 1e-3 * sign * float(values[w, side])
            if np.isfinite(value) and (known is None or sign * value > sign * known):
                cells[v] = Cell(value, f"wheelset {wheelsets[w] + 1} {SIDES[side]}")
    return _marked(heading, "kN", cells, sign)


def _marked(heading: str, unit: str, cells: Sequence[Cell], sign: float) -> Column:
    """Mark the cell that no other one exceeds, or falls below if the sign is negative."""
    worst = max((sign * cell.value for cell in cells if cell.value is not None), default=None)
    marked = (
        Cell(cell.value, cell.place, cell.verdict, cell.value is not None and sign * cell.value == worst)
        for cell in cells
    )
    return Column(heading, unit, tuple(marked))
