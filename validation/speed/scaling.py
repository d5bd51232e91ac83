"""Cost of a step over modes, window, slabs, outputs and trains, with fitted exponents."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import RUNS, apart, settings_of

__all__ = ["AXES", "Axis", "exponent", "scaling"]

PITCH = 5.67  # m, of the slabs
MODES = 60
PER_METRE = 60 / 36.0
WAY = 600.0  # m, of the scenarios; a bench ignores it
SETTLED = 0.5
"""A power law is fitted over all points, and over the upper half, where constant costs matter less."""


@dataclass(frozen=True)
class Axis:
    """A quantity to vary.

    Attributes:
        words: Description.
        x: Values.
        change: Changed fields of the engine's ingredients at a value.
        unit: Unit of the cost: "step" of all trains, or "train-step".
    """

    words: str
    x: tuple[float, ...]
    change: Callable[[float], dict[str, Any]]
    unit: str = "step"


AXES = {
    "modes": Axis("modes N of a rail field, window 36 m", (30, 60, 120, 240), lambda n: {"modes": int(n)}),
    "window": Axis(
        "window [m], 1.67 modes per metre",
        (28, 40, 60, 84, 120),
        lambda length: {"length": float(length), "modes": round(PER_METRE * length)},
    ),
    "slabs": Axis(
        "slabs (60 modes, window as long)",
        (6, 8, 12, 16, 24),
        lambda slabs: {"length": (slabs - 1.5) * PITCH, "modes": MODES},  # a window touches one more than it is long
    ),
    "trains": Axis(
        "trains together, one process", (1, 2, 4, 8, 16, 32, 64), lambda trains: {"trains": int(trains)}, "train-step"
    ),
}
INTERVALS = (1, 2, 5, 10, 50)  # steps between two samples of everything
CHANNELS = (1, 3, 6, 10, 14)  # of each wheel, every step


def scaling(effort: Effort, notify: Callable[[str], object]) -> Findings:
    """Measure every axis, then the outputs."""
    calls = [(name, effort.bench_rounds, effort.bench_steps) for name in AXES]
    data = dict(zip(AXES, apart(measure_axis, *calls), strict=True))
    notify("recorded outputs")
    (data["outputs"],) = apart(measure_outputs, (effort.rounds, effort.distance))
    values = {f"{name}_exponent": found["exponent"] for name, found in data.items() if "exponent" in found}
    return Findings({**values, **data["outputs"]["values"]}, data)


def measure_axis(name: str, rounds: int, steps: int) -> dict[str, Any]:
    """Time of a step at every value of an axis [us], and its largest stages at the last."""
    from threadpoolctl import threadpool_limits  # imported here, since the parent starts no Taichi

    from tiengine.engine import backend
    from tiengine.model.from_scenario import ingredients
    from tiengine.scenario.scenario import load_scenario
    from validation.speed.bench import Bench, timed_in_turn

    backend.start()
    axis = AXES[name]
    scenario = load_scenario("paper", settings_of(RUNS["paper"], WAY))
    given = ingredients(scenario, float(scenario.numerics.time_step))
    with threadpool_limits(1):
        benches = [Bench.of(scenario, replace(given, **axis.change(x)), steps) for x in axis.x]
        us = timed_in_turn(benches, rounds, steps)
        first, last = (bench.shares(steps) for bench in (benches[0], benches[-1]))
    if axis.unit == "train-step":
        us = [each / x for each, x in zip(us, axis.x, strict=True)]
    return {
        "words": axis.words,
        "unit": axis.unit,
        "x": list(axis.x),
        "us": us,
        "exponent": exponent(axis.x, us),
        "exponent_upper": exponent(*_upper(axis.x, us)),
        "shares_first": first,
        "shares_last": last,
    }


def measure_outputs(rounds: int, distance: float) -> dict[str, Any]:
    """Time of a step of whole runs [us], over the interval of all outputs and over the channels of a wheel."""
    from tiengine.result_files.channels import WHEEL
    from tiengine.scenario.scenario import load_scenario
    from tiengine.simulation.simulate import run as simulate

    dt, names = 2e-4, list(WHEEL)
    chosen: dict[tuple[str, int], dict[str, Any]] = {}
    for every in INTERVALS:
        chosen["interval", every] = {"output.wheel_interval": every * dt, "output.body_interval": every * dt}
    for count in CHANNELS:
        chosen["channels", count] = {"output.wheel_channels": names[:count]}
    spent: dict[tuple[str, int], list[float]] = {key: [] for key in chosen}
    for _ in range(rounds):
        for key, settings in chosen.items():
            scenario = load_scenario("paper", settings_of(RUNS["paper"], distance) | settings)
            with simulate(scenario, workers=1) as result:
                facts = result.attributes
            spent[key].append(1e6 * facts["wall_time_loop"] / facts["steps"])
    us = {key: float(np.median(times)) for key, times in spent.items()}
    interval, channels = ([us[kind, x] for x in xs] for kind, xs in (("interval", INTERVALS), ("channels", CHANNELS)))
    return {
        "interval": {"x": list(INTERVALS), "us": interval, "exponent": exponent(INTERVALS, interval)},
        "channels": {"x": list(CHANNELS), "us": channels, "exponent": exponent(CHANNELS, channels)},
        "values": {
            "outputs_interval_exponent": exponent(INTERVALS, interval),
            "outputs_channels_exponent": exponent(CHANNELS, channels),
            "outputs_us_per_channel": float(np.polyfit(CHANNELS, channels, 1)[0]),
        },
    }


def exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Exponent p of y = c x^p by least squares of logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def _upper(x: Sequence[float], y: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
    first = int(SETTLED * (len(x) - 1))
    return x[first:], y[first:]
