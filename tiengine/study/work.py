"""Work of a study: one task, computed in this process, continued where an earlier one left it.

This is all that a worker does, whoever started it: the same bits come from a process here, from Dask, from a batch
system.
"""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.result_files.reader import COMPLETE
from tiengine.study.folder import Folder

__all__ = ["Evaluate", "Progress", "Work", "do_task"]

Evaluate = Callable[[Mapping[str, Any]], Mapping[str, float]]
"""Function of the factors that gives the figures of a train, in place of the engine."""

Progress = Callable[[float, float], None]

LOCK_POLL = 1.0  # s between two looks at a part that another process writes


@dataclass(frozen=True)
class Work:
    """Settings of all tasks of a study.

    Attributes:
        checkpoint: Wall time between two checkpoints [s].
        evaluate: Function in place of the engine.
        patience: Time to wait for another process that writes the same part [s]: a worker that was given up may be
            alive, and either completes its part or ends.
    """

    checkpoint: float = 60.0
    evaluate: Evaluate | None = None
    patience: float = 0.0


def do_task(
    folder: Folder,
    task: int,
    work: Work,
    *,
    progress: Progress | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Complete a task, from its checkpoint if there is one, and put its record in place.

    Args:
        folder: Folder of the study.
        task: Number of the task.
        work: Settings.
        progress: Called with simulated time and end time [s].
        stop: Called after every chunk of steps; if true, the trains are saved and the task is left.

    Returns:
        The record; that of an earlier process if the task was complete.

    Raises:
        InputError: The part is damaged, cannot be written, or is being written by another process.
        RunStoppedError: ``stop`` returned true.
    """
    deadline = time.monotonic() + work.patience
    while (record := folder.record(task)) is None:
        clock, began = time.perf_counter(), time.time()
        try:
            trains = (
                _evaluated(folder, task, work.evaluate) if work.evaluate else _run(folder, task, work, progress, stop)
            )
        except InputError as error:
            if "another run is writing it" not in str(error) or time.monotonic() > deadline:
                raise
            time.sleep(LOCK_POLL)
            continue
        record = _record(task, trains, began, time.perf_counter() - clock)
        folder.keep(record)
        failed = sum(train["status"] != COMPLETE for train in trains)
        folder.log(f"task {task}: {len(trains)} trains in {record['wall']:.2f} s, {failed} failed")
    return record


def _record(task: int, trains: list[dict[str, Any]], began: float, wall: float) -> dict[str, Any]:
    return {
        "task": task,
        "trains": trains,
        "began": began,
        "ended": time.time(),
        "wall": wall,
        "host": socket.gethostname(),
        "process": os.getpid(),
        "tiengine_version": metadata.version("tiengine"),
    }


def _evaluated(folder: Folder, task: int, evaluate: Evaluate) -> list[dict[str, Any]]:
    """Figures of the trains of a task by a function."""
    found = []
    for member in folder.design.tasks[task]:
        try:
            figures = {name: float(value) for name, value in evaluate(folder.design.values(member)).items()}
            found.append({"member": member, "status": COMPLETE, "figures": figures})
        except ArithmeticError as error:
            found.append({"member": member, "status": f"{type(error).__name__}: {error}", "figures": {}})
    return found


def _run(
    folder: Folder, task: int, work: Work, progress: Progress | None, stop: Callable[[], bool]
) -> list[dict[str, Any]]:
    """Run or continue the part of a task and evaluate its trains."""
    members, path = folder.design.tasks[task], folder.part(task)
    try:
        _complete_part(folder, task, path, work, progress, stop)
    except RunFailedError:
        pass  # all trains failed; the part holds them with their reasons
    except InputError as error:
        if path.exists() or "output = " in str(error):
            raise
        return [{"member": member, "status": f"refused: {error}", "figures": {}} for member in members]
    return _read(path, members, folder.design.plan.indices)


def _complete_part(
    folder: Folder, task: int, path: Path, work: Work, progress: Progress | None, stop: Callable[[], bool]
) -> None:
    """Bring a part to its end."""
    from tiengine.result import open as open_result
    from tiengine.simulation import simulate

    settings: dict[str, Any] = {"workers": 0, "checkpoint": work.checkpoint, "progress": progress, "stop": stop}
    if path.exists():
        with open_result(path) as part:
            finished = part.finished
        if not finished:
            simulate.resume(path, **settings).close()
        return
    simulate.run(folder.design.scenario(task), path, **settings).close()


def _read(path: Path, members: tuple[int, ...], indices: bool) -> list[dict[str, Any]]:
    """Status and figures of the trains of a complete part."""
    from tiengine.result import open as open_result
    from tiengine.study.figures import figures_of

    found = []
    with open_result(path) as part:
        figures_by_train = figures_of(part, indices=indices)
        for train, member in enumerate(members):
            status, facts, figures = part.status(train), part.facts(train), figures_by_train.get(train, {})
            time = float(facts.get("simulated_time", 0.0))
            found.append({"member": member, "status": status, "simulated_time": time, "figures": figures})
    return found
