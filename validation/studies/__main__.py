"""Command line ``python -m validation.studies``: experiments that take minutes, as JSON."""

from __future__ import annotations

import json
from pathlib import Path

import click

FOLDER = click.argument("folder", type=click.Path(path_type=Path))


@click.group()
def main() -> None:
    """Experiments on studies; each writes to a new FOLDER and prints what it found."""


@main.command()
@FOLDER
@click.option("--trains", default=1000, show_default=True)
@click.option("--workers", default=2, show_default=True)
def throughput(folder: Path, trains: int, workers: int) -> None:
    """Run trains of 20 m as an ensemble and as a study."""
    from validation.studies.throughput import measure

    click.echo(json.dumps(measure(folder, trains, workers), indent=1))


@main.command()
@FOLDER
@click.option("--kills", default=20, show_default=True)
def kills(folder: Path, kills: int) -> None:
    """Kill a study at random instants and resume it."""
    from validation.studies.kills import measure

    click.echo(json.dumps(measure(folder, kills), indent=1))


@main.command()
@FOLDER
def hosts(folder: Path) -> None:
    """Run a study on Dask workers in network namespaces, one killed, one cut off (needs root on Linux)."""
    from validation.studies.hosts import measure

    click.echo(json.dumps(measure(folder), indent=1))


main()
