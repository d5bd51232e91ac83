"""The step's contact forces are the contact law at the end of the step, whatever speed, step and state."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.engine.equilibrium import ContactForces, evaluate_contact
from tiengine.engine.sine_state import SineState
from tiengine.kernels import contact as kernels
from tiengine.kernels import layout as at
from tiengine.model.model import Model

from ..models import V350, Run, paper_model

WALK = 5.0 / 3.6  # m/s


def at_the_coordinates(model: Model, state: SineState, V: float, irregularity: NDArray[np.float64]) -> ContactForces:
    """The contact law at a state's coordinates, rails summed over their modes here."""
    dof, n = model.ingredients.train.wheelset_dof, model.ingredients.modes
    u, v = (state.view(row, "vehicles")[:, dof] for row in (at.U, at.V))
    value, slope = model.window.shape(model.ingredients.wheel_s), model.window.shape_slope(model.ingredients.wheel_s)
    rail = np.zeros((*u.shape[:2], 2, 9))
    for field, (block, start) in enumerate((("vertical", 0), ("lateral", 0), ("lateral", 2 * n))):
        q, rate = (state.view(row, block)[..., start : start + n] for row in (at.U, at.V))
        rail[..., field] = np.einsum("wn,bsn->bws", value, q)
        rail[..., 3 + field] = np.einsum("wn,bsn->bws", slope, q)
        rail[..., 6 + field] = np.einsum("wn,bsn->bws", value, rate)
    return evaluate_contact(model, V, irregularity, u, v, rail)


def disturbed(run: Run, seed: int, shift: float, kick: float) -> NDArray[np.float64]:
    """Shift the wheelsets, give every coordinate of the train a velocity; a track for one step, shape (1, 1, W, 8)."""
    rng = np.random.default_rng(seed)
    train = run.model.ingredients.train
    run.state.view(at.U, "vehicles")[0, train.wheelset_dof[:, 0]] += shift
    run.state.view(at.V, "vehicles")[0] += kick * rng.standard_normal(train.n)
    track: NDArray[np.float64] = kick * 1e-2 * rng.standard_normal((1, 1, 4, at.N_IRREGULARITY))
    return track


@pytest.mark.parametrize("dt", [1e-4, 2e-4])
@pytest.mark.parametrize(
    ("V", "shift", "kick"),
    [
        (V350, 0.0, 1e-2),
        (V350, 4e-3, 1e-2),
        (V350, 9e-3, 1e-2),  # flange root
        (V350, -9e-3, 5e-2),
        (20.0 / 3.6, 0.0, 1e-2),
        (WALK, 0.0, 1e-3),
        (WALK, 0.0, 1e-2),  # creepage beyond slip: f/V is large
        (WALK, 9e-3, 1e-2),
        (WALK, -9e-3, 5e-2),
    ],
)
def test_forces_are_the_law_at_the_end_of_the_step(V: float, shift: float, kick: float, dt: float) -> None:
    """Many passes: what is left is the solve's own tolerance; Newton's iterations bounded."""
    model = paper_model(V=V, dt=dt, passes=6)
    run = Run(model, V, X=3.3, steps=20)
    track = disturbed(run, 1, shift, kick)
    run.advance(20, np.broadcast_to(track, (1, 20, 4, at.N_IRREGULARITY)))
    law = at_the_coordinates(model, run.state, V, track[:, 0])
    largest = np.abs(run.state.force[..., :3]).max()
    assert largest > 3e4
    assert kick > 1e-2 or run.state.iterations.max() < kernels.ITERATIONS
    # tolerance 1e-6 of the wheel load a component; a pass reduces the error by 10-20
    error = np.abs(law.local - run.state.force)[..., :3].max()
    share = 1e-4 if kick > 1e-2 else 1e-5  # thrown against the flange a wheelset is not still after six passes
    assert error < share * largest
    np.testing.assert_allclose(law.rail, run.state.rail_force, atol=share * largest)
    np.testing.assert_allclose(law.wheelset, run.state.wheelset_force, atol=2.0 * share * largest)


@pytest.mark.parametrize(("V", "shift"), [(V350, 0.0), (V350, 8e-3), (20.0 / 3.6, 4e-3), (WALK, 0.0)])
def test_three_passes_are_consistent(V: float, shift: float) -> None:
    """The residual after three passes is small against the wheel load; this found a miscompiled Newton loop."""
    model = paper_model(V=V, dt=1e-4, passes=3)
    run = Run(model, V, X=101.0, steps=50)
    track = disturbed(run, 2, shift, 1e-3)
    run.advance(50, np.broadcast_to(track, (1, 50, 4, at.N_IRREGULARITY)))
    law = at_the_coordinates(model, run.state, V, track[:, 0])
    error = np.abs(law.local - run.state.force)[..., :3].max()
    assert error < 1e-5 * 68.7e3  # N; two passes leave ten times as much
    # the recorded creepages and penetration are those of the same state
    np.testing.assert_allclose(run.state.contact, law.contact, rtol=1e-4, atol=1e-7)


def test_kick_at_walking_pace_dies_out() -> None:
    """3 mm/s on all coordinates at 5 km/h slip the wheels for a moment; friction takes the energy out again."""
    model = paper_model(V=WALK, dt=2e-4)
    run = Run(model, WALK, X=3.3, steps=200)
    disturbed(run, 1, 0.0, 3e-3)
    wheel = run.advance(200)
    Y = wheel[..., at.LATERAL_FORCE]
    assert np.abs(Y).max() < 5e3  # friction would allow 20 kN
    assert np.abs(np.diff(Y[-50:], axis=0)).max() < 50.0  # no chatter from step to step
    creepage = np.abs(wheel[..., at.LATERAL_CREEPAGE])
    assert creepage.max() < 3e-3 * 3 / WALK  # no faster than the kick, three sigma


def test_wheel_lifts_and_lands() -> None:
    """A dip pulled away under one wheelset: its forces are exactly zero in the air, and come back."""
    model = paper_model()
    run = Run(model, V350, steps=150)
    track = np.zeros((1, 150, 4, at.N_IRREGULARITY))
    track[0, 10:60, 1, at.Z_V] = 2e-3  # m: faster than the wheelset can fall
    wheel = run.advance(150, track)
    second = wheel[:, 1]
    air = second[20:40]
    assert not air[..., [at.NORMAL_FORCE, at.VERTICAL_FORCE, at.LATERAL_FORCE]].any()
    assert np.all(air[..., at.PENETRATION] < 0.0)
    assert np.all(second[61:70, :, at.NORMAL_FORCE].max(axis=0) > 68.7e3)
    assert np.isfinite(wheel).all()
    assert run.state.iterations.max() < kernels.ITERATIONS
