"""Loads of a train on moving ground: frames against differences in time, and motions that load nothing."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.irregularity.base_motion import BaseMotion, GroundRecord
from tiengine.model.base_motion_loads import BaseMotionLoads
from tiengine.vehicle.train import TrainModel

from ..models import default_model

SPEED, SPEED_RATE = 70.0, 1.5  # m/s, m/s^2


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A record whose two columns differ."""
    t = np.linspace(0.0, 3.0, 151)
    bell = np.sin(np.pi * t / 3.0) ** 4
    path = tmp_path_factory.mktemp("record") / "a.csv"
    rows = zip(t, np.sin(12.0 * t) * bell, np.cos(9.0 * t) * bell, strict=True)
    path.write_text("\n".join(["time [s], vertical [m/s^2], lateral [m/s^2]", *(f"{a}, {b}, {c}" for a, b, c in rows)]))
    return str(path)


@pytest.fixture(scope="module")
def train() -> TrainModel:
    return default_model().ingredients.train


def path_of(time):
    """Chainage and speed of a train that gains speed."""
    return 40.0 + SPEED * time + 0.5 * SPEED_RATE * time**2, SPEED + SPEED_RATE * time


def test_uniform_motion_is_an_inertia_force(file, train):
    """-m a on every body, down and to the right, and nothing else."""
    record = GroundRecord(BaseMotion(file=file))
    time = np.linspace(0.0, 3.0, 7)
    x, V = path_of(time)
    loads = BaseMotionLoads(record, train)(time, x, V, np.full(7, SPEED_RATE))
    a, mass = record.at(time, 2), np.diag(train.M)[: train.n_dof : 5]
    expected = np.zeros((7, len(mass), 5))
    expected[..., 1], expected[..., 0] = -mass * a[:, :1], -mass * a[:, 1:]
    np.testing.assert_array_equal(loads.force[0, :, : train.n_dof], expected.reshape(7, -1))
    assert not loads.elongation.any()
    assert not loads.frame_rate.any()


def test_rates_of_the_frames_are_those_of_their_motion(file, train):
    """Central differences of 1e-4 s along the bodies' paths: to h^2 w^3/6 of a wave of 12 rad/s, 3e-6."""
    loads = BaseMotionLoads(GroundRecord(BaseMotion(file=file, wave_speed=300.0)), train)
    h = 1e-4

    def moments(time):
        x, V = path_of(time)
        return time, x, V[:, None], np.full((len(time), 1), SPEED_RATE)

    middle = np.linspace(0.6, 2.4, 11)
    before, now, after = (loads.motion(*moments(middle + shift)) for shift in (-h, 0.0, h))
    for kind in range(2):
        rate = (after[:, kind] - before[:, kind]) / (2.0 * h)
        np.testing.assert_allclose(now[:, kind + 1], rate, atol=1e-5 * np.abs(rate).max())
    parts = [loads.offsets(*moments(middle + shift)[:3]) for shift in (-h, 0.0, h)]
    rate = (parts[2][0] - parts[0][0]) / (2.0 * h)
    np.testing.assert_allclose(parts[1][1], rate, atol=1e-5 * np.abs(rate).max())
    turned = loads.frame_rates(*moments(middle)[:3])[0]
    yaw = now[:, 1, [b for b, name in enumerate(train.body_names) if "wheelset" in name], 4]
    np.testing.assert_allclose(turned, yaw, rtol=1e-9)


def test_a_plane_that_moves_on_loads_nothing(file, train):
    """Behind a record with drift the ground rises and turns as a plane at constant speed: no inertia, no offsets."""
    loads = BaseMotionLoads(GroundRecord(BaseMotion(file=file, wave_speed=300.0, baseline="none")), train)
    time = np.array([5.0, 6.0])
    forces = loads(time, 40.0 + SPEED * time, np.full(2, SPEED), np.zeros(2))
    displaced = loads.motion(time, 40.0 + SPEED * time, np.full((2, 1), SPEED), np.zeros((2, 1)))
    assert np.abs(displaced[:, 0]).max() > 1e-3
    assert np.abs(forces.force).max() < 1e-6  # N: offsets cancel to rounding, times springs of 1e7 N/m
    assert np.abs(forces.elongation).max() < 1e-12
