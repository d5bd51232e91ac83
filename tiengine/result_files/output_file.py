"""Life cycle of a result file: created and locked, committed repeatedly, completed; or continued after a crash.

The file has its final name from the first commit on, so that it can be read during the run, and committed data survive
a crash of the process (:mod:`tiengine.result_files.journal`). If it replaces an older file (``force``), it is renamed
at the first commit after the header.
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
from tiengine.result_files.file_lock import acquire_lock, release_lock, remove_temporary_files
from tiengine.result_files.journal import JournalledFile, journal_of, recover, sync_folder
from tiengine.result_files.reader import COMPLETE, FORMAT, FORMAT_VERSION, RUNNING, Reader, open_reader

__all__ = ["OutputFile", "check_output", "header"]

LIBRARY = ("v110", "v110")
"""File format of HDF5 1.10, the first whose metadata carry checksums, so that damage is detected."""

DISK_ERRORS = {getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EFBIG", "EIO", "EROFS") if hasattr(errno, name)}
"""Error numbers of the system for a disk that is full or has failed."""

PACKAGES = ("numpy", "scipy", "taichi", "h5py", "pydantic")


def check_output(path: Path, force: bool = False) -> None:
    """Refuse a path that cannot become a result file, before the computation.

    Args:
        path: Path of the new file.
        force: Whether an existing file may be replaced.

    Raises:
        InputError: The path is a folder or exists already, or its folder is missing or not writable.
    """
    try:
        if path.is_dir():
            raise InputError(f"output = '{path}': must be a file, not a folder")
        if path.exists() and not path.is_file():
            raise InputError(f"output = '{path}': must be a regular file, not a device or a pipe")
    except (OSError, ValueError) as error:  # not a valid file name
        if isinstance(error, InputError):
            raise
        raise InputError(f"output = '{path}': cannot be written ({error})") from None
    if path.exists() and not force:
        how = "choose another name or --force"
        if _is_unfinished(path):
            how = f"it is an unfinished run: resume it with `tiengine resume {path}`, or {how}"
        raise InputError(f"output = '{path}': exists already; {how}")
    if not path.parent.is_dir():
        raise InputError(f"output = '{path}': there is no folder '{path.parent}'")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"output = '{path}': the folder '{path.parent}' is not writable")


def _is_unfinished(path: Path) -> bool:
    try:
        with open_reader(path) as result:
            return not result.finished
    except InputError:
        return False


class OutputFile:
    """Result file open for writing.

    Attributes:
        path: Final path of the file; None for a file in memory.
        h5: Open HDF5 file.
    """

    def __init__(self, path: Path | None, h5: Any, journalled: JournalledFile | None, lock: FileLock | None) -> None:
        """Take over open files; use :meth:`create` or :meth:`resume`."""
        self.path, self.h5 = path, h5
        self._journalled, self._lock = journalled, lock
        self._published = path is None or journalled is None or journalled.path == path

    @classmethod
    def create(cls, path: Path | None, force: bool) -> OutputFile:
        """Create a file.

        Args:
            path: Path of the file; None keeps it in memory.
            force: Replace an existing file.

        Raises:
            InputError: The file cannot be written, or another run is writing it.
        """
        if path is None:
            name = f"tiengine-{uuid.uuid4()}"  # HDF5 refuses two open files with the same name, even in memory
            return cls(None, h5py.File(name, "w", driver="core", backing_store=False, rdcc_nbytes=0), None, None)
        check_output(path, force)
        lock = acquire_lock(path)
        part = path.with_name(f".{path.name}.{os.getpid()}.part")
        try:
            remove_temporary_files(path)
            if path.exists():
                recover(path)
            else:
                journal_of(path).unlink(missing_ok=True)  # journal of a file that was removed
            journalled = JournalledFile(part, fresh=True)
            return cls(path, _opened(journalled, "w"), journalled, lock)
        except OSError as error:
            release_lock(lock)
            raise InputError(f"output = '{path}': cannot be written ({error})") from None

    @classmethod
    def resume(cls, path: Path) -> OutputFile:
        """Open the file of an unfinished run.

        Args:
            path: Path of the file.

        Raises:
            InputError: The file is not an unfinished result, cannot be written, or another run is writing it.
        """
        with open_reader(path):  # refuses files of other programs before anything is written next to them
            pass
        lock = acquire_lock(path)
        try:
            recover(path)
            remove_temporary_files(path)
            with open_reader(path) as result:
                if result.finished:
                    _remove_checkpoints(path)
                    raise InputError(f"{path}: the run is complete; there is nothing to resume")
                result.check()
            journalled = JournalledFile(path, fresh=False)
            return cls(path, _opened(journalled, "r+"), journalled, lock)
        except OSError as error:
            release_lock(lock)
            raise InputError(f"{path}: cannot be continued ({error})") from None
        except BaseException:
            release_lock(lock)
            raise

    def commit(self) -> None:
        """Make all written data permanent, under the final name of the file.

        Raises:
            InputError: The disk is full or has failed.
        """
        if self._journalled is None or self.path is None:
            return
        try:
            self.h5.flush()
            self._journalled.commit()
            self._publish()
        except (OSError, RuntimeError) as error:  # h5py raises RuntimeError if the disk is full
            raise InputError(f"output = '{self.path}': cannot be written ({error})") from None

    def complete(self, attributes: Mapping[str, Any]) -> Reader:
        """Write the final attributes and close the file.

        Args:
            attributes: Attributes of the root.

        Returns:
            The result, open for reading.

        Raises:
            InputError: The disk is full or has failed.
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
        release_lock(self._lock)
        return Reader(h5py.File(self.path, "r"), str(self.path))

    def leave(self, keep: bool) -> None:
        """Close the file without completing it.

        Args:
            keep: Keep the file as of its last commit; otherwise remove it.
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
        release_lock(self._lock)

    def _publish(self) -> None:
        """Rename the file to its final name, after removing the checkpoints of the run that it replaces."""
        if self._published or self.path is None or self._journalled is None:
            return
        _remove_checkpoints(self.path)
        self._journalled.path.replace(self.path)
        sync_folder(self.path.parent)
        self._journalled.path, self._published = self.path, True


def header(scenario_toml: str) -> dict[str, Any]:
    """Root attributes of every result file.

    Args:
        scenario_toml: Resolved scenario as TOML.
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
    """Open the HDF5 file without a chunk cache, which would take 1 MB per open dataset."""
    try:
        return h5py.File(journalled, mode, rdcc_nbytes=0, libver=LIBRARY)
    except BaseException:
        journalled.close()
        raise


def _remove_checkpoints(path: Path) -> None:
    """Remove the checkpoints of a finished run."""
    for each in checkpoint_paths(path):
        each.unlink(missing_ok=True)
