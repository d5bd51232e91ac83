"""Tasks of a study on Dask: single-threaded workers that take one task at a time, on any number of machines.

Where all workers see the folder, they write their parts into it, and a task whose worker is lost is continued by
another from its checkpoint. Otherwise each worker computes in its own folder and sends the part back when it is
complete; a task whose worker is lost then starts again. Dask itself notices lost workers and gives their tasks to
others.
"""

from __future__ import annotations

import hashlib
import queue
import sys
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tiengine.parameters.errors import InputError, RunStoppedError
from tiengine.parameters.optional_packages import needed_by
from tiengine.result_files.checkpoint import MAKERS
from tiengine.result_files.journal import atomic_write
from tiengine.study.folder import Folder
from tiengine.study.watch import Watch
from tiengine.study.work import Work, do_task

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Dask"]

CONNECT = 8.0  # s to reach a scheduler
POLL = 0.5  # s between two looks at a request to stop
TELL = 2.0  # s between two messages of progress of a task

LOCAL = "local"


@dataclass(frozen=True)
class Dask:
    """Dask as the place of a study.

    Attributes:
        address: Address of a scheduler such as ``tcp://10.0.0.1:8786``; ``"local"`` starts workers on this machine.
        workers: Number of workers that are started for ``"local"``; None takes one per core.
        attempts: Times that workers may be lost with the same task before it counts as failed.
    """

    address: str = LOCAL
    workers: int | None = None
    attempts: int = 3

    def run(self, folder: Folder, tasks: Sequence[int], work: Work, watch: Watch) -> None:
        """Complete tasks.

        Args:
            folder: Folder of the study.
            tasks: Numbers of the tasks.
            work: Settings.
            watch: Is told what happens.

        Raises:
            InputError: dask.distributed is missing, the scheduler cannot be reached, or workers do not fit.
        """
        with self._client() as client:
            _wait_for_workers(client, watch)
            if watch.stop():
                return
            _check_workers(client, watch)
            shared = _see(client, folder)
            if not shared:
                watch.notify(
                    "not all workers see the folder of the study: their parts are sent back when they are complete; a"
                    " task whose worker is lost starts again"
                )
            _Leader(client, folder, work, watch, shared, self.attempts).run(tasks)

    @contextmanager
    def _client(self) -> Iterator[Client]:
        """Connect to a scheduler, or start one with its workers."""
        with needed_by("--dask"):
            import distributed
        if self.address == LOCAL:
            from tiengine.simulation.simulate import cores

            count = min(self.workers or cores(), 1000)
            with (
                distributed.LocalCluster(
                    n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
                ) as cluster,
                distributed.Client(cluster, set_as_default=False) as client,
            ):
                yield client
            return
        try:
            client = distributed.Client(self.address, timeout=CONNECT, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(f"--dask {self.address}: no scheduler can be reached there ({_line(error)})") from None
        with client:
            yield client


@dataclass(eq=False)
class _Leader:
    """Leader of a study on a scheduler."""

    client: Client
    folder: Folder
    work: Work
    watch: Watch
    shared: bool
    attempts: int

    def run(self, tasks: Sequence[int]) -> None:
        """Hand tasks out and take their records."""
        arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()
        topic = f"tiengine-{uuid.uuid4().hex[:12]}"
        self.client.subscribe_topic(topic, lambda event: arrived.put(event[1]))
        self.folder.allow()
        common, along = self._common(topic)
        futures = {}
        for task in tasks:
            future = self.client.submit(common, task, key=f"{topic}-{task}", pure=False, **along)
            future.add_done_callback(partial(_arrive, arrived, task))
            futures[task] = future
        try:
            self._take(arrived, futures)
        finally:
            with suppress(Exception):  # the scheduler may be gone
                self.client.cancel(list(futures.values()))
                self.client.unsubscribe_topic(topic)

    def _common(self, topic: str) -> tuple[Callable[[int], Any], dict[str, Any]]:
        """Function of a task's number that workers call, and what is sent to each of them once."""
        if self.shared:
            return partial(_in_folder, str(self.folder.path.resolve()), self.work, topic), {}
        design = self.client.scatter(self.folder.design, broadcast=True, hash=False)
        return partial(_sent_back, self.folder.design.digest[:16], self.work, topic), {"design": design}

    def _take(self, arrived: queue.SimpleQueue[Any], futures: dict[int, Any]) -> None:
        """Take what arrives until all tasks have ended, or a stop is requested."""
        stopping = False
        while futures:
            if self.watch.stop() and not stopping:
                stopping = True
                self.folder.ask_to_stop()
                running = {key for keys in self.client.processing().values() for key in keys}
                self.client.cancel([each for each in futures.values() if each.key not in running])
                if not self.shared:
                    return
            try:
                message = arrived.get(timeout=POLL)
            except queue.Empty:
                if self.client.status not in ("running", "connecting"):
                    raise InputError("--dask: the scheduler is gone; resume the study when it is back") from None
                continue
            match message:
                case (int(task), (float(now), float(whole))):
                    self.watch.advanced(task, now, whole)
                case int(task):
                    self._end(task, futures.pop(task))

    def _end(self, task: int, future: Any) -> None:
        """Take the record of a task that has ended, or the reason why it has not."""
        if future.cancelled():
            return
        error = future.exception()
        if error is None:
            record, part = future.result()
            if part is not None:
                if part:
                    atomic_write(self.folder.part(task), part)
                self.folder.keep(record)
            self.watch.done(task, record)
        elif not isinstance(error, RunStoppedError):
            self.watch.failed(task, _line(error))
        future.release()


def _arrive(arrived: queue.SimpleQueue[Any], task: int, future: Any) -> None:
    arrived.put(task)


def _in_folder(path: str, work: Work, topic: str, task: int) -> tuple[dict[str, Any], None]:
    """Do a task in the folder of the study, which this worker sees."""
    folder = _opened(path)
    record = do_task(folder, task, work, progress=_teller(topic, task), stop=folder.asked_to_stop)
    return record, None


def _sent_back(digest: str, work: Work, topic: str, task: int, *, design: Any) -> tuple[dict[str, Any], bytes | None]:
    """Do a task in a folder of this worker, and return its record and its part."""
    from distributed import get_worker

    path = Path(get_worker().local_directory) / f"tiengine-{digest}"
    if str(path) not in _folders:
        _folders[str(path)] = Folder.create(path, design, shared=True)
    folder = _folders[str(path)]
    record = do_task(folder, task, work, progress=_teller(topic, task))
    part = folder.part(task)
    content = part.read_bytes() if part.exists() else None
    part.unlink(missing_ok=True)
    folder.drop(task)
    return record, content if content is not None else b""


_folders: dict[str, Folder] = {}


def _opened(path: str) -> Folder:
    """Folder of a study, whose design a worker reads once."""
    if path not in _folders:
        _folders[path] = Folder.open(path)
    return _folders[path]


def _teller(topic: str, task: int) -> Callable[[float, float], None]:
    """Progress of a task as events of the scheduler, at most one in some seconds."""
    from distributed import get_worker

    worker, last = get_worker(), 0.0

    def tell(now: float, whole: float) -> None:
        nonlocal last
        if time.monotonic() - last >= TELL:
            last = time.monotonic()
            with suppress(Exception):  # the scheduler may be out of reach; the task goes on
                worker.log_event(topic, (task, (now, whole)))

    return tell


def _wait_for_workers(client: Client, watch: Watch) -> None:
    """Wait until there is a worker."""
    said = False
    while not client.scheduler_info(n_workers=-1)["workers"] and not watch.stop():
        if not said:
            watch.notify("the scheduler has no workers yet; waiting for the first")
            said = True
        time.sleep(POLL)


def _check_workers(client: Client, watch: Watch) -> None:
    """Refuse workers with several threads or with another version of this program.

    Raises:
        InputError: The first worker that does not fit, by its address.
    """
    for address, facts in client.scheduler_info(n_workers=-1)["workers"].items():
        if facts["nthreads"] != 1:
            raise InputError(
                f"--dask: worker {address} has {facts['nthreads']} threads; must have one:"
                " dask worker --nthreads 1 --nworkers N"
            )
    own = {name: metadata.version(name) for name in MAKERS} | {"python": sys.version.split()[0]}
    for address, theirs in client.run(_versions(), own).items():
        if theirs.get("tiengine") != own["tiengine"]:
            found = theirs.get("tiengine") or "none"
            raise InputError(f"--dask: worker {address} has tiengine {found}; must be {own['tiengine']} as here")
        if others := [f"{name} {theirs[name]}" for name in MAKERS if theirs[name] != own[name]]:
            watch.notify(f"worker {address} has {', '.join(others)}: bits may differ from those computed here")


def _versions() -> Callable[[Mapping[str, str]], dict[str, str | None]]:
    """Function that finds versions on a worker; it is sent as code, since a worker may lack this program."""

    def versions(names: Mapping[str, str]) -> dict[str, str | None]:
        from importlib.metadata import PackageNotFoundError, version

        found: dict[str, str | None] = {}
        for name in names:
            try:
                found[name] = version(name)
            except PackageNotFoundError:
                found[name] = None
        return found

    return versions


def _see(client: Client, folder: Folder) -> bool:
    """Whether all workers see the folder of the study with the same contents."""
    file = folder.path.resolve() / "study.json"
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    return all(found == digest for found in client.run(_digest, str(file)).values())


def _digest(path: str) -> str | None:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return None


def _line(error: BaseException) -> str:
    """Error as one line."""
    return " ".join(str(error).split())[:300] or type(error).__name__
