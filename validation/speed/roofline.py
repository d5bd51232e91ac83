"""Stages of the spline step against the machine's roofline: one car, sixteen trains of one car, one train of eight.

A stage runs in launches of its own, on the state at the beginning of a block of steps; the time of launches that do
nothing is taken off. Times are the best of some repeats, as the roofs are; caches are warmer than in the loop. The
wheels, whose iterations need a state that moves, get what the other stages leave of launches that do everything, so
that the stages add up to the kernel.
"""

from __future__ import annotations

import time
from typing import Any

from numpy.typing import NDArray

from tiengine.engine.spline_stepper import SplineStepper
from tiengine.kernels import spline_layout as at
from tiengine.profiling.roofline import Roofs
from validation.speed.bench import Bench, timed_in_turn
from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import RUNS, apart, settings_of
from validation.speed.spline_work import STAGES, counts, sizes_of

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
    from tiengine.profiling.machine import this_machine
    from tiengine.profiling.roofline import measure_roofs
    from tiengine.scenario.scenario import load_scenario

    backend.start()
    scenario = load_scenario(RUNS[name].scenario, settings_of(RUNS[name], WAY))
    machine = this_machine()
    with threadpool_limits(1):
        bench = Bench.of(scenario, trains, steps)
        (step_us,) = timed_in_turn([bench], rounds, steps)
        steps_a_launch = bench.steps_a_launch(steps)
        stepper = bench.run.stepper
        assert isinstance(stepper, SplineStepper)
        launch_us, times = stage_times(bench, STAGES)
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


def stage_times(bench: Bench, stages: dict[str, int]) -> tuple[float, dict[str, float]]:
    """Time of a launch that does nothing [us], and of each stage in a step of the whole group [us].

    Args:
        bench: Trains in splines; they advance by a launch.
        stages: Bits of each stage by name.
    """
    stepper = bench.run.stepper
    assert isinstance(stepper, SplineStepper)
    launch, arrays = stepper.launch, stepper.state.arrays()
    before = {name: array.copy() for name, array in arrays.items()}
    bench.block_us(LAUNCH_STEPS)  # fills the chunk with the track under these steps
    after = {name: array.copy() for name, array in arrays.items()}

    def spent(mask: int, steps: int, state: dict[str, NDArray[Any]]) -> float:
        launch.job[at.STAGES] = mask
        for _ in range(2):  # the first fills the caches
            for name, array in arrays.items():
                array[...] = state[name]
            clock = time.perf_counter_ns()
            launch(0, steps)
        return (time.perf_counter_ns() - clock) * 1e-3

    others = {name: bits for name, bits in stages.items() if bits != at.CONTACT_STAGE}
    masks = {"nothing": 0, "everything": at.ALL_STAGES, **others}
    taken = [{name: spent(mask, LAUNCH_STEPS, before) for name, mask in masks.items()} for _ in range(REPEATS)]
    launch_us = min(spent(0, 1, after) for _ in range(REPEATS))
    launch.job[at.STAGES] = at.ALL_STAGES
    us = {name: min(each[name] for each in taken) for name in masks}
    found = {name: max(0.0, us[name] - us["nothing"]) / LAUNCH_STEPS for name in ("everything", *others)}
    whole = found.pop("everything")
    return launch_us, found | {"wheels": max(0.0, whole - sum(found.values()))}
