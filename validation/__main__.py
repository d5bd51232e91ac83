"""Command line: ``python -m validation``, ``python -m validation figure``."""

from __future__ import annotations

import sys
from pathlib import Path

import click
from rich.console import Console

from tiengine import backend
from validation.case import Outcome, evaluate
from validation.table import insert, markdown, show

ROOT = Path(__file__).resolve().parents[1]
REPORT = ROOT / "validation" / "report" / "verification.md"
FIGURE = ROOT / "docs" / "images" / "paper_case.png"


@click.group(invoke_without_command=True)
@click.option("--quick", is_flag=True, help="Only the cases that together take less than five minutes.")
@click.option("--only", multiple=True, metavar="NAME", help="Only cases whose name begins so; may be repeated.")
@click.option("--write", is_flag=True, help="Write the table into README.md and validation/report.")
@click.pass_context
def main(context: click.Context, quick: bool, only: tuple[str, ...], write: bool) -> None:
    """Hold the engine to closed forms, others' numbers and its own convergence; status 1 on a miss."""
    if context.invoked_subcommand is not None:
        return
    from validation.catalogue import CASES

    chosen = [case for case in CASES if (case.quick or not quick) and (not only or case.name.startswith(only))]
    if not chosen:
        raise click.UsageError(f"no case begins with {', '.join(only)}; known: {', '.join(c.name for c in CASES)}")
    backend.start()
    console = Console()
    outcomes: list[Outcome] = []
    for case in chosen:
        outcomes.append(evaluate(case))
        last = outcomes[-1]
        console.print(f"{last.verdict:16} {case.name}  {last.seconds:.1f} s", highlight=False)
    show(outcomes, console)
    if write:
        text = markdown(outcomes)
        REPORT.parent.mkdir(exist_ok=True)
        REPORT.write_text(f"# Verification\n\n{text}", encoding="utf-8")
        insert(text, ROOT / "README.md")
    sys.exit(any(outcome.verdict == "MISS" for outcome in outcomes))


@main.command()
@click.option("-o", "--output", type=click.Path(path_type=Path), default=FIGURE, show_default=True)
def figure(output: Path) -> None:
    """Run the paper's case and draw the forces of its first wheelset."""
    from validation.figure import draw

    output.parent.mkdir(parents=True, exist_ok=True)
    draw(output)
    click.echo(f"wrote {output}")


if __name__ == "__main__":
    main()
