"""Run a scenario, one train or an ensemble, in this process or in several, into one file."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from threadpoolctl import threadpool_limits

from tiengine.engine.time_step import AUTO_STEPS, prepare
from tiengine.irregularity.track_function import TrackFunction, TrackFunctions, recorded_name, track_functions
from tiengine.parameters.cache_folders import ensure_cache_folders
from tiengine.parameters.errors import InputError, RunFailedError, RunStoppedError
from tiengine.recording.recorder import Recorder
from tiengine.recording.trackside import trackside_groups
from tiengine.result import Result
from tiengine.result import open as open_result
from tiengine.result_files.checkpoint import Checkpoint, checkpoint_path, checkpoint_paths
from tiengine.result_files.layout import GroupSpec
from tiengine.result_files.output_file import check_output
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.simulation import IMPORT_BEGAN
from tiengine.simulation.collector import Gathering, Progress, Tell
from tiengine.simulation.disk_space import check_space
from tiengine.simulation.messages import Message
from tiengine.simulation.tasks import Task, plan
from tiengine.simulation.time_loop import march, never
from tiengine.simulation.worker import distribute

IMPORT_SECONDS = time.perf_counter() - IMPORT_BEGAN

__all__ = ["AUTO_STEPS", "CHECKPOINT_SECONDS", "Progress", "prepare", "resume", "run"]

CHECKPOINT_SECONDS = 60.0
"""Wall time between two checkpoints; one takes some 30 ms."""


def run(
    scenario: Scenario | str | Path | dict[str, Any],
    output: Path | str | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
    tell: Tell | None = None,
    workers: int | None = None,
    checkpoint: float = CHECKPOINT_SECONDS,
    stop: Callable[[], bool] = never,
    public_launch: bool = False,
    irregularity: TrackFunctions | None = None,
) -> Result:
    """Simulate a scenario: one train, or the trains of its ensemble.

    Results do not depend on the number of workers. A script that runs an ensemble in several processes must do so
    under ``if __name__ == "__main__"``, as they import it.

    Args:
        scenario: What to run: a checked scenario, the name of a built-in one, a TOML file, or tables.
        output: HDF5 file to write; in memory if None.
        force: Replace an existing file.
        progress: Called with simulated time and end time [s] now and then, of all trains together.
        tell: Called with a sentence for what happens on the way: events of the trains, workers that die.
        workers: Processes for an ensemble; one or less: all is done in this one. None: one a core, and for each of
            Taichi's threads one less. Never more than there are tasks; one train alone is run here.
        checkpoint: Wall time between two checkpoints [s], from which :func:`resume` goes on.
        stop: Asked now and then; if true, the chunk of steps is finished, saved, and left.
        public_launch: Launch kernels by public Taichi calls only (slower; for comparison).
        irregularity: Function of chainage (or a :class:`TrackFunction`) that replaces the irregularity's spectrum or
            file; for an ensemble one for all trains, or one for each. Rail roughness, ``scale`` and ``taper`` apply to
            it as well. The time step is not checked against its wavelengths. Worker processes need a function that
            can be pickled. The file records its name; :func:`resume` must be given it again.

    Returns:
        The result, open for reading. Trains of an ensemble that failed are in ``result.failures``.

    Raises:
        InputError: The scenario breaks a rule, or the file cannot be written.
        RunFailedError: Every train derailed or had its numbers run away; the file holds what was computed until then.
        RunStoppedError: It was asked to stop; the file holds what was computed until then and can be resumed.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    functions: tuple[TrackFunction, ...] = ()
    if irregularity is not None:
        functions = track_functions(irregularity, len(scenario.members))
        scenario = load_scenario(scenario, {"irregularity.function": recorded_name(functions)})
    tasks = plan(scenario, functions=functions)
    path = None if output is None else Path(output)
    if path is not None:
        check_output(path, force)
        check_space(scenario, path)
    ensure_cache_folders(tell)
    job = _Job(scenario, path, workers, checkpoint, stop, public_launch)
    job.check(tasks)
    groups = _groups(scenario)
    with Writer(path, to_toml(scenario), {}, [], groups, scenario.output.precision, force=force) as writer:
        return job.do(writer, Gathering(scenario, writer, path, progress, tell), tasks)


def resume(
    file: Path | str,
    *,
    progress: Progress | None = None,
    tell: Tell | None = None,
    workers: int | None = None,
    checkpoint: float = CHECKPOINT_SECONDS,
    stop: Callable[[], bool] = never,
    irregularity: TrackFunctions | None = None,
) -> Result:
    """Go on with a run that was stopped, killed, or out of disk; trains get the same bits as without a break.

    Args:
        file: Its result file; checkpoints are looked for beside it. Trains without one begin anew.
        progress: See :func:`run`.
        tell: See :func:`run`.
        workers: See :func:`run`; may be another number than before.
        checkpoint: See :func:`run`.
        stop: See :func:`run`.
        irregularity: Function of chainage, needed if the run was given one.

    Returns:
        The result, open for reading.

    Raises:
        InputError: The file is no result of this program, complete, being written, or a checkpoint is damaged.
        RunFailedError: See :func:`run`.
        RunStoppedError: See :func:`run`.
    """
    path = Path(file)
    with open_result(path) as result:
        scenario = result.scenario
    ensure_cache_folders(tell)
    functions = () if irregularity is None else track_functions(irregularity, len(scenario.members))
    tasks = plan(scenario, functions=functions)
    job = _Job(scenario, path, workers, checkpoint, stop, False)
    job.check(tasks)
    with Writer.resume(path, _groups(scenario), scenario.output.precision) as writer:
        gathering = Gathering(scenario, writer, path, progress, tell)
        saved = {each.task: each for each in map(Checkpoint.read, checkpoint_paths(path))}
        for each in saved.values():
            each.check(str(checkpoint_path(path, each.task)))
            if each.foreign and tell is not None:
                tell(f"made with {', '.join(each.foreign)}: the bits may differ from those of one run")
        gathering.go_on(saved, job.count(tasks))
        return job.do(writer, gathering, [task for task in tasks if not gathering.ended.issuperset(task.trains)])


@dataclass(frozen=True)
class _Job:
    """How the trains of a scenario are computed.

    Attributes:
        scenario, path, workers, checkpoint, stop, public: As given to :func:`run`.
    """

    scenario: Scenario
    path: Path | None
    workers: int | None
    checkpoint: float
    stop: Callable[[], bool]
    public: bool

    def count(self, tasks: Sequence[Task]) -> int:
        """Worker processes for some tasks."""
        return min(_workers(self.scenario) if self.workers is None else self.workers, len(tasks))

    def check(self, tasks: Sequence[Task]) -> None:
        """Refuse functions of chainage that cannot be sent to worker processes.

        Raises:
            InputError: One cannot be pickled.
        """
        if self.count(tasks) > 1:
            for task in tasks:
                for function in task.functions:
                    function.check_picklable()

    def do(self, writer: Writer, gathering: Gathering, tasks: Sequence[Task]) -> Result:
        """Run tasks into a file and complete it."""
        clock, count = time.perf_counter(), self.count(tasks)
        with threadpool_limits(1), closing(self._messages(tasks, count, gathering)) as messages:
            for message in messages:  # BLAS on one thread: the same bits on any machine
                gathering.take(message)
        everyone = len(self.scenario.members)
        if len(gathering.refused) == everyone:
            raise InputError(gathering.failed[0])
        if gathering.unfinished:
            done, whole = gathering.simulated
            raise RunStoppedError(f"stopped after {done:.3f} of {whole:.3f} s of simulated time")
        times = {"import": IMPORT_SECONDS, "total": time.perf_counter() - clock}
        result = Result.of(gathering.close(times, count if count > 1 else 0))
        if len(gathering.failed) == everyone:
            result.close()
            raise RunFailedError("; ".join(f"train {train}: {why}" for train, why in sorted(gathering.failed.items())))
        return result

    def _messages(self, tasks: Sequence[Task], workers: int, gathering: Gathering) -> Generator[Message, None, None]:
        """What the trains of all tasks send."""
        if workers > 1:
            yield from distribute(
                tasks,
                workers,
                gathering.latest,
                public=self.public,
                every=self.checkpoint,
                stop=self.stop,
                tell=gathering.tell,
            )
            return
        for task in tasks:
            saved = gathering.latest.get(task.number)
            yield from march(task, public=self.public, saved=saved, every=self.checkpoint, stop=self.stop)
            if self.stop():
                return


def _groups(scenario: Scenario) -> dict[str, GroupSpec]:
    """What each train records."""
    return Recorder.groups_of(scenario) | trackside_groups(scenario)


def _workers(scenario: Scenario) -> int:
    """One process a core, if each runs on one thread."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(cores // scenario.numerics.threads, 1)
