"""Cost of a step over cars, trains together, knots and slab mesh, with fitted exponents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import RUNS, apart, settings_of

__all__ = ["AXES", "Axis", "exponent", "scaling"]

WAY = 600.0  # m, of the scenarios; more than a bench needs
SETTLED = 0.5
"""A power law is fitted over all points, and over the upper half, where constant costs matter less."""


@dataclass(frozen=True)
class Axis:
    """A quantity to vary.

    Attributes:
        words: Description.
        points: Values.
        settings: Changes of the scenario ``default`` at a value.
        unit: Unit of the cost: "step" of all trains, or "train-step".
        x: Quantity at a value to draw over: None for the value itself, else a count of degrees of freedom.
    """

    words: str
    points: tuple[Any, ...]
    settings: Callable[[Any], dict[str, Any]]
    unit: str = "step"
    x: str | None = None


def _knots(refinement: float) -> dict[str, Any]:
    knots = {"finest": 0.15 / refinement, "coarsest": 1.0 / refinement}
    return {"numerics.knots": knots}


def _mesh(elements: tuple[int, int]) -> dict[str, Any]:
    return {"track.slab": {"like": "CRTS_III", "elements_x": elements[0], "elements_y": elements[1]}}


AXES = {
    "cars": Axis("cars of one train", (1, 2, 4, 8, 16), lambda cars: {"train.vehicles": ["CRH380A_v2"] * cars}),
    "trains": Axis("trains of one car together, one process", (1, 2, 4, 8, 16, 32, 64), lambda _: {}, "train-step"),
    "knots": Axis("functions per metre and field", (0.5, 0.75, 1.0, 1.5, 2.0), _knots, x="functions"),
    "mesh": Axis("coordinates of a slab", ((5, 2), (9, 2), (18, 2), (18, 4)), _mesh, x="slab_dofs"),
}


def scaling(effort: Effort, notify: Callable[[str], object]) -> Findings:
    """Measure every axis."""
    data = {}
    for name in AXES:
        notify(f"scaling, {AXES[name].words}")
        (data[name],) = apart(measure_axis, (name, effort.bench_points, effort.bench_rounds, effort.bench_steps))
    values = {f"{name}_exponent": found["exponent"] for name, found in data.items()}
    values |= {f"{name}_exponent_upper": found["exponent_upper"] for name, found in data.items()}
    return Findings({**values}, data)


def measure_axis(name: str, count: int | None, rounds: int, steps: int) -> dict[str, Any]:
    """Time of a step at the first ``count`` values of an axis [us]."""
    from threadpoolctl import threadpool_limits  # imported here, since the parent starts no Taichi

    from tiengine.engine import backend
    from tiengine.scenario.scenario import load_scenario
    from validation.speed.bench import Bench, timed_in_turn

    backend.start()
    axis = AXES[name]
    points = axis.points[:count]
    with threadpool_limits(1):
        benches = []
        for point in points:
            scenario = load_scenario("default", settings_of(RUNS["default"], WAY) | axis.settings(point))
            benches.append(Bench.of(scenario, point if name == "trains" else 1, steps))
        us = timed_in_turn(benches, rounds, steps)
    x = [float(_place(axis, point, bench)) for point, bench in zip(points, benches, strict=True)]
    if axis.unit == "train-step":
        us = [each / trains for each, trains in zip(us, x, strict=True)]
    return {
        "words": axis.words,
        "unit": axis.unit,
        "x": x,
        "us": us,
        "exponent": exponent(x, us),
        "exponent_upper": exponent(*_upper(x, us)),
    }


def _place(axis: Axis, point: Any, bench: Any) -> float:
    """Quantity to draw over."""
    given = bench.run.stepper.ingredients
    if axis.x == "functions":
        return float(given.functions.count / given.length)
    return float(given.designs.matrices[0].n) if axis.x == "slab_dofs" else float(point)


def exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Exponent p of y = c x^p by least squares of logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def _upper(x: Sequence[float], y: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
    first = int(SETTLED * (len(x) - 1))
    return x[first:], y[first:]
