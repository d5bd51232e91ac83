"""Stages of the spline step against the machine's roofline: one car, sixteen trains of one car, one train of eight.

A stage runs in launches of its own, on the state that a run has left; the time of launches that do nothing is taken
off. Contact needs fresh forward results, so it runs with the forward sweep, whose time is taken off as well. Caches
are warmer than in the whole step, and contact needs fewer iterations than on a rail that moves: the stages are
estimates, the whole step is not.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from tiengine.profiling.roofline import Roofs
from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import RUNS, apart, settings_of

__all__ = ["GROUPS", "measured", "roofline"]

GROUPS = {"one": ("default", 1), "many": ("default", 16), "eight": ("train8", 1)}
"""Scenario and number of trains of each group that is measured."""
WAY = 600.0  # m, more than any block needs
LAUNCH_STEPS = 20
REPEATS = 15


def roofline(effort: Effort) -> Findings:
    """Measure all groups."""
    values: dict[str, float | str] = {}
    calls = [(*group, effort.bench_rounds, effort.bench_steps) for group in GROUPS.values()]
    data = dict(zip(GROUPS, apart(measured, *calls), strict=True))
    for name, found in data.items():
        stages, keys = found["stages"], ("step_us", "launch_us", "steps_a_launch", "lanes")
        kernel = sum(stage["us"] for stage in stages)
        largest = max(stages, key=lambda stage: stage["us"])
        launch = found["launch_us"] / found["steps_a_launch"]
        values |= {f"{name}.{key}": found[key] for key in keys}
        values |= {
            f"{name}.kernel_us": kernel,
            f"{name}.rest_us": max(0.0, found["step_us"] - kernel - launch / found["trains"]),
            f"{name}.floor_us": sum(stage["floor_us"] for stage in stages),
            f"{name}.mflop": sum(stage["flops"] for stage in stages) * 1e-6,
            f"{name}.kb": sum(stage["traffic"] for stage in stages) * 1e-3,
            f"{name}.largest": largest["name"],
            f"{name}.largest_share": largest["us"] / kernel,
        }
    return Findings(values, data)


def measured(name: str, trains: int, rounds: int, steps: int) -> dict[str, Any]:
    """Measure a group.

    Args:
        name: Run of ``cases.toml``.
        trains: Trains advanced together.
        rounds: Blocks of steps.
        steps: Steps of a block.

    Returns:
        Times [us per train-step], a launch [us]; of each stage flops and bytes of a train-step; the roofs.
    """
    from threadpoolctl import threadpool_limits  # imported here, since the parent starts no Taichi

    from tiengine.engine import backend
    from tiengine.engine.spline_stepper import SplineStepper
    from tiengine.profiling.machine import this_machine
    from tiengine.profiling.roofline import measure_roofs
    from tiengine.scenario.scenario import load_scenario
    from validation.speed.bench import Bench, timed_in_turn
    from validation.speed.spline_work import STAGES, counts, sizes_of

    backend.start()
    scenario = load_scenario(RUNS[name].scenario, settings_of(RUNS[name], WAY))
    machine = this_machine()
    with threadpool_limits(1):
        bench = Bench.of(scenario, trains, steps)
        (step_us,) = timed_in_turn([bench], rounds, steps)
        steps_a_launch = bench.steps_a_launch(steps)
        stepper = bench.run.stepper
        assert isinstance(stepper, SplineStepper)
        launch_us, times = stage_times(stepper, STAGES)
        roofs = measure_roofs(machine.l2_bytes, machine.l3_bytes)
        work = counts(sizes_of(stepper))
    stages = [
        {
            "name": stage,
            "us": us / trains,
            "flops": work[stage].flops / trains,
            "traffic": work[stage].traffic / trains,
            "floor_us": floor_us(work[stage].flops, work[stage].traffic, roofs) / trains,
        }
        for stage, us in times.items()
    ]
    return {
        "words": RUNS[name].words,
        "trains": trains,
        "lanes": stepper.state.held.lanes,
        "step_us": step_us / trains,
        "launch_us": launch_us,
        "steps_a_launch": steps_a_launch,
        "stages": stages,
        "roofs": {"dgemm_gflops": roofs.dgemm_gflops, "triad_l2_gb_per_s": roofs.triad_l2_gb_per_s,
                  "triad_dram_gb_per_s": roofs.triad_dram_gb_per_s},
    }  # fmt: skip


def floor_us(flops: float, traffic: float, roofs: Roofs) -> float:
    """Least time [us] that the roofs allow for operations and bytes: dgemm's rate, that of the second-level cache."""
    return max(flops / roofs.dgemm_gflops, traffic / roofs.triad_l2_gb_per_s) * 1e-3


def stage_times(stepper: Any, stages: dict[str, int]) -> tuple[float, dict[str, float]]:
    """Time of a launch that does nothing [us], and of each stage in a step of the whole group [us].

    Args:
        stepper: A spline stepper whose chunk is loaded; its state is left as it was.
        stages: Bits of each stage by name.
    """
    from tiengine.kernels import spline_layout as at

    launch, state = stepper.launch, stepper.state
    kept = {name: array.copy() for name, array in state.arrays().items()}
    recorded = launch.record.copy()
    launch.record[:] = -1
    forward = at.FORWARD_STAGE
    masks = {"nothing": 0} | {name: bits | forward * (bits == at.CONTACT_STAGE) for name, bits in stages.items()}
    spent: dict[str, list[float]] = {name: [] for name in masks}
    for _ in range(REPEATS):
        for name, mask in masks.items():
            launch.job[at.STAGES] = mask
            clock = time.perf_counter_ns()
            launch(0, LAUNCH_STEPS)
            spent[name].append((time.perf_counter_ns() - clock) * 1e-3)
            for kind, array in state.arrays().items():
                array[...] = kept[kind]
    launch.job[at.STAGES] = at.ALL_STAGES
    launch.record[:] = recorded
    us = {name: float(np.median(times)) for name, times in spent.items()}
    nothing = us.pop("nothing")
    found = {name: max(0.0, time_us - nothing) / LAUNCH_STEPS for name, time_us in us.items()}
    alone = next(found[name] for name, bits in stages.items() if bits == forward)
    return nothing, {
        name: max(0.0, time_us - alone) if stages[name] == at.CONTACT_STAGE else time_us
        for name, time_us in found.items()
    }
