"""Table of the indices on screen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table

from tiengine.indices.by_car import Cell, by_car
from tiengine.indices.index import Index
from tiengine.indices.metrics import Metrics
from tiengine.indices.ride import LEAST_DISTANCE

__all__ = ["metrics_table", "notes", "place"]

COLOURS = {"within": "green", "over": "bold red", "none": "dim"}


def metrics_table(metrics: Metrics) -> RenderableType:
    """Build a table of one train's indices, or of the worst and the median over several trains, with notes below it.

    Of a train of several vehicles it shows the worst one, and a second table all vehicles.
    """
    spread = metrics.spread(by_vehicle=False)
    several = len(metrics.trains) > 1
    table = Table(box=None, pad_edge=False)
    table.add_column("index", overflow="fold")
    table.add_column("worst at", overflow="fold")
    for name in ("value", "limit", "unit"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("kind", no_wrap=True)
    if several:
        table.add_column("median", justify="right")
        table.add_column("train", justify="right")
    table.add_column("clause", overflow="fold")
    heading = ""
    for each in spread:
        index = each.worst
        if index.standard != heading:
            heading = index.standard
            table.add_row(f"[bold]{escape(heading)}[/bold]")
        row = [f"  {index.name}", place(index, metrics), _number(index.value), _number(index.limit), index.unit]
        extra = [_number(each.median), str(each.train)] if several else []
        verdict = f"{index.verdict} ({each.over} of {each.trains} over)" if each.over and several else index.verdict
        colour = COLOURS[index.verdict]
        table.add_row(
            *map(escape, row), f"[{colour}]{verdict}[/{colour}]", index.kind, *map(escape, extra), escape(index.clause)
        )
    by_vehicle = (_by_vehicle(metrics), "") if metrics.vehicles > 1 else ()
    return Group(table, "", *by_vehicle, *map(escape, notes([each.worst for each in spread], metrics)))


def place(index: Index, metrics: Metrics) -> str:
    """Name the place of an index, and in a train of several vehicles its vehicle."""
    if metrics.vehicles == 1 or index.value is None:
        return index.place
    return f"{index.place}, vehicle {index.vehicle}"


def _by_vehicle(metrics: Metrics) -> Table:
    """Build the table by vehicle; wheels in brackets are the worst ones, bold values the worst of the train."""
    columns = by_car(metrics.vehicles, metrics.spread())
    table = Table(box=None, pad_edge=False)
    table.add_column("vehicle", justify="right")
    for column in columns:
        table.add_column(f"{column.heading} [{column.unit}]".replace("[", r"\["), justify="right")
    for number, cells in enumerate(zip(*(column.cells for column in columns), strict=True), start=1):
        table.add_row(str(number), *map(_cell, cells))
    return table


def _cell(cell: Cell) -> str:
    wheel = cell.place.removeprefix("wheelset ") if cell.place.startswith("wheelset ") else ""
    style = COLOURS["over"] if cell.verdict == "over" else "bold" if cell.is_worst else "default"
    return f"[{style}]{_number(cell.value)}[/{style}]" + (f" ({escape(wheel)})" if wheel else "")


def notes(indices: Iterable[Index], metrics: Metrics) -> list[str]:
    """Collect the notes below a table of indices, each one once.

    Args:
        indices: The indices of the table.
        metrics: Metrics that they belong to, which know the trains left out.
    """
    found: dict[str, None] = {}
    for index in indices:
        if index.shortfall and metrics.vehicles == 1:
            found[f"{index.standard}: indices, not an assessment: {index.shortfall}"] = None
        elif index.shortfall and not any(line.startswith(f"{index.standard}: indices") for line in found):
            vehicle = f"vehicle {index.vehicle}: "
            found[f"{index.standard}: indices, not an assessment: {vehicle}{index.shortfall}"] = None
    for index in indices:
        if index.note:
            found[f"{index.standard}: {index.name}: {index.note}"] = None
    lines = [f"train {train} is left out: {why}" for train, why in metrics.failed.items()]
    return [*found, *_left_out(metrics), *lines]


def _left_out(metrics: Metrics) -> Iterator[str]:
    """Name the vehicles that the run of some train is too short for."""
    numbers = sorted({number for train in metrics.trains for number in train.left_out})
    if numbers:
        which = f"vehicle {numbers[0]} is" if len(numbers) == 1 else f"vehicles {numbers[0]} to {numbers[-1]} are"
        yield (
            f"{which} left out: the run ends before {LEAST_DISTANCE:g} m beyond the place where the run-in of the"
            " leading one ends; set a longer train.distance"
        )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
