"""Cases as data: ``cases.toml``."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["CHECKPOINT", "RUNS", "SEED", "Kill", "Run", "kills"]

DATA = tomllib.loads((Path(__file__).parent / "cases.toml").read_text(encoding="utf-8"))
SEED = 6
CHECKPOINT: float = DATA["common"]["checkpoint"]


@dataclass(frozen=True)
class Run:
    """A run to disturb.

    Attributes:
        words: Description.
        scenario: Built-in scenario.
        settings: Overrides ``KEY=VALUE``.
        workers: Number of processes.
    """

    words: str
    scenario: str
    settings: tuple[str, ...]
    workers: int = 1

    @property
    def arguments(self) -> list[str]:
        """Arguments of the command, without its output."""
        chosen = [word for each in (*DATA["common"]["settings"], *self.settings) for word in ("--set", each)]
        return ["run", self.scenario, *chosen, *self.effort]

    @property
    def effort(self) -> list[str]:
        """Arguments that ``resume`` accepts as well."""
        return ["--workers", str(self.workers), "--checkpoint", str(CHECKPOINT), "--quiet"]

    def shorter(self, metres: float) -> Run:
        """The same run over another distance."""
        return replace(self, settings=(*self.settings, f"train.distance={metres:g}"))


RUNS = {name: Run(**table | {"settings": tuple(table["settings"])}) for name, table in DATA["runs"].items()}


@dataclass(frozen=True)
class Kill:
    """A process to kill at some instant.

    Attributes:
        run: Name of the run.
        victim, moment, start, again: See ``cases.toml``.
        part: Share of the time that the moment leaves open, 0...1.
        then: The same for the second kill.
        event: Instead of the moment: event of the writer (:mod:`validation.faults.record`) at which a copy stands still
            until it is killed, whatever the pace of the machine; 0 for none.
    """

    run: str
    victim: str
    moment: str
    start: str
    part: float
    then: float
    again: bool = False
    event: int = 0


def kills(run: str, share: float = 1.0, seed: int = SEED) -> list[Kill]:
    """All kills of a run.

    Args:
        run: Name of the run.
        share: Share of the counts, rounded up.
        seed: Seed of the instants.
    """
    rng = np.random.default_rng([seed, len(run)])
    (table,) = (each for each in DATA["kills"] if each["run"] == run)
    found: list[Kill] = []
    counts: Sequence[dict[str, Any]] = table["counts"]
    for each in counts:
        what = {key: value for key, value in each.items() if key != "count"}
        for _ in range(max(round(share * each["count"]), 1)):
            part, then = (float(x) for x in rng.uniform(size=2))
            found.append(Kill(run=run, part=part, then=then, **what))
    return found
