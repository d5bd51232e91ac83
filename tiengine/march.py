"""The time loop of a group of trains, as a stream of messages to whoever writes the file.

One :class:`Begun`, then an :class:`Advanced` for every thousand steps, then one :class:`Ended`; or :class:`Lost` where
a group could not be set up. Messages carry all that the file needs, so that they may come from another process; the
state stays here, whatever the length of the way.

A train that fails is computed on to the end with the others and not written: not-a-numbers cost no time (measured) and
stay in its rows, so that the other trains keep their bits.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.events import check_chunk
from tiengine.irregularity import Irregularity, make_irregularity
from tiengine.kernels import layout as at
from tiengine.memory import peak_memory
from tiengine.model import Model
from tiengine.plan import Task
from tiengine.prepare import prepare
from tiengine.quantity import InputError
from tiengine.recorder import Recorder
from tiengine.scenario import Scenario
from tiengine.start import equilibrium, release
from tiengine.state import State
from tiengine.stepper import Chunk, Stepper
from tiengine.writer import Block, TrainLabels

__all__ = ["CHUNK_STEPS", "Advanced", "Begun", "Costs", "Ended", "Lost", "Message", "Run", "march"]

CHUNK_STEPS = 1000


@dataclass(frozen=True, eq=False)
class Begun:
    """Trains are about to run.

    Attributes:
        labels: Labels of each of them.
        facts: What is known of each train from the beginning, by its number.
    """

    labels: TrainLabels
    facts: dict[int, dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Advanced:
    """Trains have advanced by some steps.

    Attributes:
        time: Simulated since the beginning [s].
        blocks: Samples of each train that runs, by its number; a train that fails is in it for the last time.
        failed: Why trains failed in these steps.
    """

    time: float
    blocks: dict[int, dict[str, Block]]
    failed: dict[int, str]


@dataclass(frozen=True)
class Costs:
    """Wall times [s] of a task, and the memory of the process that did it.

    Attributes:
        process: Its number.
        jit: Compiling kernels.
        setup: Everything else before the loop.
        loop: The loop, with the time that the receiver of its messages took.
        memory: Peak of the process so far [MB].
    """

    process: int
    jit: float
    setup: float
    loop: float
    memory: float


@dataclass(frozen=True, eq=False)
class Ended:
    """Trains have run to the end of their way, or failed.

    Attributes:
        facts: What is known of each train at the end, by its number.
        costs: Of all of them.
    """

    facts: dict[int, dict[str, Any]]
    costs: Costs


@dataclass(frozen=True)
class Lost:
    """Trains that stop here, whatever they have sent.

    Attributes:
        trains: Their numbers.
        why: A sentence.
        refused: Whether their scenario is to blame.
    """

    trains: tuple[int, ...]
    why: str
    refused: bool = False


Message = Begun | Advanced | Ended | Lost


def march(task: Task, *, public: bool = False) -> Iterator[Message]:
    """Set up the trains of a task and run them to the end of their way.

    Args:
        task: The trains.
        public: Launch kernels by public Taichi calls only.

    Yields:
        What the file needs, as it comes.
    """
    clock = time.perf_counter()
    try:
        run = Run.begin(task, public)
    except InputError as error:
        yield Lost(task.trains, str(error), refused=True)
        return
    setup = time.perf_counter() - clock - run.jit
    yield Begun(run.recorder.labels(run.model.given.train, run.model.given.slots), _facts(task, run.model))
    clock = time.perf_counter()
    yield from run.blocks()
    loop = time.perf_counter() - clock
    yield Ended(run.ends(loop), Costs(os.getpid(), run.jit, setup, loop, peak_memory()))


@dataclass(eq=False)
class Run:
    """Trains on their way.

    Attributes:
        task: Who runs.
        model, stepper, recorder: What advances and records them.
        tracks: Irregularity under each train, those that fill up the task included.
        jit: Wall time of compiling [s].
        steps: Steps that each train has made, by its place.
        alive: Places of the trains that have not failed.
    """

    task: Task
    model: Model
    stepper: Stepper
    recorder: Recorder
    tracks: list[Irregularity]
    jit: float
    steps: NDArray[np.int64]
    alive: list[int]

    @classmethod
    def begin(cls, task: Task, public: bool = False) -> Run:
        """Set up: model, start, buffers, kernels.

        Args:
            task: The trains.
            public: Launch kernels by public Taichi calls only.

        Raises:
            InputError: The scenario breaks a rule that only shows in set-up.
        """
        scenario = task.scenario
        model, jit = prepare(scenario, public, task.size)
        recorder = Recorder(scenario, model.given.newmark.dt)
        state = _started(scenario, model)
        rows = (CHUNK_STEPS // every + 1 for every in (recorder.wheel_every, recorder.body_every))
        chunk = Chunk.empty(model, CHUNK_STEPS, *rows)
        parallel = scenario.numerics.threads > 1 and task.size > 1
        stepper = Stepper(model, state, chunk, parallel=parallel, public=public)
        jit += stepper.compile()
        lead = scenario.rear + float(model.wheel_s.max())
        tracks = [make_irregularity(track, lead) for track in task.tracks]
        places = list(range(len(task.trains)))
        return cls(task, model, stepper, recorder, tracks, jit, np.zeros(len(places), np.int64), places)

    def blocks(self) -> Iterator[Advanced]:
        """Advance by a chunk of steps at a time to the end of the way, or until no train is left."""
        train, dt = self.task.scenario.train, self.model.given.newmark.dt
        position = self.task.scenario.rear + self.model.centre_s
        end, done = position + train.distance, 0
        while position < end - 1e-9 and self.alive:
            x, V, V_rate = train.speed.advance(position, dt, CHUNK_STEPS)
            count = min(int(np.searchsorted(x, end - 1e-9)), CHUNK_STEPS)
            yield self._advance(done, x[1 : count + 1], V[1 : count + 1], V_rate[1 : count + 1])
            done, position = done + count, float(x[count])

    def _advance(
        self, done: int, x: NDArray[np.float64], V: NDArray[np.float64], V_rate: NDArray[np.float64]
    ) -> Advanced:
        """The coming steps; the first vehicle's centre ends each of them at chainage x [m]."""
        recorder, chunk, trains = self.recorder, self.stepper.chunk, self.task.trains
        wheels = x[:, None] + self.model.given.train.wheelset_x
        felt = np.stack([track.sample(wheels) for track in self.tracks])
        self.stepper.load(x - self.model.centre_s, V, V_rate, felt)
        with np.errstate(over="ignore", invalid="ignore"):  # numbers that run away stay in the rows of their train
            for step in recorder.rows(done, len(x)):
                self.stepper.step(*step)
            self.stepper.fill_pressures(recorder.body_rows(done, len(x)))
        self.steps[self.alive] += len(x)
        found = check_chunk(self.model, chunk, recorder, done + 1, x)
        blocks = recorder.blocks(chunk, done + 1, x, self.alive)
        sent = Advanced(
            time=(done + len(x)) * recorder.dt,
            blocks={trains[b]: block for b, block in zip(self.alive, blocks, strict=True)},
            failed={trains[b]: found[b] for b in self.alive if b in found},
        )
        self.alive = [b for b in self.alive if b not in found]
        return sent

    def ends(self, loop: float) -> dict[int, dict[str, Any]]:
        """What is known of each train at its end."""
        iterations = self.stepper.state.iterations
        return {
            number: {
                "simulated_time": self.steps[b] * self.recorder.dt,
                "steps": int(self.steps[b]),
                "contact_iterations": int(iterations[b].max()),
                "wall_time_loop": loop,
                "trains_together": self.task.size,
            }
            for b, number in enumerate(self.task.trains)
        }


def _started(scenario: Scenario, model: Model) -> State:
    """The trains at t = 0."""
    state = State.at_rest(model)
    if scenario.numerics.start == "equilibrium":
        equilibrium(model, state, scenario.rear, *scenario.train.speed.at(scenario.rear + model.centre_s))
    else:
        release(model, state, scenario.rear)
    return state


def _facts(task: Task, model: Model) -> dict[int, dict[str, Any]]:
    """What is known of each train from the beginning."""
    given = model.given
    shared = {
        **{f"dofs_{name}": count for name, count in model.dof_counts.items() if name != "total"},
        "dofs": model.dof_counts["total"],
        "time_step": given.newmark.dt,
        "passes": given.passes,
        "window_length": given.length,
        "modes": given.modes,
        "slabs": given.slots,
        "seats_in_window": int(model.dims[at.SEATS]),
    }
    return {number: {**shared, "seed": task.tracks[b].seed} for b, number in enumerate(task.trains)}
