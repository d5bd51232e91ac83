"""Couplings between vehicles: a chain against its closed form, places of their ends, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import build
from tiengine.scenario.scenario import load_scenario
from tiengine.vehicle.connector import Spring, Stop
from tiengine.vehicle.coupling import Coupling
from tiengine.vehicle.train import assemble
from tiengine.vehicle.vehicle import load_vehicle

ENDS = {"a": "car", "b": "car", "point_a": (0.0, 0.0, 1.0), "point_b": (0.0, 0.0, 1.0)}


def coupled(count: int, *springs: Spring):
    """A train of equal cars, each coupled to the next."""
    coupling = Coupling(spring=springs)
    vehicles = [load_vehicle("CRH380A_v2")] * count
    return assemble(vehicles, couplings=[(k, coupling) for k in range(count - 1)])


def stiffness(train) -> np.ndarray:
    """Stiffness of the couplings alone, from their elements."""
    K = np.zeros((train.n, train.n))
    for e in np.flatnonzero(train.element_between_cars & (train.element_kind == 1)):
        row = np.zeros(train.n)
        np.add.at(row, train.element_index[e], train.element_row[e])
        K += train.element_table[e, 1, 1] / train.element_table[e, 1, 0] * np.outer(row, row)
    return K


def test_a_chain_of_eight_cars_has_its_frequencies():
    """Masses m on springs k between neighbours: f_j = (1/pi) sqrt(k/m) sin(j pi/16), j = 0...7."""
    k = 2e5
    train = coupled(8, Spring(kz=k, **ENDS))
    z = np.array([train.dof(f"v{i + 1} car", "z") for i in range(8)])
    m = train.M[z[0], z[0]]
    K = stiffness(train)[np.ix_(z, z)]
    omega2 = eigh(K, m * np.eye(8), eigvals_only=True)
    f = np.sqrt(np.maximum(omega2, 0.0)) / (2.0 * np.pi)
    wanted = np.sqrt(k / m) / np.pi * np.sin(np.arange(8) * np.pi / 16.0)
    np.testing.assert_allclose(f, wanted, atol=1e-6)


def test_the_ends_meet_in_the_coupling_plane():
    """A lateral spring half a pitch from both centres: equal yaw of both cars stretches it by half a pitch each.

    Rigid motions of the whole train along y, and its yaw about the coupling, do not stretch it.
    """
    train = coupled(2, Spring(ky=1e5, **ENDS))
    K, half = stiffness(train), 0.5 * load_vehicle("CRH380A_v2").length
    whole = np.zeros(train.n)
    bend = np.zeros(train.n)
    for i, side in enumerate((1.0, -1.0)):
        whole[train.dof(f"v{i + 1} car", "y")] = 1.0
        whole[train.dof(f"v{i + 1} car", "yaw")] = 0.01
        whole[train.dof(f"v{i + 1} car", "y")] += 0.01 * side * half
        bend[train.dof(f"v{i + 1} car", "yaw")] = 1.0
    assert np.abs(K @ whole).max() < 1e-6
    assert bend @ K @ bend == pytest.approx(1e5 * (2.0 * half) ** 2)


def test_couplings_leave_the_vehicles_matrices_alone():
    """They are elements: C and K are those of the uncoupled train."""
    alone, joined = coupled(2, Spring(k_roll=1.0, **ENDS)), coupled(2, Spring(kz=1e6, cz=1e4, **ENDS))
    for name in ("M", "C", "K"):
        np.testing.assert_array_equal(getattr(alone, name), getattr(joined, name))
    assert joined.element_between_cars.sum() == 2
    assert not joined.element_linear[joined.element_between_cars].any()


SPRING = {"a": "car", "b": "car", "point_a": [0.0, 0.0, 1.0], "point_b": [0.0, 0.0, 1.0], "ky": 1e5}


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"part": "EMU_intercr"}, ("train.couplings[0].part = 'EMU_intercr'", "'EMU_intercar'")),
        ({"part": "gangway", "behind": [3]}, ("train.couplings[0].behind = [3]", "numbers from 1 to 2")),
        ({"part": {"spring": [SPRING | {"kx": 1e5}]}}, ("spring[0].kx = 100000", "must be 0", "longitudinal")),
        ({"part": {"spring": [SPRING | {"b": "frme 1"}]}}, ("train.couplings[0].part.spring[0].b", "'frame 1'")),
        ({"part": {"name": "none"}}, ("must have a spring, a damper or a stop",)),
        ({"part": {"spring": [SPRING | {"ky": -1.0}]}}, ("train.couplings[0].part.spring[0].ky = -1", "0 N/m")),
    ],
)
def test_refused(entry, words):
    """One line with key, value and rule."""
    with pytest.raises(InputError) as caught:
        load_scenario("train3", {"train.couplings": [entry]})
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_stop_along_the_train_is_refused():
    """There is no longitudinal coordinate."""
    with pytest.raises(InputError, match=r"stop\[0\]\.direction = 'x'"):
        build(Coupling, {"stop": (Stop(direction="x", x=(0.0, 1.0), F=(0.0, 1.0), **ENDS),)})
