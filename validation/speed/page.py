"""Report: a table on the screen, and ``speed.md``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from statistics import median
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from validation.speed.findings import Row
from validation.speed.runs import RUNS

__all__ = ["busy_words", "page", "show"]

HEAD = ("case", "quantity", "measured", "target", "", "limit")
VERDICTS = {True: "met", False: "MISS", None: ""}
COLOURS = {True: "green", False: "bold red", None: "dim"}


def show(rows: Sequence[Row], console: Console) -> None:
    """Print the table."""
    table = Table(show_lines=True)
    for name in HEAD:
        table.add_column(name, overflow="fold")
    for row in rows:
        *texts, verdict, limit = _cells(row)
        table.add_row(*map(escape, texts), f"[{COLOURS[row.met]}]{verdict}[/]", escape(limit))
    console.print(table)


def page(rows: Sequence[Row], cases: Mapping[str, Any], figures: Sequence[str]) -> str:
    """Markdown.

    Args:
        rows: Quantities with their targets.
        cases: Findings by case, with their circumstances.
        figures: Files next to the page.
    """
    judged = [row for row in rows if row.met is not None]
    lines = [
        "# Speed",
        "",
        f"{sum(bool(row.met) for row in judged)} of {len(judged)} targets met. Real-time factor (RTF): wall time over",
        "simulated time, of the loop, writing included. Medians; compared runs took turns.",
        "Written by `python -m validation.speed`.",
        "",
        *_circumstances(cases),
        "",
        *_table(HEAD, [_cells(row) for row in rows]),
    ]
    lines += ["", "**Rounds**: real-time factors (batches: per train)", "", *_rounds(cases)]
    if "scaling" in cases:
        lines += [
            "",
            "**Cost of a step**: exponents over the whole and the upper range, largest stages at the last point",
            "",
        ]
        lines += _scaling(cases["scaling"]["data"])
    if "full_length" in cases:
        lines += ["", "**A step of the full-length model** [µs]", "", *_full_length(cases["full_length"]["data"])]
    if "length" in cases:
        lines += ["", "**Distance**, few outputs", "", *_lengths(cases["length"]["data"]["lengths"])]
    pictures = [f"![{name.removesuffix('.png').replace('_', ' ')}]({name})" for name in figures]
    return "\n".join([*lines, "", *pictures]) + "\n"


def busy_words(case: str, seen: Mapping[str, Any]) -> str:
    """Warning for a case that was measured on a busy machine."""
    return f"{case}: other processes used {seen['others_cores']:.1f} cores at the start; absolute times are too long"


def _cells(row: Row) -> tuple[str, ...]:
    unit = f" {row.unit}" if row.unit else ""
    bound = "≤" if row.rule == "at most" else "≥"
    target = "" if row.target is None else f"{bound} {row.target:g}{unit}"
    return (row.case.replace("_", " "), row.quantity, f"{row.measured:.3g}{unit}", target, VERDICTS[row.met], row.limit)


def _circumstances(cases: Mapping[str, Any]) -> Iterator[str]:
    """Machine and versions, once if all cases share them, then date and load of each case."""
    seen = {name: found["circumstances"] for name, found in cases.items()}
    for machine in {_machine(each): None for each in seen.values()}:
        yield f"{machine}"
    yield ""
    yield from _table(
        ("case", "measured", "effort", "commit", "load average at the start", "cores used by others then"),
        [
            (name.replace("_", " "), each["date"], each["effort"], each["commit"], f"{each['load_average']:.2f}",
             f"{each['others_cores']:.2f}")
            for name, each in seen.items()
        ],
    )  # fmt: skip


def _machine(seen: Mapping[str, Any]) -> str:
    machine = seen["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in seen["versions"].items())
    memory = machine["memory_bytes"] / 2**30
    return f"{machine['cpu']}, {machine['cores']} cores, {memory:.0f} GiB; {machine['blas']}; {versions}."


def _rounds(cases: Mapping[str, Any]) -> list[str]:
    """Table of the spread of the rounds of every run."""
    body = []
    for found in cases.values():
        for run, rounds in found["data"].get("rounds", {}).items():
            ordered = sorted(rounds["rtf"])
            numbers = (ordered[0], median(ordered), ordered[-1])
            others = ", ".join(f"{x:.1f}" for x in rounds["others_cores"])
            body.append((RUNS[run].words, str(len(ordered)), *(f"{x:.3f}" for x in numbers), others))
    return _table(("run", "rounds", "least", "median", "largest", "cores that others used in each round"), body)


def _scaling(data: Mapping[str, Any]) -> list[str]:
    body = [
        (
            axis["words"],
            ", ".join(f"{x:g}: {us:.0f}" for x, us in zip(axis["x"], axis["us"], strict=True)),
            f"{axis['exponent']:.2f}",
            f"{axis['exponent_upper']:.2f}",
            _largest(axis["shares_last"]),
        )
        for axis in data.values()
        if "shares_last" in axis
    ]
    for kind, words, limit in (
        ("interval", "steps between samples of everything", "recording of bodies and pressures, writing"),
        ("channels", "channels of a wheel", "writing; a channel costs less than the noise"),
    ):
        axis = data["outputs"][kind]
        values = ", ".join(f"{x:g}: {us:.0f}" for x, us in zip(axis["x"], axis["us"], strict=True))
        body.append((words, values, f"{axis['exponent']:.2f}", "", limit))
    return _table(("against", "µs per step (trains: per train-step)", "exponent", "upper half", "largest stages"), body)


def _largest(shares: Mapping[str, float]) -> str:
    return ", ".join(f"{name} {share:.0%}" for name, share in list(shares.items())[:3])


def _full_length(data: Mapping[str, Any]) -> list[str]:
    profiles = data["profiles"]
    names = list(dict.fromkeys(name for each in profiles.values() for name in each["stages_us_per_step"]))
    body = [
        (name, *(f"{each['stages_us_per_step'].get(name, 0.0):.0f}" for each in profiles.values())) for name in names
    ]
    body.append(("whole step", *(f"{each['us_per_step']:.0f}" for each in profiles.values())))
    return _table(("stage", *(f"{modes} modes per slab" for modes in profiles)), body)


def _lengths(rows: Sequence[Mapping[str, float]]) -> list[str]:
    keys = ("length_km", "loop_s", "loop_s_per_km", "rtf", "peak_memory_mb", "file_mb")
    return _table(keys, [tuple(f"{row[key]:.4g}" for key in keys) for row in rows])


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *body)]
