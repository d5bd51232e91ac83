"""Timers in the loop of a run: between the parts of a chunk and between the stages of a step.

Blocks of steps without stage timers and with them take turns, so that the cost of measuring is measured as well.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from tiengine.engine.stepper import BETWEEN_STEPS, Plan, Stepper
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.result_files.writer import Writer
from tiengine.simulation.time_loop import CHUNK_STEPS, LoopTimer, Run

__all__ = ["StageTimer", "Times", "displayed_name", "measure", "plain_steps"]

BLOCK_STEPS = 100

plain_steps = LoopTimer().take
"""Steps as a run takes them."""

DISPLAYED_NAMES = {
    "predict": "predictors and correctors",
    "correct": "predictors and correctors",
    "prepare": "window and seats",
    "factors": "motion at the seats",
    "seats": "motion at the seats",
    "rails": "linear forces",
    "slabs": "linear forces",
    "trains": "linear forces",
    "forces and contact": "fastening kernel",
    "solve": "implicit solve",
}
"""Names of stages in reports; several stages may share one, those not listed keep their own."""


def displayed_name(stage: str) -> str:
    """Name of a stage of the stepper in reports."""
    return DISPLAYED_NAMES.get(stage, stage)


@dataclass
class Times:
    """Wall times of the loop [ns].

    Attributes:
        calls: Calls of each stage in a step, by its displayed name.
        stages: Time of each stage over the timed steps.
        chunks: Time of the work that is done once a chunk, over all steps.
        timed: Time of the steps that are taken at once, with stage timers.
        blocks: Mean time of a step in a block with stage timers and in its neighbour without.
        timed_ns: Time of all blocks with stage timers.
        plain_ns: Time of all blocks without.
        timed_steps: Steps in the blocks with stage timers.
        plain_steps: Steps in the blocks without.
    """

    calls: dict[str, int]
    stages: dict[str, int] = field(default_factory=dict)
    chunks: dict[str, int] = field(default_factory=dict)
    timed: list[int] = field(default_factory=list)
    blocks: list[tuple[float, float]] = field(default_factory=list)
    timed_ns: int = 0
    plain_ns: int = 0
    timed_steps: int = 0
    plain_steps: int = 0

    @classmethod
    def of(cls, stepper: Stepper) -> Times:
        """No times yet, for the stages of a stepper."""
        names = [displayed_name(name) for name, _ in (*stepper.stages, *stepper.watchers)]
        return cls({name: names.count(name) for name in names})


class StageTimer(LoopTimer):
    """Measures the loop of a run.

    Attributes:
        times: Times measured so far.
        block: Steps in a block.
    """

    def __init__(self, times: Times, block: int) -> None:
        """Measure into ``times``."""
        self.times, self.block = times, block
        self._last = 0
        self._marks: list[tuple[str, int]] = []

    def lap(self, name: str | None) -> None:
        """Add the time since the last call to a part of the work that is done once a chunk."""
        now = time.perf_counter_ns()
        if name is not None:
            self.times.chunks[name] = self.times.chunks.get(name, 0) + now - self._last
        self._last = now

    def take(self, stepper: Stepper, plan: Plan) -> None:
        """Take the steps of a chunk, blocks without and with stage timers in turn."""
        for first in range(0, len(plan.step), 2 * self.block):
            plain, timed = (plan.part(at, at + self.block) for at in (first, first + self.block))
            start = time.perf_counter_ns()
            plain_steps(stepper, plain)
            without = time.perf_counter_ns() - start
            self.times.plain_ns += without
            self.times.plain_steps += len(plain.step)
            if len(timed.step):
                spent = self.take_timed(stepper, timed)
                self.times.blocks.append((spent / len(timed.step), without / len(plain.step)))

    def take_timed(self, stepper: Stepper, plan: Plan) -> int:
        """Take steps with stage timers.

        Returns:
            Time of all of them [ns].
        """
        self._marks.clear()
        clock, append = time.perf_counter_ns, self._marks.append
        stepper.time_stages(lambda name: append((name, clock())))
        start = clock()
        plain_steps(stepper, plan)
        end = clock()
        stepper.time_stages(None)
        self._add_marks(start, end)
        self.times.timed_ns += end - start
        self.times.timed_steps += len(plan.step)
        return end - start

    def _add_marks(self, start: int, end: int) -> None:
        """Add the intervals between readings to the stages; a step ends with its last reading."""
        stages, begun, last = self.times.stages, start, start
        for i, (name, now) in enumerate(self._marks):
            if name == BETWEEN_STEPS:
                if i > 0:
                    self.times.timed.append(last - begun)
                begun = now
            shown = displayed_name(name)
            stages[shown] = stages.get(shown, 0) + now - last
            last = now
        self.times.timed.append(last - begun)
        stages[BETWEEN_STEPS] = stages.get(BETWEEN_STEPS, 0) + end - last


def measure(run: Run, writer: Writer, steps: int) -> Times:
    """Run the loop for some steps and measure it; blocks are written to a file as they come.

    Args:
        run: Running trains.
        writer: An open file.
        steps: Number of steps, at least 2.

    Raises:
        InputError: The distance ends before.
        RunFailedError: A train derailed or its numbers ran away.
    """
    times = Times.of(run.stepper)
    run.timer = timer = StageTimer(times, min(BLOCK_STEPS, steps // 2))
    end = run.done + steps
    while run.done < end:
        if not run.unfinished:
            raise InputError(
                f"train.distance = {run.task.scenario.train.distance:g}: too short for the time to measure;"
                " profile fewer seconds or enlarge the distance"
            )
        sent = run.advance(min(CHUNK_STEPS, end - run.done))
        if sent.failed:
            raise RunFailedError("; ".join(f"train {train}: {why}" for train, why in sent.failed.items()))
        for train, blocks in sent.blocks.items():
            writer.write(train, blocks)
        timer.lap("writing")
    return times
