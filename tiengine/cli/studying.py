"""Commands of studies: ``tiengine study PLAN.toml -o FOLDER``, and what is done with a folder.

Exit status as of ``tiengine run``: 0 all tasks are complete; 1 a task could not be completed; 2 invalid input; 128 + n
stopped by signal n, can be resumed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from tiengine.cli.screen import print_rows
from tiengine.cli.simulating import stopped_by_signals
from tiengine.parameters.errors import InputError

if TYPE_CHECKING:
    from tiengine.study.study import Place, Study

__all__ = ["COMMANDS"]


class _Study(click.Group):
    """Group whose first word may be a plan instead of a command."""

    def parse_args(self, context: click.Context, args: list[str]) -> list[str]:
        """Take a plan as an argument of ``run``."""
        if args and args[0] not in self.commands and args[0] not in ("-h", "--help"):
            args = ["run", *args]
        return super().parse_args(context, args)


@click.group(cls=_Study, context_settings={"help_option_names": ["-h", "--help"]})
def study() -> None:
    """Run and evaluate a study: thousands of trains from one scenario (docs/studies.md).

    ``tiengine study PLAN.toml -o FOLDER`` runs a plan; the other commands take the FOLDER.
    """


@dataclass(frozen=True)
class _Where:
    """Options that say where tasks are computed."""

    workers: int | None
    dask: str | None
    slurm: bool
    jobs: int
    slurm_set: Sequence[str]
    part: str | None

    @property
    def place(self) -> Place | None:
        """Place other than this machine."""
        if sum((self.dask is not None, self.slurm, self.part is not None)) > 1:
            raise InputError("--dask, --slurm, --part: only one of them can be given")
        if self.dask is not None:
            from tiengine.study.on_dask import Dask

            return Dask(self.dask, self.workers)
        if self.slurm:
            from tiengine.scenario.overrides import parse_value
            from tiengine.study.on_slurm import Slurm

            pairs = [text.partition("=") for text in self.slurm_set]
            if wrong := [key for key, sign, _ in pairs if not sign]:
                raise InputError(f"--slurm-set {wrong[0]!r}: must be KEY=VALUE, such as slurm_partition=short")
            return Slurm(self.jobs, {key: parse_value(value, key) for key, _, value in pairs})
        return None

    @property
    def share(self) -> tuple[int, int] | None:
        """Share of the tasks."""
        if self.part is None:
            return None
        i, slash, n = self.part.partition("/")
        if not (slash and i.isdecimal() and n.isdecimal() and 1 <= int(i) <= int(n)):
            raise InputError(f"--part {self.part}: must be I/N with I from 1 to N, such as 3/10")
        return int(i), int(n)


def _where(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options that say where tasks are computed, and how it is shown."""
    options = (
        click.option("--workers", type=click.IntRange(1), help="Worker processes; default: one per core."),
        click.option("--dask", metavar="ADDRESS", help='Compute on the Dask scheduler at ADDRESS, or "local".'),
        click.option("--slurm", is_flag=True, help="Compute as an array of Slurm jobs (submitit)."),
        click.option("--jobs", type=click.IntRange(1), default=10, show_default=True, help="Slurm jobs."),
        click.option("--slurm-set", multiple=True, metavar="KEY=VALUE", help="Setting of submitit; repeatable."),
        click.option("--part", metavar="I/N", help="Compute share I of N beside other processes, from 1."),
        click.option(
            "--checkpoint", type=click.FloatRange(0.0, min_open=True), default=60.0, show_default=True,
            help="Wall time between checkpoints [s].",
        ),
        click.option("--quiet", is_flag=True, help="Print errors only."),
    )  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


@study.command(hidden=True)
@click.argument("plan", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="New folder; default: the name of the plan.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Set a key in all trains.")
@click.option("--dry-run", is_flag=True, help="Check all trains; print their number, tasks, size and duration.")
@_where
def run(
    plan: Path,
    output: Path | None,
    settings: Sequence[str],
    dry_run: bool,
    checkpoint: float,
    quiet: bool,
    **where: Any,
) -> None:
    """Run the study of PLAN, a TOML file, or continue with another --part of it."""
    from tiengine.study.plan import load_plan
    from tiengine.study.study import TOGETHER, study

    loaded, folder = load_plan(plan)
    loaded = loaded.changed(settings)
    place = _Where(**where)
    if dry_run:
        from tiengine.simulation.simulate import cores
        from tiengine.study.design import expand
        from tiengine.study.estimate import estimate

        print_rows(estimate(expand(loaded, folder, TOGETHER), place.workers or cores()).rows())
        return
    target = output or Path(loaded.name)
    _on_screen(
        lambda **screen: study(
            loaded, target, start=folder, workers=place.workers, place=place.place, part=place.share,
            checkpoint=checkpoint, **screen,
        ),
        target,
        quiet,
    )  # fmt: skip


@study.command()
@click.argument("folder", type=click.Path(path_type=Path))
@_where
def resume(folder: Path, checkpoint: float, quiet: bool, **where: Any) -> None:
    """Compute what is left of the study in FOLDER: the bits become those of an uninterrupted one."""
    from tiengine.study.study import Study

    opened, place = Study.open(folder), _Where(**where)
    _on_screen(
        lambda **screen: opened.resume(
            workers=place.workers, place=place.place, part=place.share, checkpoint=checkpoint, **screen
        ),
        folder,
        quiet,
    )


@study.command()
@click.argument("folder", type=click.Path(path_type=Path))
def status(folder: Path) -> None:
    """Show how far the study in FOLDER is, also while it runs."""
    from tiengine.study.folder import Folder

    print_rows(Folder.open(folder).status().rows())


@study.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help=".csv or .parquet, replaced; default: FOLDER/table.csv."
)
def table(folder: Path, output: Path | None) -> None:
    """Write the table of the study in FOLDER: one row a train with factors, key figures and failures."""
    from tiengine.study.folder import Folder
    from tiengine.study.table import read_table

    found, path = read_table(Folder.open(folder)), output or folder / "table.csv"
    found.write(path)
    click.echo(f"{path}: {len(found)} rows of {len(found.columns)} columns")


@study.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Page to write, replaced; default: FOLDER/report.html."
)
def report(folder: Path, output: Path | None) -> None:
    """Write a page on the study in FOLDER: percentiles, extremes, influences, convergence, bands."""
    from tiengine.study.folder import Folder
    from tiengine.study.page import write

    path = output or folder / "report.html"
    write(Folder.open(folder), path)
    click.echo(str(path))


@study.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Result file to write.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def merge(folder: Path, output: Path, force: bool) -> None:
    """Copy all parts of the study in FOLDER into one result file, as of an ensemble."""
    from tiengine.study.folder import Folder
    from tiengine.study.merge import merge

    click.echo(f"{output}: {merge(Folder.open(folder), output, force=force)} trains")


@study.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Ends in .zarr or .parquet.")
@click.option("--length", type=float, default=10.0, show_default=True, help="Of a window [m]; [s] with --by-time.")
@click.option("--step", type=float, default=5.0, show_default=True, help="From window to window, likewise.")
@click.option("--samples", type=int, default=256, show_default=True, help="Samples of a window.")
@click.option("--by-time", is_flag=True, help="Cut by time instead of distance.")
@click.option("--channel", "channels", multiple=True, metavar="GROUP/CHANNEL", help="To learn; default: wheel forces.")
@click.option("--input", "inputs", multiple=True, metavar="GROUP/CHANNEL", help="Default: the irregularity.")
@click.option("--label", "labels", multiple=True, metavar="COLUMN", help="Column of the table, besides the factors.")
def dataset(
    folder: Path, output: Path, channels: Sequence[str], inputs: Sequence[str], labels: Sequence[str], **cut: Any
) -> None:
    """Cut the trains of the study in FOLDER into windows for learning, split by seed, with a datasheet."""
    from tiengine.study.dataset import Windows, make_dataset
    from tiengine.study.folder import Folder

    chosen: dict[str, Any] = {"channels": tuple(channels), "inputs": tuple(inputs), "labels": tuple(labels)}
    windows = Windows(**cut, **{name: value for name, value in chosen.items() if value})
    counts = make_dataset(Folder.open(folder), output, windows)
    click.echo(f"{output}: {', '.join(f'{count} windows for {name}' for name, count in counts.items())}")


COMMANDS = (study,)


def _on_screen(work: Callable[..., Study], folder: Path, quiet: bool) -> None:
    """Run a study with a progress bar and report its end."""
    from tiengine.parameters.errors import RunFailedError, RunStoppedError

    console = Console(stderr=True, quiet=quiet, highlight=False)
    with stopped_by_signals(console) as stop:
        try:
            with _progress(console, folder.name) as progress:
                done = work(
                    progress=progress,
                    notify=lambda words: console.print(words, markup=False),
                    stop=lambda: stop.requested,
                )
        except RunStoppedError as stopped:
            click.echo(f"{stopped}; resume with: tiengine study resume {folder}", err=True)
            raise SystemExit(128 + stop.number) from None
        except RunFailedError as failure:
            click.echo(f"not complete: {failure}; try again with: tiengine study resume {folder}", err=True)
            raise SystemExit(1) from None
    if not quiet:
        print_rows([*done.status().rows(), ("folder", str(folder))])


@contextmanager
def _progress(console: Console, name: str) -> Iterator[Callable[[float, float], None]]:
    """Progress bar with trains done and remaining time, as callback of a study."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.1f} of {task.total:.0f} trains"),
        TextColumn("ETA"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    bar = Progress(*columns, console=console, transient=not console.is_terminal)
    task = bar.add_task(name, total=0.0, start=False)

    def update(done: float, whole: float) -> None:
        if not bar.live.is_started:
            bar.start()
            bar.start_task(task)
        bar.update(task, completed=done, total=whole)

    try:
        yield update
    finally:
        if bar.live.is_started:
            bar.stop()
