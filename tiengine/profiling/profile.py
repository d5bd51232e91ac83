"""Profile of a scenario: the run's own loop with timers between the stages of the step.

Means add up: the stages of a step, the work that is done once a chunk, and the remainder (the loop itself) are the
loop. The real-time factor is that of the blocks of steps without timers.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import fields, is_dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from taichi.lang import impl
from threadpoolctl import threadpool_limits

from tiengine.engine.sine_stepper import SineStepper
from tiengine.engine.spline_stepper import SplineStepper
from tiengine.engine.stepper import BETWEEN_STEPS, Stepper
from tiengine.parameters.errors import InputError
from tiengine.profiling.machine import import_seconds, this_machine, versions
from tiengine.profiling.product_count import Work, count_products
from tiengine.profiling.report import Loop, Memory, ProfileReport, Rate, Stage, Wall
from tiengine.profiling.roofline import Roofs, measure_roofs
from tiengine.profiling.stage_estimates import contact_us, suspension_us
from tiengine.profiling.timed_loop import Times, displayed_name, measure
from tiengine.recording.trackside import trackside_groups
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.simulation.peak_memory import peak_memory
from tiengine.simulation.tasks import Task, plan
from tiengine.simulation.time_loop import CHUNK_STEPS, Run

__all__ = ["array_bytes", "profile"]

WARM_UP_STEPS = 300

HOME = {"suspension": "fastening kernel", "contact": "fastening kernel"}
"""Parts without a stage of their own, and the stage from whose time their estimate is subtracted."""

ORDER = ("window and seats", "irregularity", "predictors and correctors", "linear forces", "motion at the seats",
         "step", "fastening kernel", "suspension", "contact", "mortar", "implicit solve", "recording", "envelopes",
         "gauges", "deflection", "checks", "writing")  # fmt: skip
"""Rows of the table; other stages come after."""


def profile(
    scenario: Scenario | str | Path | dict[str, Any],
    *,
    trains: int | None = None,
    seconds: float = 1.0,
    steps: int | None = None,
) -> ProfileReport:
    """Measure where the time of a scenario's loop goes.

    Args:
        scenario: Scenario, as for :func:`tiengine.run`.
        trains: Trains advanced together, with consecutive seeds; by default those that a run of the scenario would
            advance together.
        seconds: Simulated time [s].
        steps: Number of steps to measure instead, at least 2.

    Returns:
        The report.

    Raises:
        InputError: The scenario breaks a rule, or its distance is too short.
        RunFailedError: The train derailed or the numbers ran away.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    _check(trains, seconds, steps)
    importing = import_seconds()
    with threadpool_limits(1), ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="tiengine-")))
        run, writer, wall = _set_up(_task(scenario, trains), importing, folder)
        stack.callback(writer.leave)
        return _profile(run, writer, wall, max(2, round(seconds / run.recorder.dt)) if steps is None else steps)


def _check(trains: int | None, seconds: float, steps: int | None) -> None:
    """Refuse settings that cannot be measured."""
    if trains is not None and trains < 1:
        raise InputError(f"trains = {trains}: must be at least 1")
    if not 0.0 < seconds < np.inf:
        raise InputError(f"seconds = {seconds:g}: must be greater than 0")
    if steps is not None and steps < 2:
        raise InputError(f"steps = {steps}: must be at least 2, one with timers and one without")


def _task(scenario: Scenario, trains: int | None) -> Task:
    """Trains to advance together: the first task of a run, or copies of its first train with consecutive seeds."""
    task = plan(scenario)[0]
    if trains is None:
        return task
    own = task.tracks[0]
    tracks = tuple(own.model_copy(update={"seed": own.seed + b}) for b in range(trains))
    return Task(0, task.scenario, tuple(range(trains)), tracks)


def _set_up(task: Task, importing: float, folder: Path) -> tuple[Run, Writer, Wall]:
    """Do everything before the loop, as a run does."""
    started = time.perf_counter()
    scenario, run = task.scenario, Run.begin(task)
    groups = run.recorder.groups() | trackside_groups(scenario)
    precision = scenario.output.precision
    writer = Writer(folder / "profile.h5", to_toml(scenario), {}, [run.labels] * task.size, groups, precision)
    generation = float(impl.get_runtime().prog.get_total_compilation_time())
    setup = time.perf_counter() - started - run.jit
    return run, writer, Wall(import_s=importing, jit_s=run.jit, code_generation_s=generation, setup_s=setup)


def _profile(run: Run, writer: Writer, wall: Wall, steps: int) -> ProfileReport:
    """Warm up, measure, estimate, count."""
    warm_up = min(WARM_UP_STEPS, max(2, steps))
    measure(run, writer, warm_up)
    times = measure(run, writer, steps)
    stepper, ingredients = run.stepper, run.stepper.ingredients
    constant, state = _constant_data(stepper), dict(stepper.state.arrays())
    memory = Memory(peak_memory(), *(array_bytes(each) * 1e-6 for each in (constant, state, stepper.chunk)))
    parts = _parts(stepper) if isinstance(stepper, SineStepper) else {}
    work = count_products(stepper)
    machine = this_machine()
    roofs = measure_roofs(machine.l2_bytes, machine.l3_bytes)
    trains, dt = stepper.state.trains, run.recorder.dt
    per_chunk = sum(times.chunks.values()) / steps
    factor = (times.plain_ns / times.plain_steps + per_chunk) * 1e-9 / dt
    loop_us = (times.timed_ns / times.timed_steps + per_chunk) * 1e-3 / trains
    p50, p90, p99 = np.percentile(times.timed, (50, 90, 99)) * 1e-3
    return ProfileReport(
        scenario=run.task.scenario.name,
        trains=trains,
        time_step_s=dt,
        passes=ingredients.passes,
        dofs=ingredients.dof_counts["total"],
        warm_up_steps=warm_up,
        steps=steps,
        versions=versions(),
        machine=machine,
        wall=wall,
        loop=Loop(
            real_time_factor=factor,
            real_time_factor_per_train=factor / trains,
            steps_per_s=1.0 / (factor * dt),
            us_per_train_step=loop_us,
            step_us_p50=float(p50),
            step_us_p90=float(p90),
            step_us_p99=float(p99),
            step_us_max=max(times.timed) * 1e-3,
            measuring_overhead=float(np.median([timed / plain for timed, plain in times.blocks])) - 1.0,
        ),
        stages=_stages(times, parts, trains, loop_us),
        memory=memory,
        roofs=roofs,
        rates=_rates(times, work, roofs),
    )


def _constant_data(stepper: Stepper) -> object:
    """Model of a stepper with its tables."""
    if isinstance(stepper, SplineStepper):
        return stepper.state.tables
    assert isinstance(stepper, SineStepper)
    return stepper.model


def _parts(stepper: SineStepper) -> dict[str, tuple[float, float]]:
    """Calls per step and time [us per train-step] of parts that share a stage with others."""
    passes = stepper.ingredients.passes
    return {
        "suspension": (passes, passes * suspension_us(stepper)),
        "contact": (passes, passes * contact_us(stepper)),
    }


def _stages(times: Times, parts: dict[str, tuple[float, float]], trains: int, loop_us: float) -> tuple[Stage, ...]:
    """Rows of the table; they add up to the loop."""
    steps = times.timed_steps + times.plain_steps
    chunks = np.ceil(steps / CHUNK_STEPS) / steps
    us = {name: ns * 1e-3 / (times.timed_steps * trains) for name, ns in times.stages.items()}
    calls: dict[str, float] = {**times.calls}
    for name, ns in times.chunks.items():
        us[name] = us.get(name, 0.0) + ns * 1e-3 / (steps * trains)
        calls[name] = calls.get(name, 0.0) + chunks
    estimated = set()
    for part, (count, time_us) in parts.items():
        if part not in us and HOME[part] in us:  # else it is a stage of its own
            us[part], calls[part] = time_us, count
            us[HOME[part]] -= time_us
            estimated |= {part, HOME[part]}
    us[BETWEEN_STEPS] = 0.0
    us[BETWEEN_STEPS] = loop_us - sum(us.values())
    names = sorted(us, key=lambda name: (name == BETWEEN_STEPS, ORDER.index(name) if name in ORDER else len(ORDER)))
    return tuple(
        Stage(name, float(calls.get(name, 1.0)), us[name], us[name] / loop_us, name in estimated) for name in names
    )


def _rates(times: Times, work: dict[str, Work], roofs: Roofs) -> tuple[Rate, ...]:
    """Matrix products of each stage over the time that the stage took."""
    stages: dict[str, Work] = {}
    for name, each in work.items():
        stages[displayed_name(name)] = stages.get(displayed_name(name), Work()) + each
    seconds = {name: times.stages[name] * 1e-9 / times.timed_steps for name in stages}
    return tuple(
        Rate(
            stage=name,
            products_per_step=each.products,
            flops_per_step=each.flops,
            bytes_per_step=each.traffic,
            gflops=each.flops / seconds[name] * 1e-9,
            gb_per_s=each.traffic / seconds[name] * 1e-9,
            of_roof=roofs.floor_s(each.flops, each.read) / seconds[name],
        )
        for name, each in stages.items()
    )


def array_bytes(data: Any) -> int:
    """Bytes of the NumPy arrays that an object of dataclasses, mappings and sequences holds, each counted once."""
    seen: dict[int, int] = {}

    def visit(value: Any) -> None:
        if isinstance(value, np.ndarray):
            owner = value if value.base is None or not isinstance(value.base, np.ndarray) else value.base
            seen[id(owner)] = owner.nbytes
        elif is_dataclass(value):
            for each in fields(value):
                visit(getattr(value, each.name))
        elif isinstance(value, dict):
            for each in value.values():
                visit(each)
        elif isinstance(value, (tuple, list)):
            for each in value:
                visit(each)

    visit(data)
    return sum(seen.values())
