"""Steady rolling in curves: balance of forces, mirror images, cant, gradient, both kinds of step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import DISPLACEMENT, State
from tiengine.model.constant_data import Model
from tiengine.model.curve_loads import CurveLoads, frame_offsets
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY

from ..models import V350, default_model, paper_model

R, CANT = 7000.0, 0.15
FLAT = 9500.0  # m, and the cant that balances 350 km/h there
BALANCED = 1.5 * np.sin(np.arctan(V350**2 / (FLAT * GRAVITY)))
FOUND = 1e-3  # N: the start is found to 1e-4 N in each of its equations


def line(radius: float = R, cant: float = CANT, gradient: float = 0.0) -> str:
    """An arc as an override."""
    return (
        f'track.alignment=[{{kind="arc", length=3000.0, radius={radius}, cant_mm={1e3 * cant},'
        f" gradient_permille={1e3 * gradient}}}]"
    )


def rolling(model: Model, V: float = V350, X: float = 100.0) -> State:
    """The train in steady rolling."""
    state = state_at_rest(model)
    equilibrium(model, state, X, V)
    return state


def forces(state: State) -> Reals:
    """Vertical and lateral forces of the wheels on the rails, shape (2, W, 2)."""
    return np.moveaxis(state.forces_on_rails[0][..., :2], -1, 0)


def mass(model: Model) -> float:
    train = model.ingredients.train
    return float(np.diag(train.M)[: train.n_dof : 5].sum())


@pytest.mark.parametrize("make", [default_model, paper_model])
def test_the_track_carries_the_unbalanced_acceleration(make: Any):
    """Sum of Y and of Q of a vehicle on a canted arc, by d'Alembert; 5.08 kN an axle (MODEL section 12)."""
    model = make(line())
    vertical, lateral = forces(rolling(model))
    roll = np.arcsin(CANT / 1.5)
    bend = V350**2 / R
    aq = bend * np.cos(roll) - GRAVITY * np.sin(roll)
    assert aq == pytest.approx(0.3625, abs=5e-5)
    assert lateral.sum() == pytest.approx(-mass(model) * aq, abs=FOUND)  # outward in a right-hand curve: to the left
    assert vertical.sum() == pytest.approx(mass(model) * (GRAVITY * np.cos(roll) + bend * np.sin(roll)), abs=FOUND)
    assert abs(lateral.sum()) / 4.0 == pytest.approx(5.08e3, abs=5.0)


def test_no_net_lateral_force_at_balanced_cant():
    _, lateral = forces(rolling(default_model(line(FLAT, BALANCED))))
    assert lateral.sum() == pytest.approx(0.0, abs=FOUND)


@pytest.mark.parametrize(("speed", "radius"), [(V350, R), (70.0 / 3.6, 300.0)])
def test_a_mirrored_curve_has_mirrored_forces(speed: float, radius: float):
    """In the sharp curve wheels stand at their flanges, which the start reaches step by step."""
    found = []
    for side in (1.0, -1.0):
        kmh = f"train.speed_kmh={3.6 * speed}"
        state = rolling(default_model(line(side * radius, side * 0.1), kmh, V=speed), speed)
        found.append((forces(state), state.part(0, "vehicles")[DISPLACEMENT]))
    (right, u), (left, u_left) = found
    assert left[0] == pytest.approx(right[0][:, ::-1], abs=FOUND)
    assert left[1] == pytest.approx(-right[1][:, ::-1], abs=FOUND)
    mirror = np.tile([-1.0, 1.0, -1.0, 1.0, -1.0], len(u) // 5)
    assert u_left == pytest.approx(mirror * u, abs=1e-9)


def test_load_moves_to_the_outer_rail_by_the_lever_of_every_body():
    """Moments about the track's centre line, with bodies where they are found to stand and lean."""
    model = default_model(line())
    state = rolling(model)
    train = model.ingredients.train
    roll, bend = np.arcsin(CANT / 1.5), V350**2 / R
    along, down = GRAVITY * np.sin(roll) - bend * np.cos(roll), GRAVITY * np.cos(roll) + bend * np.sin(roll)
    weights = np.diag(train.M)[: train.n_dof : 5]
    y = state.part(0, "vehicles")[DISPLACEMENT][: train.n_dof : 5].copy()
    y[0] -= train.body_x[1] ** 2 / (2.0 * R)  # the bogies carry the car where they stand, inward of its own middle
    moment = float(np.sum(weights * (down * y + along * train.body_height)))  # about x, the right rail down
    moment -= float(
        np.sum(train.wheelset_spin_inertia / train.wheel_radius) * V350**2 / R
    )  # gyroscopic, -J V/r kappa V
    vertical, _ = forces(state)
    b0 = float(train.half_spacing[0])
    transfer = float((vertical[:, 1] - vertical[:, 0]).sum()) * b0
    # contacts move on the heads by some mm of 746, rails yield by less than a millimetre under 70 kN a wheel
    assert transfer == pytest.approx(moment, rel=0.03)
    assert abs(transfer) / b0 > 0.1 * vertical.sum() / 4.0


def test_a_train_of_three_cars_shares_the_arc():
    """Each of the cars has its own m a_q; those in the middle stand as a car alone does."""
    model = default_model(line(), 'train.vehicles=["CRH380A_v2", "CRH380A_v2", "CRH380A_v2"]')
    _, lateral = forces(rolling(model))
    roll = np.arcsin(CANT / 1.5)
    each = mass(model) / 3.0 * (V350**2 / R * np.cos(roll) - GRAVITY * np.sin(roll))
    assert lateral.reshape(3, -1).sum(axis=1) == pytest.approx(-each, rel=1e-3)  # seats stand elsewhere under each


def test_uphill_the_wheels_pull_the_weight_and_a_vertical_curve_adds_to_it():
    """Longitudinal creep forces hold m g sin(i) back; in a hollow of 5000 m the load grows by V^2/5000."""
    gradient = 0.02
    model = default_model(line(1e6, 0.0, gradient))
    state = rolling(model)
    vertical, _ = forces(state)
    angle = np.arctan(gradient)
    bend = V350**2 / 1e6
    pull = np.moveaxis(state.wheels.force[0], -1, 0)[1].sum()
    torque_of_spin = 0.0  # the moment of the spin creepage about the axle is left to the tolerance
    assert pull == pytest.approx(mass(model) * GRAVITY * np.sin(angle) + torque_of_spin, rel=2e-3)
    assert vertical.sum() == pytest.approx(mass(model) * GRAVITY * np.cos(angle), abs=FOUND + mass(model) * bend**2)
    hollow = default_model(
        'track.alignment=[{kind="straight", length=20.0}, {kind="straight", length=200.0, gradient_permille=40.0}]'
    )
    vertical, _ = forces(rolling(hollow))
    slope = 0.04 * (100.0 + hollow.ingredients.centre_s - 20.0) / 200.0
    lifted = GRAVITY * np.cos(np.arctan(slope)) + V350**2 * 0.04 / 200.0
    assert vertical.sum() == pytest.approx(mass(hollow) * lifted, rel=1e-5)  # cos of the slope over the wheels


@pytest.mark.parametrize("make", [default_model, paper_model])
def test_the_start_in_a_curve_stays_in_balance(make: Any):
    """Host and kernels agree in a sharp arc, where flanges and stops bear; seats are held where they are."""
    V, steps = 70.0 / 3.6, 20
    model = make(line(350.0, 0.1), "train.speed_kmh=70", V=V)
    state = rolling(model, V)
    before = state.normal_force.copy()
    g = model.ingredients
    stepper = make_stepper(model, state, Chunk.empty(g, steps, 1))
    X, zero = np.full(steps, 100.0), np.zeros(steps)
    given = g.given_loads(zero, X + g.centre_s, zero + V, zero)
    stepper.load(X, zero + V, zero, np.zeros_like(stepper.chunk.irregularity), given)
    for i in range(steps):
        stepper.step(i)
    assert np.abs(state.normal_force - before).max() < 0.05


def test_a_coupling_between_cars_follows_the_chord_of_the_arc():
    """A lateral link of body points at the couplers' common middle is not strained by an arc that both cars stand on.

    By symmetry both middles lie off their frames by the same versine, so that only terms of the curvature's square are
    left; taken against each car's own frame the link would be strained by 25 m times the heading between the cars.
    """
    train = default_model(line(), 'train.vehicles=["CRH380A_v2", "CRH380A_v2"]').ingredients.train
    loads = default_model(line()).ingredients.given[0]
    assert isinstance(loads, CurveLoads)
    x, V = np.array([500.0]), np.array([[V350]])
    offset, _ = frame_offsets(loads.alignment, train, x, V, 0.0)
    first, second = (offset[0, i] for i in (0, len(train.body_x) // 2))
    half, pitch = 12.5, 25.0
    ends = first[0] - half * first[4], second[0] + half * second[4]
    assert second[0] == pytest.approx(pitch**2 / (2.0 * R), rel=1e-6)  # versine of the arc
    assert ends[0] - ends[1] == pytest.approx(0.0, abs=1e-9)
