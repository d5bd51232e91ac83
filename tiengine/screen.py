"""Words and values on the screen: what the commands of the command line share."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any

import click
from rich.console import Console
from rich.markup import escape
from rich.table import Table

__all__ = ["SUMMARY", "print_rows", "summary"]

SUMMARY = {
    "trains": ("trains", "{:d}"),
    "workers": ("worker processes (0: none but this one)", "{:d}"),
    "dofs": ("degrees of freedom", "{:d}"),
    "time_step": ("time step", "{:.3g} s"),
    "simulated_time": ("simulated time", "{:.3f} s"),
    "real_time_factor": ("real-time factor (wall over simulated time)", "{:.2f}"),
    "wall_time_import": ("wall time, import", "{:.2f} s"),
    "wall_time_jit": ("wall time, JIT", "{:.2f} s"),
    "wall_time_setup": ("wall time, set-up", "{:.2f} s"),
    "wall_time_loop": ("wall time, loop", "{:.2f} s"),
    "wall_time_writing": ("wall time, writing", "{:.2f} s"),
    "wall_time_total": ("wall time, all but import", "{:.2f} s"),
    "peak_memory": ("peak memory, all processes", "{:.0f} MB"),
}
"""Root attributes of a result that are shown: their words and format."""


def summary(attributes: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Size, step, speed and wall times of a run, from the root attributes of its result."""
    return [(words, _formatted(form, attributes[key])) for key, (words, form) in SUMMARY.items() if key in attributes]


def _formatted(form: str, value: Any) -> str:
    """A number as its form has it; what is none, as of a file that somebody changed, as it is."""
    try:
        return form.format(value)
    except (ValueError, TypeError):
        return str(value)


def print_rows(rows: Sequence[tuple[str, str]]) -> None:
    """Two columns; folded on a terminal, one line a row for a pipe."""
    if not sys.stdout.isatty():
        width = max((len(name) for name, _ in rows), default=0)
        for name, text in rows:
            click.echo(f"{name:<{width}}  {text}".rstrip())
        return
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    Console(highlight=False).print(table)
