"""A task run as a stream of messages to the process that writes the file."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from tiengine.irregularity.irregularity import Irregularity
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.errors import InputError
from tiengine.result_files.checkpoint import Checkpoint
from tiengine.simulation.messages import Begun, Costs, Ended, Lost, Message, Paused, Saved
from tiengine.simulation.peak_memory import peak_memory
from tiengine.simulation.restart import restore, save
from tiengine.simulation.tasks import Task
from tiengine.simulation.time_loop import Run

__all__ = ["facts_at_start", "never_stop", "run_task"]


def never_stop() -> bool:
    """Default stop callback: never stop."""
    return False


def run_task(
    task: Task,
    *,
    public: bool = False,
    saved: Checkpoint | None = None,
    every: float = math.inf,
    stop: Callable[[], bool] = never_stop,
) -> Iterator[Message]:
    """Set up the trains of a task and run them over their whole distance.

    Args:
        task: The trains.
        public: Launch kernels by public Taichi calls only.
        saved: Checkpoint to continue from; None starts at t = 0.
        every: Wall time between two checkpoints [s].
        stop: Called after every chunk of steps; if true, the trains are saved and left.

    Yields:
        Messages with all that is written to the file.
    """
    clock = time.perf_counter()
    try:
        run = Run.begin(task, public, at_rest=saved is not None)
        if saved is not None:
            restore(run, saved)
    except InputError as error:
        yield Lost(task.trains, str(error), refused=True)
        return
    setup = time.perf_counter() - clock - run.jit
    yield Begun(task.number, run.labels, facts_at_start(task, run.stepper.ingredients, run.tracks))
    before = 0.0 if saved is None else float(saved.facts["loop"])
    clock = last = time.perf_counter()
    try:
        for advanced in run.blocks():
            yield advanced
            now, stopping = time.perf_counter(), stop()
            if run.unfinished and (stopping or now - last >= every):
                yield Saved(task.trains, save(run, before + now - clock))
                last = time.perf_counter()
                if stopping:
                    yield Paused(task.trains)
                    return
    except InputError as error:  # of a user's function of chainage
        yield Lost(task.trains, str(error), refused=True)
        return
    loop = before + time.perf_counter() - clock
    yield Ended(task.number, run.ends(loop), Costs(os.getpid(), run.jit, setup, loop, peak_memory()))


def _functions(ingredients: Ingredients) -> dict[str, int]:
    """Trial functions of a rail field: sines are modes."""
    return {"modes" if ingredients.grading is None else "functions": ingredients.functions.count}


def facts_at_start(task: Task, ingredients: Ingredients, tracks: Sequence[Irregularity]) -> dict[int, dict[str, Any]]:
    """Facts of each train that are known from the start, by its number."""
    shared = {
        **{f"dofs_{name}": count for name, count in ingredients.dof_counts.items() if name != "total"},
        "dofs": ingredients.dof_counts["total"],
        "time_step": ingredients.newmark.dt,
        "passes": ingredients.passes,
        "window_length": ingredients.length,
        **_functions(ingredients),
        "slabs": ingredients.slots,
        "seats_in_window": ingredients.seats,
    }
    facts: dict[int, dict[str, Any]] = {}
    for b, number in enumerate(task.trains):
        facts[number] = {**shared, "seed": task.tracks[b].seed}
        if tracks[b].description:
            facts[number]["irregularity_file"] = tracks[b].description
    return facts
