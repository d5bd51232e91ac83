"""Runs in the wind: the static balance of moments, rest from a history of forces, the same bits after a break."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import RunStoppedError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate

from .test_resume import assert_same, stopped_after
from .test_shapes import QUIET

WIND = {"wind.speed": 12.0, "train.speed_kmh": 250.0, "train.distance": 15.0, "numerics.time_step": 2e-4}


@pytest.mark.parametrize("functions", ["splines", "sines"])
def test_the_wheels_carry_the_winds_moment(functions):
    """Sum of Q_right - Q_left times their arms is the wind's moment and that of the displaced weights.

    About the track's centre at the top of the rail. Within 1 %: lateral forces act some mm off the top of the rail. The
    leaning stiffness counts the weights alone, without the lift.
    """
    few = {"numerics.trial_functions": functions, "numerics.modes_per_metre": 2.0}
    scenario = load_scenario("smooth", QUIET | WIND | few)
    with simulate.run(scenario) as result:
        Q = result.wheel()["vertical_force"][-400:].mean(axis=0)
        Y = result.wheel()["lateral_force"][-400:].mean(axis=0)
        place = result.wheel()["contact_position_wheel"][-400:].mean(axis=0)
        y = result.group("body")["displacement"][-400:, :, 0].mean(axis=0)
    V, U = 250.0 / 3.6, 12.0
    side, lift, roll = scenario.parts.aerodynamics.coefficients(np.array(np.arctan2(U, V)))[:3]
    q = 0.5 * 1.225 * (V**2 + U**2)
    vehicle = scenario.parts.vehicles[0]
    arm = np.array([-1.0, 1.0]) * (vehicle.half_spacing + place) + y[3:, None]
    weights = GRAVITY * np.array([body.mass for body in vehicle.body])
    moment = (Q * arm).sum() - weights @ y
    assert moment == pytest.approx(q * 10.0 * 3.0 * roll, rel=0.01)
    assert Y.sum() == pytest.approx(q * 10.0 * side, rel=0.01)
    assert GRAVITY * vehicle.mass - Q.sum() == pytest.approx(q * 10.0 * lift, rel=0.01)


def test_a_resumed_gust_has_the_same_bits(tmp_path: Path):
    """Loads follow from chainage and time, not from where a chunk begins."""
    changes = {
        "wind.gust": "en14067", "wind.gust_at": 22.0, "train.distance": 20.0,
        "train.forces": [{"motion": "z", "rows": [[0.0, 0.0], [0.1, 1e4], [0.2, 0.0]]}],
    }  # fmt: skip
    scenario = load_scenario("smooth", QUIET | WIND | changes)
    simulate.run(scenario, tmp_path / "whole.h5").close()
    with pytest.raises(RunStoppedError):
        simulate.run(scenario, tmp_path / "run.h5", stop=stopped_after(1))
    simulate.resume(tmp_path / "run.h5").close()
    assert_same(tmp_path / "whole.h5", tmp_path / "run.h5")
