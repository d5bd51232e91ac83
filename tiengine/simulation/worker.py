"""Worker processes: tasks go out, messages come back, each over a pipe of its worker's own.

A pipe holds a few kilobytes, so that a worker waits until the parent has taken a block: a slow disk fills no memory.
Nothing is shared between workers, so that one that dies (killed, out of memory) harms its own trains only; another
takes its place, and begins them again from their last checkpoint, once. Processes are spawned: a fork would inherit
Taichi's threads half alive. All of them compile at once when Taichi's cache is cold; on a core each that takes no
longer than compiling first. This module itself imports nothing of Taichi, whose banner the worker first turns off.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import TYPE_CHECKING, cast

from threadpoolctl import threadpool_limits

if TYPE_CHECKING:
    from tiengine.result_files.checkpoint import Checkpoint
    from tiengine.simulation.messages import Message
    from tiengine.simulation.tasks import Task

__all__ = ["distribute"]

PATIENCE = 10.0  # s for a worker to leave by itself: it writes Taichi's cache

IDLE = "idle"
"""What a worker says when it is ready for a task; everything else that it sends is a message of its trains."""

STOP = "stop"
"""What a worker is told while it works, to save its trains and leave."""

LOOK = 0.2  # s between two looks for whether to stop

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that concern the parent alone, whoever else they are sent to."""

RESTARTS = 1
"""How often the trains of a worker that died are begun again, from their checkpoint if there is one."""


def work(pipe: Connection, public: bool, every: float) -> None:
    """What a worker process does, until it is sent None or its parent is gone.

    Args:
        pipe: To the parent.
        public: Public Taichi calls only.
        every: Wall time between two checkpoints [s].
    """
    for number in SIGNALS:  # to the whole group of processes: the parent tells its workers to save and leave
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_leave_with_parent, daemon=True).start()
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
    from tiengine.simulation.time_loop import march

    try:
        with threadpool_limits(1):
            pipe.send(IDLE)
            while (given := pipe.recv()) not in (None, STOP):
                task, saved = given
                for message in march(task, public=public, saved=saved, every=every, stop=pipe.poll):
                    pipe.send(message)
                pipe.send(IDLE)
    except (EOFError, ConnectionError):  # the parent is gone
        return


def _leave_with_parent() -> None:
    """End at once if the parent dies: the pipe would tell only after compiling, or a chunk of steps."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@dataclass(eq=False)
class _Worker:
    """A worker as its parent sees it."""

    process: SpawnProcess
    task: Task | None = None
    greeted: bool = False
    told: bool = False


def distribute(
    tasks: Sequence[Task],
    workers: int,
    latest: Mapping[int, Checkpoint],
    *,
    public: bool = False,
    every: float = math.inf,
    stop: Callable[[], bool] = lambda: False,
    tell: Callable[[str], None] = lambda words: None,
) -> Iterator[Message]:
    """Run tasks in worker processes.

    Args:
        tasks: What to do; each goes to the first worker that is free.
        workers: Processes.
        latest: Last checkpoint of each task by its number, kept by whoever takes the messages.
        public: Public Taichi calls only.
        every: Wall time between two checkpoints [s].
        stop: Asked now and then; if true, all trains are saved and left.
        tell: Called with a sentence for each worker that dies and whose trains are begun again.

    Yields:
        Messages of all trains, as they come.

    Raises:
        RunFailedError: A worker died before it could take a task.
    """
    from tiengine.simulation.messages import Lost

    waiting = deque(tasks)
    deaths: Counter[int] = Counter()
    early = 0
    crew: dict[Connection, _Worker] = {}
    leaving: list[_Worker] = []
    try:
        while waiting or crew:
            busy = sum(worker.task is not None for worker in crew.values())
            while len(crew) < min(workers, busy + len(waiting)):
                _hire(crew, public, every)
            if stop():
                waiting.clear()
                _tell_to_stop(crew)
            for ready in wait(list(crew), LOOK):
                pipe = cast("Connection", ready)
                worker = crew[pipe]
                try:
                    message = pipe.recv()
                except (EOFError, OSError):
                    dead = crew.pop(pipe)
                    early += not dead.greeted
                    why = _cause_of_death(dead, early <= RESTARTS * workers)
                    if dead.task is None:  # another is hired for what waits
                        continue
                    deaths[dead.task.number] += 1
                    if deaths[dead.task.number] > RESTARTS:
                        yield Lost(dead.task.trains, f"worker died twice ({why})")
                    elif not stop():
                        waiting.appendleft(dead.task)
                        tell(f"a worker died ({why}); its {len(dead.task.trains)} trains are begun again")
                    continue
                if message != IDLE:
                    yield message
                    continue
                worker.task, worker.greeted = waiting.popleft() if waiting else None, True
                _assign(pipe, worker.task, latest)
                if worker.task is None:
                    leaving.append(crew.pop(pipe))
    except BaseException:
        for worker in (*crew.values(), *leaving):
            worker.process.kill()  # they heed no milder signal, and own no file
        raise
    finally:
        _see_off([*crew.values(), *leaving])


def _hire(crew: dict[Connection, _Worker], public: bool, every: float) -> None:
    """Start a worker."""
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=work, args=(theirs, public, every), daemon=True, name=f"tiengine-{len(crew)}")
    with _signals_ignored():
        process.start()
    theirs.close()  # so that its death ends the pipe
    crew[ours] = _Worker(process)


@contextmanager
def _signals_ignored() -> Iterator[None]:
    """For processes that start in here: they inherit it, and a Ctrl-C while they import leaves no traceback."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {number: signal.signal(number, signal.SIG_IGN) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _assign(pipe: Connection, task: Task | None, latest: Mapping[int, Checkpoint]) -> None:
    """Send a task with its checkpoint, or None to let the worker go; one that has died is found by its pipe."""
    with suppress(OSError):
        pipe.send(None if task is None else (task, latest.get(task.number)))


def _tell_to_stop(crew: Mapping[Connection, _Worker]) -> None:
    """Tell those at work, once."""
    for pipe, worker in crew.items():
        if worker.task is not None and not worker.told:
            worker.told = True
            with suppress(OSError):
                pipe.send(STOP)


def _cause_of_death(worker: _Worker, excusable: bool) -> str:
    """Why a worker died.

    Args:
        worker: Is dead.
        excusable: Whether it may have been killed before it could take a task.

    Raises:
        RunFailedError: It died before it could take a task, by itself or once too often.
    """
    from tiengine.parameters.errors import RunFailedError

    worker.process.join()
    code = worker.process.exitcode or 0
    reason = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"
    if not worker.greeted and not (excusable and code < 0):
        raise RunFailedError(
            f"a worker process died before it began ({reason}); a script that runs an ensemble must do so under"
            " if __name__ == '__main__', or with workers=1"
        )
    return reason


def _see_off(workers: Sequence[_Worker]) -> None:
    """Wait until workers have left; end those that do not."""
    deadline = time.monotonic() + PATIENCE
    for worker in workers:
        worker.process.join(max(deadline - time.monotonic(), 0.0))
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
