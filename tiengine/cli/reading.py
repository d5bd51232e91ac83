"""Commands that read results: ``tiengine info``, ``metrics``, ``plot``, ``report``, ``export``; none imports Taichi."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tiengine.cli.screen import print_rows, show
from tiengine.figures.catalogue import COMPARE, names
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import parse_toml
from tiengine.result_files.summary import SUMMARY, summary

if TYPE_CHECKING:
    from tiengine.indices.metrics import Metrics
    from tiengine.vehicle.connector import VehicleClass

__all__ = ["COMMANDS"]

CLASSES = ("coach", "locomotive", "freight")
TEXT_FILES = (".csv", ".txt")


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
@click.option("--class", "vehicle_class", type=click.Choice(CLASSES), help="Class of the vehicles, for their limits.")
@click.option("--column", "columns", multiple=True, metavar="SIGNAL=COLUMN", help="Column of a text file; repeatable.")
@click.option("--rate", type=float, help="Samples per second of a text file [Hz]; default: its column time.")
@click.option("--speed", type=float, help="Speed in a text file [km/h]; default: from its column position.")
@click.option("--static-load", type=float, help="Static wheel load [kN], for wheel forces of a text file.")
@click.option("--run-in", type=float, help="Distance that is left out at the start of a text file [m].")
def metrics(
    file: Path,
    train: int | None,
    output: Path | None,
    vehicle_class: VehicleClass | None,
    columns: Sequence[str],
    **measured: float | None,
) -> None:
    """Evaluate the indices of EN 14363, GB/T 5599, EN 12299 and ISO 2631, with their limits.

    FILE is a result, or a text file (.csv, .txt) of measured signals (docs/indices.md).
    """
    from tiengine.report import metrics_table
    from tiengine.result_files.output_file import check_output

    if output is not None:
        check_output(output, force=True)
    if file.suffix.lower() in TEXT_FILES:
        if train is not None:
            raise InputError(f"--train: {file} holds the signals of one vehicle")
        found = _measured_metrics(file, columns, vehicle_class, **measured)
    else:
        found = _recorded_metrics(file, train, vehicle_class, columns, measured)
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
    help="File to write, ending in .csv, .parquet or .mat, or .pvd for ParaView.",
)
@click.option("--train", type=click.IntRange(0), default=0, show_default=True, help="Index of the train.")
@click.option("--channel", "channels", multiple=True, help="GROUP or GROUP/CHANNEL; can be repeated; default: wheel.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def export(file: Path, output: Path, train: int, channels: Sequence[str], force: bool) -> None:
    """Export channels of a result FILE to CSV, Parquet or MATLAB, or the scene to VTK (docs/results.md)."""
    from tiengine import result as results

    if output.suffix == ".pvd":
        from tiengine.figures.vtk_series import write_vtk
        from tiengine.result_files.output_file import check_output

        check_output(output, force)
        with results.open(file) as result:
            click.echo(f"{output}: {write_vtk(result, output, train)} snapshots")
        return
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


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Ends in .gif, .mp4 or .html; default: FILE.gif; replaced."
)
@click.option("--train", type=click.IntRange(0), default=0, show_default=True, help="Index of the train.")
@click.option("--fps", type=int, default=20, show_default=True, help="Frames a second.")
@click.option("--enlarged", type=float, default=500.0, show_default=True, help="Factor on deflections.")
def animate(file: Path, output: Path | None, train: int, fps: int, enlarged: float) -> None:
    """Show the train of a result FILE over its window: deflections, wheels that lift, forces as bars."""
    from tiengine import result as results
    from tiengine.figures import animation

    path = output or file.with_suffix(".gif")
    with results.open(file) as result:
        frames = animation.animate(result, path, train, fps=fps, enlarged=enlarged)
    click.echo(f"{path}: {frames} frames")


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


def _recorded_metrics(
    file: Path,
    train: int | None,
    vehicle_class: VehicleClass | None,
    columns: Sequence[str],
    measured: dict[str, float | None],
) -> Metrics:
    """Indices of a result file, to which options of text files do not apply."""
    from tiengine import result as results

    given = [name for name, value in {"column": columns or None, **measured}.items() if value is not None]
    if given:
        raise InputError(f"--{given[0].replace('_', '-')}: only for text files ({', '.join(TEXT_FILES)}), not {file}")
    with results.open(file) as result:
        return result.metrics(train, vehicle_class=vehicle_class)


def _measured_metrics(
    file: Path,
    columns: Sequence[str],
    vehicle_class: VehicleClass | None,
    *,
    rate: float | None,
    speed: float | None,
    static_load: float | None,
    run_in: float | None,
) -> Metrics:
    """Indices of measured signals."""
    from tiengine.indices.measured_ride import measured_ride
    from tiengine.indices.metrics import Metrics, train_metrics

    pairs = [entry.partition("=") for entry in columns]
    for signal, sign, column in pairs:
        if not sign or not signal.strip() or not column.strip():
            raise InputError(f"--column {signal}{sign}{column}: must be SIGNAL=COLUMN")
    for name, value in (("rate", rate), ("speed", speed), ("static-load", static_load)):
        if value is not None and not 0.0 < value < math.inf:
            raise InputError(f"--{name} {value:g}: must be a finite number > 0")
    if run_in is not None and not 0.0 <= run_in < math.inf:
        raise InputError(f"--run-in {run_in:g}: must be a finite number >= 0")
    ride = measured_ride(
        file,
        {signal.strip(): column.strip() for signal, _, column in pairs},
        rate=rate,
        speed=None if speed is None else speed / 3.6,
        run_in=run_in or 0.0,
        static_load=None if static_load is None else 1e3 * static_load,
        vehicle_class=vehicle_class,
    )
    return Metrics(str(file), (train_metrics(ride),), {})


COMMANDS = (info, metrics, plot, animate, report, export)
"""Added to the group of :mod:`tiengine.cli.commands`."""
