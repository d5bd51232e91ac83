"""Frame of a step: order of stages, watchers and clock readings; another kind of step in place of the sines."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.engine.chunk import Chunk
from tiengine.engine.state import PARTS, State
from tiengine.engine.stepper import BETWEEN_STEPS, Rows, Stage, Stepper
from tiengine.recording.guards import Guard
from tiengine.recording.recorder import Recorder
from tiengine.recording.trackside import Trackside, trackside_groups
from tiengine.scenario.event_policy import Events
from tiengine.scenario.scenario import Scenario, load_scenario

from ..models import V350, paper_model

DT = 1e-4
B = 2  # trains
SLOPE = 1e-4  # m/m: the rails are straight lines in the window, w = SLOPE s


class OtherState(State):
    """Rails as straight lines, slabs sunk by their index, trains innermost in every array."""

    def __init__(self) -> None:
        self.ingredients = paper_model(trains=B, dt=DT).ingredients
        wheels, dofs = (4, 2, B), self.ingredients.designs.matrices[0].n
        self.first_seat = self.first_slab = 0
        self.iterations = np.ones((B, 4), dtype=np.int32)
        self.load = np.full(wheels, 7e4)
        self.shift = np.zeros(wheels)
        self.on_rail = np.zeros((4, 2, 3, B))
        self.seats = np.zeros((self.ingredients.seats, 3, 2, B))
        self.sunk = np.zeros((3, self.slots, dofs, B))
        self.cleared: list[int] = []

    trains = property(lambda self: B)
    slots = property(lambda self: self.ingredients.slots)
    normal_force = property(lambda self: self.load.transpose(2, 0, 1))
    forces_on_rails = property(lambda self: self.on_rail.transpose(3, 0, 1, 2))
    relative_shift = property(lambda self: self.shift.transpose(2, 0, 1))
    relative_tilt = property(lambda self: np.zeros_like(self.relative_shift))
    seat_forces = property(lambda self: self.seats.transpose(3, 2, 1, 0))

    def body_motion(self, kind: int) -> NDArray[np.float64]:
        return np.full((B, 35), float(kind))

    def slab_motion(self, kind: int) -> NDArray[np.float64]:
        return self.sunk[kind].transpose(2, 0, 1)

    def rail_motion(self, side: int, s: float) -> NDArray[np.float64]:
        found = np.zeros((2, 3, 3, B))
        found[1, 0, 0], found[1, 0, 1] = SLOPE * s, SLOPE
        return found

    def rail_deflection(self, s: NDArray[np.float64]) -> Callable[[], NDArray[np.float64]]:
        return lambda: np.broadcast_to(SLOPE * s, (B, 2, len(s)))

    def squares(self) -> tuple[float, float, float]:
        return tuple(float(np.sum(each**2)) for each in self.sunk)  # type: ignore[return-value]

    def part(self, train: int, name: str) -> NDArray[np.float64]:
        if name == "slabs":
            return self.sunk[..., train]
        return np.zeros((3, 5) if name == "vehicles" else (3, 2, 5))

    def put(self, kind: int, name: str, values: NDArray[np.float64]) -> None:
        if name == "slabs":
            self.sunk[kind] = np.moveaxis(np.broadcast_to(values, (B, *self.sunk.shape[1:3])), 0, -1)

    def put_contact(self, contact: object, local: NDArray[np.float64], wheelset: object, rail: object) -> None:
        self.load[:] = np.moveaxis(np.broadcast_to(local[..., 0], (B, 4, 2)), 0, -1)

    def enter(self, first_seat: int, first_slab: int) -> None:
        self.first_seat, self.first_slab = first_seat, first_slab

    def clear(self, train: int) -> None:
        self.cleared.append(train)
        self.sunk[..., train] = 0.0

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        return {"sunk": self.sunk, "iterations": self.iterations}


class OtherStepper(Stepper):
    """One stage a step, as of a single launch."""

    state: OtherState

    def __init__(self, steps: int) -> None:
        state = OtherState()
        super().__init__(state.ingredients, state, Chunk.empty(state.ingredients, steps, steps))
        self.log: list[str] = []
        self.factored_speed = 0.0
        self.bind()

    def _stages(self) -> Iterator[Stage]:
        yield "step", self._whole
        yield "step", lambda: self.log.append("second")

    def _whole(self) -> None:
        self.log.append("first")
        clock, state = self.chunk.clock[self.rows.step], self.state
        state.first_seat, state.first_slab = int(clock[4]), int(clock[5])
        for slab in range(state.first_slab, state.first_slab + state.slots):
            state.sunk[0, slab % state.slots, :-2:3] = 1e-3 * slab  # w of all nodes, no slopes
        state.seats[:, 0] = 1e3 * (1 + self.rows.step)
        if self.rows.body >= 0:
            self.chunk.body[:, self.rows.body] = np.arange(3)[:, None]
            self.chunk.slab[:, self.rows.body, 0] = state.slab_motion(0)
            self.chunk.rear_slab[self.rows.body] = state.first_slab
        self.chunk.wheel[:, self.rows.step] = self.rows.step

    def factor(self, V: float) -> None:
        self.factored_speed = V

    def finish(self, body_rows: int) -> None:
        self.chunk.filled = body_rows
        self.chunk.mortar[:, :body_rows, :, 0] = 1.0

    def compile(self) -> float:
        return 0.0


def loaded(steps: int) -> OtherStepper:
    stepper = OtherStepper(steps)
    X = V350 * DT * np.arange(1, steps + 1)
    stepper.load(X, np.full(steps, V350), np.zeros(steps), np.zeros_like(stepper.chunk.irregularity))
    return stepper


def test_stages_then_watchers_in_their_order():
    stepper = loaded(3)
    for name, before in (("a", None), ("c", None), ("b", "c")):
        stepper.watch(name, lambda name=name: stepper.log.append(name), before)
    stepper.step(0, 2, 1)
    assert stepper.log == ["first", "second", "a", "b", "c"]
    assert stepper.rows == Rows(0, 2, 1)
    with pytest.raises(ValueError, match="nobody"):
        stepper.watch("d", lambda: None, before="nobody")


def test_the_clock_is_read_where_the_name_changes():
    stepper = loaded(2)
    stepper.watch("a", lambda: stepper.log.append("a"))
    stepper.time_stages(lambda name: stepper.log.append(f"<{name}>"))
    stepper.step(0)
    assert stepper.log == [f"<{BETWEEN_STEPS}>", "first", "second", "<step>", "a", "<a>"]
    stepper.time_stages(None)
    stepper.log.clear()
    stepper.step(1)
    assert stepper.log == ["first", "second", "a"]


def test_moves_are_the_steps_at_which_seats_slabs_or_speed_change():
    """A seat every 65 steps at 97 m/s; the first step always."""
    steps = 200
    stepper = loaded(steps)
    first = stepper.chunk.clock[:, 4]
    np.testing.assert_array_equal(np.flatnonzero(stepper.moves), [0, *(np.flatnonzero(np.diff(first)) + 1)])
    assert 3 <= stepper.moves.sum() <= 5
    V = np.full(steps, V350)
    V[50:] = 90.0
    stepper.load(np.full(steps, 10.0), V, np.zeros(steps), 0.0 * stepper.chunk.irregularity)
    np.testing.assert_array_equal(np.flatnonzero(stepper.moves), [0, 50])


def recorded() -> Scenario:
    gauges = [
        {"name": "rail", "on": "rail", "chainage": 20.0, "side": "left"},
        {"name": "slab", "on": "slab", "chainage": 20.0, "y": 0.0},
        {"name": "seat", "on": "fastening", "chainage": 20.0, "side": "right"},
    ]
    settings = {"gauges": gauges, "output.deflection_interval": 10 * DT, "output.precision": "double"}
    return load_scenario("paper", {"train.distance": 10.0, "numerics.time_step": DT, **settings})


def test_another_kind_of_step_is_recorded():
    """Recorder, envelopes, gauges and snapshots see the other step's rails and slabs."""
    steps, scenario = 40, recorded()
    stepper = loaded(steps)
    recorder, trackside = Recorder(scenario, DT), Trackside.watching(scenario, stepper)
    stepper.take(recorder.plan(0, steps))
    stepper.finish(recorder.body_rows(0, steps))
    ingredients = stepper.ingredients
    position = stepper.chunk.clock[:, 0] + ingredients.centre_s
    time = recorder.ends(1, steps)
    blocks = recorder.blocks(stepper.chunk, 1, position, range(B))[1]
    np.testing.assert_array_equal(blocks["body"].channels["velocity"], 1.0)
    np.testing.assert_array_equal(blocks["mortar"].channels["largest_pressure"], 1.0)
    np.testing.assert_array_equal(blocks["wheel"].channels["normal_force"][:, 0, 0], np.arange(steps))
    track = trackside.blocks(time, position)[1]
    assert set(track) == set(trackside_groups(scenario))
    points = trackside.point_offset + ingredients.centre_s
    np.testing.assert_allclose(
        track["deflection"].channels["rail"], np.broadcast_to(SLOPE * points, (4, 2, len(points)))
    )
    chainage = stepper.chunk.clock[9::10, :1] + points
    slab = np.where(np.isnan(track["deflection"].channels["slab"][:, 0]), np.nan, 1e-3 * (chainage // 5.67))
    np.testing.assert_allclose(track["deflection"].channels["slab"][:, 0], slab, atol=1e-12)  # rounding of cubics
    s = 20.0 - stepper.chunk.clock[:, 0]
    rail = track["gauges/rail"].channels
    np.testing.assert_allclose(rail["displacement"][:, 1], SLOPE * s)
    np.testing.assert_allclose(rail["velocity"][:, 1], -V350 * SLOPE)
    np.testing.assert_allclose(track["gauges/slab"].channels["displacement"][:, 1], 3e-3, rtol=1e-9)
    np.testing.assert_array_equal(track["gauges/seat"].channels["vertical_force"], 1e3 * np.arange(1, steps + 1))
    left = trackside.remainder()[1]
    assert left["seats"].channels["largest_vertical_force"].max() == 1e3 * steps
    assert left["slabs"].channels["largest_deflection"][3] == pytest.approx(3e-3, rel=1e-12)


def test_another_kind_of_step_is_guarded():
    """A derailment of one train, numbers that run away in the other."""
    stepper = loaded(10)
    guard = Guard.watching(stepper, Events(), np.full(B, np.inf))
    guard.load(0, np.arange(10.0))
    for i in range(10):
        stepper.step(i)
    assert guard.take() == {}
    stepper.state.shift[1, 0, 0] = 1.0
    stepper.state.sunk[1, 2, 5, 1] = np.inf
    guard.check(20, 1.0)
    found = guard.take()
    assert found[0][-1].kind == "derailment"
    assert "slab 2" in str(found[1][0])
    assert stepper.state.cleared == [1]
    assert guard.stopped == {0: 20, 1: 20}


def test_every_part_of_the_sines_is_given():
    """Names, shapes and kinds as the interface says."""
    from tiengine.engine.sine_state import SineState

    model = paper_model(trains=B)
    state = SineState.at_rest(model)
    rng = np.random.default_rng(0)
    state.motion[:3] = rng.standard_normal(state.motion[:3].shape)
    assert state.squares() == pytest.approx([float(np.sum(row**2)) for row in state.motion[:3]])
    parts = [np.stack([state.part(train, name).reshape(3, -1) for train in range(B)]) for name in PARTS]
    total = sum((part**2).sum(axis=(0, 2)) for part in parts)
    np.testing.assert_allclose(total, state.squares())
    s = np.array([3.0, 17.2])
    w = np.stack([[state.rail_motion(side, x)[1, 0, 0] for x in s] for side in range(2)])  # side, point, train
    np.testing.assert_allclose(state.rail_deflection(s)(), w.transpose(2, 0, 1), rtol=1e-9)
    assert state.seat_forces.shape == (B, 2, 3, model.ingredients.seats)
    assert state.slab_motion(1).shape == (B, state.slots, model.ingredients.designs.matrices[0].n)
    np.testing.assert_array_equal(state.body_motion(2), state.view(2, "vehicles")[:, :35])
