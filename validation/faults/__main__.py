"""Command line ``python -m validation.faults``."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import click
from rich.console import Console

from validation.faults.page import page, rows, show
from validation.faults.suite import PARTS, perform
from validation.speed.findings import circumstances

REPORT = Path(__file__).resolve().parents[1] / "report"
PIPE_WIDTH = 160  # columns where there is no terminal
FORMAT, FORMAT_VERSION = "tiengine-faults", 1
QUICK = 0.1  # of all repeats


@click.command()
@click.option("--quick", is_flag=True, help="Run a tenth of all repeats.")
@click.option("--only", multiple=True, type=click.Choice(tuple(PARTS)), help="Run only this part; may be repeated.")
@click.option(
    "--jobs", type=click.IntRange(1), default=2, show_default=True, help="Number of parts that run at a time."
)
@click.option("--draw", is_flag=True, help="Run nothing; make table and page from the kept findings.")
@click.option("-o", "--output", type=click.Path(path_type=Path), default=REPORT, help="Folder of the report.")
def main(quick: bool, only: tuple[str, ...], jobs: int, draw: bool, output: Path) -> None:
    """Kill and disturb runs, fill their disks; parts not chosen keep their earlier findings."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=PIPE_WIDTH)
    output.mkdir(parents=True, exist_ok=True)
    file = output / "faults.json"
    known = _read(file)
    if not draw:
        start = circumstances("quick" if quick else "whole", time.strftime("%Y-%m-%d %H:%M"))
        clock = time.perf_counter()

        def keep(name: str, found: dict[str, Any]) -> None:
            facts = {"circumstances": vars(start), "seconds": time.perf_counter() - clock}
            known[name] = {**facts, **found}
            _write(file, known, output)
            console.print(f"{time.perf_counter() - clock:6.0f} s  {PARTS[name].words}")

        perform(only or tuple(PARTS), QUICK if quick else 1.0, jobs, keep)
    _write(file, known, output)
    known = _read(file)
    show(rows(known), console)
    if any(good is False for *_, good in rows(known)):
        raise SystemExit(1)


def _read(file: Path) -> dict[str, Any]:
    """Parts of a file of findings, by name; none if the file is missing or of another version."""
    if not file.is_file():
        return {}
    kept = json.loads(file.read_text(encoding="utf-8"))
    if (kept.get("format"), kept.get("format_version")) != (FORMAT, FORMAT_VERSION):
        return {}
    return {name: kept["parts"][name] for name in PARTS if name in kept["parts"]}


def _write(file: Path, known: dict[str, Any], output: Path) -> None:
    """Write the file of findings and the page."""
    content = {"format": FORMAT, "format_version": FORMAT_VERSION, "parts": known}
    file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    ordered = {name: known[name] for name in PARTS if name in known}
    (output / "faults.md").write_text(page(ordered), encoding="utf-8")


if __name__ == "__main__":
    main()
