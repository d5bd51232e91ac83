"""Runs with rails and wheels that are not perfect."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiengine.engine.time_step import prepare
from tiengine.parameters.errors import InputError, RunStoppedError
from tiengine.scenario.scenario import Scenario, load_scenario
from tiengine.simulation import simulate

from .test_resume import assert_same, stopped_after

QUIET: dict[str, Any] = {
    "output.precision": "double",
    "output.body_interval": "step",
    "output.envelopes": False,
    "output.deflection_interval": "none",
    "irregularity.taper": 5.0,
    "numerics.time_step": 1e-4,
}
ORDER, AMPLITUDE = 20, 3e-5


def scenario(**changes: Any) -> Scenario:
    """A smooth track; two underscores stand for a dot."""
    return load_scenario("smooth", QUIET | {key.replace("__", "."): value for key, value in changes.items()})


def test_a_polygonal_wheel_is_a_wave_of_the_rail():
    """A cos n theta on the left wheels gives, step for step, the forces of a rail wave of 2 pi r/n.

    r is the radius on which they roll (0.17 mm less than r0: the contact lies off the tape circle), known from the turn
    that pitch adds to V/r0. What differs is the wheels' slip in the waves: 3 rad/10^6 of
    phase, 6e-5 of the vertical and 1.3e-4 of the lateral force.
    """
    base = scenario(train__distance=15.0)
    places, r0 = base.parts.wheelset_positions, base.parts.wheel_radii[0]
    lead = base.rear + base.centre_in_window + places.max()
    with simulate.run(base) as smooth:
        body = smooth.group("body")
        pitch = body["displacement"][:, 3, 3]
        rolled = body["position"][-1] - body["position"][0]
    r = rolled / (rolled / r0 - (pitch[-1] - pitch[0]))
    assert 0.9995 * r0 < r < r0
    Omega = ORDER / r
    wheels = [
        {"kind": "harmonics", "order": [ORDER], "amplitude": [AMPLITUDE], "phase": [Omega * (x - places.max())],
         "wheelsets": [w + 1], "side": "left"}
        for w, x in enumerate(places)
    ]  # fmt: skip
    wave = {
        "kind": "corrugation", "rail": "left", "reach": [0.0, lead + 100.0], "wavelength": 2.0 * np.pi / Omega,
        "depth": 2.0 * AMPLITUDE, "phase": -0.5 * np.pi - Omega * lead, "taper": 0.01,
    }  # fmt: skip
    with simulate.run(scenario(train__distance=15.0, train__wheel_shapes=wheels)) as first:
        of_wheel, track = first.wheel(), first.group("irregularity")["vertical"]
    with simulate.run(scenario(train__distance=15.0, track__rail_shapes=[wave])) as second:
        of_rail = second.wheel()
    assert not track.any()  # the rail is smooth
    for channel in ("normal_force", "lateral_force"):
        swing = np.ptp(of_rail[channel][:, :, 0])
        assert np.abs(of_wheel[channel] - of_rail[channel]).max() < 2e-4 * swing
    assert np.ptp(of_rail["normal_force"][:, 0, 0]) > 4e4


def test_a_resumed_run_has_the_same_bits(tmp_path: Path):
    """Stopped after a chunk while the speed changes: the wheels' angles follow from the state."""
    shapes = {
        "train__speed_kmh": [[0.0, 120.0], [60.0, 122.0]],
        "train__distance": 5.0,
        "train__wheel_shapes": [{"kind": "flat", "length": 0.1, "form": "worn", "wheelsets": [2]}],
        "track__rail_shapes": [{"kind": "weld", "at": 30.0, "length": 1.0, "depth": 3e-4}],
    }
    simulate.run(scenario(**shapes), tmp_path / "whole.h5").close()
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(**shapes), tmp_path / "run.h5", stop=stopped_after(1))
    simulate.resume(tmp_path / "run.h5").close()
    assert_same(tmp_path / "whole.h5", tmp_path / "run.h5")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"train__wheel_shapes": [{"kind": "harmonics", "order": [60], "amplitude": [1e-6]}]},
            ("train.wheel_shapes", "wheelset 1 left, of order 60", "0.0450", "8 V dt", "numerics.time_step <= 5.8e-05"),
        ),
        (
            {"track__rail_shapes": [{"kind": "corrugation", "reach": [0.0, 90.0], "wavelength": 0.03, "depth": 1e-5}]},
            ("track.rail_shapes[0]", "corrugation = 0.03 m", "8 V dt", "numerics.time_step <= 3.9e-05"),
        ),
    ],
)
def test_waves_that_the_step_cannot_follow(changes, words):
    """Named with the step that would do."""
    with pytest.raises(InputError) as caught:
        prepare(scenario(**changes))
    for word in words:
        assert word in str(caught.value)


def test_auto_takes_a_step_that_follows():
    """An order of 60 at 350 km/h needs 5e-5 s."""
    shape = {"kind": "harmonics", "order": [60], "amplitude": [1e-6]}
    model, _ = prepare(scenario(train__wheel_shapes=[shape], numerics__time_step="auto"))
    assert model.ingredients.newmark.dt == 5e-5
