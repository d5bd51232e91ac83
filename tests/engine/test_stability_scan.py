"""Scan over settings: what the trial accepts does not grow in a march, whatever it refuses.

Two trains roll over the same smooth track. The track of one is disturbed, and an irregularity of 20 um lies under its
wheels in the first steps. What counts is the largest acceleration by which rails and slabs differ, anywhere: neither
the trial's measure nor its disturbance.

Cases are a covering design: any three settings of the splines, any two of the sines, take every combination of their
values.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import ACCELERATION, VELOCITY
from tiengine.engine.stepper import Plan
from tiengine.engine.time_step import prepare
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError
from tiengine.parameters.presets import preset_names
from tiengine.scenario.scenario import load_scenario

from .covering import covering

PRESETS: dict[str, float | None] = {
    "default": None,
    "smooth": None,
    "paper": None,
    "train3": None,
    "train8": None,
    "train16": None,
    "braking": None,
    "defects": 100.0,
    "curve": 1000.0,
    "small_curve": 160.0,
    "corrugation": None,
    "polygon": None,
    "flat": None,
    "gust": None,
    "settlement": 100.0,
    "gap": 100.0,
    "warp": None,
    "unequal_wheels": None,
    "earthquake": None,
}
"""Chainages where the march begins [m]: defects and settled ground lie ahead, trains stand in the arcs of curves."""
SPLINES = covering(
    {
        "train.speed_kmh": (50.0, 200.0, 350.0, 500.0),
        "track.failed_fastenings": (
            None,
            "{seats = [60, 60], factor = 3.0}",
            "{seats = [60, 61], factor = 10.0}",
            "{seats = [50, 150], factor = 2.0}",
            "{seats = [60, 62]}",
        ),
        "track.friction": (0.3, 0.02),
        "numerics.passes": (1, 2, 3),
        "numerics.knots": (None, "{finest = 0.06, coarsest = 0.4}", "{finest = 0.3, growth = 0.4, coarsest = 2.0}"),
        "numerics.window": ("'auto'", "44.0"),
        "numerics.time_step": ("'auto'", "2e-4", "5e-5"),
    },
    strength=3,
)
SINES = covering(
    {
        "train.speed_kmh": (350.0, 400.0),
        "numerics.modes_per_metre": (6.5, 8.0, 10.0, 13.0),
        "numerics.window": ("28.0", "36.0"),
        "track.fastening": tuple(f"{{like = 'ACE2021', length = {length}}}" for length in (0.0, 0.15)),
        "numerics.time_step": ("'auto'", "1e-4"),
        "track.friction": (0.3, 0.02),
    },
    strength=2,
)

DISTANCE = 100.0  # m, for which the trial accepts
PART = 1500
"""Steps between measurements."""
GROWTH = 2.0
"""Tolerated from the second part to the third; the decay of what is damped has hidden less growth before."""
FLOOR = 10.0
"""m/s^2 that are added to both: contact forces are solved to 0.1 N, slopes of the rails have 0.05 kg m^2 a function."""
LOOKED = 24  # steps at a part's end of which the largest counts
STARTING = 40
SIZE = 2e-5  # m
VELOCITY_SIZE = 1e-4  # m/s
TRACK = ("vertical", "lateral", "slabs")


def words(changes: dict[str, object]) -> list[str]:
    """Overrides of a scenario."""
    given = {"train.distance": DISTANCE, **changes}
    return [f"{key}=[{value}]" if "failed" in key else f"{key}={value}" for key, value in given.items() if value]


def growth(name: str, overrides: list[str]) -> float | None:
    """Later over earlier difference of the trains' accelerations; None if the step is refused."""
    scenario = load_scenario(name, ["irregularity.spectrum='none'", *overrides])
    try:
        model, _ = prepare(scenario, trains=2)
    except InputError as refused:
        assert "unstable" in str(refused)  # noqa: PT017 - only then is there nothing to march
        return None
    V, g = scenario.train.speed.fastest, model.ingredients
    state, chunk = state_at_rest(model), Chunk.empty(g, PART, 1)
    equilibrium(model, state, scenario.rear, V)
    random = np.random.default_rng(0)
    for part in TRACK:
        velocity = np.stack([state.part(train, part)[VELOCITY] for train in range(2)])
        velocity[1] += VELOCITY_SIZE * random.standard_normal(velocity[1].shape)
        state.put(VELOCITY, part, velocity)
    noise = np.zeros_like(chunk.irregularity)
    for channel in (at.Z_V, at.Y_A):
        noise[1, :STARTING, :, channel] = SIZE * random.standard_normal((STARTING, noise.shape[2]))
    stepper, found = make_stepper(model, state, chunk), []
    for part in range(3):
        time = g.newmark.dt * (part * PART + np.arange(1.0, PART + 1.0))
        X, speed, zero = scenario.rear + V * time, np.full(PART, V), np.zeros(PART)
        given = g.given_loads(time, X + g.centre_s, speed, zero)
        stepper.load(X, speed, zero, noise if part == 0 else np.zeros_like(noise), given)
        steps, none = np.arange(PART), np.full(PART, -1)
        stepper.take(Plan(steps, none, none).part(0, PART - LOOKED))
        found.append(FLOOR)
        for i in range(PART - LOOKED, PART):
            stepper.take(Plan(steps, none, none).part(i, i + 1))
            apart = [state.part(1, part)[ACCELERATION] - state.part(0, part)[ACCELERATION] for part in TRACK]
            assert all(np.isfinite(each).all() for each in apart)
            found[-1] = max(found[-1], FLOOR + max(float(np.abs(each).max()) for each in apart))
    return found[2] / found[1]


def assert_steady(name: str, changes: dict[str, object]) -> None:
    """Nothing accepted grows."""
    found = growth(name, words(changes))
    assert found is None or found < GROWTH


def test_every_preset_is_scanned():
    assert set(PRESETS) == set(preset_names("scenarios"))


def test_every_combination_is_covered():
    """Of any two of three factors, in fewer cases than the product."""
    factors = {"a": (1, 2, 3), "b": "xyz", "c": (True, False)}
    cases = covering(factors, 2)
    for first, second in combinations(factors, 2):
        for values in product(factors[first], factors[second]):
            assert any((case[first], case[second]) == values for case in cases)
    assert len(cases) < 18


@pytest.mark.slow
@pytest.mark.parametrize("name", PRESETS)
def test_presets(name):
    found = growth(name, [] if PRESETS[name] is None else [f"train.start={PRESETS[name]}"])
    assert found is not None
    assert found < GROWTH


@pytest.mark.slow
@pytest.mark.parametrize("changes", SPLINES, ids=str)
def test_splines(changes):
    assert_steady("default", changes)


@pytest.mark.slow
@pytest.mark.parametrize("changes", SINES, ids=str)
def test_sines(changes):
    assert_steady("default", changes)
