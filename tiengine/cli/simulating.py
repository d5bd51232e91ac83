"""Commands that simulate: ``tiengine run`` and ``tiengine resume``.

Exit status 0: all trains are complete; 1: a train failed; 2: invalid input, or the disk is full; 128 + n: stopped by
signal n (130 Ctrl-C, 143 SIGTERM), can be resumed.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from tiengine.cli.screen import print_rows
from tiengine.result_files.summary import summary

if TYPE_CHECKING:
    from tiengine.result import Result

__all__ = ["COMMANDS", "Stop", "stopped_by_signals"]

SIGNALS = (signal.SIGINT, signal.SIGTERM)

_workers = click.option(
    "--workers", type=click.IntRange(1), help="Worker processes for an ensemble; default: one per core."
)
_checkpoint = click.option(
    "--checkpoint",
    type=click.FloatRange(0.0, min_open=True),
    default=60.0,
    show_default=True,
    help="Wall time between checkpoints [s].",
)
_quiet = click.option("--quiet", is_flag=True, help="Print errors only.")


@click.command()
@click.argument("scenario")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Result file; default: NAME.h5 with the name of the scenario.",
)
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change a key: train.speed_kmh=300")
@_workers
@_checkpoint
@_quiet
@click.option("--force", is_flag=True, help="Replace an existing result file.")
def run(
    scenario: str,
    output: Path | None,
    settings: Sequence[str],
    workers: int | None,
    checkpoint: float,
    quiet: bool,
    force: bool,
) -> None:
    """Simulate SCENARIO, the name of a preset or the path of a TOML file: one train or an ensemble."""
    from tiengine.scenario.scenario import load_scenario

    resolved = load_scenario(scenario, settings)
    path = output or Path(f"{Path(resolved.name).name}.h5")

    from tiengine.result_files.output_file import check_output

    check_output(path, force)

    from tiengine.simulation import simulate

    _run_on_screen(
        lambda **screen: simulate.run(resolved, path, force=force, workers=workers, checkpoint=checkpoint, **screen),
        path,
        resolved.name,
        len(resolved.members),
        quiet,
    )


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@_workers
@_checkpoint
@_quiet
def resume(file: Path, workers: int | None, checkpoint: float, quiet: bool) -> None:
    """Resume an interrupted run: its result FILE becomes bit for bit that of an uninterrupted run."""
    from tiengine import result as results

    with results.open(file) as unfinished:
        trains = len(unfinished.scenario.members)

    from tiengine.simulation import simulate

    _run_on_screen(
        lambda **screen: simulate.resume(file, workers=workers, checkpoint=checkpoint, **screen),
        file,
        file.stem,
        trains,
        quiet,
    )


COMMANDS = (run, resume)


def _run_on_screen(simulation: Callable[..., Result], path: Path, name: str, trains: int, quiet: bool) -> None:
    """Run a simulation with a progress bar and report its end."""
    from tiengine.parameters.errors import RunFailedError, RunStoppedError

    console = Console(stderr=True, quiet=quiet, highlight=False)
    with stopped_by_signals(console) as stop:
        try:
            with _progress(console, name, trains) as progress:
                result = simulation(
                    progress=progress,
                    notify=lambda words: console.print(words, markup=False),
                    stop=lambda: stop.requested,
                )
        except RunStoppedError as stopped:
            how = f"resume with: tiengine resume {path}" if path.exists() else "nothing has been computed yet"
            click.echo(f"{stopped}; {how}", err=True)
            raise SystemExit(128 + stop.number) from None
        except RunFailedError as failure:
            click.echo(f"run failed: {failure}; {path} holds the results up to that time", err=True)
            raise SystemExit(1) from None
    with result:
        if not quiet:
            print_rows([*summary(result.attributes), ("result", str(path))])
        failures = result.failures
    for train, why in failures.items():
        click.echo(f"train {train} failed: {why}", err=True)
    if failures:
        raise SystemExit(1)


@dataclass
class Stop:
    """Stop request by a signal.

    Attributes:
        number: Number of the signal; 0 if there was none.
    """

    number: int = 0

    @property
    def requested(self) -> bool:
        """Whether a signal has arrived."""
        return self.number > 0


@contextmanager
def stopped_by_signals(console: Console) -> Iterator[Stop]:
    """Let Ctrl-C and SIGTERM request a stop after the current chunk of steps; a second signal exits at once.

    Args:
        console: Says so, unless it is quiet.
    """
    stop = Stop()

    def request(number: int, frame: Any) -> None:
        if stop.requested:
            raise SystemExit(128 + number)
        stop.number = number
        if not console.quiet:  # by os.write: the handler may interrupt any print
            with suppress(OSError):  # the terminal may be closed
                os.write(2, b"stopping after the current steps; a second signal exits at once\n")

    previous = {number: signal.signal(number, request) for number in SIGNALS}
    try:
        yield stop
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


@contextmanager
def _progress(console: Console, name: str, trains: int) -> Iterator[Callable[[float, float], None]]:
    """Progress bar with simulated time (of all trains), remaining time and real-time factor, as callback of a run."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.2f} of {task.total:.2f} s"),
        TextColumn("ETA"),
        TimeRemainingColumn(),
        TextColumn("RTF {task.fields[factor]:.2f}" + (" per train" if trains > 1 else "")),
    )
    bar = Progress(*columns, console=console, transient=not console.is_terminal)
    task = bar.add_task(name, total=0.0, factor=0.0, start=False)
    clock: list[float] = []  # wall and simulated time at the first call: the set-up does not count in the factor

    def update(simulated_time: float, end_time: float) -> None:
        if not clock:
            clock.extend((time.perf_counter(), simulated_time))
            bar.start()  # not earlier: a run refused at set-up prints its error only
            bar.start_task(task)
        elapsed = time.perf_counter() - clock[0]
        factor = elapsed / max(simulated_time - clock[1], 1e-9)
        bar.update(task, completed=simulated_time, total=end_time, factor=factor)

    try:
        yield update
    finally:
        if clock:
            bar.stop()
