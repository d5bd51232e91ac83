"""Tasks of a study on this machine: in this process, or in worker processes that write their parts themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any

from tiengine.parameters.errors import InputError, RunStoppedError
from tiengine.simulation.worker import distribute
from tiengine.study.folder import Folder
from tiengine.study.watch import Watch
from tiengine.study.work import Work, do_task

__all__ = ["run_here"]


@dataclass(frozen=True)
class _Part:
    """Task of a study, for a worker process.

    Attributes:
        folder: Folder of the study.
        number: Number of the task.
        trains: Numbers of its members.
    """

    folder: Folder
    number: int
    trains: tuple[int, ...]


def run_here(folder: Folder, tasks: Sequence[int], work: Work, watch: Watch, workers: int) -> None:
    """Complete tasks on this machine.

    Args:
        folder: Folder of the study.
        tasks: Numbers of the tasks.
        work: Settings.
        watch: Is told what happens.
        workers: Processes; one or less computes in this process, as does a function in place of the engine.
    """
    if min(workers, len(tasks)) <= 1 or work.evaluate is not None:
        for task in tasks:
            if watch.stop():
                return
            _do(folder, task, work, watch.stop, partial(_hear, watch))
        return
    parts = [_Part(folder, task, folder.design.tasks[task]) for task in tasks]
    run = partial(_send, work=work)
    with closing(distribute(parts, workers, {}, run=run, stop=watch.stop, notify=watch.notify)) as messages:
        for message in messages:
            _hear(watch, message)


def _send(part: _Part, saved: Any, stop: Callable[[], bool], send: Callable[[Any], None], *, work: Work) -> None:
    """Do a task in a worker process; its folder is read once."""
    _do(_opened(part.folder), part.number, work, stop, send)


_folders: dict[str, Folder] = {}


def _opened(folder: Folder) -> Folder:
    return _folders.setdefault(str(folder.path), folder)


def _do(folder: Folder, task: int, work: Work, stop: Callable[[], bool], send: Callable[[Any], None]) -> None:
    """Do a task and send how it goes: simulated time and end time, then the record or a reason."""
    try:
        record = do_task(folder, task, work, progress=lambda now, whole: send((task, (now, whole))), stop=stop)
    except RunStoppedError:
        return
    except InputError as error:
        send((task, str(error)))
        return
    send((task, record))


def _hear(watch: Watch, message: Any) -> None:
    """Pass a message of a worker on."""
    match message:
        case (int(task), (float(now), float(whole))):
            watch.advanced(task, now, whole)
        case (int(task), str(why)):
            watch.failed(task, why)
        case (int(task), dict(record)):
            watch.done(task, record)
        case _:  # a worker died twice
            lost = set(message.trains)
            task = next(i for i, members in enumerate(watch.folder.design.tasks) if lost <= set(members))
            watch.failed(task, message.why)
