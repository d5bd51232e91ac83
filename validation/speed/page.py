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
        "simulated time, of the loop, writing included, with default outputs. Medians; compared runs took turns.",
        "Limits are computed from the measurement and shown where a target is missed.",
        "Written by `python -m validation.speed`.",
        "",
        *_circumstances(cases),
        "",
        *_table(HEAD, [_cells(row) for row in rows]),
    ]
    lines += ["", "**Rounds**: real-time factors (batches: per train)", "", *_rounds(cases)]
    if "roofline" in cases:
        lines += ["", "**Stages of the spline step** against the roofline of one core", ""]
        lines += _roofline(cases["roofline"]["data"])
    if "scaling" in cases:
        lines += ["", "**Cost of a step**: exponents over the whole and the upper range", ""]
        lines += _scaling(cases["scaling"]["data"])
    if "full_length" in cases:
        found = cases["full_length"]["data"]
        lines += ["", "**Accuracy**: errors of the normal forces over the largest force [%]", "", *_accuracy(found)]
        lines += ["", "**A step of the full-length model** [µs]", "", *_full_length(found["profile"])]
    if "features" in cases:
        lines += ["", "**Features**: one car with each in turn, over the same distance", ""]
        lines += _features(cases["features"]["data"]["features"])
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
    return (row.case.replace("_", " "), row.quantity, f"{row.measured:.3g}{unit}", target, VERDICTS[row.met],
            "" if row.met else row.limit)  # fmt: skip


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


def _roofline(data: Mapping[str, Any]) -> list[str]:
    """Table of the stages of every group; times and counts are those of a train-step."""
    head = ("trains", "stage", "µs (estimate)", "kflop", "kB", "GFLOP/s", "of the roof")
    body = []
    for group in data.values():
        for stage in group["stages"]:
            us = max(stage["us"], 1e-9)
            numbers = (stage["us"], stage["flops"] / 1e3, stage["traffic"] / 1e3, stage["flops"] / us / 1e3)
            cells = (*(f"{number:.1f}" for number in numbers), f"{stage['floor_us'] / us:.0%}")
            body.append((_group(group), stage["name"], *cells))
        body.append((_group(group), "whole step of the loop", f"{group['step_us']:.1f}", "", "", "", ""))
        launch = f"a launch, every {group['steps_a_launch']:.1f} steps"
        body.append((_group(group), launch, f"{group['launch_us']:.1f}", "", "", "", ""))
    return _table(head, body)


def _features(data: Sequence[Mapping[str, Any]]) -> list[str]:
    """Table of the cost of each feature; the first row is the car without any."""
    head = ("feature", "time step [s]", "µs a step", "added by the feature", "spread of the rounds")
    body = [
        (row["words"], f"{row['time_step']:g}", f"{row['us']:.1f}", f"{row['added']:+.1f}" if i else "",
         f"{row['spread']:.1f}")
        for i, row in enumerate(data)
    ]  # fmt: skip
    return _table(head, body)


def _group(group: Mapping[str, Any]) -> str:
    """Trains of a group."""
    return f"{group['trains']} x {group['words']}"


def _scaling(data: Mapping[str, Any]) -> list[str]:
    body = [
        (
            axis["words"],
            ", ".join(f"{x:.3g}: {us:.0f}" for x, us in zip(axis["x"], axis["us"], strict=True)),
            f"{axis['exponent']:.2f}",
            f"{axis['exponent_upper']:.2f}",
        )
        for axis in data.values()
    ]
    return _table(("against", "µs per step (trains: per train-step)", "exponent", "upper half"), body)


def _accuracy(data: Mapping[str, Any]) -> list[str]:
    found = data["accuracy"]
    named = [("default", found["default"])]
    named += [
        (f"full length, {density:g} sines per metre, {1e6 * step:g} µs", error)
        for (density, step), error in zip(found["numerics"], found["full_length"], strict=True)
    ]
    body = [(words, f"{error['largest']:.2f}", f"{error['p99']:.2f}") for words, error in named]
    return _table(("run", "largest", "99th percentile"), body)


def _full_length(profile: Mapping[str, Any]) -> list[str]:
    body = [(name, f"{us:.0f}") for name, us in profile["stages_us_per_step"].items()]
    return _table(("stage", "µs"), [*body, ("whole step", f"{profile['us_per_step']:.0f}")])


def _lengths(rows: Sequence[Mapping[str, float]]) -> list[str]:
    keys = ("length_km", "loop_s", "loop_s_per_km", "rtf", "peak_memory_mb", "file_mb")
    return _table(keys, [tuple(f"{row[key]:.4g}" for key in keys) for row in rows])


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *body)]
