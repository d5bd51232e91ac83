"""Commands that read results: ``tiengine info``, ``metrics``, ``plot``, ``report``, ``export``; none imports Taichi."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from tiengine.cli.screen import print_rows, show
from tiengine.figures.catalogue import COMPARE, names
from tiengine.parameters.input_files import parse_toml
from tiengine.result_files.summary import SUMMARY, summary

__all__ = ["COMMANDS"]


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
def info(file: Path) -> None:
    """Describe the contents and the origin of a result FILE."""
    from tiengine import result as results

    with results.open(file) as result:
        attributes = result.attributes
        scenario = parse_toml(result.scenario_toml, f"{file}: scenario")
        rows = [("scenario", str(scenario.get("name", "")))]
        for section, key in (("train", "vehicles"), ("train", "speed_kmh"), ("train", "distance")):
            table = scenario.get(section)
            rows.append((f"{section}.{key}", _text(table.get(key)) if isinstance(table, dict) else ""))
        hidden = {*SUMMARY, "scenario", "scenario_crc32"}
        rows += [(key, str(value)) for key, value in attributes.items() if key not in hidden]
        rows += summary(attributes)
        for train in range(result.trains):
            path = f"trains/{train:03d}"
            rows += [(f"{path}/{group}", content) for group, content in _groups(result[path])]
    print_rows(rows)


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--train", type=click.IntRange(0), help="Index of one train of an ensemble; default: summary of all.")
@click.option(
    "--json", "output", type=click.Path(path_type=Path), help="Also write all indices to this file, replacing it."
)
def metrics(file: Path, train: int | None, output: Path | None) -> None:
    """Evaluate the indices of EN 14363, GB/T 5599, EN 12299 and ISO 2631 for a result FILE, with their limits."""
    from tiengine import result as results
    from tiengine.report import metrics_table
    from tiengine.result_files.output_file import check_output

    if output is not None:
        check_output(output, force=True)
    with results.open(file) as result:
        found = result.metrics(train)
    if output is not None:
        output.write_text(found.to_json() + "\n", encoding="utf-8")
    show(metrics_table.metrics_table(found))


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    required=True,
    help="File to write, ending in .csv, .parquet or .mat.",
)
@click.option("--train", type=click.IntRange(0), default=0, show_default=True, help="Index of the train.")
@click.option("--channel", "channels", multiple=True, help="GROUP or GROUP/CHANNEL; can be repeated; default: wheel.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def export(file: Path, output: Path, train: int, channels: Sequence[str], force: bool) -> None:
    """Export channels of a result FILE to CSV, Parquet or MATLAB (docs/results.md)."""
    from tiengine import result as results
    from tiengine.result_files import export as exporting

    with results.open(file) as result:
        written = exporting.export(result, output, train=train, channels=channels, force=force)
    click.echo(f"{output}: {written}")


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.argument("kind", type=click.Choice(names()), required=False)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Figure to write (.png, .pdf, .svg), or a folder."
)
@click.option("--with", "other", type=click.Path(path_type=Path), help="Second result, for the kind compare.")
@click.option("--train", type=click.IntRange(0), default=0, show_default=True, help="Index of the train.")
def plot(file: Path, kind: str | None, output: Path | None, other: Path | None, train: int) -> None:
    """Draw one KIND of figure of a result FILE, or all available ones, as FILE_KIND.png; replaces existing figures."""
    from tiengine import result as results
    from tiengine.figures.files import draw_all, draw_one

    with ExitStack() as stack:
        result = stack.enter_context(results.open(file))
        second = stack.enter_context(results.open(other)) if other is not None else None
        if kind is None and second is None:
            for name, words in draw_all(result, output, train):
                click.echo(f"{name:<10}  {words}")
        else:
            click.echo(str(draw_one(result, kind or COMPARE.name, output, train, second)))


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Page to write, replacing it; default: FILE.html."
)
@click.option("--train", type=click.IntRange(0), help="Index of the train to draw; default: the first complete one.")
def report(file: Path, output: Path | None, train: int | None) -> None:
    """Write a self-contained HTML page of a result FILE: scenario, key figures, indices and figures."""
    from tiengine import result as results
    from tiengine.report import page as reporting

    path = output or file.with_suffix(".html")
    with results.open(file) as result:
        reporting.write(result, path, train)
    click.echo(str(path))


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def _groups(train: Any, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Name of each group of a train, with its number of samples and its channels."""
    for name, group in train.items():
        if not hasattr(group, "keys"):  # format version 1 has a dataset "time" here
            continue
        channels = {key: dataset for key, dataset in group.items() if "coordinates" in dataset.attrs}
        if channels:
            samples = next(iter(channels.values())).shape[0]
            yield f"{prefix}{name}", f"{samples} samples of {', '.join(channels)}"
        elif "event" in group:
            yield f"{prefix}{name}", f"{group['event'].shape[0]} events"
        else:
            yield from _groups(group, f"{prefix}{name}/")


COMMANDS = (info, metrics, plot, report, export)
"""Added to the group of :mod:`tiengine.cli.commands`."""
