"""Collector of the messages that the trains of a run send: writes their samples and sums up their costs."""

from __future__ import annotations

import math
import os
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tiengine.parameters.errors import InputError
from tiengine.result_files.checkpoint import Checkpoint, checkpoint_path
from tiengine.result_files.events import Event
from tiengine.result_files.reader import COMPLETE, RUNNING, Reader
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import Scenario, duration
from tiengine.simulation.messages import Advanced, Begun, Costs, Ended, Lost, Message, Paused, Saved
from tiengine.simulation.peak_memory import peak_memory

__all__ = ["Collector", "Notify", "Progress"]

Progress = Callable[[float, float], None]
Notify = Callable[[str], None]

FLUSH_SECONDS = 5.0
"""Wall time after which written samples are committed to disk [s]: a commit takes about 20 ms for one train."""

COMMIT_SHARE = 0.01
"""Largest share of the wall time for commits: on a slow disk, or with many trains, they are rarer."""

ONLY_OF_TRAINS = ("wall_time_loop", "trains_together", "status", "vehicles")


class Collector:
    """Results received so far.

    Attributes:
        failed: Reasons why trains failed, by their number.
        refused: Trains whose scenario was refused.
        latest: Last checkpoint of every unfinished task, by its number.
        ended: Trains that send nothing more.
        notify: Called with a sentence for each event.
    """

    def __init__(
        self,
        scenario: Scenario,
        writer: Writer,
        path: Path | None = None,
        progress: Progress | None = None,
        notify: Notify | None = None,
    ) -> None:
        """Begin with no results.

        Args:
            scenario: The whole ensemble.
            writer: The open file.
            path: Its path, for checkpoints in the same folder; None in memory.
            progress: Called with simulated and whole time [s], of all trains together.
            notify: Called with a sentence for each event.
        """
        self.latest: dict[int, Checkpoint] = {}
        self.ended: set[int] = set()
        self._path = path
        self.notify: Notify = notify or (lambda words: None)
        self._told: set[str] = set()
        self._committed, self._pause = time.perf_counter(), FLUSH_SECONDS
        self.failed: dict[int, str] = {}
        self.refused: set[int] = set()
        self._writer, self._progress = writer, progress
        self._simulated = dict.fromkeys(range(len(scenario.members)), 0.0)
        self._whole = [duration(train) for train in scenario.members]
        self._facts: dict[int, dict[str, Any]] = {i: {} for i in self._simulated}
        self._costs: list[Costs] = []
        self._writing = 0.0

    def resume(self, latest: Mapping[int, Checkpoint], workers: int) -> None:
        """Take over the results of an earlier session.

        Args:
            latest: Checkpoints of unfinished tasks, by their number.
            workers: Processes that share the remaining work.
        """
        self.latest.update(latest)
        loop = 0.0
        for train, known in self._writer.facts().items():
            self._facts[train] = known
            self._simulated[train] = _number(known, "simulated_time", 0.0)
            status = known.get("status", RUNNING)
            if status not in (COMPLETE, RUNNING):
                self._fail({train: str(status)})
            if status != RUNNING:
                self.ended.add(train)
                loop += _number(known, "wall_time_loop", 0.0) / max(_number(known, "trains_together", 1.0), 1.0)
        self._costs.append(Costs(0, 0.0, 0.0, loop / max(workers, 1), 0.0))

    def take(self, message: Message) -> None:
        """Write a message."""
        clock = time.perf_counter()
        match message:
            case Begun():
                self._begin(message)
            case Advanced(now, blocks, failed, events):
                for train, block in blocks.items():
                    self._writer.write(train, block)
                    self._simulated[train] = now
                self._note(events)
                self._fail(failed)
                if clock - self._committed >= self._pause:
                    self._commit()
            case Saved(trains, checkpoint):
                self._save(trains, checkpoint)
            case Paused():
                pass  # the checkpoint has come before
            case Ended(task, facts, costs):
                self._costs.append(costs)
                self.ended.update(facts)
                for train, known in facts.items():
                    self._writer.describe(train, known | {"status": self.failed.get(train, COMPLETE)})
                    self._facts[train] |= known
                self._commit()
                self._forget(task)
            case Lost(trains, why, refused):
                self._fail(dict.fromkeys(trains, why) | self.failed)
                self.refused.update(trains if refused else ())
                self.ended.update(trains)
                for train in trains:
                    status = {"status": self.failed[train], "simulated_time": self._simulated[train]}
                    self._writer.add(train, None, status)
        self._writing += time.perf_counter() - clock
        if self._progress is not None and isinstance(message, Advanced):
            done = sum(self._simulated.values())
            self._progress(done, max(sum(self._whole), done))

    @property
    def unfinished(self) -> bool:
        """Whether trains have not ended."""
        return len(self.ended) < len(self._facts)

    @property
    def simulated(self) -> tuple[float, float]:
        """Simulated time so far and in all [s], of all trains together."""
        return sum(self._simulated.values()), sum(self._whole)

    def close(self, started: dict[str, float], workers: int) -> Reader:
        """Complete the file.

        Args:
            started: Wall times [s] before the first message, by their purpose.
            workers: Worker processes; 0 if this process did all.
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

    def _begin(self, begun: Begun) -> None:
        """Trains begin, or continue from their checkpoint."""
        saved = self.latest.get(begun.task)
        for train, known in begun.facts.items():
            self._writer.add(train, begun.labels, known | {"status": RUNNING})
            self._facts[train] |= known
            if (words := str(known.get("irregularity_file", ""))) and words not in self._told:
                self._told.add(words)
                self.notify(words)
            if saved is not None:
                self._writer.rewind(train, saved.facts["rows"][str(train)])

    def _save(self, trains: Iterable[int], checkpoint: Checkpoint) -> None:
        """Commit the file first: a checkpoint must not be ahead of it."""
        rows = {str(train): self._writer.rows(train) for train in trains}
        for train in trains:
            self._writer.describe(train, {"simulated_time": self._simulated[train]})
        complete = Checkpoint(checkpoint.task, {**checkpoint.facts, "rows": rows}, checkpoint.arrays)
        self._commit()
        self.latest[checkpoint.task] = complete
        if self._path is None:
            return
        try:
            complete.write(self._path)
        except OSError as error:
            raise InputError(f"output = '{self._path}': its checkpoint cannot be written ({error})") from None

    def _commit(self) -> None:
        clock = time.perf_counter()
        self._writer.commit()
        self._committed = time.perf_counter()
        self._pause = max(FLUSH_SECONDS, (self._committed - clock) / COMMIT_SHARE)

    def _forget(self, task: int) -> None:
        """Remove the checkpoint of a task that has ended."""
        self.latest.pop(task, None)
        if self._path is not None:
            checkpoint_path(self._path, task).unlink(missing_ok=True)

    def _note(self, events: Mapping[int, Sequence[Event]]) -> None:
        for train, found in events.items():
            self._writer.add_events(train, found)
            of = f"train {train}: " if len(self._facts) > 1 else ""
            for event in found:
                self.notify(f"{of}{event}")

    def _fail(self, failed: dict[int, str]) -> None:
        """Mark trains as failed; they send nothing more."""
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
        """Wall times [s]; among processes that work at the same time the longest counts."""
        spent: dict[str, Counter[int]] = {"jit": Counter(), "setup": Counter(), "loop": Counter()}
        for cost in self._costs:
            for name, per_process in spent.items():
                per_process[cost.process] += getattr(cost, name)
        longest = {name: max(per_process.values(), default=0.0) for name, per_process in spent.items()}
        return {**longest, "writing": self._writing}

    def _memory(self) -> float:
        """Peak memory of all processes together [MB], as if they peaked at the same time."""
        peaks = {cost.process: cost.memory for cost in self._costs}  # a process's later peaks are no smaller
        return sum(peaks.values()) + (0.0 if os.getpid() in peaks else peak_memory())

    def _common(self) -> dict[str, Any]:
        """Facts that hold for every train."""
        first, *others = [known for known in self._facts.values() if known] or [{}]
        rows = {key: value for key, value in first.items() if key not in ONLY_OF_TRAINS}
        return {key: value for key, value in rows.items() if all(known.get(key) == value for known in others)}


def _number(known: Mapping[str, Any], key: str, default: float) -> float:
    """A fact of a train in the file that is being continued.

    Raises:
        InputError: It is no finite number.
    """
    try:
        value = float(known.get(key, default))
    except (TypeError, ValueError):
        value = float("nan")
    if not math.isfinite(value):
        raise InputError(f"{key} = {str(known.get(key))[:80]}: must be a finite number; the file is damaged")
    return value
