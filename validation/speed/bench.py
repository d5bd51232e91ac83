"""A stepper that is timed block by block; callers keep BLAS on one thread, as runs do."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.state import State
from tiengine.engine.stepper import Chunk, Stepper
from tiengine.irregularity.irregularity import Irregularity, make_irregularity
from tiengine.model.model import Ingredients, build_model
from tiengine.profiling.timed_loop import StageTimers, Times
from tiengine.recording.recorder import Recorder
from tiengine.scenario.scenario import Scenario

__all__ = ["Bench", "timed_in_turn"]

WARM_UP = 100  # steps


@dataclass(eq=False)
class Bench:
    """Time step of some trains, without writing.

    Attributes:
        scenario: Source of start and recording.
        stepper: Stepper of the trains.
        tracks: Irregularity of each train.
        recorder: Selects the steps to record.
        V: Speed [m/s].
        done: Number of steps so far.
    """

    scenario: Scenario
    stepper: Stepper
    tracks: list[Irregularity]
    recorder: Recorder
    V: float
    done: int = 0

    @classmethod
    def of(cls, scenario: Scenario, given: Ingredients, steps: int) -> Bench:
        """Set up the trains.

        Args:
            scenario: Scenario of one train.
            given: Ingredients of the model, including the trains.
            steps: Number of steps in a block.
        """
        V = scenario.train.speed.fastest
        model = build_model(given, V)
        state = State.at_rest(model)
        equilibrium(model, state, scenario.rear, V)
        stepper = Stepper(model, state, Chunk.empty(model, steps, steps + 1, steps + 1))
        stepper.compile()
        lead = scenario.rear + float(model.wheel_s.max())
        tracks = [
            make_irregularity(scenario.irregularity.model_copy(update={"seed": seed}), lead)
            for seed in range(given.trains)
        ]
        bench = cls(scenario, stepper, tracks, Recorder(scenario, given.newmark.dt), V)
        bench.block_us(min(WARM_UP, steps))
        return bench

    def block_us(self, steps: int) -> float:
        """Wall time of a step of all trains [us], mean over a block, including its loading."""
        felt, X = self._ahead(steps)
        clock = time.perf_counter_ns()
        self.stepper.load(X, np.full(steps, self.V), np.zeros(steps), felt)
        for row in self.recorder.rows(self.done, steps):
            self.stepper.step(*row)
        spent = time.perf_counter_ns() - clock
        self.done += steps
        if not np.isfinite(self.stepper.state.motion).all():
            raise RuntimeError(f"{self.scenario.name}: ran away within {self.done} steps; times would mean nothing")
        return spent * 1e-3 / steps

    def shares(self, steps: int) -> dict[str, float]:
        """Share of each stage of the step, in descending order."""
        timers = StageTimers(self.stepper)
        times = Times(timers.calls)
        felt, X = self._ahead(steps)
        self.stepper.load(X, np.full(steps, self.V), np.zeros(steps), felt)
        timers.run(list(self.recorder.rows(self.done, steps)), times)
        self.done += steps
        total = sum(times.stages.values())
        return {name: ns / total for name, ns in sorted(times.stages.items(), key=lambda item: -item[1])}

    def _ahead(self, steps: int) -> tuple[Any, Any]:
        """Irregularity of the coming steps, and chainage of the window's rear end [m]."""
        X = self.scenario.rear + self.V * self.recorder.dt * np.arange(self.done + 1.0, self.done + steps + 1.0)
        model = self.stepper.model
        wheels = (X + model.centre_s)[:, None] + model.given.train.wheelset_x
        return np.stack([track.sample(wheels) for track in self.tracks]), X


def timed_in_turn(benches: Sequence[Bench], rounds: int, steps: int) -> list[float]:
    """Wall time of a step of each bench [us], medians over rounds in which each runs a block in turn."""
    spent = [[bench.block_us(steps) for bench in benches] for _ in range(rounds)]
    return [float(x) for x in np.median(spent, axis=0)]
