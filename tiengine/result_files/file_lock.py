"""Lock of a result file: one writer at a time, and clean-up after writers that were killed.

A writer holds a lock file next to the result file; the system releases the lock when the process ends. The holder of
the lock may complete an interrupted commit and remove temporary files.
"""

from __future__ import annotations

import re
import time
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from tiengine.parameters.errors import InputError
from tiengine.result_files.journal import journal_of, recover

__all__ = ["acquire_lock", "complete_commit", "release_lock", "remove_temporary_files"]

PATIENCE = 2.0
"""Time for which a reader waits for a commit in progress [s]; a commit takes about 20 ms."""


def acquire_lock(path: Path) -> FileLock:
    """Acquire the lock of a result file.

    Args:
        path: Result file.

    Raises:
        InputError: Another run holds the lock, or the folder is not writable.
    """
    lock = _lock_of(path)
    try:
        lock.acquire()
    except Timeout:
        if not Path(lock.lock_file).exists():  # filelock also times out in /proc, for example
            raise InputError(f"output = '{path}': cannot be written (no lock file can be created next to it)") from None
        raise InputError(f"output = '{path}': another run is writing it") from None
    except OSError as error:
        raise InputError(f"output = '{path}': cannot be written ({error})") from None
    return lock


def release_lock(lock: FileLock | None) -> None:
    """Release a lock and remove its file.

    Args:
        lock: Lock from :func:`acquire_lock`, or None.
    """
    if lock is not None:
        with suppress(OSError):
            Path(lock.lock_file).unlink(missing_ok=True)
        lock.release()


def complete_commit(path: Path) -> None:
    """Bring a file to its last commit before it is read: complete that of a killed writer, or wait for a live one.

    Args:
        path: Result file; left as it is if the folder is not writable.
    """
    deadline = time.monotonic() + PATIENCE
    while journal_of(path).exists() and time.monotonic() < deadline:
        lock = _lock_of(path)
        try:
            lock.acquire()
        except Timeout:  # a commit is in progress
            time.sleep(0.01)
            continue
        except OSError:
            return
        try:
            with suppress(OSError):
                recover(path)
            return
        finally:
            release_lock(lock)


def remove_temporary_files(path: Path) -> None:
    """Remove temporary files of killed writers; the caller must hold the lock.

    Args:
        path: Result file.
    """
    name = re.escape(path.name)
    part = re.compile(rf"\.({name}|{name}\.journal|\.{name}\.\d+\.checkpoint)\.\d+\.part")
    for each in path.parent.iterdir():
        if part.fullmatch(each.name):
            with suppress(OSError):
                each.unlink()


def _lock_of(path: Path) -> FileLock:
    return FileLock(path.with_name(f".{path.name}.lock"), timeout=0)
