"""A thousand random alignments: each is refused in one line, or gives finite loads."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from tiengine.model.curve_loads import CurveLoads
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import to_tuples
from tiengine.parameters.quantity import build
from tiengine.scenario.tables import Track
from tiengine.vehicle.train import TrainModel, assemble
from tiengine.vehicle.vehicle import load_vehicle

COUNT = 1000
ODD = (0.0, -1.0, 1e-300, 1e300, -0.0, float("inf"), float("nan"), 1e7, "x", True, None, ())


@cache
def train() -> TrainModel:
    return assemble([load_vehicle("CRH2")] * 2)


def elements(random: np.random.Generator) -> list[dict[str, Any]]:
    """Mostly sensible elements, some of them damaged."""
    made = []
    arc = {"kind": "arc", "radius": 1000.0}
    for _ in range(random.integers(1, 8)):
        kind = random.choice(["straight", "transition", "arc"])
        element: dict[str, Any] = {"kind": str(kind), "length": float(random.uniform(1.0, 300.0))}
        if kind == "arc":
            arc = {"kind": "arc", "radius": float(random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(2.2, 4.5))}
            arc["cant_mm"] = float(np.sign(arc["radius"]) * random.uniform(0.0, 160.0))
            element |= arc
        if random.random() < 0.2:
            element["gradient_permille"] = float(random.normal(0.0, 15.0))
        made.append(element)
        if kind == "straight" and random.random() < 0.7:
            made.append({"kind": "transition", "length": float(random.uniform(40.0, 200.0))})
    if random.random() < 0.3:
        spoilt = made[random.integers(len(made))]
        key = str(random.choice(["length", "radius", "cant_mm", "gradient_permille", "kind", "curve"]))
        spoilt[key] = ODD[random.integers(len(ODD))]
    return made


def rows(random: np.random.Generator) -> list[list[Any]]:
    """Rows of a random line, some of them damaged."""
    count = random.integers(1, 30)
    x = np.cumsum(random.uniform(0.8, 60.0, count))
    curvature = np.cumsum(random.normal(0.0, 1e-4, count))
    cant, grade = np.cumsum(random.normal(0.0, 10.0, count)), np.cumsum(random.normal(0.0, 1.0, count))
    made = np.stack([x, curvature, cant, grade], axis=1).tolist()
    if random.random() < 0.3:
        made[random.integers(count)][random.integers(4)] = ODD[random.integers(len(ODD))]
    return made


def test_random_alignments_are_refused_in_one_line_or_give_loads():
    kept, refused = 0, []
    for seed in range(COUNT):
        random = np.random.default_rng((17, seed))
        track = {"alignment": elements(random)} if seed % 2 else {"alignment_rows": rows(random)}
        try:
            line = build(Track, to_tuples(track, "track"), "track").line
        except InputError as error:
            refused.append(str(error))
            continue
        kept += 1
        assert line is not None
        x, V = np.linspace(0.0, 400.0, 200), np.full(200, 70.0 / 3.6)
        loads = CurveLoads(line, train())(x, x, V, 0.1 * np.ones(200))
        for values in (loads.force, loads.elongation, loads.frame_rate):
            assert np.isfinite(values).all(), seed
        assert np.abs(loads.frame_rate).max() < 0.1  # rad/s: 20 m/s on 250 m, or over a twist of 2.5 mm/m
    assert all(text.startswith("track.alignment") and "\n" not in text for text in refused)
    assert COUNT / 10 < kept < COUNT  # both happen
