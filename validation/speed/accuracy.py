"""Density of sines that the full-length model needs for the accuracy of the default numerics.

Both run the same track at the same time step, with the same slab mesh, all of whose modes the full-length model keeps.
The reference is the engine with half the step, knots twice as close and a window longer by 4 m at either end. Errors
are differences of the normal forces of all wheels after the run-in, over the largest force.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from validation.frame.runs import Forces, full_length, simulate
from validation.msm.simulate import FullLength
from validation.speed.runs import step_of

__all__ = ["Error", "accuracy", "difference", "enough"]

START, RUN_IN = 30.0, 40.0  # m
SPARE = 20.0  # m of rail of the full-length model beyond the distance, the train's length and its ends
TRAIN = 40.0  # m, more than the outer wheels of a car are apart with the ends' margins
SAMPLES = "output.wheel_interval=0.0002"
WINDOW, KNOTS = 44.0, "numerics.knots={finest=0.075, coarsest=0.5}"


@dataclass(frozen=True)
class Error:
    """Difference of the normal forces over the largest force [%].

    Attributes:
        largest: Largest.
        p99: Exceeded in 1 % of all samples.
    """

    largest: float
    p99: float


def accuracy(densities: list[float], distance: float) -> dict[str, Any]:
    """Errors of ``default`` and of the full-length model at rising densities.

    Args:
        densities: Sines per metre and field, ascending.
        distance: Distance of each run [m], longer than the run-in.
    """
    way = (f"train.start={START}", f"train.distance={distance}", SAMPLES)
    fine = simulate("default", *way, "numerics.time_step=1e-4", f"numerics.window={WINDOW}", KNOTS)
    scenario, rail = load_scenario("default", way), distance + TRAIN + SPARE
    modes, step = scenario.parts.slab.plate_dofs, step_of(scenario)
    runs = {density: full_length("default", FullLength(rail, density, modes, step), *way) for density in densities}
    default = difference(simulate("default", *way), fine)
    full = {density: difference(run, fine) for density, run in runs.items()}
    return {
        "default": vars(default),
        "densities": densities,
        "full_length": [vars(error) for error in full.values()],
        "enough": enough(default, full),
        "distance": distance - RUN_IN,
    }


def enough(default: Error, full: dict[float, Error]) -> float | None:
    """Least density whose error is exceeded in 1 % of the time no more than that of the default; None if none is."""
    return next((density for density, error in sorted(full.items()) if error.p99 <= default.p99), None)


def difference(run: Forces, reference: Forces) -> Error:
    """Difference of two runs where both have samples, after the run-in."""
    own, other = (np.rint(forces.time / 1e-6).astype(np.int64) for forces in (run, reference))
    _, i, j = np.intersect1d(own, other, return_indices=True)
    later = reference.position[j] > reference.position[0] + RUN_IN
    truth: Reals = reference.normal[j[later]]
    error = np.abs(run.normal[i[later]] - truth) / np.abs(truth).max()
    return Error(largest=float(100.0 * error.max()), p99=float(100.0 * np.percentile(error, 99.0)))
