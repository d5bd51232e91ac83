"""A file that changes only by whole commits, whatever happens in between.

HDF5 changes its metadata in place and in no particular order, so that a process killed on its way leaves a file that
may not open. Here, bytes behind the last commit's end go straight to the file, where nothing refers to them yet; pages
before it are held in memory. A commit writes these pages to a journal, puts the journal in place by an atomic rename,
brings the file up to date and removes the journal. So the file is as of the last commit at any instant but the
millisecond in which pages are brought up to date, and for that instant there is the journal (:func:`recover`).

Data reach the disk (fsync) before what refers to them does; a power cut is as harmless as a kill.
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
    """Where the journal of a file is while a commit is under way."""
    return path.with_name(f"{path.name}.journal")


class JournalledFile(io.RawIOBase):
    """A binary file for h5py's ``fileobj`` driver; see the module.

    Attributes:
        path: Where it is; may be changed after the file was moved.
    """

    def __init__(self, path: Path, *, fresh: bool) -> None:
        """Open.

        Args:
            path: The file.
            fresh: Create an empty one; else continue one that :func:`recover` has seen.

        Raises:
            OSError: It cannot be opened for writing.
        """
        super().__init__()
        self.path = path
        self._file: BinaryIO = Path(path).open("x+b" if fresh else "r+b", buffering=0)  # noqa: SIM115
        self._size = self._committed = os.fstat(self._file.fileno()).st_size
        self._position = 0
        self._pages: dict[int, bytearray] = {}
        self._abandoned = False

    def readable(self) -> bool:
        """Yes."""
        return True

    def writable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """Yes."""
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place; see :meth:`io.IOBase.seek`."""
        base = {os.SEEK_SET: 0, os.SEEK_CUR: self._position, os.SEEK_END: self._size}[whence]
        self._position = base + offset
        return self._position

    def tell(self) -> int:
        """Where the next byte is read or written."""
        return self._position

    def readinto(self, buffer: Any) -> int:
        """Read, changes that are not committed included."""
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
        """Write: behind the committed end at once, else into pages for the next commit."""
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
        """Set the size; what was committed stays until the next commit."""
        if self._abandoned:
            return self._size
        self._size = self._position if size is None else size
        if self._size >= self._committed:
            self._file.truncate(self._size)
        return self._size

    def commit(self) -> None:
        """Make everything written so far permanent.

        Raises:
            OSError: The disk is full or gone; the file is as of the last commit, or the journal holds what is missing.
        """
        os.fsync(self._file.fileno())
        if self._pages or self._size < self._committed:
            journal = journal_of(self.path)
            starts = {page * PAGE: content for page, content in sorted(self._pages.items())}
            # of the page that the committed end divides, the rest has been written already
            pages = [(start, content[: self._committed - start]) for start, content in starts.items()]
            atomic_write(journal, _journal(self._size, pages))
            _apply(self._file, self._size, pages)
            journal.unlink()
            self._pages.clear()
        self._committed = self._size

    def abandon(self) -> None:
        """Take no more changes: for HDF5, which writes once more when it closes, on a disk that may be full."""
        self._abandoned = True

    def close(self) -> None:
        """Close; what was not committed is dropped (bytes behind the committed end are harmless)."""
        if not self.closed:
            self._file.close()
        super().close()

    def _page(self, page: int) -> bytearray:
        """The page to change, as the file has it until then."""
        if page not in self._pages:
            content = bytearray(PAGE)
            _read_at(self._file, page * PAGE, memoryview(content))
            self._pages[page] = content
        return self._pages[page]


def recover(path: Path) -> bool:
    """Complete a commit that a crash interrupted. Only for who holds the file's lock.

    Args:
        path: The file.

    Returns:
        Whether there was one.

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
            # the rename reached the disk before the contents: the file itself was not touched yet
            journal.unlink()
        return False  # something else of that name is left alone
    with path.open("r+b", buffering=0) as file:
        _apply(file, size, pages)
    journal.unlink()
    return True


def atomic_write(path: Path, content: bytes) -> None:
    """Write a whole file, or leave what is there.

    Args:
        path: The file.
        content: All of it.

    Raises:
        OSError: It cannot be written.
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
    """Put names that were given in a folder onto the disk.

    Args:
        path: The folder.

    Raises:
        OSError: The disk is gone.
    """
    if hasattr(os, "O_DIRECTORY"):  # Windows has no such call
        folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def _parts(start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Pages under a stretch of bytes: number, first and last byte in the page."""
    for page in range(start // PAGE, (end + PAGE - 1) // PAGE):
        first, last = max(start - page * PAGE, 0), min(end - page * PAGE, PAGE)
        if first < last:
            yield page, first, last


def _read_at(file: BinaryIO, offset: int, into: memoryview) -> None:
    """Fill ``into`` as far as the file goes."""
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
    """A journal's bytes; pages are cut at the file's end."""
    kept = [(offset, page[: size - offset]) for offset, page in pages if offset < size]
    body = b"".join(PLACE.pack(offset, len(page)) + page for offset, page in kept)
    return MAGIC + HEADER.pack(size, len(kept), zlib.crc32(body)) + body


def _read_journal(content: bytes) -> tuple[int, list[tuple[int, bytearray]]]:
    """Size of the file and pages.

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
    """Bring the file up to date and onto the disk."""
    for offset, page in pages:
        if offset < size:
            _write_at(file, offset, page[: size - offset])
    file.truncate(size)
    os.fsync(file.fileno())
