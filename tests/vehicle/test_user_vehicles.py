"""Vehicles as users write them, body by body: a six-axle locomotive, a three-piece wagon loaded off its centre."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.model.from_scenario import ingredients
from tiengine.parameters.conventions import GRAVITY
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import load_toml
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.vehicle.train import assemble, static_wheel_loads
from tiengine.vehicle.vehicle import load_vehicle

DATA = Path(__file__).parents[1] / "data" / "vehicles"
LOAD, OFFSET = 75e3, 0.1  # kg, m to the right: of the wagon


def test_a_locomotive_stands_on_six_equal_axles():
    """Springs over each axle alike: a twelfth of the weight each wheel; the springs hold every body."""
    loco = load_vehicle(str(DATA / "loco.toml"))
    loads = static_wheel_loads(assemble([loco]))
    assert loads == pytest.approx(np.full((6, 2), loco.mass * GRAVITY / 12.0), rel=1e-9)  # a solve of condition 1e6


def test_a_load_off_the_centre_presses_on_its_side():
    """Moments about the centre line: sum of (right - left) b0 = m g y."""
    wagon = load_vehicle(str(DATA / "wagon_offset.toml"))
    loads = static_wheel_loads(assemble([wagon]))
    assert loads.sum() == pytest.approx(wagon.mass * GRAVITY, rel=1e-9)
    moment = (loads[:, 1] - loads[:, 0]).sum() * wagon.half_spacing
    assert moment == pytest.approx(LOAD * GRAVITY * OFFSET, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"car.mass": -32000.0}, "car.mass = -32000.0: must be greater than 0 kg"),
        ({"geometry.wheel_radius": 460.0}, "wheel_radius = 460.0: must be less than or equal to 1.5 m"),
        ({"geometry.half_wheelbase": 1280.0}, "half_wheelbase = 1280.0: must be less than or equal to 100 m"),
        ({"secondary.kz": 0.0}, "car: not restrained by springs, mostly in z"),
    ],
)
def test_other_units_are_named(change, message):
    """Millimetres, forgotten springs: in one line."""
    keys = {f"train.vehicles.0.{key}": value for key, value in change.items()}
    with pytest.raises(InputError, match=message):
        ingredients(load_scenario("smooth", {"train.vehicles": ["Manchester"], **keys}), 2e-4)


def test_a_vehicle_that_would_tip_over_is_refused():
    """The centre of gravity of the wagon's car a metre beside the track's centre."""
    wagon = load_toml(DATA / "wagon_offset.toml")
    wagon["body"][0]["y"] = 1.0
    with pytest.raises(InputError, match=r"wheelset [1-4] left would carry -[\d.]+ kN at rest; all wheels must carry"):
        ingredients(load_scenario("smooth", {"train.vehicles": [wagon]}), 2e-4)


def test_both_side_frames_take_the_torque_of_the_brakes():
    """Alike, as both guide the wheelset; in all the wheelsets' torques."""
    wagon = load_vehicle(str(DATA / "wagon_offset.toml"))
    wheels, axles = (assemble([wagon], effort=effort).acceleration_force for effort in ("wheels", "axles"))
    train = assemble([wagon])
    difference = wheels - axles
    frames = [train.dof(f"side frame {bogie}{side}", "pitch") for bogie in (1, 2) for side in "LR"]
    assert difference[frames] == pytest.approx(np.full(4, difference[frames].sum() / 4.0), rel=1e-12)
    torque = wagon.mass * wagon.wheel_radius + 4 * 100.0 / wagon.wheel_radius
    assert difference[frames].sum() == pytest.approx(torque, rel=1e-12)
    assert difference.sum() == pytest.approx(0.0, abs=1e-9 * torque)


@pytest.mark.parametrize("name", ["loco", "wagon_offset"])
def test_they_run(name):
    """Over 12 m of smooth track at 80 km/h the weight stays on the wheels, and off the centre where the load is.

    2 %: the seats' passing. The load's moment grows by the car body's roll, some 2 % of its lever.
    """
    vehicle = load_vehicle(str(DATA / f"{name}.toml"))
    keys = {
        "train.vehicles": (str(DATA / f"{name}.toml"),),
        "train.speed_kmh": 80.0,
        "train.distance": 12.0,
        "numerics.modes_per_metre": 2.0,
        "numerics.truncation": "none",
    }
    with run(load_scenario("smooth", keys)) as result:
        force = result.wheel()["vertical_force"].astype(np.float64)
    assert force.sum(axis=(1, 2)).mean() == pytest.approx(vehicle.mass * GRAVITY, rel=0.02)
    moment = (force[..., 1] - force[..., 0]).sum(axis=1).mean() * vehicle.half_spacing
    expected = LOAD * GRAVITY * OFFSET if name == "wagon_offset" else 0.0
    assert moment == pytest.approx(expected, rel=0.1, abs=0.001 * vehicle.mass * GRAVITY)
