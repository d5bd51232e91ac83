"""Start from steady rolling, at high friction and low."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import state_at_rest
from tiengine.engine.state import DISPLACEMENT
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError

from ..models import V350, Run, default_model

KMH = 1.0 / 3.6


@pytest.mark.parametrize("kmh", [100.0, 350.0])
@pytest.mark.parametrize("friction", [0.3, 0.03, 0.02, 0.01])
def test_steady_rolling_is_found_down_to_low_friction(kmh, friction):
    """The train stands on its springs, upright, and creep forces keep to friction."""
    model = default_model(f"track.friction={friction}", V=kmh * KMH)
    state = state_at_rest(model)
    equilibrium(model, state, 0.0, kmh * KMH)
    local, wheels = state.wheels.force[0], state.normal_force[0]
    weight = model.ingredients.train.gravity[1 : model.ingredients.train.n_dof : 5].sum()
    assert state.forces_on_rails[0, ..., 0].sum() == pytest.approx(weight, rel=1e-8)  # forces balance to 1e-4 N
    assert np.all(np.hypot(local[..., 1], local[..., 2]) <= friction * wheels)
    across = state.body_motion(DISPLACEMENT)[0, ::5]
    assert np.abs(across).max() < 1e-6  # a symmetric train on a symmetric track: rounding over guiding stiffness


def test_slippery_rolling_stays_steady():
    """0.1 s from the start at a friction of 0.02: wheel loads ripple over the seats, nothing else moves."""
    V = 350.0 * KMH
    run = Run(default_model("track.friction=0.02", V=V), V, steps=500)
    wheel = run.advance(500)
    load = run.model.constants[at.STATIC_LOAD]
    np.testing.assert_allclose(wheel[..., at.VERTICAL_FORCE], load, rtol=0.05)
    assert np.abs(wheel[..., at.LATERAL_FORCE]).max() < 0.02 * 1.1 * load + 0.05 * load


def test_what_cannot_roll_is_told():
    """A train that gains 1e9 m/s in a second."""
    model = default_model()
    with pytest.raises(InputError, match=r"start = 'equilibrium': no steady rolling found at 350 km/h"):
        equilibrium(model, state_at_rest(model), 0.0, 350.0 * KMH, V_rate=1e9)


def test_a_wheelset_on_stiffened_seats_finds_its_start():
    """The leading wheelset stands where stiffened fastenings begin: it sinks less and carries its load."""
    settings = ("track.failed_fastenings=[{seats = [50, 150], factor = 2.0}]", "numerics.window=44.0")
    model = default_model(*settings)
    state = state_at_rest(model)
    equilibrium(model, state, 0.0, V350)
    np.testing.assert_allclose(state.normal_force.sum(axis=2), 2.0 * model.constants[at.STATIC_LOAD], rtol=0.05)
