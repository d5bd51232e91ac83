"""Faults of the physics are found within a millisecond, named, and written to the file."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest

from tiengine.engine.chunk import Chunk
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.spline_stepper import SplineStepper
from tiengine.engine.state import DISPLACEMENT, PARTS, VELOCITY
from tiengine.engine.stepper import Plan, Rows
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.recording.guards import Guard, climbing_shift
from tiengine.scenario.event_policy import Events
from tiengine.scenario.scenario import Scenario, load_scenario
from tiengine.simulation import simulate

from ..reference.stepping import model_of

STEP = 2e-4


@pytest.fixture
def guard() -> Guard:
    """Checks one train at rest, all wheels loaded; the model is shared by the tests."""
    return guard_of(Events())


def guard_of(policy: Events, track_end: float = np.inf, steps: int = 1, overrides: tuple[str, ...] = ()) -> Guard:
    model = model_of("smooth", *overrides, dt=STEP)
    state = state_at_rest(model)
    state.enter(0, 0)
    state.normal_force[...] = 7e4
    stepper = make_stepper(model, state, Chunk.empty(model.ingredients, steps, 1))
    return Guard.watching(stepper, policy, np.full(1, track_end))


def only(guard: Guard):
    """The one event that was found."""
    ((train, (event,)),) = guard.take().items()
    assert train == 0
    return event


def test_nothing_is_said_of_a_train_at_rest(guard: Guard):
    guard.check(5, 100.0)
    assert guard.take() == {}
    assert guard.stopped == {}


def test_it_checks_every_millisecond_and_after_the_last_step(guard: Guard, monkeypatch: pytest.MonkeyPatch):
    """Five steps of 0.2 ms; a chunk of 12 steps after 1000."""
    checked = []
    monkeypatch.setattr(guard, "check", lambda step, position: checked.append((step, position)))
    guard.load(1000, np.arange(12.0))
    for i in range(12):
        guard.stepper.rows = Rows(i)
        guard.watch_step()
    assert checked == [(1005, 4.0), (1010, 9.0), (1012, 11.0)]


def test_wheelsets_that_have_turned_far_have_not_run_away(guard: Guard):
    """After 100 km a wheelset has turned by 50 rad against its mean spin: nothing is wrong."""
    values = guard.state.part(0, "vehicles")[DISPLACEMENT]
    pitch = guard.stepper.ingredients.train.wheelset_dof[:, 3]
    values[pitch] = 50.0
    guard.state.put(DISPLACEMENT, "vehicles", values[None])
    guard.check(10, 42.0)
    assert guard.take() == {}


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e30], ids=["nan", "infinite", "huge"])
@pytest.mark.parametrize(
    ("block", "index", "words"),
    [
        ("vertical", (0, 1, 3), "the right rail, vertically"),
        ("lateral", (0, 0, 3), "the left rail, laterally"),
        ("slabs", (0, 2, 5), "slab 2"),
        ("vehicles", (0, 6), "body 1 bogie front \\(z\\)|body .* \\(z\\)"),
    ],
    ids=["vertical", "lateral", "slab", "body"],
)
def test_numbers_that_run_away_end_a_train(guard: Guard, block: str, index: tuple[int, ...], words: str, value: float):
    """The field is named; the train is taken out of the way."""
    values = guard.state.part(0, block)[VELOCITY]
    values[index[1:]] = value
    guard.state.put(VELOCITY, block, values[None])
    guard.check(10, 42.0)
    event = only(guard)
    assert event.kind == "runaway"
    assert event.stops
    assert guard.stopped == {0: 10}
    assert str(event).startswith("numbers ran away, first of ")
    assert np.any([word in str(event) for word in words.replace("\\", "").split("|")]) or block == "vehicles"
    assert "(t = 0.0020 s, chainage 42.00 m)" in str(event)
    assert "numerics.time_step = 0.0001" in str(event)
    assert not any(guard.state.part(0, name).any() for name in PARTS)
    guard.check(15, 42.1)
    assert guard.take() == {}


def test_a_wheel_that_stays_off_its_rail_is_noted_once(guard: Guard):
    """50 ms without load, seen at the fiftieth check; it stays one event while it lasts."""
    guard.state.normal_force[0, 2, 1] = 0.0
    for check in range(1, 50):
        guard.check(5 * check, 10.0)
    assert guard.take() == {}
    for check in range(50, 80):
        guard.check(5 * check, 10.0)
    event = only(guard)
    assert (event.kind, event.wheelset, event.side, event.stops) == ("wheel_lift", 3, "right", False)
    assert event.time == pytest.approx(0.05, abs=1e-9)
    assert guard.stopped == {}


def test_a_flight_that_ends_in_time_is_no_event(guard: Guard):
    """40 ms off, then loaded, then 40 ms off again."""
    for load in (0.0, 7e4, 0.0):
        guard.state.normal_force[0, 0, 0] = load
        for check in range(1 if load else 40):
            guard.check(5 * (check + 1), 10.0)
    assert guard.take() == {}


def test_each_wheel_climbs_on_its_own_flange():
    """S1002 on the right of wheelset 2: between its limit and LMA's, only wheels of the lower limit climb."""
    guard = guard_of(Events(), overrides=("train.wheel_profiles=[{wheelsets=[2], side='right', profile='S1002'}]",))
    contacts = guard.stepper.ingredients.contacts
    assert contacts is not None
    lma, s1002 = map(climbing_shift, contacts.tables)
    guard.state.relative_shift[0, 1, :] = 0.5 * (lma + s1002)
    guard.check(5, 10.0)
    event = only(guard)
    assert (event.kind, event.wheelset, event.side) == ("flange_climb", 2, "left" if lma < s1002 else "right")
    assert f"beyond {1e3 * min(lma, s1002):.1f} mm" in event.words


def test_climbing_and_derailing(guard: Guard):
    """The flange first, the end of the profile next; the latter ends the train."""
    climb = climbing_shift(guard.stepper.ingredients.contact)
    assert 11.5e-3 < climb < 12.5e-3  # LMA on CHN60: the flank of 70 degrees ends at 12.1 mm (contact table)
    guard.state.relative_shift[0, 1, 0] = climb + 1e-4
    guard.check(5, 10.0)
    event = only(guard)
    assert (event.kind, event.wheelset, event.side, event.stops) == ("flange_climb", 2, "left", False)
    guard.state.relative_shift[0, 1, 0] = 14e-3
    guard.check(10, 10.1)
    event = only(guard)
    assert (event.kind, event.stops) == ("derailment", True)
    assert guard.stopped == {0: 10}


@pytest.mark.parametrize(("what", "value"), [("relative_tilt", -12.3e-3), ("relative_shift", -16.1e-3)])
def test_a_wheel_beyond_the_contact_table_is_noted(guard: Guard, what: str, value: float):
    """A tilt of 12 mrad to either side and a shift of 16 mm to the field are the last with a geometry of their own."""
    getattr(guard.state, what)[0, 1, 1] = 0.97 * value
    guard.check(5, 10.0)
    assert guard.take() == {}
    getattr(guard.state, what)[0, 1, 1] = value
    guard.state.normal_force[0, 1, 1] = 0.0
    guard.check(10, 10.0)
    assert guard.take() == {}  # off the rail
    guard.state.normal_force[0, 1, 1] = 7e4
    guard.check(15, 10.0)
    event = only(guard)
    assert (event.kind, event.wheelset, event.side, event.stops) == ("contact_range", 2, "right", False)
    assert "tilt beyond 12 mrad or shift below -16.0 mm" in str(event)


def test_the_scenario_decides(guard: Guard):
    """A derailment that is only recorded, a climb that stops."""
    guard = guard_of(Events(derailment="record", flange_climb="stop"))
    guard.state.relative_shift[0, 0, 0] = 12.4e-3
    guard.check(5, 1.0)
    assert only(guard).stops
    guard = guard_of(Events(derailment="record"))
    guard.state.relative_shift[0, 0, 0] = 14e-3
    guard.check(5, 1.0)
    assert {event.kind: event.stops for event in guard.take()[0]} == {"flange_climb": False, "derailment": False}
    assert guard.stopped == {}


@pytest.mark.parametrize("policy", ["stop", "record"])
def test_forces_that_alternate_from_step_to_step(policy: str):
    """A lateral force of 5 kN to and fro: found once it has grown from one 0.1 s to the next, in a look every 20 ms."""
    guard = guard_of(Events(oscillation=policy), steps=1000)
    guard.load(0, np.arange(1000.0))
    for i in range(1000):
        guard.stepper.rows = Rows(i)
        guard.stepper.chunk.wheel[0, i, 1, 0, at.LATERAL_FORCE] = 5e3 * np.exp(1e-3 * i) * (-1) ** i
        guard.watch_step()
    event = only(guard)
    assert (event.kind, event.wheelset, event.side, event.stops) == ("oscillation", 2, "left", policy == "stop")
    assert event.time == pytest.approx(0.19, abs=0.021)
    assert "numerics.time_step = 0.0001 or more passes" in event.words


def test_the_end_of_a_measured_track(guard: Guard):
    """Noted once, when the leading wheel comes to it, 11.25 m ahead of the centre."""
    front = float(guard.stepper.ingredients.train.wheelset_x.max())
    guard = guard_of(Events(), track_end=50.0)
    guard.check(5, 50.0 - front - 0.01)
    assert guard.take() == {}
    guard.check(10, 50.0 - front + 0.01)
    event = only(guard)
    assert event.kind == "track_end"
    assert "ends at chainage 50.00 m" in event.words
    guard.check(15, 60.0)
    assert guard.take() == {}


SHORT = {
    "train.distance": 6.0,
    "numerics.time_step": STEP,
    "irregularity.taper": 1.0,
}


def short(**changes: object) -> Scenario:
    return load_scenario("default", SHORT | {key.replace("__", "."): value for key, value in changes.items()})


def test_events_are_in_the_file_and_samples_end_with_them(tmp_path):
    """A hundred times the track's roughness: the train derails; nothing is written beyond that instant."""
    path = tmp_path / "run.h5"
    notes: list[str] = []
    with pytest.raises(RunFailedError, match=r"derailed|ran away"):
        simulate.run(short(irregularity__scale=100.0), path, notify=notes.append)
    with simulate.open_result(path) as result:
        events = result.group("events")
        last = events["time"][-1]
        assert events["stops"].tolist()[-1] == 1
        assert events["message"][-1] in result.status()
        assert result.facts()["simulated_time"] == pytest.approx(last, abs=1e-12)
        for group in ("wheel", "body"):
            time = result.group(group)["time"]
            assert last - 1.001e-3 <= time[-1] <= last + 1e-12
        assert np.isfinite(result.wheel()["normal_force"][:-5]).all()  # a check is at most five steps late
    assert notes
    assert str(notes[-1]).startswith(str(events["message"][-1]))


def test_launches_stop_where_a_check_is_needed(tmp_path, monkeypatch: pytest.MonkeyPatch):
    """A launch of many steps that looks at the state itself finds what a check every millisecond finds: same bits.

    The roughness begins within a metre: in the second run wheels leave the rails and come back, the last one derails.
    """
    for scale, ends in ((0.2, False), (1.0, False), (100.0, True)):
        found = []
        for looks in (True, False):
            with monkeypatch.context() as patch:
                checks = count_checks(patch)
                if not looks:
                    patch.setattr(SplineStepper, "look_out", lambda self, lookout: False)
                path = tmp_path / f"{scale}{looks}.h5"
                with pytest.raises(RunFailedError) if ends else nullcontext():
                    simulate.run(short(irregularity__scale=scale, events__wheel_lift_time=2e-3), path)
            with simulate.open_result(path) as result:
                events, wheel = result.group("events"), result.wheel()
                found.append(({key: list(events[key]) for key in events}, np.array(wheel["normal_force"]), len(checks)))
        assert found[0][0] == found[1][0]
        np.testing.assert_array_equal(found[0][1], found[1][1])
        assert found[0][2] <= found[1][2]
        if scale == 0.2:
            assert found[0][2] < 0.2 * found[1][2]
        if scale == 1.0:
            assert (found[0][1] == 0.0).any()


def count_checks(patch: pytest.MonkeyPatch) -> list[int]:
    """Steps after which a guard checks, filled as it does."""
    checks: list[int] = []
    check = Guard.check
    patch.setattr(Guard, "check", lambda self, step, position: (checks.append(step), check(self, step, position)))
    return checks


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30])
@pytest.mark.parametrize("part", ["vertical", "lateral", "slabs", "vehicles"])
def test_a_launch_stops_at_numbers_that_run_away(part: str, value: float):
    """It ends after the first step that is looked at, here the fifth; the check names the part."""
    guard = guard_of(Events(), steps=20)
    stepper = guard.stepper
    assert guard.called
    values = guard.state.part(0, part)[VELOCITY]
    values[(0,) * values.ndim] = value
    guard.state.put(VELOCITY, part, values[None])
    count = 20
    stepper.load(np.zeros(count), np.full(count, 80.0), np.zeros(count), np.zeros_like(stepper.chunk.irregularity))
    guard.load(100, np.arange(float(count)))
    guard.lookout.always = False
    none = np.full(count, -1)
    stepper.take(Plan(np.arange(count), none, none))
    assert guard.stopped == {0: 105}
    assert only(guard).kind == "runaway"


def test_a_measured_track_that_is_never_reached_is_refused(tmp_path):
    """It would be a smooth track without a word."""
    x = np.arange(900.0, 1000.0, 0.25)
    rows = "\n".join(f"{s:.2f},{1e-3 * np.sin(s):.6f},{1e-3 * np.sin(s):.6f},0,0" for s in x)
    file = tmp_path / "track.csv"
    file.write_text("distance [m],vertical_left [m],vertical_right [m],alignment_left [m],alignment_right [m]\n" + rows)
    with pytest.raises(
        InputError, match=r"irregularity\.file: begins at chainage 900 m: must be before the end of the run"
    ):
        simulate.run(short(irregularity__file=str(file)), tmp_path / "run.h5")
    assert list(tmp_path.iterdir()) == [file]
