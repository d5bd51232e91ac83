"""The loop of a run, taken apart and timed.

Blocks of steps with timers and without take turns, so that what measuring costs is measured beside what it measures.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.stepper import Stepper
from tiengine.irregularity.irregularity import Irregularity
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.recording.guards import Guard
from tiengine.recording.recorder import Recorder
from tiengine.recording.trackside import Trackside
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import Scenario
from tiengine.simulation.time_loop import CHUNK_STEPS

__all__ = ["REST", "StageTimers", "TimedLoop", "Times", "shown"]

BLOCK_STEPS = 100


STAGE_NAMES = {
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
"""What reports call the stages of ``Stepper.stages``; several may share a name, those not named here keep theirs."""

PROLOGUE = "window and seats"
"""What a step does before its first stage: seats and slabs in and out, and what loading a chunk does."""

REST = "between stages"
"""What it does after its last, and the loop around it."""


def shown(name: str) -> str:
    """What reports call a stage of ``Stepper.stages``."""
    return STAGE_NAMES.get(name, name)


@dataclass
class Times:
    """What the loop took, in nanoseconds.

    Attributes:
        calls: Calls of each stage in a step, by the names of the report.
        stages: Time of each stage over the timed steps.
        chunks: What is done once a chunk, over all steps.
        timed: Each step with timers.
        blocks: A block with timers and its neighbour without, a step.
        timed_ns: All blocks with timers.
        plain_ns: All blocks without.
        timed_steps: Steps in them.
        plain_steps: Steps in them.
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


class StageTimers:
    """Readings of the clock between the stages of a stepper: one where the name changes, as each costs 0.1 us.

    Attributes:
        plain: The stages without readings.
        calls: Calls of each stage in a step, by the names of the report.
    """

    def __init__(self, stepper: Stepper) -> None:
        """Prepare readings for the stages that a stepper has."""
        self._stepper, self.plain = stepper, stepper.stages
        self._readings: list[int] = []
        self._read = _reader(self._readings)
        names = [shown(name) for name, _ in self.plain]
        self.calls = {PROLOGUE: 1, **{name: names.count(name) for name in names}}
        timed: list[tuple[str, Callable[[], object]]] = [("timer", self._read)]
        self._intervals = [PROLOGUE]
        for i, stage in enumerate(self.plain):
            timed.append(stage)
            if i + 1 == len(names) or names[i + 1] != names[i]:
                timed.append(("timer", self._read))
                self._intervals.append(names[i])
        self._intervals.append(REST)
        self._timed = tuple(timed)

    def run(self, rows: list[tuple[int, int, int]], times: Times) -> int:
        """Take steps with readings, add them to ``times`` and return the time of all [ns]."""
        step, read = self._stepper.step, self._read
        self._readings.clear()
        self._stepper.stages = self._timed
        start = time.perf_counter_ns()
        for row in rows:
            read()
            step(*row)
            read()
        spent = time.perf_counter_ns() - start
        self._stepper.stages = self.plain
        readings = np.array(self._readings).reshape(len(rows), -1)
        for name, ns in zip(self._intervals, np.diff(readings).sum(axis=0), strict=True):
            times.stages[name] = times.stages.get(name, 0) + int(ns)
        times.timed += (readings[:, -1] - readings[:, 0]).tolist()
        return spent


def _reader(readings: list[int]) -> Callable[[], None]:
    """A call that appends the clock's reading."""
    clock, append = time.perf_counter_ns, readings.append
    return lambda: append(clock())


@dataclass
class TimedLoop:
    """The loop of a run, taken apart.

    Attributes:
        scenario: What runs.
        stepper: Model, state, buffers, step.
        timers: Around its stages.
        recorder, trackside: Decide what is recorded.
        guard: Looks for what goes wrong.
        writer: Writes it, to a temporary file.
        irregularities: One a train.
        position: Chainage of the first vehicle's centre [m].
        end: Where the way ends [m].
        done: Steps so far.
    """

    scenario: Scenario
    stepper: Stepper
    timers: StageTimers
    recorder: Recorder
    trackside: Trackside
    guard: Guard
    writer: Writer
    irregularities: list[Irregularity]
    position: float
    end: float
    done: int = 0

    def load(self, count: int, lap: Callable[[str], object] = lambda name: None) -> NDArray[np.float64]:
        """Fill the buffers for the coming steps.

        Args:
            count: Steps.
            lap: Called with the name of what was just done.

        Returns:
            Chainage of the first vehicle's centre at each step [m], shape (count,).

        Raises:
            InputError: The way ends before.
        """
        model = self.stepper.model
        x, V, V_rate = (a[1:] for a in self.scenario.train.speed.advance(self.position, self.recorder.dt, count))
        if x[-1] > self.end:
            raise InputError(
                f"train.distance = {self.scenario.train.distance:g}: too short for the time to measure;"
                " profile fewer seconds or lengthen the way"
            )
        lap("window and seats")
        wheels = x[:, None] + model.ingredients.train.wheelset_x
        felt = np.stack([each.sample(wheels) for each in self.irregularities])
        lap("irregularity")
        self.stepper.load(x - model.centre_s, V, V_rate, felt)
        self.guard.load(self.done, x)
        lap("window and seats")
        self.position = float(x[-1])
        return x

    def advance(self, steps: int) -> Times:
        """Take steps, blocks without and with timers in turn.

        Args:
            steps: How many, at least 2.

        Returns:
            What they took.

        Raises:
            InputError: The way ends before.
            RunFailedError: A train derailed or its numbers ran away.
        """
        times = Times(self.timers.calls)
        block = min(BLOCK_STEPS, steps // 2)
        last = time.perf_counter_ns()

        def lap(name: str | None) -> None:
            nonlocal last
            now = time.perf_counter_ns()
            if name is not None:
                times.chunks[name] = times.chunks.get(name, 0) + now - last
            last = now

        for first in range(0, steps, CHUNK_STEPS):
            count = min(CHUNK_STEPS, steps - first)
            lap(None)
            x = self.load(count, lap)
            rows = list(self.recorder.rows(self.done, count))
            for begin in range(0, count, 2 * block):
                self._pair(rows[begin : begin + block], rows[begin + block : begin + 2 * block], times)
            lap(None)
            self.stepper.fill_pressures(self.recorder.body_rows(self.done, count))
            lap("mortar")
            events = self.guard.take()
            if self.guard.stopped:
                raise RunFailedError("; ".join(f"train {b}: {events[b][-1]}" for b in self.guard.stopped))
            self.recorder.write(self.writer, self.stepper.chunk, self.done + 1, x)
            for train, blocks in enumerate(self.trackside.blocks(self.recorder.ends(self.done + 1, count), x)):
                self.writer.write(train, blocks)
            lap("writing")
            self.done += count
        return times

    def _pair(self, plain: list[tuple[int, int, int]], timed: list[tuple[int, int, int]], times: Times) -> None:
        """A block without timers, then one with."""
        clock, step = time.perf_counter_ns, self.stepper.step
        start = clock()
        for row in plain:
            step(*row)
        bare = clock() - start
        times.plain_ns += bare
        times.plain_steps += len(plain)
        if not timed:
            return
        spent = self.timers.run(timed, times)
        times.timed_ns += spent
        times.timed_steps += len(timed)
        times.blocks.append((spent / len(timed), bare / len(plain)))
