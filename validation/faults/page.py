"""Report: a table on the screen, and ``faults.md``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

__all__ = ["page", "rows", "show"]

TARGET = 0.02  # of the loop, for checkpoints
HEAD = ("part", "what was done", "result", "")
VERDICTS = {True: "good", False: "BAD", None: "skipped"}
COLOURS = {True: "green", False: "bold red", None: "yellow"}

Row = tuple[str, str, str, bool | None]
Found = Mapping[str, Any]


def rows(known: Mapping[str, Found]) -> list[Row]:
    """Rows of the table, one per experiment.

    Args:
        known: Findings by part.
    """
    found: list[Row] = []
    for name, part in known.items():
        if "summary" in part:
            found += _kills(name, part)
        if "deaths" in part:
            found.append(_boundaries(name, part))
        found += _checks(name, part.get("checks", []))
        for each in part.get("overhead", []):
            words = f"{each['trains']} train{'s together' if each['trains'] > 1 else ''}: cost of checkpoints"
            said = f"{each['counted']:.2%} of the loop counted, {each['direct']:.2%} directly"
            found.append((name, words, said, max(each["counted"], each["direct"]) < TARGET))
    return found


def show(table_rows: Sequence[Row], console: Console) -> None:
    """Print the table."""
    table = Table(show_lines=True)
    for name in HEAD:
        table.add_column(name, overflow="fold")
    for part, words, said, good in table_rows:
        table.add_row(*map(escape, (part, words, said)), f"[{COLOURS[good]}]{VERDICTS[good]}[/]")
    console.print(table)


def page(known: Mapping[str, Found]) -> str:
    """Markdown.

    Args:
        known: Findings by part, with date, machine and load.
    """
    found = rows(known)
    judged = [row for row in found if row[3] is not None]
    lines = [
        "# Faults",
        "",
        f"{sum(bool(row[3]) for row in judged)} of {len(judged)} good. Written by `python -m validation.faults`;",
        "`docs/robustness.md` states the guarantees.",
        "",
        *_summary(known),
        *_circumstances(known),
    ]
    for part in known.values():
        if "summary" in part:
            lines += ["", f"## kill -9: {part['words']}", "", *_kill_tables(part)]
    if "deaths" in known.get("boundaries", {}):
        lines += ["", "## Death between any two system calls", "", *_boundary_words(known["boundaries"])]
    if "deaths" in known.get("power", {}):
        lines += ["", "## Power cuts", "", *_power_words(known["power"])]
    if "overhead" in known.get("overhead", {}):
        lines += ["", "## Cost of checkpoints", "", *_overhead(known["overhead"]["overhead"])]
    rest = [row for row in found if "checks" in known[row[0]]]
    lines += ["", "## Other faults", ""]
    lines += _table(HEAD, [(part, words, said, VERDICTS[good]) for part, words, said, good in rest])
    return "\n".join(lines) + "\n"


def _kills(name: str, part: Found) -> Iterator[Row]:
    summary = part["summary"]
    said = (
        f"{summary['survived']} of {summary['kills']} ended with the bits of an undisturbed run; committed samples"
        f" lost: in {summary['kills'] - summary['kept']}; at most {summary['lost_bytes_largest'] / 1e6:.2f} MB since"
        " the last commit"
    )
    yield name, f"kill -9 at random instants, {part['words']}", said, summary["survived"] == summary["kills"]


DEATHS = {
    "boundaries": "death at every system call that changes the disk",
    "power": "power cut at every second of these calls, constructed",
}


def _boundaries(name: str, part: Found) -> Row:
    said = (
        f"{part['deaths']} deaths: {part['as_before']} times as of the last commit, {part['as_after']} of the one in"
        f" progress; {len(part['wrong'])} times another state"
    )
    return name, DEATHS[name], said, not part["wrong"]


def _checks(name: str, checks: Sequence[Found]) -> Iterator[Row]:
    for each in checks:
        said = each.get("said", "")
        if "off" in each:
            said = f"{each['estimate'] / 1e6:.2f} MB for {each['true'] / 1e6:.2f} MB: {each['off']:+.1%}"
        if each.get("status") is not None:
            said = f"exit status {each['status']}; {said}"
        if "late" in each:
            said = f"after {each['late'] * 1e3:.1f} ms: {said}"
        wrong = "; ".join(map(str, each.get("wrong", [])))
        yield name, each["words"], _one_line(f"{said} **{wrong}**" if wrong else said), each["good"]


def _summary(known: Mapping[str, Found]) -> Iterator[str]:
    """Sentences about all kills, and about the messages of diverging trains."""
    killed = [part["summary"] for part in known.values() if "summary" in part]
    if killed:
        survived, kills, kept = (sum(each[name] for each in killed) for name in ("survived", "kills", "kept"))
        largest = max(each["lost_bytes_largest"] for each in killed)
        yield f"**kill -9: {survived} of {kills} ended with the same bits, {kills - kept} lost a committed sample.**"
        yield f"At most {largest / 1e6:.1f} MB had been written since the last commit: these runs commit every thousand"
        yield "steps; a run with default settings every 5 s. After the resume nothing is missing."
    spoilt = [each for each in known.get("physics", {}).get("checks", []) if "late" in each]
    if spoilt:
        named = sum(each["named"] for each in spoilt)
        yield f"Of {len(spoilt)} trains whose state was corrupted, each was stopped after"
        yield f"{max(each['late'] for each in spoilt) * 1e3:.1f} ms at most; {named} times the message names the part"
        yield "that was corrupted, otherwise another part, to which it had spread by then."
    yield ""


def _circumstances(known: Mapping[str, Found]) -> list[str]:
    """Table of machine and date of each part."""
    seen = {name: part["circumstances"] for name, part in known.items()}
    lines = list({_machine(each): None for each in seen.values()})
    body = [
        (name, each["date"], each["effort"], each["commit"], f"{each['load_average']:.1f}", f"{part['seconds']:.0f}")
        for (name, each), part in zip(seen.items(), known.values(), strict=True)
    ]
    return [*lines, "", *_table(("part", "begun", "effort", "commit", "load average", "seconds"), body)]


def _machine(seen: Found) -> str:
    machine = seen["machine"]
    versions = ", ".join(f"{name} {version}" for name, version in seen["versions"].items())
    return f"{machine['cpu']}, {machine['cores']} cores, {machine['memory_bytes'] / 2**30:.0f} GiB; {versions}."


def _kill_tables(part: Found) -> list[str]:
    """Counts by kind of kill and phase, then the kills that went wrong."""
    groups: dict[tuple[str, ...], list[Found]] = {}
    for row in part["kills"]:
        kill = row["kill"]
        again = ", and in the resume" if kill["again"] else ""
        groups.setdefault((kill["victim"], f"{kill['moment']}{again}", kill["start"]), []).append(row)
    head = ("victim", "when", "started as", "kills", "survived", "killed in", "opened", "opened by the journal",
            "second kills", "since last commit, largest")  # fmt: skip
    body = []
    for key, group in groups.items():
        phases = sorted({row["phase"] for row in group})
        counts = ", ".join(f"{phase} {sum(row['phase'] == phase for row in group)}" for phase in phases)
        numbers = (sum(row[name] for row in group) for name in ("survived", "opens", "mended"))
        survived, opened, mended = (str(number) for number in numbers)
        twice = str(sum(row["resumed"] > 1 for row in group))
        lost = f"{max(row['lost_bytes'] for row in group) / 1e6:.2f} MB"
        body.append((*key, str(len(group)), survived, counts, opened, mended, twice, lost))
    lines = _table(head, body)
    wrong = [f"- {row['kill']}: {'; '.join(row['wrong'])}" for row in part["kills"] if row["wrong"]]
    return [*lines, "", *(_one_line(each) for each in wrong)]


def _boundary_words(part: Found) -> list[str]:
    sessions = ", ".join(f"{name} {calls}" for name, calls in part["sessions"].items())
    return [
        f"System calls of each session: {sessions}. A copy of the process died before each of them, and in the",
        f"middle of each write: {part['deaths']} times. The file was as of the last commit {part['as_before']} times,",
        f"as of the one in progress {part['as_after']} times; {part['by_journal']} of these only after the journal was",
        "applied by the program that opened the file next, which was interrupted before every call as well,",
        f"{part['twice']} times.",
        f"Other states: {len(part['wrong'])}.",
        *(f"- {_one_line(each)}" for each in part["wrong"][:20]),
    ]


def _power_words(part: Found) -> list[str]:
    return [
        f"{part['deaths']} disks were constructed as a journalling file system may leave them when power fails in the",
        "same sessions: of each file the content at its last fsync and any part of later writes, in any",
        f"order. The file was as of the last commit {part['as_before']} times, as of the one in progress",
        f"{part['as_after']} times, {part['by_journal']} of these with its journal.",
        f"Other states: {len(part['wrong'])}.",
        *(f"- {_one_line(each)}" for each in part["wrong"][:20]),
    ]


def _overhead(found: Sequence[Found]) -> list[str]:
    head = (
        *("trains", "1000 steps", "commit of 5 s of samples", "checkpoint with commit", "share, counted"),
        *("additional time of a block with a checkpoint", "share, directly"),
    )
    body = [
        (str(each["trains"]), f"{each['chunk'] * 1e3:.0f} ms", f"{each['commit'] * 1e3:.1f} ms",
         f"{each['checkpoint'] * 1e3:.1f} ms", f"{each['counted']:.2%}", f"{each['difference'] * 1e3:.1f} ms",
         f"{each['direct']:.2%}")
        for each in found
    ]  # fmt: skip
    return _table(head, body)


def _table(head: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    cells = [[cell.replace("|", "/") for cell in row] for row in (head, ["---"] * len(head), *body)]
    return [f"| {' | '.join(row)} |" for row in cells]


def _one_line(text: str) -> str:
    words = " ".join(text.split())
    return words if len(words) < 500 else f"{words[:250]} ... {words[-240:]}"
