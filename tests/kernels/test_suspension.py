"""The kernel of the nonlinear suspension elements against NumPy and hand values."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.kernels.suspension import suspension_forces
from tiengine.vehicle.train import TrainModel, assemble
from tiengine.vehicle.vehicle import load_vehicle

ROUNDING = np.finfo(float).eps
NAMES = ("CRH380A_v2", "CRH380A_v6", "Zhai_coach", "Manchester")


def kernel_forces(train: TrainModel, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Forces that the kernel adds for states of shape (trains, n)."""
    motion = np.stack([u.ravel(), v.ravel(), np.zeros(u.size)])
    suspension_forces(
        train.n,
        train.element_index,
        train.element_row,
        train.element_kind,
        train.element_linear,
        train.element_table,
        np.zeros(len(train.element_kind)),
        motion,
    )
    return motion[2].reshape(u.shape)


def law(points: NDArray[np.float64], q: float) -> float:
    """Odd piecewise-linear force with NumPy, its last slope going on."""
    x = abs(q)
    slope = (points[-1, 1] - points[-2, 1]) / (points[-1, 0] - points[-2, 0])
    beyond = slope * max(x - points[-1, 0], 0.0)
    return float(np.sign(q) * (np.interp(x, *points.T) + beyond))


def elements(train: TrainModel, u: NDArray[np.float64], v: NDArray[np.float64]):
    """Element, its row over all coordinates, its abscissa and its whole force."""
    for e, kind in enumerate(train.element_kind):
        row = np.zeros(train.n)
        np.add.at(row, train.element_index[e], train.element_row[e])
        q = row @ (u if kind else v)
        yield e, row, q, law(train.element_table[e], q)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("series", [False, True])
@pytest.mark.parametrize("trains", [1, 3])
def test_kernel_equals_numpy(name, series, trains):
    """Random states far into the tables and beyond, for several trains in one array."""
    train = assemble([load_vehicle(name)] * 2, series_springs=series)
    rng = np.random.default_rng(7)
    u, v = 0.03 * rng.standard_normal((trains, train.n)), 0.3 * rng.standard_normal((trains, train.n))
    expected = np.zeros_like(u)
    for b in range(trains):
        for e, row, q, force in elements(train, u[b], v[b]):
            expected[b] -= row * (force - train.element_linear[e] * q)
    own = kernel_forces(train, u, v)
    # differences of forces up to linear * q ~ 5e6 * 3 N times arms of 10 m, sums of 12
    scale = 12 * 10.0 * np.abs(train.element_linear).max(initial=1e6) * 3.0
    assert own == pytest.approx(expected, abs=4 * ROUNDING * scale)
    assert np.abs(expected).max() > 1e3


@pytest.mark.parametrize(
    ("name", "part", "q", "force"),
    [
        ("CRH380A_v6", "frame 1 left yaw damper", 0.004, 9.81e3),
        ("CRH380A_v6", "frame 1 left yaw damper", -0.104, -9.81e3 - 4.995e3),
        ("CRH380A_v2", "frame 2 right yaw damper", 0.015, 73.5e3),
        ("CRH380A_v2", "frame 1 left lateral damper", 0.15, 8.82e3),
        ("CRH380A_v6", "frame 1 lateral stop", 0.019, 0.0),
        ("CRH380A_v6", "frame 1 lateral stop", 0.026, 2e3),
        ("CRH380A_v6", "frame 2 lateral stop", -0.046, -37.25e3),
        ("Zhai_coach", "frame 1 left yaw damper", 0.02, 16.85e3),
        ("Zhai_coach", "frame 1 left yaw damper", 3.0, 25.75e3),
        ("Zhai_coach", "frame 1 right lateral damper", -2.0, -3.585e3),
        ("Manchester", "frame 1 lateral stop", 0.0625, 129.6e3),
    ],
)
def test_hand_values(name, part, q, force):
    """Points of the data sheets; what C or K holds and what the kernel adds make the whole force."""
    train = assemble([load_vehicle(name)])
    e = train.element_names.index(part)
    y = train.element_index[e, 0]  # a coordinate that the element lengthens by
    state = np.zeros((1, train.n))
    state[0, y] = q / train.element_row[e, 0]
    u, v = (state, 0.0 * state) if train.element_kind[e] else (0.0 * state, state)
    alone = {key: getattr(train, key)[e : e + 1] for key in
             ("element_index", "element_row", "element_kind", "element_linear", "element_table")}  # fmt: skip
    motion = np.stack([u.ravel(), v.ravel(), np.zeros(train.n)])
    suspension_forces(train.n, *alone.values(), np.zeros(1), motion)
    f = motion[2]
    whole = train.element_linear[e] * q - f[y] / train.element_row[e, 0]
    assert whole == pytest.approx(force, rel=1e-12, abs=1e-9)  # rounding of the difference


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_added_on_the_initial_slope(name):
    """Small motions are wholly implicit; forces differ by rounding only."""
    train = assemble([load_vehicle(name)])
    rng = np.random.default_rng(3)
    u, v = 1e-5 * rng.standard_normal((1, train.n)), 1e-5 * rng.standard_normal((1, train.n))
    whole = np.abs(train.C).max() * 1e-4
    assert np.abs(kernel_forces(train, u, v)).max() <= 100 * ROUNDING * whole


def test_dampers_never_feed_power():
    """Linear part and deviation together: rate times force is positive for every element, at any rate."""
    rng = np.random.default_rng(5)
    for name in NAMES:
        train = assemble([load_vehicle(name)])
        for size in (1e-4, 1e-2, 1.0, 30.0):
            v = size * rng.standard_normal((1, train.n))
            power = v[0] @ train.C @ v[0] - v[0] @ kernel_forces(train, 0.0 * v, v)[0]
            assert power > 0.0


def test_action_is_reaction():
    """Forces between bodies: no resultant along y or z, and no roll moment about the rail of level parts."""
    train = assemble([load_vehicle("CRH380A_v6")])
    rng = np.random.default_rng(11)
    f = kernel_forces(train, 0.05 * rng.standard_normal((1, 35)), rng.standard_normal((1, 35)))[0]
    for motion in (0, 1):
        resultant = f[motion::5].sum()
        assert resultant == pytest.approx(0.0, abs=35 * ROUNDING * np.abs(f).max())


def test_vehicles_without_elements_need_no_kernel_entries():
    """CRH2 is linear: empty arrays, and the kernel adds nothing."""
    train = assemble([load_vehicle("CRH2")])
    assert train.element_index.shape == train.element_row.shape == (0, 12)
    u = np.ones((1, train.n))
    assert not kernel_forces(train, u, u).any()
