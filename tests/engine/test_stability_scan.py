"""Scan over settings: what the trial accepts does not grow in a march, whatever it refuses.

One train rolls over a smooth track; an irregularity of 20 um in the first steps starts every oscillation there is.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.time_step import prepare
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario

PRESETS = ("default", "smooth", "paper", "train3", "train8", "braking", "defects")
SPEEDS = (50.0, 200.0, 350.0, 500.0)  # km/h
SEATS = (None, "{seats = [60, 60], factor = 3.0}", "{seats = [50, 150], factor = 2.0}", "{seats = [60, 62]}")
FRICTION = (0.3, 0.02)
PASSES = (1, 2, 3)
KNOTS = ("{}", "{finest = 0.06, coarsest = 0.4}")  # the default, and finer ones
DENSITIES = (6.5, 8.0, 10.0, 13.0)  # sines a metre
WINDOWS = ("'auto'", "36.0")
LENGTHS = (0.0, 0.15)  # m, of a seat
STEPS = ("'auto'", "1e-4")

SPLINES = [
    {
        "train.speed_kmh": speed,
        "track.failed_fastenings": seats,
        "track.friction": friction,
        "numerics.passes": passes,
        "numerics.knots": knots,
    }
    for speed, seats, friction, passes, knots in product(SPEEDS, SEATS, FRICTION, PASSES, KNOTS)
]
SINES = [
    {
        "numerics.trial_functions": "'sines'",
        "train.speed_kmh": speed,
        "numerics.modes_per_metre": density,
        "numerics.window": window,
        "track.fastening": f"{{like = 'ACE2021', length = {length}}}",
        "numerics.time_step": step,
    }
    for speed, density, window, length, step in product((350.0, 400.0), DENSITIES, WINDOWS, LENGTHS, STEPS)
]

MARCHED = 6000
"""Steps: what grows by less than a thousandth a step does so by 400 at most."""
STARTING = 40
SIZE = 2e-5  # m


def alternating(force):
    """Amplitude of what alternates from step to step within eight steps, largest of all wheels, shape (windows,).

    By seventh differences: a sine of six steps a period counts with a hundredth.
    """
    windows = force[: len(force) // 8 * 8].reshape(-1, 8, force[0].size)
    return np.abs(np.diff(windows, n=7, axis=1)[:, 0]).max(axis=1) / 128.0


def growth(name: str, changes: dict[str, object]) -> float | None:
    """Later over earlier amplitude of an oscillation, 10 N added to both; None if the step is refused."""
    overrides = [f"{key}=[{value}]" if "failed" in key else f"{key}={value}" for key, value in changes.items() if value]
    scenario = load_scenario(name, ["train.distance=150.0", "irregularity.spectrum='none'", *overrides])
    try:
        model, _ = prepare(scenario)
    except InputError as refused:
        assert "unstable" in str(refused)  # noqa: PT017 - only then is there nothing to march
        return None
    V, g = scenario.train.speed.fastest, model.ingredients
    state, chunk = state_at_rest(model), Chunk.empty(g, MARCHED, 1)
    equilibrium(model, state, 0.0, V)
    stepper = make_stepper(model, state, chunk)
    noise = np.zeros_like(chunk.irregularity)
    random = np.random.default_rng(0).standard_normal((STARTING, noise.shape[2]))
    noise[0, :STARTING, :, at.Z_V] = SIZE * random
    noise[0, :STARTING, :, at.Y_A] = SIZE * random[:, ::-1]
    stepper.load(g.newmark.dt * V * np.arange(1.0, MARCHED + 1.0), np.full(MARCHED, V), np.zeros(MARCHED), noise)
    for i in range(MARCHED):
        stepper.step(i, i)
    forces = chunk.wheel[0, :MARCHED][..., [at.VERTICAL_FORCE, at.LATERAL_FORCE]]
    assert np.isfinite(forces).all()
    found = alternating(forces.reshape(MARCHED, -1))
    third = len(found) // 3
    earlier, later = (10.0 + np.median(part) for part in (found[third : 2 * third], found[2 * third :]))
    return float(later / earlier)  # the blow at a defect or a joint is no growth: medians


def assert_steady(name: str, changes: dict[str, object]) -> None:
    """Nothing accepted grows twofold within 2000 steps, beyond 10 N."""
    found = growth(name, changes)
    assert found is None or found < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("name", PRESETS)
def test_presets(name):
    found = growth(name, {})
    assert found is not None
    assert found < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("changes", SPLINES, ids=str)
def test_splines(changes):
    assert_steady("default", changes)


@pytest.mark.slow
@pytest.mark.parametrize("changes", SINES, ids=str)
def test_sines(changes):
    assert_steady("default", changes)
