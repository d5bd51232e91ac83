"""Key figures of a train as columns of a table: names that every program reads, values as numbers."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

from tiengine.indices.key_figures import key_figures
from tiengine.indices.metrics import evaluate
from tiengine.indices.train_record import Train
from tiengine.parameters.errors import InputError
from tiengine.result_files.reader import COMPLETE, Reader

__all__ = ["column_name", "figures_of"]


def figures_of(result: Reader, *, indices: bool = False) -> dict[int, dict[str, float | None]]:
    """Key figures of the complete trains of a result; those whose data are missing are left out.

    Args:
        result: An open file.
        indices: Whether the indices of the standards are evaluated too.

    Returns:
        Values by column and by the index of the train.
    """
    complete = [train for train in range(result.trains) if result.status(train) == COMPLETE]
    found = {
        train: {column_name(each.name, each.unit): _number(each.value) for each in key_figures(Train(result, train))}
        for train in complete
    }
    if not indices or not complete:
        return found
    try:
        metrics = evaluate(result)
    except InputError:  # too short, or channels are missing
        return found
    for each in metrics.trains:
        spread = replace(metrics, trains=(each,)).spread(by_vehicle=False)
        rows = ((i.worst, i.worst.value) for i in spread)
        found[each.train] |= {column_name(f"{i.standard} {i.name}", i.unit): _number(value) for i, value in rows}
    return found


def column_name(name: str, unit: str) -> str:
    """Name of a column: letters, digits and underscores, with the unit at its end.

    Args:
        name: Name of a quantity.
        unit: Its unit.
    """
    words = re.sub(r"\W+", "_", f"{name} {'' if unit in ('-', '1', '') else unit}", flags=re.ASCII)
    return words.strip("_")


def _number(value: Any) -> float | None:
    """Number for JSON, which has no infinity."""
    return None if value is None or value != value or abs(value) == float("inf") else float(value)
