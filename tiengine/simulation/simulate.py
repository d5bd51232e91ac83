"""Run a scenario, one train or an ensemble, in this process or in several, into one file."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
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
from tiengine.simulation.collector import Collector, Notify, Progress
from tiengine.simulation.disk_space import check_space
from tiengine.simulation.messages import Message
from tiengine.simulation.stream import never_stop, run_task
from tiengine.simulation.tasks import Task, plan
from tiengine.simulation.worker import distribute, send_task

IMPORT_SECONDS = time.perf_counter() - IMPORT_BEGAN

__all__ = ["AUTO_STEPS", "CHECKPOINT_SECONDS", "Progress", "cores", "prepare", "resume", "run"]

CHECKPOINT_SECONDS = 60.0
"""Wall time between two checkpoints [s]; one takes about 30 ms."""


def run(
    scenario: Scenario | str | Path | dict[str, Any],
    output: Path | str | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
    notify: Notify | None = None,
    workers: int | None = None,
    checkpoint: float = CHECKPOINT_SECONDS,
    stop: Callable[[], bool] = never_stop,
    public_launch: bool = False,
    irregularity: TrackFunctions | None = None,
) -> Result:
    """Simulate a scenario: one train, or the trains of its ensemble.

    Results do not depend on the number of workers. A script that runs an ensemble in several processes must do so
    under ``if __name__ == "__main__"``, as they import it.

    Args:
        scenario: A checked scenario, the name of a built-in one, a TOML file, or tables.
        output: HDF5 file to write; in memory if None.
        force: Replace an existing file.
        progress: Called with simulated time and end time [s] after every chunk of steps, of all trains together.
        notify: Called with a sentence for each event of a train and each worker that dies.
        workers: Processes for an ensemble; one or less runs all trains in this process. None takes one per core,
            divided by Taichi's threads. Never more than there are tasks; a single train always runs in this process.
        checkpoint: Wall time between two checkpoints [s], from which :func:`resume` continues.
        stop: Called after every chunk of steps; if true, the trains are saved and the run ends.
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
        RunStoppedError: ``stop`` returned true; the file holds what was computed until then and can be resumed.
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
    ensure_cache_folders(notify)
    job = _Job(scenario, path, workers, checkpoint, stop, public_launch)
    job.check(tasks)
    groups = _groups(scenario)
    with Writer(path, to_toml(scenario), {}, [], groups, scenario.output.precision, force=force) as writer:
        return job.do(writer, Collector(scenario, writer, path, progress, notify), tasks)


def resume(
    file: Path | str,
    *,
    progress: Progress | None = None,
    notify: Notify | None = None,
    workers: int | None = None,
    checkpoint: float = CHECKPOINT_SECONDS,
    stop: Callable[[], bool] = never_stop,
    irregularity: TrackFunctions | None = None,
) -> Result:
    """Continue a run that was stopped, killed, or ran out of disk; results have the same bits as without a break.

    Args:
        file: Its result file; checkpoints are expected in the same folder. Trains without one start at t = 0.
        progress: See :func:`run`.
        notify: See :func:`run`.
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
    ensure_cache_folders(notify)
    functions = () if irregularity is None else track_functions(irregularity, len(scenario.members))
    tasks = plan(scenario, functions=functions)
    job = _Job(scenario, path, workers, checkpoint, stop, False)
    job.check(tasks)
    with Writer.resume(path, _groups(scenario), scenario.output.precision) as writer:
        collector = Collector(scenario, writer, path, progress, notify)
        saved = {each.task: each for each in map(Checkpoint.read, checkpoint_paths(path))}
        for each in saved.values():
            each.check(str(checkpoint_path(path, each.task)))
            if each.foreign and notify is not None:
                notify(f"made with {', '.join(each.foreign)}: the bits may differ from those of one run")
        collector.resume(saved, job.count(tasks))
        return job.do(writer, collector, [task for task in tasks if not collector.ended.issuperset(task.trains)])


@dataclass(frozen=True)
class _Job:
    """Settings of a run.

    Attributes:
        scenario, path, workers, checkpoint, stop, public: Arguments of :func:`run`.
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

    def do(self, writer: Writer, collector: Collector, tasks: Sequence[Task]) -> Result:
        """Run tasks into a file and complete it."""
        clock, count = time.perf_counter(), self.count(tasks)
        with threadpool_limits(1), closing(self._messages(tasks, count, collector)) as messages:
            for message in messages:  # BLAS on one thread: the same bits on any machine
                collector.take(message)
        everyone = len(self.scenario.members)
        if len(collector.refused) == everyone:
            raise InputError(collector.failed[0])
        if collector.unfinished:
            done, whole = collector.simulated
            raise RunStoppedError(f"stopped after {done:.3f} of {whole:.3f} s of simulated time")
        times = {"import": IMPORT_SECONDS, "total": time.perf_counter() - clock}
        result = Result.of(collector.close(times, count if count > 1 else 0))
        if len(collector.failed) == everyone:
            result.close()
            raise RunFailedError("; ".join(f"train {train}: {why}" for train, why in sorted(collector.failed.items())))
        return result

    def _messages(self, tasks: Sequence[Task], workers: int, collector: Collector) -> Generator[Message, None, None]:
        """Messages of the trains of all tasks."""
        if workers > 1:
            yield from distribute(
                tasks,
                workers,
                collector.latest,
                run=partial(send_task, public=self.public, every=self.checkpoint),
                stop=self.stop,
                notify=collector.notify,
            )
            return
        for task in tasks:
            saved = collector.latest.get(task.number)
            yield from run_task(task, public=self.public, saved=saved, every=self.checkpoint, stop=self.stop)
            if self.stop():
                return


def _groups(scenario: Scenario) -> dict[str, GroupSpec]:
    """Groups that each train records."""
    return Recorder.groups_of(scenario) | trackside_groups(scenario)


def _workers(scenario: Scenario) -> int:
    """Processes: one per core, divided by the threads of each."""
    return max(cores() // scenario.numerics.threads, 1)


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
