"""Numerics that the full-length model needs for the accuracy of the default ones.

Both run the same track on the same slab mesh, all of whose modes the full-length model keeps. The reference is the
engine with rails and time refined: knots twice as close, a quarter of the step, three passes, a window longer by 4 m
at either end. Errors are differences of the normal forces of all wheels after the run-in, over the largest force.

More sines alone do not make the full-length model accurate: with them grows the operator that stands in for the
fastenings, and with it the error of two passes, which a shorter step takes away.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from validation.frame.runs import Forces, full_length, simulate
from validation.msm.simulate import FullLength

__all__ = ["Error", "accuracy", "difference", "enough"]

START, RUN_IN = 30.0, 40.0  # m
SPARE = 20.0  # m of rail of the full-length model beyond the distance, the train's length and its ends
TRAIN = 40.0  # m, more than the outer wheels of a car are apart with the ends' margins
SAMPLES = "output.wheel_interval=0.0002"
REFINED = (
    "numerics.time_step=5e-5",
    "numerics.passes=3",
    "numerics.window=44",
    "numerics.knots={finest=0.075, coarsest=0.5}",
)

Numerics = tuple[float, float]
"""Sines per metre and field, and time step [s], of the full-length model."""


@dataclass(frozen=True)
class Error:
    """Difference of the normal forces over the largest force [%].

    Attributes:
        largest: Largest.
        p99: Exceeded in 1 % of all samples.
    """

    largest: float
    p99: float


def accuracy(numerics: list[Numerics], distance: float) -> dict[str, Any]:
    """Errors of ``default`` and of the full-length model.

    Args:
        numerics: Of the full-length model.
        distance: Distance of each run [m], longer than the run-in.
    """
    way = (f"train.start={START}", f"train.distance={distance}", SAMPLES)
    fine = simulate("default", *way, *REFINED)
    modes, rail = load_scenario("default", way).parts.slab.plate_dofs, distance + TRAIN + SPARE
    full = {}
    for density, step in numerics:
        run = full_length("default", FullLength(rail, density, modes, step), *way, f"numerics.time_step={step}")
        full[density, step] = difference(run, fine)
    default = difference(simulate("default", *way), fine)
    return {
        "default": vars(default),
        "numerics": [list(each) for each in numerics],
        "full_length": [vars(error) for error in full.values()],
        "enough": enough(default, full),
        "distance": distance - RUN_IN,
    }


def enough(default: Error, full: dict[Numerics, Error]) -> Numerics | None:
    """Cheapest numerics whose 99th percentile of the error is not above the default's; None if none are."""
    good = [numerics for numerics, error in full.items() if error.p99 <= default.p99]
    return min(good, key=lambda numerics: numerics[0] / numerics[1], default=None)


def difference(run: Forces, reference: Forces) -> Error:
    """Difference of two runs where both have samples, after the run-in."""
    own, other = (np.rint(forces.time / 1e-6).astype(np.int64) for forces in (run, reference))
    _, i, j = np.intersect1d(own, other, return_indices=True)
    later = reference.position[j] > reference.position[0] + RUN_IN
    truth: Reals = reference.normal[j[later]]
    error = np.abs(run.normal[i[later]] - truth) / np.abs(truth).max()
    return Error(largest=float(100.0 * error.max()), p99=float(100.0 * np.percentile(error, 99.0)))
