"""Command line: ``tiengine run``, ``profile``, ``contact``, ``metrics``, ``list``, ``info``.

Bad input ends with one line on stderr and exit status 2, a run that fails on its way with status 1. Taichi is imported
only by ``run`` and ``profile``, so that the others answer at once.
"""

from __future__ import annotations

import os
import signal
import sys
import time
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from tiengine.presets import KINDS, preset_names, preset_source
from tiengine.quantity import InputError

__all__ = ["main"]

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


class _Commands(click.Group):
    """Turns bad input into one line and exit status 2."""

    def invoke(self, context: click.Context) -> Any:
        """Run the command."""
        try:
            return super().invoke(context)
        except InputError as error:
            click.echo(f"error: {' '.join(str(error).split())}", err=True)
            context.exit(2)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="tiengine", message="%(prog)s %(version)s")
def main() -> None:
    """Moving train-slab-track interaction in three dimensions."""
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")


@main.command()
@click.argument("scenario")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Result file; default: the scenario's name.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change a key: train.speed_kmh=300")
@click.option("--workers", type=click.IntRange(1), help="Processes for an ensemble; default: one a core.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
@click.option("--force", is_flag=True, help="Replace an existing result file.")
def run(
    scenario: str, output: Path | None, settings: Sequence[str], workers: int | None, quiet: bool, force: bool
) -> None:
    """Simulate SCENARIO, the name of a built-in one or the path of a TOML file: one train or an ensemble."""
    from tiengine.scenario import load_scenario

    resolved = load_scenario(scenario, settings)
    path = output or Path(f"{Path(resolved.name).name}.h5")

    from tiengine.writer import check_output

    check_output(path, force)

    from tiengine import simulate
    from tiengine.events import RunFailedError

    console = Console(stderr=True, quiet=quiet)
    try:
        with _ended_by_sigterm(), _progress(console, resolved.name) as progress:
            result = simulate.run(resolved, path, force=force, progress=progress, workers=workers)
    except RunFailedError as failure:
        click.echo(f"run failed: {failure}; {path} holds what was computed until then", err=True)
        raise SystemExit(1) from None
    with result:
        if not quiet:
            _print_rows([*_summary(result.attributes), ("result", str(path))])
        failures = result.failures
    for train, why in failures.items():
        click.echo(f"train {train} failed: {why}", err=True)
    if failures:
        raise SystemExit(1)


@main.command()
@click.argument("scenario", default="paper")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change a key: train.speed_kmh=300")
@click.option("--trains", type=click.IntRange(1), help="Trains advanced together; default: the scenario's.")
@click.option("--seconds", type=float, default=1.0, show_default=True, help="Simulated time to measure.")
@click.option("--steps", type=click.IntRange(2), help="Steps to measure instead.")
@click.option("--json", "file", type=click.Path(path_type=Path), help="Write the report here too, replacing a file.")
@click.option("--compare", nargs=2, type=click.Path(path_type=Path), help="Set two such files side by side instead.")
def profile(
    scenario: str,
    settings: Sequence[str],
    trains: int | None,
    seconds: float,
    steps: int | None,
    file: Path | None,
    compare: tuple[Path, Path] | None,
) -> None:
    """Measure where the time of SCENARIO's loop goes, stage by stage, in this process."""
    from tiengine import profile_report, profile_tables

    if compare:
        reports = [profile_report.read_json(path) for path in compare]
        comparison = profile_report.compare(*reports)
        profile_tables.show(profile_tables.comparison_table(comparison, [str(path) for path in compare]))
        return

    from tiengine.scenario import load_scenario

    resolved = load_scenario(scenario, settings)
    if file is not None:
        from tiengine.writer import check_output

        check_output(file, force=True)

    from tiengine import profiling
    from tiengine.events import RunFailedError

    try:
        with _ended_by_sigterm():
            report = profiling.profile(resolved, trains=trains, seconds=seconds, steps=steps)
    except RunFailedError as failure:
        click.echo(f"run failed: {failure}", err=True)
        raise SystemExit(1) from None
    if file is not None:
        file.write_text(report.to_json() + "\n", encoding="utf-8")
    profile_tables.show(profile_tables.report_tables(report))


@main.command()
@click.argument("wheel")
@click.argument("rail")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Draw a figure, replacing a file.")
@click.option("--json", "as_json", is_flag=True, help="Print all numbers as JSON.")
@click.option("--cant", type=float, default=0.025, show_default=True, help="Inclination of the rail.")
@click.option("--canted", is_flag=True, help="The rail's points are inclined already.")
@click.option("--gauge", type=float, default=1.435, show_default=True, help="[m]")
@click.option("--gauge-depth", type=float, default=0.016, show_default=True, help="Below the rail's top [m].")
@click.option("--half-spacing", type=float, default=0.7465, show_default=True, help="Of the tape circles [m].")
@click.option("--wheel-radius", type=float, default=0.43, show_default=True, help="At the tape circle [m].")
@click.option("--tape-circle", type=float, default=0.0, help="Outward from the wheel file's y = 0 [m].")
@click.option("--mirror-rail/--no-mirror-rail", default=None, help="The rail's gauge face is at positive y, or not.")
@click.option("--smoothing", type=click.FloatRange(0.0, 5e-3), help="Of points; 0.0005 for measured profiles [m].")
@click.option("--largest", type=float, default=0.008, show_default=True, help="Largest shift [m].")
def contact(
    wheel: str,
    rail: str,
    output: Path | None,
    as_json: bool,
    canted: bool,
    tape_circle: float,
    mirror_rail: bool | None,
    smoothing: float | None,
    largest: float,
    **placement: float,
) -> None:
    """Show how WHEEL and RAIL, presets or files, touch: rolling radii, conicity, points of contact."""
    from tiengine.contact_geometry import ContactSettings
    from tiengine.contact_report import contact_report, draw
    from tiengine.profile import ROUNDING_LENGTH, load_profile
    from tiengine.quantity import build

    length = ROUNDING_LENGTH if smoothing is None else smoothing
    report = contact_report(
        load_profile(wheel, "wheel", smoothing=length, tape_circle=tape_circle),
        load_profile(rail, "rail", smoothing=length, has_cant=canted, mirror=mirror_rail),
        build(ContactSettings, placement, "contact"),
        largest,
    )
    if output is not None:
        draw(report, output)
    if as_json:
        click.echo(report.to_json())
        return
    _print_rows([("wheel, rail", f"{wheel}, {rail}"), *report.rows()])


@main.command("list")
@click.argument("kind", type=click.Choice(KINDS), required=False)
def list_presets(kind: str | None) -> None:
    """List the presets of the library and where their numbers come from."""
    for each in (kind,) if kind else KINDS:
        click.secho(each, bold=True)
        _print_rows([(f"  {name}", preset_source(each, name)) for name in preset_names(each)])


@main.command()
@click.argument("file", type=click.Path(path_type=Path))
def info(file: Path) -> None:
    """Say what a result FILE holds and how it was made."""
    from tiengine import results

    with results.open(file) as result:
        attributes = result.attributes
        scenario = tomllib.loads(result.scenario_toml)
        rows = [("scenario", str(scenario.get("name", "")))]
        for section, key in (("train", "vehicles"), ("train", "speed_kmh"), ("train", "distance")):
            rows.append((f"{section}.{key}", _text(scenario.get(section, {}).get(key))))
        hidden = {*SUMMARY, "scenario"}
        rows += [(key, str(value)) for key, value in attributes.items() if key not in hidden]
        rows += _summary(attributes)
        for train in range(result.trains):
            path = f"trains/{train:03d}"
            rows += [(f"{path}/{group}", content) for group, content in _groups(result[path])]
    _print_rows(rows)


@main.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--train", type=click.IntRange(0), help="One train of an ensemble; default: all, summarised.")
@click.option("--json", "output", type=click.Path(path_type=Path), help="Write all indices here too, replacing a file.")
def metrics(file: Path, train: int | None, output: Path | None) -> None:
    """Indices of EN 14363, GB/T 5599, EN 12299 and ISO 2631 for a result FILE, beside their limits."""
    from tiengine import metrics_table, profile_tables, results
    from tiengine.writer import check_output

    if output is not None:
        check_output(output, force=True)
    with results.open(file) as result:
        found = result.metrics(train)
    if output is not None:
        output.write_text(found.to_json() + "\n", encoding="utf-8")
    profile_tables.show(metrics_table.metrics_table(found))


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def _groups(train: Any) -> Iterator[tuple[str, str]]:
    """Name of every group of a train, with its samples and channels."""
    for name, group in train.items():
        if hasattr(group, "keys"):  # the train's own time is a dataset
            channels = [key for key, dataset in group.items() if "coordinates" in dataset.attrs]
            yield name, f"{group['time'].shape[0]} samples of {', '.join(channels)}"


def _print_rows(rows: Sequence[tuple[str, str]]) -> None:
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


def _summary(attributes: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Size, step, speed and wall times of a run."""
    return [(words, form.format(attributes[key])) for key, (words, form) in SUMMARY.items() if key in attributes]


@contextmanager
def _progress(console: Console, name: str) -> Iterator[Callable[[float, float], None]]:
    """A bar with simulated time, ETA and real-time factor, as the callback of a run."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.2f} of {task.total:.2f} s"),
        TextColumn("ETA"),
        TimeRemainingColumn(),
        TextColumn("RTF {task.fields[factor]:.2f}"),
    )
    bar = Progress(*columns, console=console, transient=not console.is_terminal)
    task = bar.add_task(name, total=0.0, factor=0.0, start=False)
    clock: list[float] = []  # the time of the first call: set-up is not part of the factor

    def update(simulated_time: float, end_time: float) -> None:
        if not clock:
            clock.extend((time.perf_counter(), simulated_time))
            bar.start()  # not before: a run refused at set-up leaves one line, its error
            bar.start_task(task)
        elapsed = time.perf_counter() - clock[0]
        factor = elapsed / max(simulated_time - clock[1], 1e-9)
        bar.update(task, completed=simulated_time, total=end_time, factor=factor)

    try:
        yield update
    finally:
        if clock:
            bar.stop()


@contextmanager
def _ended_by_sigterm() -> Iterator[None]:
    """Let a termination signal unwind the stack, so that no half file is left behind."""

    def leave(number: int, frame: object) -> None:
        raise SystemExit(128 + number)

    previous = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)
