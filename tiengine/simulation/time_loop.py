"""Time loop of a group of trains, chunk by chunk of steps.

A train that fails is computed on to the end with the others and not written, so that the other trains keep their bits.
Between two chunks of steps a checkpoint can be made (:mod:`tiengine.simulation.restart`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium, release
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import State
from tiengine.engine.stepper import Plan, Stepper
from tiengine.engine.time_step import prepare
from tiengine.irregularity.ground import LATERAL, Ground, ground_shape, reach_of
from tiengine.irregularity.irregularity import Irregularity, make_irregularity
from tiengine.irregularity.rail_shapes import RailShapes, SettledRail
from tiengine.irregularity.shaped_channels import ShapedChannels
from tiengine.irregularity.track_checks import check_reach
from tiengine.kernels import layout as at
from tiengine.model.constant_data import Model
from tiengine.recording.guards import Guard
from tiengine.recording.recorder import Recorder
from tiengine.recording.trackside import Trackside
from tiengine.result_files.layout import Block, TrainLabels
from tiengine.scenario.scenario import Scenario
from tiengine.simulation.messages import Advanced
from tiengine.simulation.tasks import Task
from tiengine.track.dead_state import LaidRail
from tiengine.track.settled_rail import GroundShape, settled_rail

__all__ = ["CHUNK_STEPS", "LoopTimer", "Run"]

CHUNK_STEPS = 1000


class LoopTimer:
    """Hooks of the loop for a profiler; these measure nothing."""

    def lap(self, name: str | None) -> None:
        """Mark the end of a part of the work that is done once a chunk.

        Args:
            name: The part; None begins the first.
        """

    def take(self, stepper: Stepper, plan: Plan) -> None:
        """Take the steps of a chunk.

        Args:
            stepper: Is loaded.
            plan: The steps.
        """
        stepper.take(plan)


@dataclass(eq=False)
class Run:
    """Running trains of a task.

    Attributes:
        task: The trains.
        stepper: Advances them.
        recorder, trackside: Record them and their track.
        tracks: Irregularity under each train, those that pad the task included.
        jit: Wall time of compiling [s].
        guard: Checks their state.
        steps: Steps that each train has made, by its place.
        alive: Places of the trains that have not failed.
        position: Chainage of the first vehicle's centre [m].
        shapes: Shapes of rails and wheels; None without any.
        done: Steps so far.
        timer: Hooks for a profiler.
    """

    task: Task
    stepper: Stepper
    recorder: Recorder
    trackside: Trackside
    tracks: list[Irregularity]
    jit: float
    guard: Guard
    steps: NDArray[np.int64]
    alive: list[int]
    position: float
    shapes: ShapedChannels | None = None
    done: int = 0
    timer: LoopTimer = field(default_factory=LoopTimer)

    @classmethod
    def begin(cls, task: Task, public: bool = False, at_rest: bool = False) -> Run:
        """Set up model, start, buffers and kernels.

        Args:
            task: The trains.
            public: Launch kernels by public Taichi calls only.
            at_rest: Leave the state at rest, for a checkpoint to fill.

        Raises:
            InputError: The scenario breaks a rule that only shows in set-up.
        """
        model, jit = prepare(task.scenario, public, task.size)
        run = cls.of(task, model, public=public, at_rest=at_rest)
        run.jit += jit
        return run

    @classmethod
    def of(cls, task: Task, model: Model, *, public: bool = False, at_rest: bool = False) -> Run:
        """Set up start, buffers and kernels for a model.

        Args:
            task: The trains.
            model: Their constant data.
            public: Launch kernels by public Taichi calls only.
            at_rest: Leave the state at rest, for a checkpoint to fill.

        Raises:
            InputError: The scenario breaks a rule that only shows in set-up.
        """
        scenario, ingredients = task.scenario, model.ingredients
        recorder = Recorder(scenario, ingredients.newmark.dt)
        state = state_at_rest(model) if at_rest else _started(scenario, model)
        chunk = Chunk.empty(ingredients, CHUNK_STEPS, CHUNK_STEPS // recorder.body_every + 1)
        parallel = scenario.numerics.threads > 1 and task.size > 1
        stepper = make_stepper(model, state, chunk, parallel=parallel, public=public)
        jit = stepper.compile()
        trackside = Trackside.watching(scenario, stepper)
        lead = scenario.rear + float(ingredients.wheel_s.max())
        tracks = [make_irregularity(track, lead, f) for track, f in zip_longest(task.tracks, task.functions)]
        start = scenario.rear + ingredients.centre_s
        check_reach(tracks, start + scenario.train.distance + float(ingredients.train.wheelset_x.max()))
        guard = Guard.watching(stepper, scenario.events, np.array([track.end for track in tracks]), scenario.track)
        places = list(range(len(task.trains)))
        steps = np.zeros(len(places), np.int64)
        shapes = _shapes(scenario, model, start)
        return cls(task, stepper, recorder, trackside, tracks, jit, guard, steps, places, start, shapes)

    @property
    def labels(self) -> TrainLabels:
        """Labels of each train."""
        labels = self.recorder.labels(self.stepper.ingredients.train, self.stepper.ingredients.slots)
        return replace(labels, point_offset=self.trackside.point_offset)

    @property
    def unfinished(self) -> bool:
        """Whether some distance is left, and a train to run it."""
        return self.position < self._end - 1e-9 and bool(self.alive)

    @property
    def _end(self) -> float:
        """Chainage of the first vehicle's centre at the end of the distance [m]."""
        scenario = self.task.scenario
        return scenario.rear + self.stepper.ingredients.centre_s + scenario.train.distance

    def blocks(self) -> Iterator[Advanced]:
        """Advance chunk by chunk to the end of the distance, or until no train is left."""
        while self.unfinished:
            yield self.advance(CHUNK_STEPS)
        if self.alive:
            trains, left = self.task.trains, self.trackside.remainder()
            time = self.done * self.recorder.dt
            yield Advanced(time=time, blocks={trains[b]: left[b] for b in self.alive}, failed={})

    def advance(self, most: int) -> Advanced:
        """Take a chunk of steps.

        Args:
            most: Steps to take, up to ``CHUNK_STEPS``; fewer where the distance ends.
        """
        self.timer.lap(None)
        x = self._load(most)
        done, count, recorder = self.done, len(x), self.recorder
        with np.errstate(over="ignore", invalid="ignore"):  # until the guard checks
            self.timer.take(self.stepper, recorder.plan(done, count))
            self.timer.lap(None)
            self.stepper.finish(recorder.body_rows(done, count))
        self.timer.lap("mortar")
        self._move_with_ground(x)
        sent = self._collect(x)
        self.done += count
        return sent

    def _load(self, most: int) -> NDArray[np.float64]:
        """Fill the buffers for the coming steps; chainage of the first vehicle's centre at their ends [m], (steps,)."""
        ingredients, speed = self.stepper.ingredients, self.task.scenario.train.speed
        x, V, V_rate = speed.advance(self.position, ingredients.newmark.dt, most)
        count = min(int(np.searchsorted(x, self._end - 1e-9)), most)
        x, V, V_rate = x[1 : count + 1], V[1 : count + 1], V_rate[1 : count + 1]
        self.timer.lap("window and seats")
        wheels = x[:, None] + ingredients.train.wheelset_x
        irregularity = np.stack([track.sample(wheels) for track in self.tracks])
        if self.shapes is not None:
            irregularity = self.shapes.joined(irregularity, self.tracks, wheels)
        self.timer.lap("irregularity")
        time = ingredients.newmark.dt * np.arange(self.done + 1.0, self.done + count + 1.0)
        given = ingredients.given_loads(time, x, V, V_rate)
        self.stepper.load(x - ingredients.centre_s, V, V_rate, irregularity, given, time)
        self.guard.load(self.done, x)
        self.position = float(x[-1])
        self.timer.lap("window and seats")
        return x

    def _move_with_ground(self, x: NDArray[np.float64]) -> None:
        """Add the ground's motion to that of the bodies, recorded from it, at steps that end at chainages x [m]."""
        ground, chunk = self.stepper.ingredients.moving_ground, self.stepper.chunk
        if ground is None or not chunk.filled:
            return
        number = np.arange(self.done + 1, self.done + len(x) + 1)
        taken = number % self.recorder.body_every == 0
        V, V_rate = chunk.clock[: len(x)][taken][:, [at.SPEED, at.SPEED_RATE]].T[..., None]
        motion = ground.motion(number[taken] * self.recorder.dt, x[taken], V, V_rate)
        chunk.body[:, : chunk.filled] += motion.reshape(*motion.shape[:2], -1)

    def _collect(self, x: NDArray[np.float64]) -> Advanced:
        """Blocks and events of the steps that end at chainages x [m]; trains that failed are taken out."""
        recorder, trains, done = self.recorder, self.task.trains, self.done
        events = self.guard.take()
        failed = {b: str(events[b][-1]) for b in self.alive if b in self.guard.stopped}
        blocks = recorder.blocks(self.stepper.chunk, done + 1, x, self.alive)
        of_track = self.trackside.blocks(recorder.ends(done + 1, len(x)), x, failed)
        found = {b: block | of_track[b] for b, block in zip(self.alive, blocks, strict=True)}
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

    def ends(self, loop: float) -> dict[int, dict[str, Any]]:
        """Facts of each train at its end, by its number."""
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


def _shapes(scenario: Scenario, model: Model, start: float) -> ShapedChannels | None:
    """Shapes of rails and wheels, for a run that starts at the given chainage of the first vehicle's centre [m]."""
    train = model.ingredients.train
    if not model.ingredients.shaped:
        return None
    g = model.ingredients
    settled = [
        SettledRail(
            settled_rail(
                partial(ground_shape, each) if g.dead is None else _sideways(each),
                reach_of(each),
                g.rail,
                g.fastening,
                g.slab,
                g.mortar,
                lambda slab: g.designs.matrices[g.designs.of_slab.get(slab, 0)],
                g.seat_factors,
            )
        )
        for each in scenario.track.ground
    ]
    laid = [] if g.dead is None else [LaidRail(g.dead, side) for side in range(2)]
    rails = RailShapes(scenario.track.rail_shapes, settled, laid)
    return ShapedChannels(rails, start + train.wheelset_x, train.wheel_radius)


def _sideways(ground: Ground) -> GroundShape:
    """Displacement of the ground to the right alone: the state at rest of slabs that may lift has the vertical one."""
    return lambda x, direction: ground_shape(ground, x, direction) if direction == LATERAL else np.zeros_like(x)


def _started(scenario: Scenario, model: Model) -> State:
    """State of the trains at t = 0."""
    state = state_at_rest(model)
    if scenario.numerics.start == "equilibrium":
        equilibrium(model, state, scenario.rear, *scenario.train.speed.at(scenario.rear + model.ingredients.centre_s))
    else:
        release(model, state, scenario.rear)
    return state


def _until(blocks: dict[str, Block], time: float) -> dict[str, Block]:
    """Samples up to a time [s]; envelopes are not among them."""
    kept = {}
    for name, block in blocks.items():
        count = int(np.searchsorted(block.along, time * (1.0 + 1e-12), side="right"))
        channels = {channel: values[:count] for channel, values in block.channels.items()}
        kept[name] = Block(block.along[:count], block.chainage[:count], channels)
    return kept
