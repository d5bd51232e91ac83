"""Findings of the cases, kept as JSON from one run to the next, and compared with the targets."""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import psutil

from tiengine.profiling.machine import this_machine, versions
from validation.speed.runs import CASES

__all__ = ["Circumstances", "Findings", "Row", "circumstances", "read", "rows", "write"]

FORMAT, FORMAT_VERSION = "tiengine-speed", 2
BUSY = 0.25  # cores used by others, above which comparisons remain valid but absolute times do not
MISSING = "not measured"


@dataclass(frozen=True)
class Circumstances:
    """Date, effort and machine of a measurement.

    Attributes:
        date: Local time.
        effort: Name of the effort.
        commit: Commit of the source, with "+" if files differ from it.
        load_average: Load average of the last minute at the start.
        others_cores: Cores that other processes used at the start.
        machine: The computer.
        versions: Python and packages.
    """

    date: str
    effort: str
    commit: str
    load_average: float
    others_cores: float
    machine: dict[str, Any]
    versions: dict[str, str]

    @property
    def busy(self) -> bool:
        """Whether other processes were using the machine."""
        return self.others_cores > BUSY


@dataclass(frozen=True)
class Findings:
    """Findings of one case.

    Attributes:
        values: Numbers by key, unit in the key's name.
        data: Tables for figures, in JSON's types.
    """

    values: dict[str, float | str]
    data: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """A quantity with its target.

    Attributes:
        case: Name of the case.
        key: Key of the value.
        quantity: Description.
        unit: Unit.
        measured: Value.
        target: Required value, None for information.
        rule: "at most" or "at least".
        met: Verdict, None for information.
        limit: Reason of the limit.
    """

    case: str
    key: str
    quantity: str
    unit: str
    measured: float
    target: float | None
    rule: str
    met: bool | None
    limit: str


def circumstances(effort: str, date: str) -> Circumstances:
    """Observe the machine for a second."""
    cores = os.cpu_count() or 1
    others = psutil.cpu_percent(interval=1.0) / 100.0 * cores
    return Circumstances(date, effort, _commit(), psutil.getloadavg()[0], others, asdict(this_machine()), versions())


def _commit() -> str:
    """Commit of the source."""
    words = ("git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty=+", "--exclude=*")
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "unknown"


def read(path: Path) -> dict[str, Any]:
    """Cases of a file of findings, by name; none if the file is missing or of another version."""
    if not path.is_file():
        return {}
    kept = json.loads(path.read_text(encoding="utf-8"))
    if (kept.get("format"), kept.get("format_version")) != (FORMAT, FORMAT_VERSION):
        return {}
    cases: dict[str, Any] = kept["cases"]
    return cases


def write(path: Path, cases: Mapping[str, Any]) -> None:
    """Write cases and rows."""
    known = rows(cases)
    content = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "rows": [asdict(row) for row in known],
        "cases": cases,
    }
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def rows(cases: Mapping[str, Any]) -> list[Row]:
    """Rows of ``cases.toml`` whose cases were measured.

    Args:
        cases: By name, each with ``values``.
    """
    values = {f"{case}.{key}": value for case, found in cases.items() for key, value in found["values"].items()}
    return [_row(table, values) for table in CASES["rows"] if table["key"] in values]


def _row(table: Mapping[str, Any], values: Mapping[str, float | str]) -> Row:
    target, rule, measured = table.get("target"), table.get("rule", "at most"), float(values[table["key"]])
    met = None if target is None else measured <= target if rule == "at most" else measured >= target
    case, _, key = table["key"].partition(".")
    quantity, limit = (_filled(table[name], values) for name in ("quantity", "limit"))
    return Row(case, key, quantity, table.get("unit", ""), measured, target, rule, met, limit)


def _filled(text: str, values: Mapping[str, float | str]) -> str:
    """Insert numbers into a text: ``{case.key:format}``."""

    def number(match: re.Match[str]) -> str:
        key, _, form = match[1].partition(":")
        return format(values[key], form) if key in values else MISSING

    return re.sub(r"\{([^}]+)\}", number, text)
