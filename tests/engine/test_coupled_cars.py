"""Couplings in the step: explicit forces against cars that are one implicit block, and where they are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tiengine.engine.state import ACCELERATION, DISPLACEMENT
from tiengine.engine.time_step import prepare
from tiengine.irregularity.irregularity import make_irregularity
from tiengine.model.coupled_cars import coupling_returned
from tiengine.model.from_scenario import ingredients
from tiengine.model.spline_model import build_spline_model
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario

from ..models import V350, Run

LINK = {
    "a": "car", "b": "car", "point_a": [0.0, 0.0, 1.0], "point_b": [0.0, 0.0, 1.0],
    "ky": 2e6, "kz": 2e6, "cy": 5e4, "cz": 5e4,
}  # fmt: skip
TRAIN = {"train.vehicles": ["CRH380A_v2", "CRH380A_v2"], "train.distance": 30.0}
STEPS = 500


def run(**changes):
    """Two cars over a rough track for 0.1 s; accelerations and displacements of the car bodies, the last state."""
    scenario = load_scenario("default", TRAIN | {"train.couplings": [{"part": {"spring": [LINK]}}]})
    g = ingredients(scenario, 2e-4)
    g = replace(g, train=changes.get("train", lambda train: train)(g.train))
    made = Run(build_spline_model(g, V350), V350, steps=STEPS)
    x = V350 * 2e-4 * np.arange(1, STEPS + 1)[:, None] + g.wheel_s
    track = make_irregularity(scenario.irregularity, 0.0).sample(x)[None]
    made.advance(STEPS, track)
    cars = [g.train.dof(f"v{i} car", "y") + m for i in (1, 2) for m in range(5)]
    return made.state.body_motion(ACCELERATION)[0, cars], made.state.body_motion(DISPLACEMENT)[0, cars]


def implicit(train):
    """The same couplings in K and C: both cars are then one block of the step."""
    K, C = train.K.copy(), train.C.copy()
    for e in np.flatnonzero(train.element_between_cars):
        row = np.zeros(train.n)
        np.add.at(row, train.element_index[e], train.element_row[e])
        slope = train.element_table[e, 1, 1] / train.element_table[e, 1, 0]
        (C if train.element_kind[e] == 0 else K)[:] += slope * np.outer(row, row)
    kept = ~train.element_between_cars
    names = ("element_index", "element_row", "element_kind", "element_linear", "element_table", "element_between_cars")
    return replace(train, K=K, C=C, **{name: getattr(train, name)[kept] for name in names})


def uncoupled(train):
    """No couplings."""
    return replace(implicit(train), K=train.K, C=train.C)


def test_explicit_couplings_are_as_good_as_implicit_ones():
    """Couplings ten times as stiff as a gangway: a thousandth of what they change, over 500 steps."""
    explicit, block, free = run(), run(train=implicit), run(train=uncoupled)
    for found, wanted, without in zip(explicit, block, free, strict=True):
        changed = np.abs(wanted - without).max()
        assert changed > 1e-5
        assert np.abs(found - wanted).max() < 1e-3 * changed


def test_what_comes_back_in_a_pass():
    """A damper between the cars' centres: gamma dt c (1/m + 1/m) but for the suspension, which holds the cars."""
    spring = LINK | {
        "ky": 0.0,
        "kz": 0.0,
        "cy": 0.0,
        "cz": 1e6,
        "point_a": [12.5, 0.0, 1.0],
        "point_b": [-12.5, 0.0, 1.0],
    }
    scenario = load_scenario("default", TRAIN | {"train.couplings": [{"part": {"spring": [spring]}}]})
    g = ingredients(scenario, 2e-4)
    m = g.train.M[g.train.dof("v1 car", "z"), g.train.dof("v1 car", "z")]
    assert coupling_returned(g) == pytest.approx(g.newmark.gamma_dt * 2e6 / m, rel=0.01)


def test_couplings_that_are_too_stiff_are_refused():
    """Between wheelsets of 1500 kg a damper of 1e8 N s/m would multiply changes from pass to pass."""
    wild = LINK | {"a": "wheelset 4", "b": "wheelset 1", "cz": 1e8}
    scenario = load_scenario("default", TRAIN | {"train.couplings": [{"part": {"spring": [wild]}}]})
    with pytest.raises(InputError, match=r"numerics\.time_step = auto: unstable; train\.couplings .* in a pass"):
        prepare(scenario)
