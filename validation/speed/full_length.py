"""Window against whole rails with the same integrator and passes, at equal accuracy.

The full-length model gets the sines per metre and the time step that it needs to be as accurate as the default
numerics, or less; :mod:`validation.speed.accuracy` measures the errors of both.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from validation.speed.accuracy import accuracy
from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import RAIL, RUNS, Facts, apart, median_of, settings_of
from validation.speed.throughput import factors, step_us

__all__ = ["full_length", "profile_full_length"]

STAGES = {
    "_predict_slabs": "slabs",
    "_forces": "rails and vehicle, explicit",
    "_seats": "seats, transforms apart",
    "_solve_slabs": "slabs",
    "_contact": "rails' solve and contact",
}
"""Methods of ``FullStepper`` in which a step spends its time, and the names that the report gives them."""
WARM_UP = 20  # steps
PROFILE_STEPS = 500
ACCURACY_DISTANCE = 90.0  # m
TRANSFORMS, REST = "seats, sine transforms", "vehicle's solve and recording"


def full_length(effort: Effort, rounds: Mapping[str, Sequence[Facts]]) -> Findings:
    """Measure ratios of real-time factors and the errors of both, and profile the full-length step."""
    one, batch, whole = (median_of(rounds[name], "real_time_factor") for name in ("default", "batch", "full"))
    density, step = RUNS["full"].modes_per_metre or 0.0, float(rounds["full"][0]["time_step"])
    numerics = list(dict.fromkeys([*effort.full_length, (density, step)]))
    (errors,) = apart(accuracy, (numerics, ACCURACY_DISTANCE))
    error = errors["full_length"][numerics.index((density, step))]["p99"]
    (profile,) = apart(profile_full_length, (density, step, PROFILE_STEPS))
    full, default = rounds["full"][0]["dofs"], rounds["default"][0]["dofs"]
    us, default_us = step_us(rounds["full"]), step_us(rounds["default"])
    return Findings(
        {
            "modes_per_metre": density,
            "time_step_us": 1e6 * step,
            "rtf": whole,
            "ratio_one": whole / one,
            "ratio_batch": whole / batch,
            "us_per_step": us,
            "ns_per_dof": 1e3 * us / full,
            "default_ns_per_dof": 1e3 * default_us / default,
            "dofs": float(full),
            "dofs_over_default": full / default,
            "error": error,
            "error_default": errors["default"]["p99"],
            "error_ratio": error / errors["default"]["p99"],
        },
        {"profile": profile, "accuracy": errors, "rounds": factors(rounds, ("full",))},
    )


def profile_full_length(modes_per_metre: float, step: float, steps: int) -> dict[str, Any]:
    """Measure the stages of a full-length step by timers around its methods.

    Args:
        modes_per_metre: Sines per metre and field.
        step: Time step [s].
        steps: Number of steps.

    Returns:
        Time of each stage and of a step [us].
    """
    from threadpoolctl import threadpool_limits  # imported here, since the parent does not need it

    from tiengine.irregularity.irregularity import make_irregularity
    from tiengine.scenario.scenario import load_scenario
    from validation.msm.simulate import FullLength, load, prepare

    distance = 0.8 * RAIL
    scenario = load_scenario(RUNS["full"].scenario, settings_of(RUNS["full"], distance))
    numerics = FullLength(RAIL, modes_per_metre, scenario.parts.slab.plate_dofs, step)
    with threadpool_limits(1):
        stepper = prepare(scenario, numerics, *(WARM_UP + steps,) * 2)
        start = scenario.rear + scenario.centre_in_window
        load(stepper, scenario, make_irregularity(scenario.irregularity, start + 50.0), start, start + distance)
        spent: Counter[str] = Counter()
        for method, stage in STAGES.items():
            setattr(stepper, method, _timed(getattr(stepper, method), stage, spent))
        transform = stepper.track.transform
        for method in ("to_seats", "from_seats"):
            object.__setattr__(transform, method, _timed(getattr(transform, method), TRANSFORMS, spent))
        for i in range(WARM_UP):  # the first launches load their kernels
            stepper.step(i, i)
        spent.clear()
        clock = time.perf_counter_ns()
        for i in range(WARM_UP, WARM_UP + steps):
            stepper.step(i, i)
        whole = time.perf_counter_ns() - clock
        spent["seats, transforms apart"] -= spent[TRANSFORMS]
        spent[REST] = whole - sum(spent.values())
    stages = {name: ns * 1e-3 / steps for name, ns in sorted(spent.items(), key=lambda item: -item[1])}
    return {"us_per_step": whole * 1e-3 / steps, "stages_us_per_step": stages}


def _timed(call: Callable[..., Any], stage: str, spent: Counter[str]) -> Callable[..., Any]:
    """Wrap a call to add up its wall time [ns]."""

    def timed(*arguments: Any, **named: Any) -> Any:
        clock = time.perf_counter_ns()
        result = call(*arguments, **named)
        spent[stage] += time.perf_counter_ns() - clock
        return result

    return timed
