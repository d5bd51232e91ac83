"""One writer at a time for a result file, and what a writer that died has left beside it.

A writer holds a lock beside the file, which the system frees when the process dies. Whoever holds it may complete a
commit that a crash interrupted and remove temporary files.
"""

from __future__ import annotations

import re
import time
from contextlib import suppress
from pathlib import Path

from filelock import FileLock, Timeout

from tiengine.parameters.errors import InputError
from tiengine.result_files.journal import journal_of, recover

__all__ = ["locked", "release", "settle", "sweep"]

PATIENCE = 2.0
"""How long a reader waits for a commit under way [s]; it takes some 20 ms."""


def locked(path: Path) -> FileLock:
    """The lock on a result.

    Args:
        path: The result.

    Raises:
        InputError: Another run holds it, or the folder cannot be written to.
    """
    lock = _lock_of(path)
    try:
        lock.acquire()
    except Timeout:
        if not Path(lock.lock_file).exists():  # filelock tries again where nothing can be made, /proc for example
            raise InputError(f"output = '{path}': cannot be written (no lock can be made beside it)") from None
        raise InputError(f"output = '{path}': another run is writing it") from None
    except OSError as error:
        raise InputError(f"output = '{path}': cannot be written ({error})") from None
    return lock


def release(lock: FileLock | None) -> None:
    """Let others write, and leave no lock file behind.

    Args:
        lock: As from :func:`locked`; None does nothing.
    """
    if lock is not None:
        with suppress(OSError):
            Path(lock.lock_file).unlink(missing_ok=True)
        lock.release()


def settle(path: Path) -> None:
    """Bring a file that is about to be read to its last commit: complete it if its writer died, else wait for it.

    Args:
        path: The result; nothing happens where the folder cannot be written to.
    """
    deadline = time.monotonic() + PATIENCE
    while journal_of(path).exists() and time.monotonic() < deadline:
        lock = _lock_of(path)
        try:
            lock.acquire()
        except Timeout:  # a commit is under way
            time.sleep(0.01)
            continue
        except OSError:
            return
        try:
            with suppress(OSError):
                recover(path)
            return
        finally:
            release(lock)


def sweep(path: Path) -> None:
    """Remove temporary files of writers that died. Only for who holds the lock.

    Args:
        path: The result.
    """
    name = re.escape(path.name)
    part = re.compile(rf"\.({name}|{name}\.journal|\.{name}\.\d+\.checkpoint)\.\d+\.part")
    for each in path.parent.iterdir():
        if part.fullmatch(each.name):
            with suppress(OSError):
                each.unlink()


def _lock_of(path: Path) -> FileLock:
    return FileLock(path.with_name(f".{path.name}.lock"), timeout=0)
