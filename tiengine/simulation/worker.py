"""Worker processes: each receives tasks and sends messages over a pipe of its own.

A pipe holds a few kilobytes, so that a worker waits until the parent has taken a block: with a slow disk no memory
fills up. Nothing is shared between workers, so that one that dies (killed, out of memory) harms its own trains only;
another takes its place, and starts them once more from their last checkpoint. Processes are spawned: a fork would
inherit Taichi's threads in an undefined state. All of them compile at once when Taichi's cache is cold; with a core
each this takes no longer than compiling first. This module itself imports no Taichi, whose banner the worker first
turns off.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import TYPE_CHECKING, Any, Protocol, cast

from threadpoolctl import threadpool_limits

if TYPE_CHECKING:
    from tiengine.result_files.checkpoint import Checkpoint
    from tiengine.simulation.tasks import Task

__all__ = ["Runner", "Work", "distribute", "send_task"]

PATIENCE = 10.0  # s for a worker to exit by itself: it writes Taichi's cache

IDLE = "idle"
"""Sent by a worker that is ready for a task; everything else that it sends is a message of its trains."""

STOP = "stop"
"""Sent to a worker while it works: save the trains and exit."""

POLL = 0.2  # s between two calls of ``stop``

SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that only the parent handles, also where they are sent to the whole group of processes."""

RESTARTS = 1
"""Number of times that the trains of a dead worker are started again, from their checkpoint if there is one."""


class Work(Protocol):
    """Task as this module sees it.

    Attributes:
        number: Number of the task.
        trains: Numbers of its trains.
    """

    @property
    def number(self) -> int: ...  # noqa: D102

    @property
    def trains(self) -> tuple[int, ...]: ...  # noqa: D102


Runner = Callable[[Any, "Checkpoint | None", Callable[[], bool], Callable[[Any], None]], None]
"""Function that does a task in a worker: task, its checkpoint, ``stop``, and where to send messages."""


def work(pipe: Connection, run: Runner) -> None:
    """Main function of a worker process; it ends when None is received or the parent is gone.

    Args:
        pipe: Connection to the parent.
        run: Does a task.
    """
    for number in SIGNALS:  # the parent itself sends its workers STOP
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_exit_with_parent, daemon=True).start()
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
    try:
        pipe.send(IDLE)
        while (received := pipe.recv()) not in (None, STOP):
            task, saved = received
            run(task, saved, pipe.poll, pipe.send)
            pipe.send(IDLE)
    except (EOFError, ConnectionError):  # the parent is gone
        return


def send_task(
    task: Task,
    saved: Checkpoint | None,
    stop: Callable[[], bool],
    send: Callable[[Any], None],
    *,
    public: bool,
    every: float,
) -> None:
    """Send the messages of a task of trains.

    Args:
        task: The trains.
        saved: Checkpoint to continue from; None starts at t = 0.
        stop: Called after every chunk of steps; if true, the trains are saved and left.
        send: Called with every message.
        public: Launch kernels by public Taichi calls only.
        every: Wall time between two checkpoints [s].
    """
    from tiengine.simulation.stream import run_task

    with threadpool_limits(1):  # of the libraries that are loaded by now: the engine has loaded all of them
        for message in run_task(task, public=public, saved=saved, every=every, stop=stop):
            send(message)


def _exit_with_parent() -> None:
    """End at once if the parent dies: the pipe would show it only after compiling, or after a chunk of steps."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


@dataclass(eq=False)
class _Worker:
    """A worker as its parent sees it."""

    process: SpawnProcess
    task: Work | None = None
    ready: bool = False
    stopping: bool = False


def distribute(
    tasks: Sequence[Work],
    workers: int,
    latest: Mapping[int, Checkpoint],
    *,
    run: Runner,
    stop: Callable[[], bool] = lambda: False,
    notify: Callable[[str], None] = lambda words: None,
) -> Generator[Any, None, None]:
    """Run tasks in worker processes.

    Args:
        tasks: Tasks; each goes to the first worker that is free.
        workers: Processes.
        latest: Last checkpoint of each task by its number, kept by the receiver of the messages.
        run: Does a task in a worker; must be picklable without importing Taichi.
        stop: Called several times a second; if true, all trains are saved and the workers exit.
        notify: Called with a sentence for each worker that dies and whose trains are started again.

    Yields:
        Messages of all trains in the order of arrival.

    Raises:
        RunFailedError: A worker died before it could take a task.
    """
    from tiengine.simulation.messages import Lost

    waiting = deque(tasks)
    deaths: Counter[int] = Counter()
    early = 0
    active: dict[Connection, _Worker] = {}
    leaving: list[_Worker] = []
    try:
        while waiting or active:
            busy = sum(worker.task is not None for worker in active.values())
            while len(active) < min(workers, busy + len(waiting)):
                _start_worker(active, run)
            if stop():
                waiting.clear()
                _send_stop(active)
            for ready in wait(list(active), POLL):
                pipe = cast("Connection", ready)
                worker = active[pipe]
                try:
                    message = pipe.recv()
                except (EOFError, OSError):
                    dead = active.pop(pipe)
                    early += not dead.ready
                    why = _cause_of_death(dead, early <= RESTARTS * workers)
                    if dead.task is None:  # another is started for the waiting tasks
                        continue
                    deaths[dead.task.number] += 1
                    if deaths[dead.task.number] > RESTARTS:
                        yield Lost(dead.task.trains, f"worker died twice ({why})")
                    elif not stop():
                        waiting.appendleft(dead.task)
                        notify(f"a worker died ({why}); its {len(dead.task.trains)} trains are started again")
                    continue
                if message != IDLE:
                    yield message
                    continue
                worker.task, worker.ready = waiting.popleft() if waiting else None, True
                _assign(pipe, worker.task, latest)
                if worker.task is None:
                    leaving.append(active.pop(pipe))
    except BaseException:
        for worker in (*active.values(), *leaving):
            worker.process.kill()  # they ignore milder signals, and own no file
        raise
    finally:
        _wait_for_exit([*active.values(), *leaving])


def _start_worker(active: dict[Connection, _Worker], run: Runner) -> None:
    """Start a worker."""
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=work, args=(theirs, run), daemon=True, name=f"tiengine-{len(active)}")
    with _signals_ignored():
        process.start()
    theirs.close()  # so that its death ends the pipe
    active[ours] = _Worker(process)


@contextmanager
def _signals_ignored() -> Iterator[None]:
    """Ignore signals in processes that start within: a Ctrl-C while they import leaves no traceback."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {number: signal.signal(number, signal.SIG_IGN) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _assign(pipe: Connection, task: Work | None, latest: Mapping[int, Checkpoint]) -> None:
    """Send a task with its checkpoint, or None to end the worker; one that has died shows at its pipe."""
    with suppress(OSError):
        pipe.send(None if task is None else (task, latest.get(task.number)))


def _send_stop(active: Mapping[Connection, _Worker]) -> None:
    """Send STOP to the workers that have a task, once."""
    for pipe, worker in active.items():
        if worker.task is not None and not worker.stopping:
            worker.stopping = True
            with suppress(OSError):
                pipe.send(STOP)


def _cause_of_death(worker: _Worker, excusable: bool) -> str:
    """Why a worker died.

    Args:
        worker: A worker whose pipe is closed.
        excusable: Whether it may have been killed before it could take a task.

    Raises:
        RunFailedError: It died before it could take a task, by itself or too often.
    """
    from tiengine.parameters.errors import RunFailedError

    worker.process.join()
    code = worker.process.exitcode or 0
    reason = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit status {code}"
    if not worker.ready and not (excusable and code < 0):
        raise RunFailedError(
            f"a worker process died before it began ({reason}); a script that runs an ensemble must do so under"
            " if __name__ == '__main__', or with workers=1"
        )
    return reason


def _wait_for_exit(workers: Sequence[_Worker]) -> None:
    """Wait until workers have exited; kill those that do not."""
    deadline = time.monotonic() + PATIENCE
    for worker in workers:
        worker.process.join(max(deadline - time.monotonic(), 0.0))
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()
