"""Cost of single features: one car with each of them in turn, against the same car without."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median

from validation.speed.findings import Findings
from validation.speed.runs import RUNS, Facts
from validation.speed.throughput import factors

__all__ = ["FEATURES", "PLAIN", "features"]

PREFIX = "with_"
PLAIN = f"{PREFIX}nothing"
FEATURES = tuple(name for name in RUNS if name.startswith(PREFIX))
"""Runs of the case, the plain one first."""


def features(rounds: Mapping[str, Sequence[Facts]]) -> Findings:
    """Cost of a step with each feature, and what the feature adds to the plain step [us].

    What is added is the median over the rounds of differences within a round, so that a machine whose pace drifts does
    not count.
    """
    costs = {name: [_step_us(facts) for facts in rounds[name]] for name in FEATURES}
    rows = [
        {
            "words": RUNS[name].words,
            "time_step": float(rounds[name][0]["time_step"]),
            "us": median(costs[name]),
            "added": median(own - plain for own, plain in zip(costs[name], costs[PLAIN], strict=True)),
            "spread": max(costs[name]) - min(costs[name]),
        }
        for name in FEATURES
    ]
    values = {f"us_{name.removeprefix(PREFIX)}": float(median(costs[name])) for name in FEATURES}
    return Findings({**values}, {"rounds": factors(rounds, FEATURES), "features": rows})


def _step_us(facts: Facts) -> float:
    """Wall time of a step of the loop, writing included [us]."""
    return 1e6 * float(facts["real_time_factor"]) * float(facts["time_step"])
