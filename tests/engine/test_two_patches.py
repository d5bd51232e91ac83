"""Two patches a wheel in whole steps: the same bits whatever the batch, the lanes and the breaks of a run."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import h5py
import numpy as np
import pytest

from tiengine.kernels import layout as at
from tiengine.parameters.errors import RunStoppedError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate

from ..models import V350, paper_model
from .spline_bed import make_bed, with_trains
from .spline_reference import motion_of

S1002 = {
    "train.vehicles": ["Manchester"], "train.wheel_profile": "S1002", "track.rail_profile": "60E1",
    "track.gauge_depth": 0.014, "contact.patches": 2,
}  # fmt: skip
SHIFT = 5.1e-3
"""m: tread and flange root touch at once."""
LIFT = 4.2e-4
"""m: by which the gap falls on the way there."""


@pytest.mark.slow  # four kernels are compiled
def test_any_lanes_and_any_place_give_the_same_bits() -> None:
    """Train b is the same alone and in a batch, in vectors of 2, 4 and 8 lanes, with both patches in use."""
    words = (
        "contact.patches=2",
        'train.vehicles=["Manchester"]',
        "train.wheel_profile=S1002",
        "track.rail_profile=60E1",
        "track.gauge_depth=0.014",
    )
    built = paper_model(*words, dt=2e-4)
    train = built.ingredients.train

    def bits(trains: int, b: int, lanes: int | None = None) -> list[np.ndarray]:
        given = make_bed(with_trains(built, trains), V350, **({} if lanes is None else {"lanes": lanes}))
        given.start(1)
        coordinates = given.state.vehicles(0)
        coordinates[:, train.wheelset_dof[:, 0]] += SHIFT
        coordinates[:, train.wheelset_dof[:, 1]] -= LIFT
        given.state.set_vehicles(0, coordinates)
        given.step.record[:] = np.arange(len(given.step.record))
        given.step(0, 4)
        state = motion_of(given, b)
        return [state.rails, state.slabs, state.train, given.contact.force[b].copy(), given.record[b].copy()]

    together = bits(3, 0)
    patch = together[4][..., at.N_WHEEL :].reshape(*together[4].shape[:-1], 2, at.N_PATCH)
    assert (patch[..., at.PATCH_NORMAL_FORCE] > 1e3).all(axis=-1).any()
    for lanes in (2, 4, 8):
        for a, b in zip(bits(1, 0, lanes), together, strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 0.4 s on rough track."""
    path = tmp_path_factory.mktemp("two") / "whole.h5"
    simulate.run(scenario(), path).close()
    return path


def scenario():
    return load_scenario(
        "default",
        S1002 | {
            "train.distance": 17.0, "train.speed_kmh": 150.0, "numerics.time_step": 2e-4, "irregularity.spectrum":
            "german_high", "output.precision": "double", "track.friction": 0.4,
        },
    )  # fmt: skip


def test_patches_are_recorded(whole: Path) -> None:
    """Group ``patch``: forces add up to the wheel's, shares to one, and creep forces dissipate in either patch."""
    with h5py.File(whole) as file:
        wheel, patch = file["trains/000/wheel"], file["trains/000/patch"]
        N = patch["normal_force"][()]
        assert N.shape[1:] == (4, 2, 2)
        np.testing.assert_allclose(N.sum(axis=-1), wheel["normal_force"][()], rtol=1e-12)
        touching = N.sum(axis=-1) > 0.0
        np.testing.assert_allclose(patch["share"][()].sum(axis=-1)[touching], 1.0, rtol=1e-12)
        assert (N > 1.0).all(axis=-1).any()
        work = patch["longitudinal_creep_force"][()] * patch["longitudinal_creepage"][()]
        across = patch["lateral_creep_force"][()] * patch["lateral_creepage"][()]
        np.testing.assert_allclose(patch["wear_number"][()], np.abs(work) + np.abs(across), rtol=1e-12)
        assert patch["time"][()].tobytes() == wheel["time"][()].tobytes()
        assert patch["normal_force"].attrs["units"] == "N"


def test_resumed_run_has_the_same_bits(whole: Path, tmp_path: Path) -> None:
    """Stopped after a chunk and resumed."""
    path, calls = tmp_path / "resumed.h5", count(1)
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(), path, stop=lambda: next(calls) >= 1)
    simulate.resume(path).close()
    with h5py.File(whole) as one, h5py.File(path) as two:
        for group in ("wheel", "patch", "body"):
            for name, values in one[f"trains/000/{group}"].items():
                if values.dtype.kind == "f":
                    assert values[()].tobytes() == two[f"trains/000/{group}/{name}"][()].tobytes(), name


def test_one_patch_records_no_patches() -> None:
    """Buffers and groups are those of before."""
    assert at.N_WHEEL_RECORD[1] == at.N_WHEEL
    assert at.CONTACT_ROWS[1] == 2
