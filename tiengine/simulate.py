"""Run a scenario, one train or an ensemble, in this process or in several, into one file."""

from __future__ import annotations

import time

_clock = time.perf_counter()  # importing the engine's packages is part of what a user waits for

import os  # noqa: E402
from collections.abc import Generator, Sequence  # noqa: E402
from contextlib import closing  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

from threadpoolctl import threadpool_limits  # noqa: E402

from tiengine.events import RunFailedError  # noqa: E402
from tiengine.gather import Gathering, Progress  # noqa: E402
from tiengine.march import Message, march  # noqa: E402
from tiengine.plan import Task, plan  # noqa: E402
from tiengine.prepare import AUTO_STEPS, prepare  # noqa: E402
from tiengine.quantity import InputError  # noqa: E402
from tiengine.recorder import Recorder  # noqa: E402
from tiengine.results import Result  # noqa: E402
from tiengine.scenario import Scenario, load_scenario, to_toml  # noqa: E402
from tiengine.worker import distribute  # noqa: E402
from tiengine.writer import Writer, check_output  # noqa: E402

IMPORT_SECONDS = time.perf_counter() - _clock

__all__ = ["AUTO_STEPS", "Progress", "prepare", "run"]


def run(
    scenario: Scenario | str | Path | dict[str, Any],
    output: Path | str | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
    workers: int | None = None,
    public_launch: bool = False,
) -> Result:
    """Simulate a scenario: one train, or the trains of its ensemble.

    Results do not depend on the number of workers. A script that runs an ensemble in several processes must do so
    under ``if __name__ == "__main__"``, as they import it.

    Args:
        scenario: What to run: a checked scenario, the name of a built-in one, a TOML file, or tables.
        output: HDF5 file to write; in memory if None.
        force: Replace an existing file.
        progress: Called with simulated time and end time [s] now and then, of all trains together.
        workers: Processes for an ensemble; one or less: all is done in this one. None: one a core, and for each of
            Taichi's threads one less. Never more than there are tasks; one train alone is run here.
        public_launch: Launch kernels by public Taichi calls only (slower; for comparison).

    Returns:
        The result, open for reading. Trains of an ensemble that failed are in ``result.failures``.

    Raises:
        InputError: The scenario breaks a rule, or the file cannot be written.
        RunFailedError: Every train derailed or had its numbers run away; the file holds what was computed until then.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    path = None if output is None else Path(output)
    if path is not None:
        check_output(path, force)
    tasks = plan(scenario)
    count = min(_workers(scenario) if workers is None else workers, len(tasks))
    clock = time.perf_counter()
    with (
        threadpool_limits(1),  # BLAS on one thread: the same bits on any machine
        Writer(
            path, to_toml(scenario), {}, [], Recorder.groups_of(scenario), scenario.output.precision, force=force
        ) as writer,
        closing(_messages(tasks, count, public_launch)) as messages,
    ):
        gathering = Gathering(scenario, writer, progress)
        for message in messages:
            gathering.take(message)
        if len(gathering.refused) == len(scenario.members):
            raise InputError(gathering.failed[0])
        times = {"import": IMPORT_SECONDS, "total": time.perf_counter() - clock}
        result = gathering.close(times, count if count > 1 else 0)
    if len(gathering.failed) == len(scenario.members):
        result.close()
        raise RunFailedError("; ".join(f"train {train}: {why}" for train, why in sorted(gathering.failed.items())))
    return result


def _workers(scenario: Scenario) -> int:
    """One process a core, if each runs on one thread."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(cores // scenario.numerics.threads, 1)


def _messages(tasks: Sequence[Task], workers: int, public: bool) -> Generator[Message, None, None]:
    """What the trains of all tasks send."""
    if workers > 1:
        yield from distribute(tasks, workers, public=public)
    else:
        for task in tasks:
            yield from march(task, public=public)
