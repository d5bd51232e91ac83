"""Command line ``python -m validation.speed``."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import click
from rich.console import Console

from validation.speed import findings
from validation.speed.command import command
from validation.speed.effort import Effort, effort
from validation.speed.features import FEATURES, features
from validation.speed.findings import Findings
from validation.speed.full_length import full_length
from validation.speed.length import length
from validation.speed.page import busy_words, page, show
from validation.speed.roofline import roofline
from validation.speed.runs import Facts, in_turn
from validation.speed.scaling import scaling
from validation.speed.throughput import BATCHES, ONE_CAR, TRAINS, batch, one_car, trains

REPORT = Path(__file__).resolve().parents[1] / "report"
PIPE_WIDTH = 160  # columns where there is no terminal

Rounds = Mapping[str, Sequence[Facts]]
Tell = Callable[[str], object]


@dataclass(frozen=True)
class Case:
    """A measurement.

    Attributes:
        runs: Runs of ``cases.toml`` that the case compares in turn.
        measure: Function of the effort, these runs and a callback for progress that returns the findings.
    """

    runs: tuple[str, ...]
    measure: Callable[[Effort, Rounds, Tell], Findings]


CASES = {
    "trains": Case(TRAINS, lambda effort, rounds, notify: trains(rounds)),
    "one_car": Case(ONE_CAR, lambda effort, rounds, notify: one_car(rounds)),
    "batch": Case(BATCHES, lambda effort, rounds, notify: batch(rounds)),
    "full_length": Case(("default", "batch", "full"), lambda effort, rounds, notify: full_length(effort, rounds)),
    "command": Case((), lambda effort, rounds, notify: command(effort)),
    "roofline": Case((), lambda effort, rounds, notify: roofline(effort)),
    "scaling": Case((), lambda effort, rounds, notify: scaling(effort, notify)),
    "features": Case(FEATURES, lambda effort, rounds, notify: features(rounds)),
    "length": Case((), lambda effort, rounds, notify: length(effort, notify)),
}


@click.command()
@click.option("--quick", is_flag=True, help="Measure in about five minutes: fewer repeats, shorter distances.")
@click.option("--long", "far", is_flag=True, help="Measure a run of 100 km as well.")
@click.option("--only", multiple=True, type=click.Choice(tuple(CASES)), help="Measure only this case; may be repeated.")
@click.option("--draw", is_flag=True, help="Measure nothing; make table, page and figures from the kept findings.")
@click.option("-o", "--output", type=click.Path(path_type=Path), default=REPORT, help="Folder of the report.")
def main(quick: bool, far: bool, only: tuple[str, ...], draw: bool, output: Path) -> None:
    """Measure the engine's speed; cases not chosen keep their earlier findings."""
    from validation.speed.figures import draw as draw_figures  # imports matplotlib

    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=PIPE_WIDTH)
    output.mkdir(parents=True, exist_ok=True)
    file = output / "speed.json"
    known = findings.read(file)
    if not draw:
        found = _measure(tuple(only) or tuple(CASES), effort(quick, far), console)
        known = {name: (known | found)[name] for name in CASES if name in known or name in found}
        findings.write(file, known)
    rows = findings.rows(known)
    show(rows, console)
    figures = draw_figures(known, output)
    (output / "speed.md").write_text(page(rows, known, figures), encoding="utf-8")
    for name in ("speed.json", "speed.md", *figures):
        console.print(f"wrote {output / name}")


def _measure(chosen: Sequence[str], much: Effort, console: Console) -> dict[str, dict[str, object]]:
    """Measure the chosen cases; return their circumstances and findings."""
    date = time.strftime("%Y-%m-%d %H:%M")
    start = findings.circumstances(much.name, date)
    clock = time.perf_counter()

    def notify(words: str) -> None:
        console.print(f"{time.perf_counter() - clock:6.0f} s  {words}")

    if start.busy:
        console.print(f"[yellow]{busy_words('warning', asdict(start))}[/]")
    runs = tuple(dict.fromkeys(run for name in chosen for run in CASES[name].runs))
    rounds = in_turn(runs, much.rounds, much.share, notify)
    found = {}
    for name in chosen:
        notify(name.replace("_", " "))
        found[name] = {"circumstances": asdict(start), **asdict(CASES[name].measure(much, rounds, notify))}
    notify("done")
    return found


if __name__ == "__main__":
    main()
