"""The step against scipy's BDF on the same equations, assembled apart from it (validation/semi_discrete.py).

A window of the wheels and 2 m at either end, one mode a metre, three plate elements a slab: 431 degrees of freedom. The
German spectrum for high disturbance begins within 2 m, so that all wheels move vertically and laterally.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from threadpoolctl import threadpool_limits

from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.sine_state import SineState
from tiengine.irregularity.irregularity import make_irregularity
from validation.cases.bdf import RTOL, SHORT, SIZES, STEPS
from validation.cases.semi_discrete import SemiDiscrete

from ..reference.stepping import KMH, model_of, run_steps, scenario

SPEED = 350.0 * KMH


@pytest.fixture(scope="module")
def system() -> tuple[SemiDiscrete, np.ndarray]:
    """The equations, and the engine's start in their coordinates."""
    model = model_of("paper", *SHORT, dt=1e-4)
    state = SineState.at_rest(model)
    equilibrium(model, state, 0.0, SPEED)
    track = make_irregularity(scenario("paper", *SHORT).irregularity, float(model.ingredients.wheel_s.max()))
    equations = SemiDiscrete(model, track, SPEED, range(model.ingredients.slots))
    return equations, equations.pack(state)


def test_start_is_steady(system):
    """Every acceleration at the start vanishes: to 1e-9 m/s^2, the start's tolerance of 1e-4 N on 1000 kg and more."""
    equations, y = system
    rates = equations.rhs(0.0, y)
    assert np.abs(rates[equations.n :]).max() < 1e-7
    assert np.flatnonzero(rates[: equations.n]).size == 4  # only the wheelsets turn, faster or slower than V/r0


def test_jacobian_of_the_equations(system):
    """Against a difference in a random direction; rounding of the difference, 1e-9 of the motion."""
    equations, y = system
    z = 1e-9 * np.random.default_rng(0).standard_normal(len(y))
    difference = 0.5 * (equations.rhs(1e-3, y + z) - equations.rhs(1e-3, y - z))
    np.testing.assert_allclose(equations.jacobian(1e-3, y) @ z, difference, atol=1e-6 * np.abs(difference).max())


def test_wheel_forces_against_bdf(system):
    """Largest difference over the range of the forces, of second order; ``python -m validation`` does 0.05 s."""
    duration = 0.006
    equations, y = system
    n = equations.n
    times = np.arange(1, round(duration / 2e-4) + 1) * 2e-4
    with threadpool_limits(1):
        found = solve_ivp(
            equations.rhs, (0.0, times[-1]), y, method="BDF", jac=equations.jacobian, rtol=RTOL,
            atol=RTOL * np.repeat(SIZES, n), t_eval=times,
        )  # fmt: skip
    assert found.success, found.message
    reference = np.array([equations.contact(t, y).rail[0, :, :, :2] for t, y in zip(times, found.y.T, strict=True)])
    errors = []
    for dt in STEPS:
        run = run_steps("paper", *SHORT, dt=dt, duration=duration)
        forces = np.stack([run.vertical, run.lateral], axis=-1)[round(2e-4 / dt) - 1 :: round(2e-4 / dt)]
        errors.append(np.abs(forces - reference).max(axis=(0, 1, 2)) / np.ptp(reference, axis=(0, 1, 2)))
    assert np.all(errors[-1] < 1e-4)
    order = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(order > 1.7)
