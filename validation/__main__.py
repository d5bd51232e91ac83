"""Command line ``python -m validation`` and its commands."""

from __future__ import annotations

import sys
from pathlib import Path

import click
from rich.console import Console
from rich.progress import Progress

from tiengine.engine import backend
from tiengine.scenario.scenario import load_scenario
from validation.frame.case import Outcome, evaluate
from validation.frame.table import headlines, insert, keep, markdown, show

ROOT = Path(__file__).resolve().parents[1]
REPORT = ROOT / "validation" / "report" / "verification.md"


@click.group(invoke_without_command=True)
@click.option("--quick", is_flag=True, help="Run only the cases that together take less than five minutes.")
@click.option(
    "--only", multiple=True, metavar="NAME", help="Run only cases whose name begins with NAME; may be repeated."
)
@click.option("--write", is_flag=True, help="Update the tables in README.md and validation/report.")
@click.pass_context
def main(context: click.Context, quick: bool, only: tuple[str, ...], write: bool) -> None:
    """Compare the engine with closed forms, published numbers and finer settings; exit status 1 if a case misses."""
    if context.invoked_subcommand is not None:
        return
    from validation.frame.catalogue import CASES, HEADLINES

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
        if write:  # after every case, so that an interrupted run loses nothing
            REPORT.parent.mkdir(exist_ok=True)
            known = keep([last], REPORT.with_suffix(".json"), CASES)
    show(outcomes, console)
    if write:
        REPORT.write_text(f"# Verification\n\n{markdown(known)}", encoding="utf-8")
        insert(headlines(known, HEADLINES), ROOT / "README.md")
    sys.exit(any(outcome.verdict == "MISS" for outcome in outcomes))


@main.command()
def figures() -> None:
    """Draw the report's smaller figures: conicity, periodic supports, spectrum of the wheel force."""
    from validation.cases import contact_geometry, periodic_support_figure, wheel_spectrum

    backend.start()
    for name, module in (
        ("conicity", contact_geometry),
        ("periodic_support", periodic_support_figure),
        ("spectrum", wheel_spectrum),
    ):
        module.draw(REPORT.parent / f"{name}.png")
        click.echo(f"wrote {name}.png")


@main.command()
def convergence() -> None:
    """Refine step, modes, slab mesh and window; table and figures go to validation/report (7 min)."""
    from validation.convergence.report import write

    backend.start()
    write(REPORT.parent)


@main.command()
def paper() -> None:
    """Compare window and full length on the paper's case; tables and figures go to validation/report (half an hour)."""
    from validation.paper.report import write

    page = write(REPORT.parent)
    click.echo(f"wrote {page}")


@main.command()
@click.argument("scenario")
@click.option("-o", "--output", type=click.Path(path_type=Path), required=True, help="Result file.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change a key: train.speed_kmh=300")
@click.option("--length", default=600.0, show_default=True, help="Length of the rail [m].")
@click.option("--modes-per-metre", default=2.0, show_default=True, help="Trial functions per field and metre.")
@click.option("--slab-modes", default=20, show_default=True, help="Free-free plate modes per slab.")
@click.option("--time-step", default=2e-4, show_default=True, help="Time step [s].")
@click.option("--force", is_flag=True, help="Replace an existing result file.")
def msm(
    scenario: str, output: Path, settings: tuple[str, ...], length: float, modes_per_metre: float, slab_modes: int,
    time_step: float, force: bool,
) -> None:  # fmt: skip
    """Run SCENARIO in the traditional full-length model and write the engine's HDF5 layout."""
    from validation.msm.simulate import FullLength, run_full_length

    console = Console(stderr=True)
    resolved = load_scenario(scenario, settings)
    numerics = FullLength(length, modes_per_metre, slab_modes, time_step)
    with Progress(console=console) as bar:
        task = bar.add_task(resolved.name, total=1.0)
        with run_full_length(
            resolved, numerics, output, force=force, progress=lambda now, end: bar.update(task, completed=now / end)
        ) as result:
            facts = result.attributes
    console.print(
        f"{facts['dofs']} DOFs, {facts['steps']} steps, {1e3 * facts['wall_time_loop'] / facts['steps']:.2f} ms per"
        f" step,"
        f" {facts['real_time_factor']:.1f} s per simulated second; wrote {output}"
    )


if __name__ == "__main__":
    main()
