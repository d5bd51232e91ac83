"""Window against whole rails with the same integrator, time step and passes, and run time of the latter's stages."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import MODES_PER_METRE, RAIL, RUNS, Facts, apart, median_of, settings_of
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
TRANSFORMS, REST = "seats, sine transforms", "vehicle's solve and recording"


def full_length(effort: Effort, rounds: Mapping[str, Sequence[Facts]]) -> Findings:
    """Measure ratios of real-time factors, and profile the full-length step."""
    one, batch = (median_of(rounds[name], "real_time_factor") for name in ("paper", "batch"))
    whole = {modes: median_of(rounds[f"full_{modes}"], "real_time_factor") for modes in (20, 90)}
    found = apart(profile_full_length, *((modes, effort.profile_steps // 5) for modes in (20, 90)))
    profiles = dict(zip(("20", "90"), found, strict=True))
    seats, dense = profiles["20"], profiles["20"]["dense"]
    without = step_us(rounds["full_20"]) - seats["stages_us_per_step"][TRANSFORMS]
    us = step_us(rounds["paper"])
    return Findings(
        {
            "rtf_20": whole[20],
            "rtf_90": whole[90],
            "ratio_one": whole[20] / one,
            "ratio_batch": whole[20] / batch,
            "ratio_one_90": whole[90] / one,
            "ratio_batch_90": whole[90] / batch,
            "us_per_step_20": step_us(rounds["full_20"]),
            "us_per_step_90": step_us(rounds["full_90"]),
            "transforms_us": seats["stages_us_per_step"][TRANSFORMS],
            "dense_us": dense["us_per_step"],
            "dense_mb": dense["mb"],
            "ratio_one_dense": (without + dense["us_per_step"]) / us,
            "dofs": float(rounds["full_20"][0]["dofs"]),
            "dofs_over_window": rounds["full_20"][0]["dofs"] / rounds["paper"][0]["dofs"],
        },
        {"profiles": profiles, "rounds": factors(rounds, ("full_20", "full_90"))},
    )


def profile_full_length(slab_modes: int, steps: int) -> dict[str, Any]:
    """Measure the stages of a full-length step by timers around its methods.

    Args:
        slab_modes: Plate modes per slab.
        steps: Number of steps.

    Returns:
        Time of each stage and of a step [us], and of products with a dense matrix of sines.
    """
    from threadpoolctl import threadpool_limits  # imported here, since the parent does not need it

    from tiengine.irregularity.irregularity import make_irregularity
    from tiengine.scenario.scenario import load_scenario
    from validation.msm.simulate import FullLength, load, prepare

    distance = 0.8 * RAIL
    scenario = load_scenario("paper", settings_of(RUNS["paper"], distance))
    numerics = FullLength(RAIL, MODES_PER_METRE, slab_modes, float(scenario.numerics.time_step))
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
        dense = _dense(transform.seats, stepper.track.modes, stepper.track.passes)
    stages = {name: ns * 1e-3 / steps for name, ns in sorted(spent.items(), key=lambda item: -item[1])}
    return {"us_per_step": whole * 1e-3 / steps, "stages_us_per_step": stages, "dense": dense}


def _timed(call: Callable[..., Any], stage: str, spent: Counter[str]) -> Callable[..., Any]:
    """Wrap a call to add up its wall time [ns]."""

    def timed(*arguments: Any, **named: Any) -> Any:
        clock = time.perf_counter_ns()
        result = call(*arguments, **named)
        spent[stage] += time.perf_counter_ns() - clock
        return result

    return timed


def _dense(seats: int, modes: int, passes: int, repeats: int = 30) -> dict[str, float]:
    """Time products of six rows with the matrix of sines, to the seats and back, in each pass."""
    j, i = np.arange(seats) + 0.5, np.arange(1, modes + 1)
    sines = np.sin(np.pi / seats * np.outer(i, j))
    amplitudes, back = np.ones((6, modes)), np.ascontiguousarray(sines.T)
    times = []
    for _ in range(repeats):
        clock = time.perf_counter_ns()
        for _ in range(passes):
            forces = amplitudes @ sines
            forces @ back
        times.append(time.perf_counter_ns() - clock)
    return {"us_per_step": float(np.median(times)) * 1e-3, "mb": sines.nbytes * 1e-6}
