"""Groups of trains whose steps are timed in the run's own loop; callers keep BLAS on one thread, as runs do."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tiengine.engine.stepper import BETWEEN_STEPS, Plan, Stepper
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import build_model
from tiengine.scenario.scenario import Scenario
from tiengine.simulation.tasks import Task
from tiengine.simulation.time_loop import CHUNK_STEPS, LoopTimer, Run
from validation.speed.runs import step_of

__all__ = ["Bench", "timed_in_turn"]

WARM_UP = 100  # steps


class _Launches(LoopTimer):
    """Counts how often the stages of a step are called: once a launch."""

    count = 0

    def take(self, stepper: Stepper, plan: Plan) -> None:
        """Take the steps of a chunk."""
        stepper.time_stages(self._note)
        stepper.take(plan)
        stepper.time_stages(None)

    def _note(self, name: str) -> None:
        self.count += name == BETWEEN_STEPS


@dataclass(eq=False)
class Bench:
    """Running trains; writing their samples is not part of the time.

    Attributes:
        run: The trains.
    """

    run: Run

    @classmethod
    def of(cls, scenario: Scenario, trains: int, steps: int) -> Bench:
        """Set up.

        Args:
            scenario: Scenario of one train, long enough for all steps.
            trains: Trains advanced together.
            steps: Steps in a block.
        """
        given = replace(ingredients(scenario, step_of(scenario)), trains=trains)
        model = build_model(given, scenario.train.speed.fastest)
        seeds = range(trains)
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

    def steps_a_launch(self, steps: int) -> float:
        """Steps of a launch, mean over a block."""
        counter = _Launches()
        self.run.timer = counter
        self._advance(steps)
        self.run.timer = LoopTimer()
        return steps / counter.count

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
