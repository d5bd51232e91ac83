"""Runs through curves: forces over a transition, the same bits after a break, an ensemble on one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import RunStoppedError
from tiengine.scenario.scenario import Scenario, load_scenario
from tiengine.simulation import simulate

from .test_resume import assert_same, stopped_after

LINE = (
    {"kind": "straight", "length": 40.0},
    {"kind": "transition", "length": 30.0},
    {"kind": "arc", "length": 300.0, "radius": 600.0, "cant_mm": 60.0},
)


def scenario(**changes: Any) -> Scenario:
    """A coach into a curve of 600 m; two underscores stand for a dot."""
    tables = {
        "train.vehicles": ["Manchester"], "train.speed_kmh": 80.0, "train.distance": 80.0, "track.alignment": LINE,
        "irregularity.spectrum": "none", "numerics.truncation": "none", "output.precision": "double",
        "output.run_in": 1.0,
    }  # fmt: skip
    return load_scenario("default", tables | {key.replace("__", "."): value for key, value in changes.items()})


def test_forces_follow_the_transition_without_a_jump():
    """Sum of Y of the coach is the inertia of its bodies on the line, and its own; it grows as the curvature does."""
    with simulate.run(scenario()) as result:
        Y = result.wheel()["lateral_force"][:].sum(axis=(1, 2))
        x = result.wheel()["position"][:]
        train, line = result.scenario.parts, result.scenario.track.line
        mass = sum(vehicle.mass for vehicle in train.vehicles)
    V = 80.0 / 3.6
    aq = line.lateral_acceleration(x, np.full(len(x), V), GRAVITY)
    arc = x > 90.0  # all wheels have entered; the car still swings
    assert Y[arc].mean() == pytest.approx(-mass * aq[-1], rel=0.1)
    step = float(np.median(np.diff(x)))
    per_metre = np.abs(Y[round(1.0 / step) :] - Y[: -round(1.0 / step)]).max()
    # a curvature that jumps would bring m a_q in the metre in which a wheelset passes it, a quarter each
    assert per_metre < 0.15 * mass * abs(aq[-1])


def test_a_resumed_run_in_a_curve_has_the_same_bits(tmp_path: Path):
    """The speed changes on the way, the break is in the transition."""
    braking = scenario(train__speed_kmh=[[0.0, 80.0], [80.0, 79.0]], train__distance=40.0)
    simulate.run(braking, tmp_path / "whole.h5").close()
    with pytest.raises(RunStoppedError):
        simulate.run(braking, tmp_path / "run.h5", stop=stopped_after(2))
    simulate.resume(tmp_path / "run.h5").close()
    assert_same(tmp_path / "whole.h5", tmp_path / "run.h5")


def test_trains_of_an_ensemble_run_on_the_same_line():
    """Two trains of other friction, advanced together, each lean outward."""
    several = scenario(ensemble__size=2, ensemble__vary={"track.friction": [0.3, 0.4]}, train__start=120.0,
                       train__distance=5.0)  # fmt: skip
    with simulate.run(several, workers=1) as result:
        totals = [result.wheel(train)["lateral_force"][:].sum(axis=(1, 2)) for train in range(2)]
    for total in totals:
        assert total.mean() == pytest.approx(totals[0].mean(), rel=1e-3)  # m a_q whatever the friction
        assert total.mean() < -1e4


def test_guards_in_a_curve() -> None:
    """Nothing is said of flanges against the rail at 0.29 g outward; a push of 120 kN at the car lifts inner wheels.

    In the mirrored curve those of the other side lift, at the same places.
    """
    rows = [[0.0, 0.0], [0.3, 1.2e5], [10.0, 1.2e5]]
    found = []
    for side, push, distance in ((1.0, 0.0, 4.0), (1.0, -1.0, 13.0), (-1.0, 1.0, 13.0)):
        arc = {"kind": "arc", "length": 300.0, "radius": side * 350.0, "cant_mm": 0.0}
        running = scenario(
            track__alignment=(*LINE[:2], arc), train__start=120.0, train__distance=distance, train__speed_kmh=114.0,
            train__forces=[{"motion": "y", "rows": rows, "scale": push}],
        )  # fmt: skip
        with simulate.run(running) as result:
            events = result.group("events")
            found.append([[str(value) for value in events[name]] for name in ("kind", "wheelset", "side")])
            found[-1].append([float(position) for position in events["position"]])
    assert found[0] == [[], [], [], []]
    for (kinds, wheelsets, sides, _), inner in zip(found[1:], ("right", "left"), strict=True):
        assert kinds == ["wheel_lift"] * 4
        assert sorted(wheelsets) == ["1", "2", "3", "4"]
        assert set(sides) == {inner}
    assert found[1][3] == pytest.approx(found[2][3], abs=1e-9)
