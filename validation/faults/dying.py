"""Death of a copy of this process right before a system call that changes files."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

__all__ = ["DIED", "Call", "at_call", "in_copy", "watched"]

DIED = 99
"""Exit status of a copy that died."""


class Call(NamedTuple):
    """A system call that is about to change a file or folder.

    Attributes:
        kind: "open", "write", "truncate", "fsync", "rename" or "unlink".
        path: Path of the file, or of the folder for changes of names.
        target: New name of a renamed file.
        offset: Position of the bytes, or the new size.
        data: Bytes to write.
        fresh: Whether opening creates or empties the file.
    """

    kind: str
    path: Path
    target: Path | None = None
    offset: int = 0
    data: bytes = b""
    fresh: bool = False

    @property
    def words(self) -> str:
        """Kind of the call and name of the file."""
        return f"{self.kind} {(self.target or self.path).name}"


def at_call(n: int) -> Callable[[Call], bool]:
    """Predicate that is true for the n-th call, from 0."""
    left = [n]

    def due(call: Call) -> bool:
        left[0] -= 1
        return left[0] == -1

    return due


def in_copy(session: Callable[[], object], due: Callable[[Call], bool], torn: bool = False) -> int:
    """Run a function in a copy of this process that dies right before a call.

    Args:
        session: Function to run.
        due: Whether to die before a call.
        torn: Perform the first half of the call, if it is a write.

    Returns:
        Exit status, ``DIED`` after death.
    """
    pid = os.fork()
    if pid:
        return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])

    def before(call: Call, half: Callable[[], object]) -> None:
        if due(call):
            if torn:
                half()
            os._exit(DIED)

    status = 1
    try:
        with watched(before):
            session()
        status = 0
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        os._exit(status)
    return status


Before = Callable[[Call, Callable[[], object]], None]


@contextmanager
def watched(before: Before) -> Iterator[None]:
    """Call a function before every call that changes files.

    Args:
        before: Function of the call and of an action that performs half of it if it is a write.
    """
    plain_open, replace, unlink, fsync = pathlib.Path.open, pathlib.Path.replace, pathlib.Path.unlink, os.fsync

    def watched_open(path: Path, mode: str = "r", *rest: Any, **options: Any) -> Any:
        if mode in ("r", "rb"):
            return plain_open(path, mode, *rest, **options)
        before(Call("open", path, fresh=mode[0] in "wx"), _nothing)
        return _Watched(plain_open(path, mode, buffering=0), path, before)

    def watched_replace(path: Path, target: Path) -> Any:
        before(Call("rename", path, Path(target)), _nothing)
        return replace(path, target)

    def watched_unlink(path: Path, missing_ok: bool = False) -> None:
        if path.exists():
            before(Call("unlink", path), _nothing)
        unlink(path, missing_ok)

    def watched_fsync(number: int) -> None:
        before(Call("fsync", Path(f"/proc/self/fd/{number}").readlink()), _nothing)
        fsync(number)

    pathlib.Path.open, pathlib.Path.replace = watched_open, watched_replace  # type: ignore[method-assign,assignment]
    pathlib.Path.unlink, os.fsync = watched_unlink, watched_fsync  # type: ignore[method-assign,assignment]
    try:
        yield
    finally:
        pathlib.Path.open, pathlib.Path.replace = plain_open, replace  # type: ignore[method-assign]
        pathlib.Path.unlink, os.fsync = unlink, fsync  # type: ignore[method-assign]


def _nothing() -> None:
    """Do nothing: the call has no halves."""


class _Watched:
    """A file whose writes go directly to the system."""

    def __init__(self, file: Any, path: Path, before: Before) -> None:
        self._file, self._path, self._before = file, path, before

    def write(self, data: Any) -> int:
        view = memoryview(data).cast("B")
        call = Call("write", self._path, offset=self._file.tell(), data=bytes(view))
        self._before(call, lambda: self._file.write(view[: len(view) // 2]))
        return int(self._file.write(view))

    def truncate(self, size: int) -> int:
        self._before(Call("truncate", self._path, offset=size), _nothing)
        return int(self._file.truncate(size))

    def __enter__(self) -> _Watched:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)
