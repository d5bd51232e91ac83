"""The life of a result file: created, locked, committed now and then, completed; or continued after a crash.

The file has its name from its first commit on, so that it can be read while the run goes on, and what was committed
survives whatever happens to the process (:mod:`tiengine.result_files.journal`). While it replaces an older
file (``force``), it gets its name only once it holds something.
"""

from __future__ import annotations

import errno
import os
import platform
import uuid
import zlib
from collections.abc import Mapping
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from typing import Any

import h5py
from filelock import FileLock

from tiengine.parameters.errors import InputError
from tiengine.result_files.checkpoint import checkpoint_paths
from tiengine.result_files.file_lock import locked, release, sweep
from tiengine.result_files.journal import JournalledFile, journal_of, recover, sync_folder
from tiengine.result_files.reader import COMPLETE, FORMAT, FORMAT_VERSION, RUNNING, Reader, open_reader

__all__ = ["OutputFile", "check_output", "header"]

LIBRARY = ("v110", "v110")
"""File format of HDF5 1.10: the first whose own structures carry checksums, so that a damaged file is found out."""

DISK_ERRORS = {getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG", "EIO", "EROFS") if hasattr(errno, name)}
"""What the system says when a disk is full or gone."""

PACKAGES = ("numpy", "scipy", "taichi", "h5py", "pydantic")


def check_output(path: Path, force: bool = False) -> None:
    """Refuse a path that cannot become a result file, before anything is computed.

    Args:
        path: Where the file shall be.
        force: Whether an existing file may be replaced.

    Raises:
        InputError: The path is a folder, exists already, or lies in no folder that can be written.
    """
    try:
        if path.is_dir():
            raise InputError(f"output = '{path}': must be a file, not a folder")
        if path.exists() and not path.is_file():
            raise InputError(f"output = '{path}': must be a regular file, not a device or a pipe")
    except (OSError, ValueError) as error:  # a name that no file can have
        if isinstance(error, InputError):
            raise
        raise InputError(f"output = '{path}': cannot be written ({error})") from None
    if path.exists() and not force:
        how = "choose another name or --force"
        if _is_unfinished(path):
            how = f"it is an unfinished run: continue it by `tiengine resume {path}`, or {how}"
        raise InputError(f"output = '{path}': exists already; {how}")
    if not path.parent.is_dir():
        raise InputError(f"output = '{path}': there is no folder '{path.parent}'")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"output = '{path}': the folder '{path.parent}' cannot be written to")


def _is_unfinished(path: Path) -> bool:
    try:
        with open_reader(path) as result:
            return not result.finished
    except InputError:
        return False


class OutputFile:
    """A result file open for writing.

    Attributes:
        path: Where it is or shall be; None in memory.
        h5: The open HDF5 file.
    """

    def __init__(self, path: Path | None, h5: Any, journalled: JournalledFile | None, lock: FileLock | None) -> None:
        """See :meth:`create` and :meth:`resume`."""
        self.path, self.h5 = path, h5
        self._journalled, self._lock = journalled, lock
        self._published = path is None or journalled is None or journalled.path == path

    @classmethod
    def create(cls, path: Path | None, force: bool) -> OutputFile:
        """A new file.

        Args:
            path: Where it shall be; None keeps it in memory.
            force: Replace an existing file.

        Raises:
            InputError: It cannot be written, or another run writes it.
        """
        if path is None:
            name = f"tiengine-{uuid.uuid4()}"  # HDF5 refuses two open files of one name, in memory too
            return cls(None, h5py.File(name, "w", driver="core", backing_store=False, rdcc_nbytes=0), None, None)
        check_output(path, force)
        lock = locked(path)
        part = path.with_name(f".{path.name}.{os.getpid()}.part")
        try:
            sweep(path)
            if path.exists():
                recover(path)
            else:
                journal_of(path).unlink(missing_ok=True)  # of a file that was removed
            journalled = JournalledFile(part, fresh=True)
            return cls(path, _opened(journalled, "w"), journalled, lock)
        except OSError as error:
            release(lock)
            raise InputError(f"output = '{path}': cannot be written ({error})") from None

    @classmethod
    def resume(cls, path: Path) -> OutputFile:
        """A file that a run has left unfinished.

        Args:
            path: The file.

        Raises:
            InputError: It is not an unfinished result, cannot be written, or another run writes it.
        """
        with open_reader(path):  # says what is wrong with a foreign file, and touches none
            pass
        lock = locked(path)
        try:
            recover(path)
            sweep(path)
            with open_reader(path) as result:
                if result.finished:
                    _remove_checkpoints(path)
                    raise InputError(f"{path}: is complete; there is nothing to resume")
                result.check()
            journalled = JournalledFile(path, fresh=False)
            return cls(path, _opened(journalled, "r+"), journalled, lock)
        except OSError as error:
            release(lock)
            raise InputError(f"{path}: cannot be continued ({error})") from None
        except BaseException:
            release(lock)
            raise

    @property
    def exists(self) -> bool:
        """Whether the file has its name."""
        return self._published

    def commit(self) -> None:
        """Make what was written permanent, under the file's own name.

        Raises:
            InputError: The disk is full or gone.
        """
        if self._journalled is None or self.path is None:
            return
        try:
            self.h5.flush()
            self._journalled.commit()
            self._publish()
        except (OSError, RuntimeError) as error:  # h5py says RuntimeError when the disk is full
            raise InputError(f"output = '{self.path}': cannot be written ({error})") from None

    def complete(self, attributes: Mapping[str, Any]) -> Reader:
        """Write the last attributes and close.

        Args:
            attributes: Of the root.

        Returns:
            The result, open for reading.

        Raises:
            InputError: The disk is full or gone.
        """
        self.h5.attrs.update({"status": COMPLETE} | dict(attributes))
        if self._journalled is None or self.path is None:
            return Reader(self.h5, "in memory")
        try:
            self.h5.close()
            self._journalled.commit()
            self._publish()
        except (OSError, RuntimeError) as error:
            raise InputError(f"output = '{self.path}': cannot be completed ({error})") from None
        self._journalled.close()
        _remove_checkpoints(self.path)
        release(self._lock)
        return Reader(h5py.File(self.path, "r"), str(self.path))

    def leave(self, keep: bool) -> None:
        """Close without completing.

        Args:
            keep: Leave the file as of its last commit; else remove it.
        """
        if self._journalled is None or self.path is None:
            self.h5.close()
            return
        self._journalled.abandon()
        with suppress(OSError, RuntimeError):
            self.h5.close()
        self._journalled.close()
        if not self._published:
            self._journalled.path.unlink(missing_ok=True)
        elif not keep:
            self.path.unlink(missing_ok=True)
        release(self._lock)

    def _publish(self) -> None:
        """Give the file its name; checkpoints of the run that it replaces must never meet it."""
        if self._published or self.path is None or self._journalled is None:
            return
        _remove_checkpoints(self.path)
        self._journalled.path.replace(self.path)
        sync_folder(self.path.parent)
        self._journalled.path, self._published = self.path, True


def header(scenario_toml: str) -> dict[str, Any]:
    """Root attributes of every file.

    Args:
        scenario_toml: Resolved scenario.
    """
    versions = {f"{package}_version": metadata.version(package) for package in PACKAGES}
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "tiengine_version": metadata.version("tiengine"),
        "scenario": scenario_toml,
        "scenario_crc32": zlib.crc32(scenario_toml.encode()),
        "status": RUNNING,
        "python_version": platform.python_version(),
        "platform": platform.platform(),
        **versions,
    }


def _opened(journalled: JournalledFile, mode: str) -> Any:
    """The HDF5 file; without a chunk cache, else every open dataset holds 1 MB."""
    try:
        return h5py.File(journalled, mode, rdcc_nbytes=0, libver=LIBRARY)
    except BaseException:
        journalled.close()
        raise


def _remove_checkpoints(path: Path) -> None:
    """Of a run that is over."""
    for each in checkpoint_paths(path):
        each.unlink(missing_ok=True)
