"""The time loop of a group of trains, as a stream of messages to whoever writes the file.

A train that fails is computed on to the end with the others and not written, so that the other trains keep their bits.
Between two chunks of steps all that the rest of the run depends on fits in a checkpoint of plain arrays.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.equilibrium import equilibrium, release
from tiengine.engine.state import State
from tiengine.engine.stepper import Chunk, Stepper
from tiengine.engine.time_step import prepare
from tiengine.irregularity.irregularity import Irregularity, check_reach, make_irregularity
from tiengine.kernels import layout as at
from tiengine.model.model import Model
from tiengine.parameters.errors import InputError
from tiengine.recording.guards import Guard
from tiengine.recording.recorder import Recorder
from tiengine.recording.trackside import Trackside
from tiengine.result_files.checkpoint import Checkpoint
from tiengine.result_files.layout import Block, TrainLabels
from tiengine.scenario.scenario import Scenario
from tiengine.simulation.messages import Advanced, Begun, Costs, Ended, Lost, Message, Paused, Saved
from tiengine.simulation.peak_memory import peak_memory
from tiengine.simulation.tasks import Task

__all__ = ["CHUNK_STEPS", "Run", "march", "never"]

CHUNK_STEPS = 1000


def never() -> bool:
    """Nobody asks to stop."""
    return False


def march(
    task: Task,
    *,
    public: bool = False,
    saved: Checkpoint | None = None,
    every: float = math.inf,
    stop: Callable[[], bool] = never,
) -> Iterator[Message]:
    """Set up the trains of a task and run them to the end of their way.

    Args:
        task: The trains.
        public: Launch kernels by public Taichi calls only.
        saved: Where to go on; None begins at the beginning.
        every: Wall time between two checkpoints [s].
        stop: Asked after every chunk of steps; if true, the trains are saved and left.

    Yields:
        What the file needs, as it comes.
    """
    clock = time.perf_counter()
    try:
        run = Run.begin(task, public, saved)
    except InputError as error:
        yield Lost(task.trains, str(error), refused=True)
        return
    setup = time.perf_counter() - clock - run.jit
    yield Begun(task.number, run.labels, _facts(task, run.model))
    before = 0.0 if saved is None else float(saved.facts["loop"])
    clock = last = time.perf_counter()
    try:
        for advanced in run.blocks():
            yield advanced
            now, asked = time.perf_counter(), stop()
            if run.on_its_way and (asked or now - last >= every):
                yield Saved(task.trains, run.saved(before + now - clock))
                last = time.perf_counter()
                if asked:
                    yield Paused(task.trains)
                    return
    except InputError as error:  # of a user's function of chainage
        yield Lost(task.trains, str(error), refused=True)
        return
    loop = before + time.perf_counter() - clock
    yield Ended(task.number, run.ends(loop), Costs(os.getpid(), run.jit, setup, loop, peak_memory()))


@dataclass(eq=False)
class Run:
    """Trains on their way.

    Attributes:
        task: Who runs.
        model, stepper, recorder, trackside: What advances and records them.
        tracks: Irregularity under each train, those that fill up the task included.
        jit: Wall time of compiling [s].
        guard: Looks for what goes wrong.
        steps: Steps that each train has made, by its place.
        alive: Places of the trains that have not failed.
        position: Chainage of the first vehicle's centre [m].
        done: Steps so far.
    """

    task: Task
    model: Model
    stepper: Stepper
    recorder: Recorder
    trackside: Trackside
    tracks: list[Irregularity]
    jit: float
    guard: Guard
    steps: NDArray[np.int64]
    alive: list[int]
    position: float
    done: int = 0

    @classmethod
    def begin(cls, task: Task, public: bool = False, saved: Checkpoint | None = None) -> Run:
        """Set up: model, start, buffers, kernels.

        Args:
            task: The trains.
            public: Launch kernels by public Taichi calls only.
            saved: Where to go on; None begins at the beginning.

        Raises:
            InputError: The scenario breaks a rule that only shows in set-up, or the checkpoint does not fit it.
        """
        scenario = task.scenario
        model, jit = prepare(scenario, public, task.size)
        recorder = Recorder(scenario, model.given.newmark.dt)
        state = State.at_rest(model) if saved else _started(scenario, model)
        rows = (CHUNK_STEPS // every + 1 for every in (recorder.wheel_every, recorder.body_every))
        chunk = Chunk.empty(model, CHUNK_STEPS, *rows)
        parallel = scenario.numerics.threads > 1 and task.size > 1
        stepper = Stepper(model, state, chunk, parallel=parallel, public=public)
        jit += stepper.compile()
        trackside = Trackside.beside(scenario, stepper)
        lead = scenario.rear + float(model.wheel_s.max())
        tracks = [make_irregularity(track, lead, f) for track, f in zip_longest(task.tracks, task.functions)]
        start = scenario.rear + model.centre_s
        check_reach(tracks, start + scenario.train.distance + float(model.given.train.wheelset_x.max()))
        guard = Guard.beside(stepper, scenario.events, np.array([track.end for track in tracks]))
        places = list(range(len(task.trains)))
        steps = np.zeros(len(places), np.int64)
        run = cls(task, model, stepper, recorder, trackside, tracks, jit, guard, steps, places, start)
        if saved is not None:
            run._restore(saved)
        return run

    @property
    def labels(self) -> TrainLabels:
        """Labels of each train."""
        labels = self.recorder.labels(self.model.given.train, self.model.given.slots)
        return replace(labels, point_offset=self.trackside.point_offset)

    @property
    def on_its_way(self) -> bool:
        """Whether there is some way left, and a train to run it."""
        return self.position < self._end - 1e-9 and bool(self.alive)

    @property
    def _end(self) -> float:
        """Chainage of the first vehicle's centre where the way ends [m]."""
        scenario = self.task.scenario
        return scenario.rear + self.model.centre_s + scenario.train.distance

    def blocks(self) -> Iterator[Advanced]:
        """Advance by a chunk of steps at a time to the end of the way, or until no train is left."""
        train, dt = self.task.scenario.train, self.model.given.newmark.dt
        while self.on_its_way:
            x, V, V_rate = train.speed.advance(self.position, dt, CHUNK_STEPS)
            count = min(int(np.searchsorted(x, self._end - 1e-9)), CHUNK_STEPS)
            sent = self._advance(x[1 : count + 1], V[1 : count + 1], V_rate[1 : count + 1])
            self.done, self.position = self.done + count, float(x[count])
            yield sent
        if self.alive:
            trains, rest = self.task.trains, self.trackside.rest()
            yield Advanced(time=self.done * dt, blocks={trains[b]: rest[b] for b in self.alive}, failed={})

    def _advance(self, x: NDArray[np.float64], V: NDArray[np.float64], V_rate: NDArray[np.float64]) -> Advanced:
        """The coming steps; the first vehicle's centre ends each of them at chainage x [m]."""
        recorder, chunk, trains, done = self.recorder, self.stepper.chunk, self.task.trains, self.done
        wheels = x[:, None] + self.model.given.train.wheelset_x
        felt = np.stack([track.sample(wheels) for track in self.tracks])
        self.stepper.load(x - self.model.centre_s, V, V_rate, felt)
        self.guard.load(done, x)
        with np.errstate(over="ignore", invalid="ignore"):  # until the guard looks
            for step in recorder.rows(done, len(x)):
                self.stepper.step(*step)
            self.stepper.fill_pressures(recorder.body_rows(done, len(x)))
        events = self.guard.take()
        failed = {b: str(events[b][-1]) for b in self.alive if b in self.guard.stopped}
        blocks = recorder.blocks(chunk, done + 1, x, self.alive)
        beside = self.trackside.blocks(recorder.ends(done + 1, len(x)), x, failed)
        found = {b: block | beside[b] for b, block in zip(self.alive, blocks, strict=True)}
        for b in failed:
            found[b] = _until(found[b], self.guard.stopped[b] * recorder.dt)
        for b in self.alive:
            self.steps[b] = self.guard.stopped.get(b, done + len(x))
        sent = Advanced(
            time=(done + len(x)) * recorder.dt,
            blocks={trains[b]: block for b, block in found.items()},
            failed={trains[b]: why for b, why in failed.items()},
            events={trains[b]: events[b] for b in self.alive if b in events},
        )
        self.alive = [b for b in self.alive if b not in failed]
        return sent

    def saved(self, loop: float) -> Checkpoint:
        """All that the rest of the run depends on, between two chunks.

        Args:
            loop: Wall time of the loop so far [s].
        """
        state, watch = self.stepper.state, self.guard.watch
        arrays = {f"state.{name}": getattr(state, name) for name in _arrays_of(state)}
        arrays |= {f"watch.{name}": getattr(watch, name) for name in _arrays_of(watch)}
        arrays |= {f"trackside.{name}": value for name, value in self.trackside.saved().items()}
        facts = {
            "done": self.done,
            "position": self.position,
            "loop": loop,
            "speed": self.stepper.factored_speed,
            "first_seat": state.first_seat,
            "first_slab": state.first_slab,
            "steps": self.steps.tolist(),
            "alive": self.alive,
            "stopped": {str(place): step for place, step in self.guard.stopped.items()},
        }
        return Checkpoint(self.task.number, facts, arrays)

    def _restore(self, saved: Checkpoint) -> None:
        """Go on from a checkpoint.

        Raises:
            InputError: It does not fit the scenario.
        """
        state, watch, facts = self.stepper.state, self.guard.watch, saved.facts
        try:
            for part, target in (("state", state), ("watch", watch)):
                for name in _arrays_of(target):
                    given, own = saved.arrays[f"{part}.{name}"], getattr(target, name)
                    if given.shape != own.shape or given.dtype != own.dtype:
                        raise ValueError(f"{part}.{name}: shape {given.shape}, here {own.shape}")
                    own[:] = given
            prefix = "trackside."
            self.trackside.restore(
                {key.removeprefix(prefix): a for key, a in saved.arrays.items() if key.startswith(prefix)}
            )
            state.first_seat, state.first_slab = int(facts["first_seat"]), int(facts["first_slab"])
            self.done, self.position = int(facts["done"]), float(facts["position"])
            self.alive, self.steps[:] = [int(b) for b in facts["alive"]], facts["steps"]
            self.guard.stopped = {int(place): int(step) for place, step in facts["stopped"].items()}
            self.stepper.factor(float(facts["speed"]))
        except (KeyError, ValueError, TypeError, AttributeError) as error:
            raise InputError(f"checkpoint of task {saved.task}: does not fit the scenario ({error})") from None

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


def _until(blocks: dict[str, Block], time: float) -> dict[str, Block]:
    """What was sampled up to a time [s]; envelopes are not in it."""
    kept = {}
    for name, block in blocks.items():
        count = int(np.searchsorted(block.along, time * (1.0 + 1e-12), side="right"))
        channels = {channel: values[:count] for channel, values in block.channels.items()}
        kept[name] = Block(block.along[:count], block.chainage[:count], channels)
    return kept


def _arrays_of(part: Any) -> list[str]:
    """Names of the arrays of a dataclass."""
    return [each.name for each in fields(part) if isinstance(getattr(part, each.name), np.ndarray)]
