"""Command line: ``tiengine profile``, ``contact`` and ``list``, and the group to which all commands belong.

Invalid input ends with one line on stderr and exit status 2, a failed run with status 1. Only commands that simulate
import Taichi, so that the others start fast.
"""

from __future__ import annotations

import errno
import math
import os
import signal
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import click

from tiengine.cli import reading, simulating, studying
from tiengine.cli.screen import print_rows, show
from tiengine.parameters.errors import InputError, InputNote
from tiengine.parameters.presets import KINDS, preset_names, preset_source

__all__ = ["main"]


class _Commands(click.Group):
    """Group of commands that reports invalid input in one line (exit status 2) and notes on input, one line each."""

    def invoke(self, context: click.Context) -> Any:
        """Run a command."""
        if sys.stdout is None or sys.stderr is None:  # closed by whoever started this process
            nowhere = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - until the process ends
            sys.stdout, sys.stderr = sys.stdout or nowhere, sys.stderr or nowhere
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always", InputNote)
                show_others = warnings.showwarning

                def show_note(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
                    if issubclass(category, InputNote):
                        click.echo(f"note: {' '.join(str(message).split())}", err=True)
                    else:
                        show_others(message, category, *place, **more)

                warnings.showwarning = show_note
                return super().invoke(context)
        except InputError as error:
            click.echo(f"error: {' '.join(str(error).split())}", err=True)
            context.exit(2)
        except OSError as error:
            if error.errno not in (errno.ENOSPC, errno.EIO, errno.EDQUOT) or error.filename is not None:
                raise
            click.echo(f"error: standard output: {error.strerror}", err=True)
            context.exit(1)


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="tiengine", message="%(prog)s %(version)s")
def main() -> None:
    """Moving train-slab-track interaction in three dimensions."""
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")


@main.command()
@click.argument("scenario", default="paper")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change a key: train.speed_kmh=300")
@click.option(
    "--trains", type=click.IntRange(1), help="Number of trains advanced together; default: as in the scenario."
)
@click.option("--seconds", type=float, default=1.0, show_default=True, help="Simulated time to measure.")
@click.option("--steps", type=click.IntRange(2), help="Number of steps to measure, instead of --seconds.")
@click.option(
    "--json", "file", type=click.Path(path_type=Path), help="Also write the report to this file, replacing it."
)
@click.option(
    "--compare", nargs=2, type=click.Path(path_type=Path), help="Compare two such files instead of measuring."
)
def profile(
    scenario: str,
    settings: Sequence[str],
    trains: int | None,
    seconds: float,
    steps: int | None,
    file: Path | None,
    compare: tuple[Path, Path] | None,
) -> None:
    """Measure the wall time of each stage of the time loop of SCENARIO, in this process."""
    from tiengine.profiling import report as profile_report
    from tiengine.profiling import tables as profile_tables

    if compare:
        reports = [profile_report.read_json(path) for path in compare]
        comparison = profile_report.compare(*reports)
        show(profile_tables.comparison_table(comparison, [str(path) for path in compare]))
        return

    from tiengine.scenario.scenario import load_scenario

    resolved = load_scenario(scenario, settings)
    if file is not None:
        from tiengine.result_files.output_file import check_output

        check_output(file, force=True)

    from tiengine.parameters.errors import RunFailedError
    from tiengine.profiling import profile as profiling

    try:
        with _exit_on_sigterm():
            report = profiling.profile(resolved, trains=trains, seconds=seconds, steps=steps)
    except RunFailedError as failure:
        click.echo(f"run failed: {failure}", err=True)
        raise SystemExit(1) from None
    if file is not None:
        file.write_text(report.to_json() + "\n", encoding="utf-8")
    show(profile_tables.report_tables(report))


@main.command()
@click.argument("wheel")
@click.argument("rail")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Draw a figure to this file, replacing it.")
@click.option("--json", "as_json", is_flag=True, help="Print all numbers as JSON.")
@click.option("--cant", type=float, default=0.025, show_default=True, help="Inclination of the rail.")
@click.option("--canted/--upright", default=None, help="The rail's points are inclined already, or not.")
@click.option("--gauge", type=float, default=1.435, show_default=True, help="[m]")
@click.option("--gauge-depth", type=float, default=0.016, show_default=True, help="Below the rail's top [m].")
@click.option("--half-spacing", type=float, default=0.7465, show_default=True, help="Of the tape circles [m].")
@click.option("--wheel-radius", type=float, default=0.43, show_default=True, help="At the tape circle [m].")
@click.option("--tape-circle", type=float, help="Distance of the tape circle outward from the wheel file's y = 0 [m].")
@click.option("--rail-axis", type=float, help="The rail file's y at the axis of an upright rail [m].")
@click.option("--allow-kinks", is_flag=True, help="Accept kinks where wheel and rail can touch.")
@click.option("--mirror-rail/--no-mirror-rail", default=None, help="The rail's gauge face is at positive y, or not.")
@click.option("--smoothing", type=click.FloatRange(0.0, 5e-3), help="Of points; 0.0005 for measured profiles [m].")
@click.option(
    "--method",
    type=click.Choice(["harmonic", "en15302"]),
    default="harmonic",
    show_default=True,
    help="Equivalent conicity by harmonic linearisation, or by the integral of EN 15302 (without roll).",
)
@click.option("--largest", type=float, default=0.008, show_default=True, help="Largest shift [m].")
@click.option("--left-wheel", help="Profile of the left wheel if another, preset or file.")
@click.option("--left-rail", help="Profile of the left rail if another, preset or file.")
@click.option("--left-larger", type=float, default=0.0, help="Radius of the left wheel less that of the right one [m].")
def contact(
    wheel: str,
    rail: str,
    output: Path | None,
    as_json: bool,
    canted: bool | None,
    tape_circle: float | None,
    rail_axis: float | None,
    allow_kinks: bool,
    mirror_rail: bool | None,
    smoothing: float | None,
    largest: float,
    method: Literal["harmonic", "en15302"],
    left_wheel: str | None,
    left_rail: str | None,
    left_larger: float,
    **placement: float,
) -> None:
    """Evaluate the contact geometry of WHEEL and RAIL, presets or files: rolling radii, conicity, contact points.

    With one of the options --left-..., WHEEL and RAIL are those of the right side.
    """
    from tiengine.contact.point_list import ROUNDING_LENGTH
    from tiengine.contact.profile import Profile, load_profile
    from tiengine.contact.table import ContactSettings
    from tiengine.parameters.quantity import build
    from tiengine.report.contact_report import contact_report, draw
    from tiengine.result_files.output_file import check_output

    length = ROUNDING_LENGTH if smoothing is None else smoothing
    if not math.isfinite(length):  # click accepts NaN as within the range
        raise InputError(f"smoothing = {length}: must be a finite number")
    if output is not None:
        check_output(output, force=True)

    def wheel_of(name: str) -> Profile:
        return load_profile(name, "wheel", smoothing=length, tape_circle=tape_circle, allow_kinks=allow_kinks)

    def rail_of(name: str) -> Profile:
        return load_profile(
            name,
            "rail",
            smoothing=length,
            has_cant=canted,
            mirror=mirror_rail,
            allow_kinks=allow_kinks,
            rail_axis=rail_axis,
        )

    report = contact_report(
        wheel_of(wheel),
        rail_of(rail),
        build(ContactSettings, placement, "contact"),
        largest,
        method,
        left_wheel=wheel_of(left_wheel) if left_wheel else None,
        left_rail=rail_of(left_rail) if left_rail else None,
        larger_left=left_larger,
    )
    if output is not None:
        draw(report, output)
    if as_json:
        click.echo(report.to_json())
        return
    print_rows([("wheel, rail", f"{wheel}, {rail}"), *report.rows()])


@main.command("list")
@click.argument("kind", type=click.Choice(KINDS), required=False)
def list_presets(kind: str | None) -> None:
    """List the presets of the library and the sources of their values."""
    for each in (kind,) if kind else KINDS:
        click.secho(each, bold=True)
        print_rows([(f"  {name}", preset_source(each, name)) for name in preset_names(each)])


for _command in (*simulating.COMMANDS, *reading.COMMANDS, *studying.COMMANDS):
    main.add_command(_command)


@contextmanager
def _exit_on_sigterm() -> Iterator[None]:
    """Turn a termination signal into SystemExit, so that no incomplete file remains."""

    def leave(number: int, frame: object) -> None:
        raise SystemExit(128 + number)

    previous = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)
