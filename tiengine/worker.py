"""Worker processes: tasks go out, messages come back, each over a pipe of its worker's own.

A pipe holds a few kilobytes, so that a worker waits until the parent has taken a block: a slow disk fills no memory.
Nothing is shared between workers, so that one that dies (killed, out of memory) harms its own trains only; another
takes its place for the tasks that are left. Processes are spawned: a fork would inherit Taichi's threads half alive.
All of them compile at once when Taichi's cache is cold; on a core each that takes no longer than compiling first.
This module itself imports nothing of Taichi, whose banner the worker first turns off.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import TYPE_CHECKING, cast

from threadpoolctl import threadpool_limits

if TYPE_CHECKING:
    from tiengine.march import Message
    from tiengine.plan import Task

__all__ = ["distribute"]

PATIENCE = 10.0  # s for a worker to leave by itself: it writes Taichi's cache

IDLE = "idle"
"""What a worker says when it is ready for a task; everything else that it sends is a message of its trains."""


def work(pipe: Connection, public: bool) -> None:
    """What a worker process does, until it is sent None or its parent is gone.

    Args:
        pipe: To the parent.
        public: Public Taichi calls only.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the parent, which ends its workers
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
    from tiengine.march import march

    try:
        with threadpool_limits(1):
            pipe.send(IDLE)
            while (task := pipe.recv()) is not None:
                for message in march(task, public=public):
                    pipe.send(message)
                pipe.send(IDLE)
    except (EOFError, ConnectionError):  # the parent is gone
        return


@dataclass(eq=False)
class _Worker:
    """A worker as its parent sees it."""

    process: SpawnProcess
    task: Task | None = None
    greeted: bool = False


def distribute(tasks: Sequence[Task], workers: int, *, public: bool = False) -> Iterator[Message]:
    """Run tasks in worker processes.

    Args:
        tasks: What to do; each goes to the first worker that is free.
        workers: Processes.
        public: Public Taichi calls only.

    Yields:
        Messages of all trains, as they come.

    Raises:
        RunFailedError: A worker died before it could take a task.
    """
    waiting = deque(tasks)
    crew: dict[Connection, _Worker] = {}
    leaving: list[_Worker] = []
    try:
        while waiting or crew:
            busy = sum(worker.task is not None for worker in crew.values())
            while len(crew) < min(workers, busy + len(waiting)):
                _hire(crew, public)
            for ready in wait(list(crew)):
                pipe = cast("Connection", ready)
                worker = crew[pipe]
                try:
                    message = pipe.recv()
                except (EOFError, OSError):
                    yield from _bury(crew.pop(pipe))
                    continue
                if message != IDLE:
                    yield message
                    continue
                worker.task, worker.greeted = waiting.popleft() if waiting else None, True
                if not _assigned(pipe, worker.task):
                    yield from _bury(crew.pop(pipe))
                elif worker.task is None:
                    leaving.append(crew.pop(pipe))
    except BaseException:
        for worker in (*crew.values(), *leaving):
            worker.process.terminate()
        raise
    finally:
        _see_off([*crew.values(), *leaving])


def _hire(crew: dict[Connection, _Worker], public: bool) -> None:
    """Start a worker."""
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=work, args=(theirs, public), daemon=True, name=f"tiengine-{len(crew)}")
    with _ctrl_c_ignored():
        process.start()
    theirs.close()  # so that its death ends the pipe
    crew[ours] = _Worker(process)


@contextmanager
def _ctrl_c_ignored() -> Iterator[None]:
    """For processes that start in here: they inherit it, and a Ctrl-C while they import leaves no traceback."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


def _assigned(pipe: Connection, task: Task | None) -> bool:
    """Send a task, or None to let the worker go; False if it has died."""
    try:
        pipe.send(task)
    except OSError:
        return False
    return True


def _bury(worker: _Worker) -> Iterator[Message]:
    """Say what becomes of a dead worker's trains."""
    from tiengine.events import RunFailedError
    from tiengine.march import Lost

    worker.process.join()
    code = worker.process.exitcode or 0
    reason = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"
    if not worker.greeted:
        raise RunFailedError(
            f"a worker process died before it began ({reason}); a script that runs an ensemble must do so under"
            " if __name__ == '__main__', or with workers=1"
        )
    if worker.task is not None:
        yield Lost(worker.task.trains, f"worker died ({reason})")


def _see_off(workers: Sequence[_Worker]) -> None:
    """Wait until workers have left; end those that do not."""
    deadline = time.monotonic() + PATIENCE
    for worker in workers:
        worker.process.join(max(deadline - time.monotonic(), 0.0))
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
