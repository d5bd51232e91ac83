"""Newmark on constant blocks: inverses, the order and the constant of its error, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp

from tiengine.engine.chunk import Chunk
from tiengine.engine.sine_state import SineState
from tiengine.engine.sine_stepper import SineStepper
from tiengine.kernels import layout as at
from tiengine.model.implicit_seats import seat_inverse_terms
from tiengine.model.model import Model
from tiengine.model.newmark import Newmark, inverse
from tiengine.parameters.errors import InputError
from tiengine.track.slab_matrices import seat_shapes

from ..models import V350, paper_model


@pytest.fixture(scope="module")
def model() -> Model:
    return paper_model(modes=24)


def test_blocks_are_inverses(model: Model) -> None:
    """Vehicle block against dense algebra; the rails' beyond the bare rail holds springs and dampers only."""
    train, dt = model.ingredients.train, 1e-4
    A = train.M + 0.5 * dt * (train.C + V350 * train.C_speed) + 0.25 * dt**2 * train.K
    np.testing.assert_allclose(model.blocks.vehicle.T, la.inv(A), atol=1e-12 * np.abs(la.inv(A)).max())
    for block, (M, C, K) in (
        (model.blocks.vertical, model.window.vertical(V350)),
        (model.blocks.lateral, model.window.lateral(V350)),
    ):
        bare = (M + 0.5 * dt * C + 0.25 * dt**2 * K).toarray()
        smeared = la.inv(block.T) - bare
        np.testing.assert_allclose(smeared, smeared.T, atol=1e-9 * np.abs(bare).max())
        assert la.eigvalsh(smeared).min() > -1e-9 * np.abs(bare).max()  # springs and dampers only add
        assert la.eigvalsh(smeared).max() > 1e-3 * model.window.modal_masses[0]


def test_slab_block_is_an_inverse(model: Model) -> None:
    """Slab with bed and its own side of the fastenings."""
    g, slab, dt = model.ingredients, model.ingredients.designs.matrices[0], 1e-4
    own_K, own_C = seat_inverse_terms(seat_shapes(slab), np.ones((9, 2)), g.fastening, g.rail.half_base)
    rigid = np.zeros(slab.n)
    rigid[: slab.n - 2 : 3] = 1.0
    assert abs(rigid @ own_K @ rigid / (18 * g.fastening.vertical_stiffness) - 1.0) < 1e-12
    assert abs(own_K[-2, -2] / (18 * g.fastening.lateral_stiffness) - 1.0) < 1e-12
    assert abs(rigid @ own_C @ rigid / (18 * g.fastening.vertical_damping) - 1.0) < 1e-12
    A = slab.M + 0.5 * dt * (slab.C_bed + own_C) + 0.25 * dt**2 * (slab.K_plate + slab.K_bed + own_K)
    expected = la.inv(A)
    np.testing.assert_allclose(model.slab_inverse[0].T, expected, atol=1e-11 * np.abs(expected).max())


def test_inverse() -> None:
    """A sparse operator against dense algebra; singular and nearly singular ones are refused by name."""
    rng = np.random.default_rng(1)
    A = rng.standard_normal((20, 20)) + 20.0 * np.eye(20)
    np.testing.assert_allclose(inverse(sp.csc_array(A), "test"), la.inv(A), atol=1e-14)
    A[3] = 0.0
    with pytest.raises(InputError, match="test block: singular"):
        inverse(sp.csc_array(A), "test")
    A = la.hilbert(12)  # condition 2e16
    with pytest.raises(InputError, match="test block"):
        inverse(sp.csc_array(A), "test")


def rail_period_error(dt: float) -> float:
    """Relative error of the phase of a free torsion mode of the rail by the engine's step, fastenings failed, at rest.

    A one-mass oscillator in the step's own kernels: the mode is decoupled, and its frequency k sqrt(GK/J) is known.
    """
    model = paper_model(modes=24, V=1e-9, dt=dt, passes=16, seat_factors=lambda first, count: np.zeros((count, 2)))
    state = SineState.at_rest(model)
    steps = round(5e-3 / dt)
    chunk = Chunk.empty(model.ingredients, steps, 1)
    stepper = SineStepper(model, state, chunk)
    r = model.ingredients.rail
    mode = 7
    omega = (mode + 1) * np.pi / 36.0 * np.sqrt(r.GK / (r.rho * r.I_polar))
    state.view(at.U, "vehicles")[:, 1 : model.ingredients.train.n_dof : 5] = -1.0  # wheels off the rail
    torsion = state.view(at.U, "lateral")[0, 0, 48:]
    torsion[mode] = 1e-3
    state.view(at.A, "lateral")[0, 0, 48 + mode] = -(omega**2) * 1e-3
    stepper.load(np.zeros(steps), np.full(steps, 1e-9), np.zeros(steps), np.zeros_like(chunk.irregularity))
    for i in range(steps):
        stepper.step(i)
    rate = state.view(at.V, "lateral")[0, 0, 48 + mode]
    phase = np.arctan2(-rate / omega, torsion[mode])
    turns = np.round((omega * steps * dt - phase) / (2.0 * np.pi))
    assert np.abs(np.delete(torsion, mode)).max() < 1e-12 * 1e-3 * 10.0  # 1e-9 m/s convects next to nothing
    assert abs(np.hypot(torsion[mode], rate / omega) / 1e-3 - 1.0) < (omega * dt) ** 2  # no damping
    return float(1.0 - (phase + 2.0 * np.pi * turns) / (omega * steps * dt))


def test_oscillator_keeps_newmarks_period() -> None:
    """Average acceleration lengthens the period by (omega dt)^2/12 and damps nothing: order two with its constant."""
    omega = 8 * np.pi / 36.0 * np.sqrt(1.9587e5 / (7830.0 * 3.741e-5))
    n = Newmark(1e-4)
    assert (n.beta_dt2, n.gamma_dt) == (0.25e-8, 0.5e-4)
    m, k = 2.0, 2.0 * omega**2
    A = n.operator(sp.csc_array([[m]]), sp.csc_array((1, 1)), sp.csc_array([[k]]))
    errors = []
    for dt in (2e-4, 1e-4):
        n = Newmark(dt)
        A = inverse(n.operator(sp.csc_array([[m]]), sp.csc_array((1, 1)), sp.csc_array([[k]])), "one mass")[0, 0]
        u, v, a = 1.0, 0.0, -(omega**2)
        steps = round(0.5 / dt)
        angle = last = 0.0
        for _ in range(steps):
            u_p, v_p = u + dt * v + (0.5 - n.beta) * dt**2 * a, v + (1.0 - n.gamma) * dt * a
            a = -A * k * u_p
            u, v = u_p + n.beta_dt2 * a, v_p + n.gamma_dt * a
            now = np.arctan2(-v / omega, u)
            angle += (now - last) % (2.0 * np.pi)
            last = now
        errors.append(1.0 - angle / (omega * steps * dt))
        assert abs(u**2 + (v / omega) ** 2 - 1.0) < 1e-9  # energy
    # next term (omega dt)^4/80; the end's phase is read on an ellipse rounder than omega dt squared over 0.5 s
    np.testing.assert_allclose(errors, [(omega * dt) ** 2 / 12.0 for dt in (2e-4, 1e-4)], rtol=2e-2)


def test_the_step_keeps_newmarks_period() -> None:
    """The same of the engine's step itself: wheels off the rail, all fastenings failed, one torsion mode.

    The smeared fastenings stand in the implicit block though all seats have failed; each pass takes off part of what
    they add, so sixteen are made (two leave an error of 1 % of the period at 1e-4 s, of second order too).
    """
    omega = 8 * np.pi / 36.0 * np.sqrt(1.9587e5 / (7830.0 * 3.741e-5))
    found = [rail_period_error(dt) for dt in (1e-4, 5e-5)]
    np.testing.assert_allclose(found, [(omega * dt) ** 2 / 12.0 for dt in (1e-4, 5e-5)], rtol=0.02)
