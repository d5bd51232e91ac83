"""Output of tables on the screen or into a pipe."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import click
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.table import Table

__all__ = ["PIPE_WIDTH", "print_rows", "show"]

PIPE_WIDTH = 120  # columns if there is no terminal


def print_rows(rows: Sequence[tuple[str, str]]) -> None:
    """Print two columns, wrapped on a terminal; one line per row into a pipe."""
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


def show(content: RenderableType) -> None:
    """Print to stdout in the width of the terminal."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=PIPE_WIDTH)
    console.print(content)
