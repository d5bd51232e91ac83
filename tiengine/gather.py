"""Writing what the trains of a run send, and counting it."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from tiengine.march import Advanced, Begun, Costs, Ended, Lost, Message
from tiengine.memory import peak_memory
from tiengine.results import COMPLETE, Result
from tiengine.scenario import Scenario
from tiengine.writer import Writer

__all__ = ["Gathering", "Progress"]

Progress = Callable[[float, float], None]

RUNNING = "running"
ONLY_OF_TRAINS = ("wall_time_loop", "trains_together", "status")


class Gathering:
    """What has come so far.

    Attributes:
        failed: Why trains failed, by their number.
        refused: Trains whose scenario is to blame.
    """

    def __init__(self, scenario: Scenario, writer: Writer, progress: Progress | None) -> None:
        """Begin with nothing.

        Args:
            scenario: The whole ensemble.
            writer: The open file.
            progress: Called with simulated and whole time [s], of all trains together.
        """
        self.failed: dict[int, str] = {}
        self.refused: set[int] = set()
        self._writer, self._progress = writer, progress
        self._simulated = dict.fromkeys(range(len(scenario.members)), 0.0)
        self._whole = [_duration(train) for train in scenario.members]
        self._facts: dict[int, dict[str, Any]] = {i: {} for i in self._simulated}
        self._costs: list[Costs] = []
        self._writing = 0.0

    def take(self, message: Message) -> None:
        """Write a message."""
        clock = time.perf_counter()
        match message:
            case Begun(labels, facts):
                for train, known in facts.items():
                    self._writer.add(train, labels, known | {"status": RUNNING})
                    self._facts[train] |= known
            case Advanced(now, blocks, failed):
                for train, block in blocks.items():
                    self._writer.write(train, block)
                    self._simulated[train] = now
                self._fail(failed)
            case Ended(facts, costs):
                self._costs.append(costs)
                for train, known in facts.items():
                    self._writer.describe(train, known | {"status": self.failed.get(train, COMPLETE)})
                    self._facts[train] |= known
            case Lost(trains, why, refused):
                self._fail(dict.fromkeys(trains, why) | self.failed)
                self.refused.update(trains if refused else ())
                for train in trains:
                    status = {"status": self.failed[train], "simulated_time": self._simulated[train]}
                    self._writer.add(train, None, status)
        self._writing += time.perf_counter() - clock
        if self._progress is not None and isinstance(message, Advanced):
            done = sum(self._simulated.values())
            self._progress(done, max(sum(self._whole), done))

    def close(self, started: dict[str, float], workers: int) -> Result:
        """Complete the file.

        Args:
            started: Wall times [s] before the first message, by what they were for.
            workers: Worker processes; 0 if all was done here.
        """
        simulated = sum(self._simulated.values())
        walls = started | self._walls()
        attributes: dict[str, Any] = {
            **self._common(),
            **{f"wall_time_{name}": seconds for name, seconds in walls.items()},
            "status": self._status(),
            "simulated_time": simulated,
            "steps": sum(known.get("steps", 0) for known in self._facts.values()),
            "contact_iterations": max(known.get("contact_iterations", 0) for known in self._facts.values()),
            "real_time_factor": walls["loop"] / simulated if simulated else float("nan"),
            "peak_memory": self._memory(),
        }
        if len(self._facts) > 1:
            attributes |= {"trains": len(self._facts), "workers": workers}
        return self._writer.close(attributes)

    def _fail(self, failed: dict[int, str]) -> None:
        """Mark trains; nothing more will come of them."""
        self.failed |= failed
        for train in failed:
            self._whole[train] = self._simulated[train]

    def _status(self) -> str:
        if not self.failed:
            return COMPLETE
        if len(self._facts) == 1:
            return f"train 0: {self.failed[0]}"
        return f"{len(self.failed)} of {len(self._facts)} trains failed"

    def _walls(self) -> dict[str, float]:
        """Wall times [s]: of processes that work at the same time that of the longest."""
        spent: dict[str, Counter[int]] = {"jit": Counter(), "setup": Counter(), "loop": Counter()}
        for cost in self._costs:
            for name, per_process in spent.items():
                per_process[cost.process] += getattr(cost, name)
        longest = {name: max(per_process.values(), default=0.0) for name, per_process in spent.items()}
        return {**longest, "writing": self._writing}

    def _memory(self) -> float:
        """Peak of all processes together [MB], as if they had their peaks at once."""
        peaks = {cost.process: cost.memory for cost in self._costs}  # a process's later marks are no smaller
        return sum(peaks.values()) + (0.0 if os.getpid() in peaks else peak_memory())

    def _common(self) -> dict[str, Any]:
        """Facts that hold for every train."""
        first, *others = [known for known in self._facts.values() if known] or [{}]
        rows = {key: value for key, value in first.items() if key not in ONLY_OF_TRAINS}
        return {key: value for key, value in rows.items() if all(known.get(key) == value for known in others)}


def _duration(train: Scenario) -> float:
    """Time that the way takes [s], for the progress bar."""
    start = train.rear + train.centre_in_window
    x = np.linspace(start, start + train.train.distance, 200)
    slowness = np.array([1.0 / train.train.speed.at(float(here))[0] for here in x])
    return float(np.trapezoid(slowness, x))
