"""Cost of checkpoints and commits, as a share of the loop.

Counted: the time of one checkpoint (state, commit, file) every 60 s and of one commit every 5 s (less often if it
took more than 1 % of that), each with the data written in the meantime. Directly: blocks of steps with and without a
commit and a checkpoint after each, in turn; their difference, which includes the effect on caches, at the rates of
a real run.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from threadpoolctl import threadpool_limits

from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import load_scenario, to_toml
from tiengine.simulation.collector import COMMIT_SHARE, FLUSH_SECONDS, Collector
from tiengine.simulation.messages import Begun, Saved
from tiengine.simulation.restart import save
from tiengine.simulation.simulate import CHECKPOINT_SECONDS, _groups
from tiengine.simulation.stream import facts_at_start
from tiengine.simulation.tasks import plan
from tiengine.simulation.time_loop import Run

__all__ = ["Overhead", "overhead"]


@dataclass(frozen=True)
class Overhead:
    """Costs of a run with default outputs.

    Attributes:
        trains: Number of trains advanced together.
        chunk: Wall time of a thousand steps, including writing [s].
        commit: Wall time of a commit after the chunks of 5 s [s].
        checkpoint: Wall time of a checkpoint, including its commit [s].
        counted: Share of the loop, counted.
        difference: Difference between blocks with and without a checkpoint [s].
        direct: Share of the loop, measured directly.
    """

    trains: int
    chunk: float
    commit: float
    checkpoint: float
    counted: float
    difference: float
    direct: float


def overhead(folder: Path, trains: int, repeats: int) -> Overhead:
    """Measure the costs.

    Args:
        folder: Folder of the result.
        trains: Number of trains advanced together.
        repeats: Number of repeats of each.
    """
    settings = ["train.distance=100000", f"ensemble.size={trains}"]
    scenario = load_scenario("paper", settings)
    path = folder / f"overhead{trains}.h5"
    with threadpool_limits(1), Writer(path, to_toml(scenario), {}, [], _groups(scenario)) as writer:
        (task,) = plan(scenario)
        run = Run.begin(task)
        collector = Collector(scenario, writer, path)
        collector.take(Begun(0, run.labels, facts_at_start(task, run.stepper.ingredients, run.tracks)))
        measure = _Measure(run, collector, writer)
        measure.block(3)
        plain, with_one = [], []
        for _ in range(repeats):
            plain.append(measure.block(1))
            with_one.append(measure.block(1) + measure.checkpoint())
        chunk = median(plain)
        between = max(round(FLUSH_SECONDS / chunk), 1)
        few = max(repeats // 4, 3)
        commits = [measure.commit_after(between) for _ in range(few)]
        checkpoints = [measure.checkpoint_after(between) for _ in range(few)]
        size = path.stat().st_size
    path.unlink()
    for each in folder.glob(f".{path.name}*"):
        each.unlink()
    assert size > 0
    commit, checkpoint = median(commits), median(checkpoints)
    difference = median(b - a for a, b in zip(plain, with_one, strict=True))
    per_second = 1.0 / CHECKPOINT_SECONDS
    often = commit / max(FLUSH_SECONDS, commit / COMMIT_SHARE)
    counted, direct = (often + each * per_second for each in (checkpoint, difference))
    return Overhead(trains, chunk, commit, checkpoint, counted, difference, direct)


class _Measure:
    """A run that is advanced a chunk of steps at a time."""

    def __init__(self, run: Run, collector: Collector, writer: Writer) -> None:
        self._run, self._collector, self._writer = run, collector, writer
        self._blocks = run.blocks()

    def block(self, chunks: int) -> float:
        """Advance and write without a commit."""
        clock = time.perf_counter()
        for _ in range(chunks):
            self._collector._committed = clock + 1e9  # none of its own
            self._collector.take(next(self._blocks))
        return time.perf_counter() - clock

    def checkpoint(self) -> float:
        """Write a checkpoint, as a run does every 60 s."""
        clock = time.perf_counter()
        saved = save(self._run, 0.0)
        self._collector.take(Saved(self._run.task.trains, saved))
        return time.perf_counter() - clock

    def commit_after(self, chunks: int) -> float:
        """Time of a commit after some chunks."""
        self.block(chunks)
        clock = time.perf_counter()
        self._writer.commit()
        return time.perf_counter() - clock

    def checkpoint_after(self, chunks: int) -> float:
        """Time of a checkpoint after some chunks."""
        self.block(chunks)
        return self.checkpoint()
