"""The table of outcomes: on the screen, and as Markdown for README and report."""

from __future__ import annotations

import json
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from validation.frame.case import Case, Outcome

__all__ = ["COLUMNS", "headlines", "insert", "keep", "markdown", "show"]

COLUMNS = ("case", "quantity", "reference", "ours", "deviation", "tolerance", "source", "verdict")
TEXTS = ("verdict", "reference", "ours", "deviation", "tolerance", "seconds")
"""Attributes of an outcome that are kept from one run to the next."""
BEGIN, END = "<!-- verification -->", "<!-- /verification -->"
TITLES = {
    "verification": "Against closed forms",
    "validation": "Against published numbers",
    "full length": "Against the traditional full-length model",
    "convergence": "Against finer settings of the engine",
    "information": "For information",
}
_COLOURS = {"ok": "green", "MISS": "bold red", "for information": "dim", "left out": "yellow", "not run": "yellow"}


def _row(outcome: Outcome) -> tuple[str, ...]:
    """Cells of a case in the order of :data:`COLUMNS`."""
    case = outcome.case
    tolerance = f"{outcome.tolerance}: {case.why}" if outcome.tolerance else case.why
    return (
        case.name,
        case.quantity,
        outcome.reference,
        outcome.ours,
        outcome.deviation,
        tolerance,
        case.source,
        outcome.verdict,
    )


def show(outcomes: Sequence[Outcome], console: Console) -> None:
    """Print a table for each kind of case."""
    for kind, title in TITLES.items():
        chosen = [outcome for outcome in outcomes if outcome.case.kind == kind]
        if not chosen:
            continue
        table = Table(title=title, title_justify="left", show_lines=True)
        for column in COLUMNS:
            table.add_column(column, overflow="fold")
        for outcome in chosen:
            *texts, verdict = _row(outcome)
            table.add_row(*map(escape, texts), f"[{_COLOURS[verdict]}]{verdict}[/]")
        console.print(table)


def markdown(outcomes: Sequence[Outcome]) -> str:
    """Format the tables as Markdown, with score and versions."""
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("tiengine", "taichi", "numpy", "scipy"))
    lines = [
        f"{_score(outcomes)} Python {platform.python_version()}, {versions}.",
        "Where a case has many numbers, the one that uses most of its tolerance is shown.",
    ]
    for kind, title in TITLES.items():
        chosen = [outcome for outcome in outcomes if outcome.case.kind == kind]
        if chosen:
            lines += ["", f"**{title}**", "", _line(COLUMNS), _line(["---"] * len(COLUMNS))]
            lines += [_line(_row(outcome)) for outcome in chosen]
    return "\n".join(lines) + "\n"


def headlines(outcomes: Sequence[Outcome], names: Sequence[str]) -> str:
    """Format the README's table: the score, and a few selected cases."""
    columns = ("quantity", "reference", "ours", "tolerance", "source")
    lines = [f"{_score(outcomes)} All of them: [table](validation/report/verification.md).", ""]
    lines += [_line(columns), _line(["---"] * len(columns))]
    for outcome in outcomes:
        if outcome.case.name in names and outcome.verdict != "not run":
            cells = (outcome.case.quantity, outcome.reference, outcome.ours, outcome.tolerance, outcome.case.source)
            lines.append(_line(cells))
    return "\n".join(lines) + "\n"


def _score(outcomes: Sequence[Outcome]) -> str:
    judged = [outcome for outcome in outcomes if outcome.verdict in ("ok", "MISS")]
    missed = [outcome.case.name for outcome in judged if outcome.verdict == "MISS"]
    waiting = sum(outcome.verdict == "not run" for outcome in outcomes)
    return (
        f"`python -m validation`: {len(judged) - len(missed)} of {len(judged)} cases met"
        + (f"; missed: {', '.join(missed)}" if missed else "")
        + (f"; {waiting} not run since what they test has changed." if waiting else ".")
    )


def keep(outcomes: Sequence[Outcome], file: Path, cases: Sequence[Case]) -> list[Outcome]:
    """Add outcomes to those of earlier runs, so that a few cases can be computed again without the others.

    Args:
        outcomes: New outcomes.
        file: JSON with the texts of each case, rewritten.
        cases: All cases; outcomes of cases that no longer exist are dropped.

    Returns:
        Outcomes of all cases in their order; those of which the file knows nothing are "not run".
    """
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    for outcome in outcomes:
        known[outcome.case.name] = {name: getattr(outcome, name) for name in TEXTS}
    known = {case.name: known[case.name] for case in cases if case.name in known}
    file.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
    return [Outcome(case, **known.get(case.name, {"verdict": "not run"})) for case in cases]


def insert(text: str, file: Path) -> None:
    """Insert a text between the markers of a Markdown file; without markers, they are added at its end."""
    old = file.read_text(encoding="utf-8") if file.exists() else ""
    if BEGIN not in old or END not in old:
        old = f"{old.rstrip()}\n\n{BEGIN}\n{END}\n".lstrip()
    before, rest = old.split(BEGIN, 1)
    after = rest.split(END, 1)[1]
    file.write_text(f"{before}{BEGIN}\n{text}{END}{after}", encoding="utf-8")


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
