"""Runs on ground that moves in time: balance, batches, breaks, recorded motions."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine.state import DISPLACEMENT
from tiengine.irregularity.base_motion import GroundRecord
from tiengine.parameters.errors import RunStoppedError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate
from tiengine.simulation.tasks import plan
from tiengine.simulation.time_loop import Run

from .test_resume import assert_same, stopped_after

SHORT = {
    "train.distance": 60.0,
    "train.start": 45.0,
    "numerics.time_step": 2e-4,
    "output.precision": "double",
    "output.run_in": 1.0,
}


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """A burst of 4 Hz and 1.5 Hz within 0.6 s, down and to the right; its file."""
    t = np.linspace(0.0, 0.6, 61)
    bell = np.sin(np.pi * t / 0.6) ** 4
    path = tmp_path_factory.mktemp("record") / "a.csv"
    rows = zip(t, 1.5 * np.sin(25.0 * t) * bell, 1.2 * np.cos(10.0 * t) * bell, strict=True)
    path.write_text("\n".join(["time [s], vertical [m/s^2], lateral [m/s^2]", *(f"{a}, {b}, {c}" for a, b, c in rows)]))
    return str(path)


def scenario(record, **changes):
    """The default train on ground that moves; two underscores stand for a dot."""
    motion = {"file": record, "taper": 0.05, **changes.pop("motion", {})}
    more = {key.replace("__", "."): value for key, value in changes.items()}
    return load_scenario("default", SHORT | {"track.base_motion": motion} | more)


def test_wheels_carry_weight_less_what_accelerates(record):
    """Vertically and laterally: the wheels' forces are the weight less m a of all bodies, whose accelerations are
    those recorded, the ground's included.

    To the rounding of Newton's method and of the recorded differences, 20 N of 490 kN.
    """
    s = scenario(record, irregularity__spectrum="none", output__body_interval="step")
    with simulate.run(s) as result:
        wheel, body = result.wheel(), result.body()
    masses = np.concatenate([[b.mass for b in vehicle.body] for vehicle in s.parts.vehicles])
    acceleration = body["acceleration"]
    for name, axis, weight in (("vertical_force", 1, 9.81 * masses.sum()), ("lateral_force", 0, 0.0)):
        inertia = (acceleration[..., axis] * masses).sum(axis=1)
        assert np.abs(inertia).max() > 1e4
        carried = wheel[name].sum(axis=(1, 2))
        assert np.abs(carried - weight + inertia).max() < 20.0, name


def test_rails_and_slabs_weigh_on_their_seats_and_beds(record):
    """Far from the train a seat bears -rho A d a of its rails, a slab sinks by -(its mass and that of both rails) a/k.

    Less the same on ground at rest. The ground moves slowly
    against rails on seats (200 Hz and more): to 2 % of the largest vertically, laterally (60 Hz) to 5 %.
    """
    end = {
        "motion": {"start": 0.0},
        "train__distance": 29.0,
        "train__start": 60.0,
        "irregularity__spectrum": "none",
    }  # 0.298 s: at the peak
    end |= {"numerics__window": 60.0}  # a seat 10 m from the train and from the window's end
    states = []
    for s in (scenario(record, **end), scenario(record, **end | {"motion": {"start": 50.0}})):
        trip = Run.begin(plan(s)[0])
        for _ in trip.blocks():
            pass
        state = trip.stepper.state
        states.append((state.seat_forces[0].copy(), state.slab_motion(DISPLACEMENT)[0].copy(), state.first_slab))
    forces, slabs = states[0][0] - states[1][0], states[0][1] - states[1][1]
    parts = trip.task.scenario.parts
    time = trip.done * trip.recorder.dt
    down, aside = GroundRecord(scenario(record, **end).track.base_motion).at(np.array([time]), 2)[0]
    rail = parts.rail.mass_per_length * parts.slab.fastening_pitch
    assert abs(down) > 0.5
    assert abs(aside) > 0.5
    np.testing.assert_allclose(forces[:, 0, 15], -rail * down, rtol=0.02)
    np.testing.assert_allclose(forces[:, 1, 15], -rail * aside, rtol=0.05)
    slab = slabs[(states[0][2] + 1) % len(slabs)]
    area = parts.slab.length * parts.slab.width
    loaded = parts.slab.mass + 2.0 * rail * parts.slab.fastenings
    for found, a, k in (
        (slab[:-2:3].mean(), down, parts.mortar.stiffness),
        (slab[-2], aside, parts.mortar.lateral_stiffness),
    ):
        assert found == pytest.approx(-loaded * a / (k * area), rel=0.05)


def test_a_resumed_run_has_the_same_bits(record, tmp_path):
    """Stopped after one chunk while a wave passes."""
    s = scenario(record, motion={"wave_speed": 400.0, "at": 30.0, "start": 0.1})
    simulate.run(s, tmp_path / "whole.h5").close()
    path = tmp_path / "run.h5"
    with pytest.raises(RunStoppedError):
        simulate.run(s, path, stop=stopped_after(1))
    simulate.resume(path).close()
    assert_same(tmp_path / "whole.h5", path)


@pytest.mark.slow
def test_trains_together_move_as_alone(record):
    """The second of two trains on irregular track and the same alone: forces to the rounding of other vectors."""
    both = scenario(record, ensemble__size=2, train__distance=20.0)
    with simulate.run(both) as result:
        expected = result.wheel(train=1)["vertical_force"]
    alone = scenario(record, irregularity__seed=both.members[1].irregularity.seed, train__distance=20.0)
    with simulate.run(alone) as result:
        np.testing.assert_allclose(result.wheel()["vertical_force"], expected, atol=1e-3)


def test_a_record_that_has_not_begun_changes_nothing(record):
    """Ground at rest in the step for moving ground: as the step without, but for its rounding."""
    later = scenario(record, irregularity__spectrum="none", motion={"start": 100.0})
    with simulate.run(later) as result:
        found = result.wheel()["vertical_force"]
    with simulate.run(load_scenario("default", SHORT | {"irregularity.spectrum": "none"})) as result:
        expected = result.wheel()["vertical_force"]
    leaning = 60.0  # N: on moving ground the springs' stiffness includes what a car that leans loads
    assert np.abs(found - expected).max() < leaning


def test_recorded_motions_include_the_ground(record):
    """A wheelset moves down with the ground, but for what the contact and the rails give way: 5 % of the largest."""
    small = scenario(record, irregularity__spectrum="none", motion={"scale": 1e-3})
    with simulate.run(small) as result:
        body = result.body()
    ground = GroundRecord(small.track.base_motion).at(body["time"], 0)
    still = load_scenario(
        "default", SHORT | {"irregularity.spectrum": "none", "track.base_motion": {"file": record, "start": 50.0}}
    )
    with simulate.run(still) as result:
        rest = result.body()["displacement"]
    wheelset = body["displacement"][:, 3, 1] - rest[:, 3, 1]
    assert np.abs(wheelset - ground[:, 0]).max() < 0.05 * np.abs(ground[:, 0]).max()
