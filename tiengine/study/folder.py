"""Folder of a study: design, parts, records and log; whoever has it can continue, read or complete the study.

::

    study.json              the design, written once
    parts/00042.h5          result of task 42, as `tiengine run` writes it, with its checkpoint while it runs
    records/00042.json      what is known of task 42, written when it is complete; together, the index of the study
    log/HOST-1234.txt       what process 1234 did

A task is complete when its record exists. Records are put in place by an atomic rename after the part is complete, so
that a process that is killed at any instant leaves either none, and the part is continued, or all of it.
"""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import read_bytes
from tiengine.result_files.file_lock import acquire_lock, release_lock
from tiengine.result_files.journal import atomic_write
from tiengine.study.design import Design

__all__ = ["DESIGN", "Folder", "Status"]

DESIGN = "study.json"
STOP = "stop"
LARGEST_DESIGN = 1_000_000_000  # bytes
LARGEST_RECORD = 50_000_000  # bytes


@dataclass(frozen=True)
class Status:
    """How far a study is.

    Attributes:
        tasks, complete, running: Numbers of tasks.
        trains, done, failed: Numbers of trains; failed ones are among those done.
        wall: Wall time of the complete tasks together [s].
        recent: Tasks completed in the last ten minutes.
        size: Bytes of parts and records.
    """

    tasks: int
    complete: int
    running: int
    trains: int
    done: int
    failed: int
    wall: float
    recent: int
    size: int

    @property
    def finished(self) -> bool:
        """Whether all tasks are complete."""
        return self.complete == self.tasks

    def rows(self) -> list[tuple[str, str]]:
        """Descriptions and values."""
        each = self.wall / self.complete if self.complete else float("nan")
        return [
            ("tasks", f"{self.complete} of {self.tasks} complete, {self.running} running"),
            ("trains", f"{self.done} of {self.trains} done, {self.failed} failed"),
            ("wall time of a task", f"{each:.2f} s" if self.complete else "-"),
            ("completed in the last ten minutes", f"{self.recent} tasks"),
            ("size", f"{self.size / 1e6:.1f} MB"),
        ]


class Folder:
    """Folder of a study.

    Attributes:
        path: The folder.
    """

    def __init__(self, path: Path | str) -> None:
        """Name a folder; see :meth:`create` and :meth:`open`."""
        self.path = Path(path)
        self._design: Design | None = None

    def __reduce__(self) -> Any:
        """Send the path alone to another process, which reads the design itself."""
        return Folder, (self.path,)

    @classmethod
    def open(cls, path: Path | str) -> Folder:
        """Open the folder of a study.

        Args:
            path: The folder.

        Raises:
            InputError: It holds no study.
        """
        folder = cls(path)
        if not folder._file.is_file():
            raise InputError(f"{path}: no folder of a study (it holds no {DESIGN})")
        return folder

    @classmethod
    def create(cls, path: Path | str, design: Design, *, shared: bool = False) -> Folder:
        """Create a folder, or join one that holds the same study.

        Args:
            path: The folder.
            design: The study.
            shared: Whether the folder may hold this very study already.

        Raises:
            InputError: It holds another study, or other files, or cannot be written.
        """
        folder = cls(path)
        try:
            if folder.path.is_dir() and any(folder.path.iterdir()) and not folder._file.exists() and not shared:
                raise InputError(f"output = '{path}': holds other files; a study needs a new or an empty folder")
            folder.path.mkdir(exist_ok=True)
            for each in ("parts", "records", "log"):
                (folder.path / each).mkdir(exist_ok=True)
        except OSError as error:
            raise InputError(f"output = '{path}': cannot be written ({error.strerror or error})") from None
        if folder._file.exists():
            if folder.design.digest != design.digest:
                raise InputError(f"output = '{path}': holds another study; choose another folder")
            if not shared:
                raise InputError(
                    f"output = '{path}': holds this study already; continue it with `tiengine study resume {path}`"
                )
            return folder
        try:
            atomic_write(folder._file, json.dumps(design.tables()).encode())
        except OSError as error:
            raise InputError(f"output = '{path}': cannot be written ({error.strerror or error})") from None
        return folder

    @property
    def design(self) -> Design:
        """The study, read once."""
        if self._design is None:
            text = read_bytes(self._file, str(self._file), LARGEST_DESIGN)
            try:
                tables = json.loads(text)
            except ValueError as error:
                raise InputError(f"{self._file}: damaged ({error})") from None
            self._design = Design.from_tables(tables, str(self._file))
        return self._design

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Hold the folder: only one process may lead a study.

        Raises:
            InputError: Another process leads it.
        """
        try:
            lock = acquire_lock(self.path / "study")
        except InputError as error:
            if "another run" in str(error):
                raise InputError(f"output = '{self.path}': another study runs in this folder") from None
            raise
        try:
            yield
        finally:
            release_lock(lock)

    def part(self, task: int) -> Path:
        """Path of the result of a task.

        Args:
            task: Its number.
        """
        return self.path / "parts" / f"{task:05d}.h5"

    def record(self, task: int) -> dict[str, Any] | None:
        """Record of a task; None if it is not complete.

        Args:
            task: Its number.
        """
        path = self._record(task)
        if not path.exists():
            return None
        try:
            found: dict[str, Any] = json.loads(read_bytes(path, str(path), LARGEST_RECORD))
        except ValueError as error:
            raise InputError(f"{path}: damaged ({error}); remove it to evaluate the task again") from None
        return found

    def records(self) -> Iterator[dict[str, Any]]:
        """Records of all complete tasks, in their order."""
        for task in sorted(self.complete()):
            if (record := self.record(task)) is not None:
                yield record

    def keep(self, record: dict[str, Any]) -> None:
        """Put the record of a complete task in place.

        Args:
            record: Has its number under ``task``.

        Raises:
            InputError: The disk is full or has failed.
        """
        path = self._record(record["task"])
        try:
            atomic_write(path, json.dumps(record).encode())
        except OSError as error:
            raise InputError(f"output = '{path}': cannot be written ({error.strerror or error})") from None

    def drop(self, task: int) -> None:
        """Remove the record of a task, after its part was sent to another folder.

        Args:
            task: Its number.
        """
        self._record(task).unlink(missing_ok=True)

    def ask_to_stop(self) -> None:
        """Ask processes elsewhere to save their trains and end."""
        (self.path / STOP).touch()

    def allow(self) -> None:
        """Withdraw an earlier request to stop."""
        (self.path / STOP).unlink(missing_ok=True)

    def asked_to_stop(self) -> bool:
        """Whether processes elsewhere shall end."""
        return (self.path / STOP).exists()

    def complete(self) -> set[int]:
        """Numbers of the complete tasks."""
        return {
            int(name[:-5]) for name in os.listdir(self.path / "records") if name.endswith(".json") and name[0] != "."
        }

    def left(self) -> list[int]:
        """Numbers of the tasks that are not complete."""
        complete = self.complete()
        return [task for task in range(len(self.design.tasks)) if task not in complete]

    def status(self) -> Status:
        """Count what is complete; needs no lock, so that it can be asked at any time, from anywhere."""
        began, done, failed, wall, recent = time.time() - 600.0, 0, 0, 0.0, 0
        for record in self.records():
            done += len(record["trains"])
            failed += sum(train["status"] != "complete" for train in record["trains"])
            wall += record["wall"]
            recent += record["ended"] > began
        complete = self.complete()
        running = sum(self._is_written(task, began) for task in self.left())
        size = sum(each.stat().st_size for kind in ("parts", "records") for each in os.scandir(self.path / kind))
        tasks = self.design.tasks
        return Status(len(tasks), len(complete), running, sum(map(len, tasks)), done, failed, wall, recent, size)

    def _is_written(self, task: int, since: float) -> bool:
        """Whether an incomplete part was written since an instant [s]; a lock alone may be that of a killed process."""
        path = self.part(task)
        lock = path.with_name(f".{path.name}.lock")
        try:
            return lock.exists() and max(lock.stat().st_mtime, path.stat().st_mtime) > since
        except OSError:  # just removed, or not begun
            return False

    def log(self, words: str) -> None:
        """Add a line to the log of this process.

        Args:
            words: What happened.
        """
        path = self.path / "log" / f"{socket.gethostname()}-{os.getpid()}.txt"
        with path.open("a", encoding="utf-8") as file:
            file.write(f"{time.strftime('%Y-%m-%d %H:%M:%S')}  {' '.join(words.split())}\n")

    @property
    def _file(self) -> Path:
        return self.path / DESIGN

    def _record(self, task: int) -> Path:
        return self.path / "records" / f"{task:05d}.json"
