"""Runs of the engine and of the full-length model, each in a process of its own, taking turns where they are compared.

A process sets up once and then runs again and again, so that only the first of several runs pays for kernels and
contact table; neither is part of what is compared.
"""

from __future__ import annotations

import multiprocessing
import os
import time
import tomllib
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import psutil

from tiengine.scenario.scenario import Scenario

__all__ = ["CASES", "RUNS", "Facts", "Run", "apart", "in_turn", "median_of", "perform", "settings_of", "step_of"]

T = TypeVar("T")
Facts = dict[str, Any]
CASES = tomllib.loads((Path(__file__).parent / "cases.toml").read_text(encoding="utf-8"))

RAIL = 600.0  # m, of the full-length model
WARM_UP = 5.0  # m: the first launches load kernels


@dataclass(frozen=True)
class Run:
    """A run of ``cases.toml``.

    Attributes:
        words: Description.
        scenario: Built-in scenario.
        distance: Distance of a whole measurement [m].
        settings: Overrides.
        workers: Number of processes.
        modes_per_metre: Sines per metre of the full-length model; None for the engine.
    """

    words: str
    scenario: str
    distance: float
    settings: dict[str, Any] = field(default_factory=dict)
    workers: int = 1
    modes_per_metre: float | None = None


RUNS = {name: Run(**table) for name, table in CASES["runs"].items()}


def settings_of(run: Run, distance: float) -> dict[str, Any]:
    """Overrides for a distance [m]."""
    return run.settings | {"train.distance": distance}


def step_of(scenario: Scenario) -> float:
    """Time step of a run of ``cases.toml`` [s]; "auto" takes the longest, which their tracks and trains allow."""
    from tiengine.engine.time_step import AUTO_STEPS  # imported here, since the parent starts no Taichi

    wanted = scenario.numerics.time_step
    return AUTO_STEPS[0] if wanted == "auto" else float(wanted)


def perform(run: Run, distance: float) -> Facts:
    """Run in this process, into a temporary file.

    Args:
        run: Run to measure.
        distance: Distance [m].

    Returns:
        Attributes of the result, times in s, memory in MB, and ``file_mb``.
    """
    from tiengine.scenario.scenario import load_scenario
    from tiengine.simulation.peak_memory import peak_memory  # imported here, since the parent measures nothing
    from tiengine.simulation.simulate import run as simulate
    from validation.msm.simulate import FullLength, run_full_length

    scenario = load_scenario(run.scenario, settings_of(run, distance))
    with TemporaryDirectory(prefix="tiengine-speed-") as folder:
        path = Path(folder) / "run.h5"
        if run.modes_per_metre is None:
            result = simulate(scenario, path, workers=run.workers)
        else:
            slab_modes = scenario.parts.slab.plate_dofs  # all, as the window has them
            numerics = FullLength(RAIL, run.modes_per_metre, slab_modes, step_of(scenario))
            result = run_full_length(scenario, numerics, path)
        with result:
            facts: Facts = result.attributes
        del facts["scenario"]
        facts.setdefault("peak_memory", peak_memory())
        return facts | {"file_mb": path.stat().st_size * 1e-6}


def in_turn(names: Sequence[str], rounds: int, share: float, notify: Callable[[str], object]) -> dict[str, list[Facts]]:
    """Run several, one after another, round by round.

    Args:
        names: Names of the runs.
        rounds: Number of repeats of each.
        share: Part of each run's distance.
        notify: Called with a description of the next run.

    Returns:
        Rounds of each run, with ``others_cores``, the cores that other processes used meanwhile.
    """
    facts: dict[str, list[Facts]] = {name: [] for name in names}
    with ExitStack() as stack:
        processes = {name: stack.enter_context(_process()) for name in names}
        for name, process in processes.items():
            if RUNS[name].workers == 1:  # workers start again each time
                notify(f"{RUNS[name].words}, set-up")
                process.submit(perform, RUNS[name], WARM_UP).result()
        for i in range(rounds):
            for name, process in processes.items():
                notify(f"{RUNS[name].words}, round {i + 1} of {rounds}")
                before = _cpu_seconds()
                found = process.submit(perform, RUNS[name], share * RUNS[name].distance).result()
                wall, own, everyone = (now - then for now, then in zip(_cpu_seconds(), before, strict=True))
                facts[name].append(found | {"others_cores": max(everyone - own, 0.0) / wall})
    return facts


def apart(call: Callable[..., T], *calls: Sequence[Any]) -> list[T]:
    """Call a function with these arguments, one after another, in one new process."""
    with _process() as process:
        return [process.submit(call, *arguments).result() for arguments in calls]


def median_of(facts: Sequence[Facts], key: str) -> float:
    """Median over repeated runs."""
    return float(median(float(each[key]) for each in facts))


def _cpu_seconds() -> tuple[float, float, float]:
    """Clock, processor time of this process with its descendants, and of all processes [s]."""
    me = psutil.Process()
    own = sum(
        sum(each.cpu_times()[:4]) for each in (me, *me.children(recursive=True))
    )  # including descendants that ended
    times = psutil.cpu_times()
    return time.perf_counter(), own, times.user + times.nice + times.system


def _process() -> ProcessPoolExecutor:
    """A process that works on request; spawned, since Taichi does not survive a fork."""
    return ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"), initializer=_quiet)


def _quiet() -> None:
    os.environ["ENABLE_TAICHI_HEADER_PRINT"] = "False"
