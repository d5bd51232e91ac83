"""File that changes only by whole commits, even if the process is killed.

HDF5 changes its metadata in place and in no particular order, so that a killed process may leave a file that does not
open. Here, bytes beyond the end of the last commit are written to the file at once, where nothing refers to them yet;
changed pages before that end are held in memory. A commit writes these pages to a journal, puts the journal in place by
an atomic rename, updates the file and removes the journal. The file therefore always holds the last commit, except for
the millisecond in which its pages are updated; for that time the journal exists (:func:`recover`).

Data are flushed to the disk (fsync) before anything refers to them, which also covers a power cut.
"""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

__all__ = ["JournalledFile", "atomic_write", "journal_of", "recover", "sync_folder"]

PAGE = 4096
MAGIC = b"tiengine journal 1\n"
HEADER = struct.Struct("<QQI")  # size of the file, number of pages, checksum of what follows
PLACE = struct.Struct("<QI")  # offset and length of a page


def journal_of(path: Path) -> Path:
    """Path of the journal of a file, which exists while a commit is in progress."""
    return path.with_name(f"{path.name}.journal")


class JournalledFile(io.RawIOBase):
    """Binary file for the ``fileobj`` driver of h5py; see the module.

    Attributes:
        path: Path of the file; to be changed when the file is renamed.
    """

    def __init__(self, path: Path, *, fresh: bool) -> None:
        """Open the file.

        Args:
            path: Path of the file.
            fresh: Create an empty file; otherwise continue one after :func:`recover`.

        Raises:
            OSError: The file cannot be opened for writing.
        """
        super().__init__()
        self.path = path
        self._file: BinaryIO = Path(path).open("x+b" if fresh else "r+b", buffering=0)  # noqa: SIM115
        self._size = self._committed = os.fstat(self._file.fileno()).st_size
        self._position = 0
        self._pages: dict[int, bytearray] = {}
        self._abandoned = False

    def readable(self) -> bool:
        """Return True; see :meth:`io.IOBase.readable`."""
        return True

    def writable(self) -> bool:
        """Return True; see :meth:`io.IOBase.writable`."""
        return True

    def seekable(self) -> bool:
        """Return True; see :meth:`io.IOBase.seekable`."""
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Set the position; see :meth:`io.IOBase.seek`."""
        base = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._size}[whence]
        self._position = base + offset
        return self._position

    def tell(self) -> int:
        """Position of the next byte to be read or written."""
        return self._position

    def readinto(self, buffer: Any) -> int:
        """Read bytes, including changes that are not committed yet."""
        view = memoryview(buffer).cast("B")
        start = self._position
        count = max(min(len(view), self._size - start), 0)
        view[:count] = bytes(count)
        _read_at(self._file, start, view[:count])
        for page, first, last in _parts(start, min(start + count, self._committed)):
            if page in self._pages:
                view[page * PAGE + first - start : page * PAGE + last - start] = self._pages[page][first:last]
        self._position += count
        return count

    def write(self, data: Any) -> int:
        """Write bytes: directly beyond the committed end, otherwise into pages for the next commit."""
        view = memoryview(data).cast("B")
        if self._abandoned:
            self._position += len(view)
            return len(view)
        start, end = self._position, self._position + len(view)
        held = min(max(self._committed - start, 0), len(view))
        for page, first, last in _parts(start, start + held):
            at = page * PAGE + first - start
            self._page(page)[first:last] = view[at : at + last - first]
        if held < len(view):
            _write_at(self._file, start + held, view[held:])
        self._position = end
        self._size = max(self._size, end)
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the size; committed bytes are kept until the next commit."""
        if self._abandoned:
            return self._size
        self._size = self._position if size is None else size
        if self._size >= self._committed:
            self._file.truncate(self._size)
        return self._size

    def commit(self) -> None:
        """Make all bytes written so far permanent.

        Raises:
            OSError: The disk is full or has failed; the file holds the last commit, or the journal completes this one.
        """
        os.fsync(self._file.fileno())
        if self._pages or self._size < self._committed:
            journal = journal_of(self.path)
            starts = {page * PAGE: content for page, content in sorted(self._pages.items())}
            # the last page extends beyond the committed end: that part has been written to the file already
            pages = [(start, content[: self._committed - start]) for start, content in starts.items()]
            atomic_write(journal, _journal(self._size, pages))
            _apply(self._file, self._size, pages)
            journal.unlink()
            self._pages.clear()
        self._committed = self._size

    def abandon(self) -> None:
        """Discard all further changes: HDF5 writes again when it closes, and the disk may be full."""
        self._abandoned = True

    def close(self) -> None:
        """Close the file; uncommitted changes are dropped (bytes beyond the committed end are harmless)."""
        if not self.closed:
            self._file.close()
        super().close()

    def _page(self, page: int) -> bytearray:
        """Page held in memory, read from the file at its first change."""
        if page not in self._pages:
            content = bytearray(PAGE)
            _read_at(self._file, page * PAGE, memoryview(content))
            self._pages[page] = content
        return self._pages[page]


def recover(path: Path) -> bool:
    """Complete an interrupted commit; the caller must hold the lock of the file.

    Args:
        path: Path of the file.

    Returns:
        Whether there was an interrupted commit.

    Raises:
        OSError: The file cannot be written.
    """
    journal = journal_of(path)
    if not journal.exists():
        return False
    content = journal.read_bytes()
    try:
        size, pages = _read_journal(content)
    except ValueError:
        if content.startswith(MAGIC) or not any(content):
            # the rename reached the disk before the contents: the file itself has not been changed yet
            journal.unlink()
        return False  # a file of another kind is not touched
    with path.open("r+b", buffering=0) as file:
        _apply(file, size, pages)
    journal.unlink()
    return True


def atomic_write(path: Path, content: bytes) -> None:
    """Write a whole file, or leave the existing one unchanged.

    Args:
        path: Path of the file.
        content: Complete contents.

    Raises:
        OSError: The file cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def sync_folder(path: Path) -> None:
    """Flush new names in a folder to the disk.

    Args:
        path: Path of the folder.

    Raises:
        OSError: The disk has failed.
    """
    if hasattr(os, "O_DIRECTORY"):  # not available on Windows
        folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _parts(start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Pages that cover a range of bytes: number, first and last byte within the page."""
    for page in range(start // PAGE, (end + PAGE - 1) // PAGE):
        first, last = max(start - page * PAGE, 0), min(end - page * PAGE, PAGE)
        if first < last:
            yield page, first, last


def _read_at(file: BinaryIO, offset: int, into: memoryview) -> None:
    """Fill ``into`` up to the end of the file."""
    file.seek(offset)
    done = 0
    while done < len(into):
        got = file.readinto(into[done:])  # type: ignore[attr-defined]
        if not got:
            return
        done += got


def _write_at(file: BinaryIO, offset: int, data: memoryview | bytearray) -> None:
    file.seek(offset)
    view = memoryview(data)
    while len(view):
        view = view[file.write(view) :]


def _journal(size: int, pages: list[tuple[int, bytearray]]) -> bytes:
    """Contents of a journal; pages are cut at the end of the file."""
    kept = [(offset, page[: size - offset]) for offset, page in pages if offset < size]
    body = b"".join(PLACE.pack(offset, len(page)) + page for offset, page in kept)
    return MAGIC + HEADER.pack(size, len(kept), zlib.crc32(body)) + body


def _read_journal(content: bytes) -> tuple[int, list[tuple[int, bytearray]]]:
    """Read the size of the file and the pages from a journal.

    Raises:
        ValueError: The journal is damaged.
    """
    start = len(MAGIC) + HEADER.size
    if len(content) < start or not content.startswith(MAGIC):
        raise ValueError("no journal")
    size, count, checksum = HEADER.unpack(content[len(MAGIC) : start])
    if zlib.crc32(content[start:]) != checksum:
        raise ValueError("checksum")
    pages = []
    for _ in range(count):
        offset, length = PLACE.unpack_from(content, start)
        start += PLACE.size
        pages.append((offset, bytearray(content[start : start + length])))
        start += length
    return size, pages


def _apply(file: BinaryIO, size: int, pages: list[tuple[int, bytearray]]) -> None:
    """Write the pages to the file, set its size and flush it to the disk."""
    for offset, page in pages:
        if offset < size:
            _write_at(file, offset, page[: size - offset])
    file.truncate(size)
    os.fsync(file.fileno())
