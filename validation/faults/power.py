"""Power cuts: data written since the last fsync reach the disk in part, in any order.

The system calls of a session are recorded with their bytes. For an instant, a disk is constructed in a state that a
journalling file system may leave: of every file the bytes of its last fsync and any selection of later writes, in whole
or in part; of the folder's names those of its last fsync and the first few changes since, in order. The result
file must be as of the last commit, or of the one in progress.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from validation.faults.boundaries import SESSIONS, Boundaries, check_left, memory_folder, new_folder, states_of
from validation.faults.dying import Call, watched
from validation.faults.plan import SEED

__all__ = ["power_cuts"]

TORN = 512  # bytes that a disk writes at once


def power_cuts(draws: int, stride: int = 1) -> Boundaries:
    """Run every session, with power cuts at every ``stride``-th call, ``draws`` times each."""
    found, rng = Boundaries(), np.random.default_rng(SEED)
    with TemporaryDirectory(prefix="tiengine-power-", dir=memory_folder()) as top:
        for name, (session, prepare) in SESSIONS.items():
            folder = Path(top) / name
            template = new_folder(folder / "template")
            prepare(template)
            words, states = states_of(session, shutil.copytree(template, folder / "whole"))
            calls = _recorded(session, shutil.copytree(template, folder / "recorded"))
            if [call.kind for call in calls] != [word.split()[0] for word in words]:
                raise RuntimeError(f"{name}: two sessions made other calls")
            found.sessions[name] = len(calls)
            for n in range(0, len(calls) + 1, stride):
                done = sum(end <= n for end, _ in states) - 1
                allowed = [states[k][1] for k in (done, done + 1) if k < len(states)]
                for draw in range(draws):
                    here = new_folder(folder / "here")
                    _Disk.after(calls[:n], template, rng).write(here)
                    found.deaths += 1
                    check_left(here, allowed, f"{name}, power cut {draw} before call {n}", found)
                    shutil.rmtree(here)
    return found


def _recorded(session: Callable[[Path], None], folder: Path) -> list[Call]:
    """Record the calls of a session."""
    calls: list[Call] = []
    with watched(lambda call, half: calls.append(call)):
        session(folder)
    return calls


@dataclass(eq=False)
class _File:
    """A file on the disk.

    Attributes:
        content: Content as of its last fsync.
        since: Writes and truncations since then.
    """

    content: bytearray
    since: list[Call] = field(default_factory=list)

    def fsync(self) -> None:
        for call in self.since:
            self.change(call, len(call.data))
        self.since.clear()

    def change(self, call: Call, count: int) -> None:
        """Perform a call, of a write only the given number of bytes."""
        if call.kind == "truncate":
            del self.content[call.offset :]
            self.content.extend(bytes(call.offset - len(self.content)))
            return
        self.content.extend(bytes(max(call.offset + count - len(self.content), 0)))
        self.content[call.offset : call.offset + count] = call.data[:count]

    def cut_off(self, rng: Any) -> None:
        """Let a part of the writes since the last fsync reach the disk."""
        for call in self.since:
            fate = rng.random()
            torn = TORN * int(rng.integers(len(call.data) // TORN + 1))
            self.change(call, len(call.data) if fate < 0.5 else torn) if fate < 0.75 else None


class _Disk:
    """Files and names of a folder."""

    def __init__(self, folder: Path) -> None:
        self.names = {each.name: _File(bytearray(each.read_bytes())) for each in folder.iterdir()}
        self.now = dict(self.names)
        self.open = dict(self.names)
        """Files by the name under which they were last opened."""
        self.since: list[dict[str, _File]] = []
        """Names after each change since the folder's last fsync."""

    @classmethod
    def after(cls, calls: Sequence[Call], template: Path, rng: Any) -> _Disk:
        """State of the disk if power fails after the given calls."""
        disk = cls(template)
        for call in calls:
            disk._take(call)
        kept = int(rng.integers(len(disk.since) + 1))
        if kept:
            disk.names = disk.since[kept - 1]
        for file in {id(file): file for file in disk.names.values()}.values():
            file.cut_off(rng)
        return disk

    def write(self, folder: Path) -> None:
        """Make it up."""
        for name, file in self.names.items():
            (folder / name).write_bytes(file.content)

    def _take(self, call: Call) -> None:
        name = call.path.name
        match call.kind:
            case "write" | "truncate":
                self.open[name].since.append(call)
            case "open":
                if name not in self.now:
                    self._name({**self.now, name: _File(bytearray())})
                elif call.fresh:
                    self.now[name].since.append(Call("truncate", call.path))
                self.open[name] = self.now[name]
            case "rename":
                rest = {key: file for key, file in self.now.items() if key != name}
                self._name({**rest, str(call.target and call.target.name): self.now[name]})
            case "unlink":
                self._name({key: file for key, file in self.now.items() if key != name})
            case "fsync" if name in self.now:
                self.now[name].fsync()
            case "fsync":
                self.names = self.now
                self.since.clear()

    def _name(self, names: dict[str, _File]) -> None:
        self.now = names
        self.since.append(names)
