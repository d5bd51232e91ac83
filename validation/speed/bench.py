"""Groups of trains whose steps are timed in the run's own loop; callers keep BLAS on one thread, as runs do."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tiengine.engine.stepper import Plan, Stepper
from tiengine.model.model import Ingredients, build_model
from tiengine.profiling.timed_loop import StageTimer, Times
from tiengine.scenario.scenario import Scenario
from tiengine.simulation.tasks import Task
from tiengine.simulation.time_loop import CHUNK_STEPS, LoopTimer, Run

__all__ = ["Bench", "timed_in_turn"]

WARM_UP = 100  # steps


class _AllTimed(StageTimer):
    """Stage timers in every step."""

    def take(self, stepper: Stepper, plan: Plan) -> None:
        """Take the steps of a chunk."""
        self.take_timed(stepper, plan)


@dataclass(eq=False)
class Bench:
    """Running trains; writing their samples is not part of the time.

    Attributes:
        run: The trains.
    """

    run: Run

    @classmethod
    def of(cls, scenario: Scenario, ingredients: Ingredients, steps: int) -> Bench:
        """Set up.

        Args:
            scenario: Scenario of one train, long enough for all steps.
            ingredients: Ingredients of the model, number of trains included.
            steps: Steps in a block.
        """
        model = build_model(ingredients, scenario.train.speed.fastest)
        seeds = range(ingredients.trains)
        tracks = tuple(scenario.irregularity.model_copy(update={"seed": seed}) for seed in seeds)
        bench = cls(Run.of(Task(0, scenario, tuple(seeds), tracks), model))
        bench.block_us(min(WARM_UP, steps))
        return bench

    def block_us(self, steps: int) -> float:
        """Wall time of a step of all trains [us], mean over a block; loading and collecting it included."""
        clock = time.perf_counter_ns()
        self._advance(steps)
        spent = time.perf_counter_ns() - clock
        return spent * 1e-3 / steps

    def shares(self, steps: int) -> dict[str, float]:
        """Share of each stage of the step, the largest first."""
        times = Times.of(self.run.stepper)
        self.run.timer = _AllTimed(times, steps)
        self._advance(steps)
        self.run.timer = LoopTimer()
        total = sum(times.stages.values())
        return {name: ns / total for name, ns in sorted(times.stages.items(), key=lambda item: -item[1])}

    def _advance(self, steps: int) -> None:
        """Take steps.

        Raises:
            RuntimeError: A train failed or the distance ended; times would mean nothing.
        """
        end = self.run.done + steps
        while self.run.done < end:
            if not self.run.unfinished or self.run.advance(min(CHUNK_STEPS, end - self.run.done)).failed:
                name = self.run.task.scenario.name
                raise RuntimeError(f"{name}: failed or ended within {self.run.done} steps; times would mean nothing")


def timed_in_turn(benches: Sequence[Bench], rounds: int, steps: int) -> list[float]:
    """Wall time of a step of each bench [us], medians over rounds in which each runs a block in turn."""
    spent = [[bench.block_us(steps) for bench in benches] for _ in range(rounds)]
    return [float(x) for x in np.median(spent, axis=0)]
