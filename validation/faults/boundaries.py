"""Death between any two system calls of a small session of the writer.

A copy of this process writes a small result, with checkpoints, and ends itself right before its n-th call that changes
the disk: opening for writing, write, truncate, fsync, rename, unlink; and also in the middle of every write. The file
must then be as of the last commit, or of the one in progress. The same holds for writers that replace an older file or
continue one, and for the program that completes the commit of a dead one.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tiengine import result as results
from tiengine.parameters.errors import InputError
from tiengine.result_files.channels import DOFS
from tiengine.result_files.checkpoint import Checkpoint, checkpoint_path, checkpoint_paths
from tiengine.result_files.events import Event
from tiengine.result_files.journal import journal_of
from tiengine.result_files.layout import Block, GroupSpec, TrainLabels
from tiengine.result_files.writer import Writer
from validation.faults.contents import contents, litter, reads
from validation.faults.dying import DIED, Call, at_call, in_copy

__all__ = ["NAME", "SESSIONS", "Boundaries", "boundaries", "check_left", "memory_folder", "new_folder", "states_of"]

NAME = "run.h5"
GROUPS = {
    "wheel": GroupSpec.standard("wheel", ("normal_force", "lateral_force")),
    "body": GroupSpec.standard("body", ("displacement",)),
}
LABELS = TrainLabels(["coach"], ["car"], np.zeros(2, np.int64), np.array([1.0, -1.0]))
SAMPLES = (700, 500, 900)  # rows of each block: the last chunk of a dataset is changed in place, and new ones are added


@dataclass
class Boundaries:
    """Findings of all sessions.

    Attributes:
        sessions: Number of system calls of each session.
        deaths: How often a session died.
        as_before, as_after: How often the file was as of the last commit, or of the one in progress.
        by_journal: How often plain h5py could not read the file until the journal was applied.
        twice: Deaths while a journal was applied.
        wrong: Errors found.
    """

    sessions: dict[str, int] = field(default_factory=dict)
    deaths: int = 0
    as_before: int = 0
    as_after: int = 0
    by_journal: int = 0
    twice: int = 0
    wrong: list[str] = field(default_factory=list)


def boundaries(stride: int = 1) -> Boundaries:
    """Run every session, dying at every ``stride``-th call."""
    found = Boundaries()
    with TemporaryDirectory(prefix="tiengine-faults-", dir=memory_folder()) as folder:
        for name, (session, prepare) in SESSIONS.items():
            _try(name, session, prepare, Path(folder) / name, stride, found)
    return found


def _fresh(folder: Path, force: bool = False) -> None:
    """Create, write, commit, save, complete."""
    with Writer(folder / NAME, 'name = "small"\n', {}, [], GROUPS, force=force) as writer:
        writer.add(0, LABELS, {"status": "running"})
        _blocks(writer, 0)


def _resumed(folder: Path) -> None:
    """Continue the file that :func:`_broken_off` has left."""
    with Writer.resume(folder / NAME, GROUPS) as writer:
        saved = Checkpoint.read(checkpoint_path(folder / NAME, 0))
        writer.add(0, LABELS, {"status": "running"})
        writer.rewind(0, saved.facts["rows"])
        _blocks(writer, int(saved.facts["blocks"]))


def _blocks(writer: Writer, first: int) -> None:
    for number in range(first, len(SAMPLES)):
        writer.write(0, _block(number))
        writer.add_events(0, [Event("wheel_lift", 0.1 * number, 1.0, 1, "left", f"block {number}", False)])
        writer.commit()
        Checkpoint(0, {"rows": writer.rows(0), "blocks": number + 1}, {"state": np.arange(500.0)}).write(_path(writer))
    writer.describe(0, {"status": "complete"})
    writer.commit()
    checkpoint_path(_path(writer), 0).unlink()
    writer.close({"status": "complete"}).close()


def _block(number: int) -> dict[str, Block]:
    count = SAMPLES[number]
    rng = np.random.default_rng(number)
    time = np.arange(0.0, count) + 1000.0 * number
    wheel = {name: rng.standard_normal((count, 2, 2)) for name in GROUPS["wheel"].channels}
    body = {"displacement": rng.standard_normal((count, 1, len(DOFS)))}
    return {"wheel": Block(time, time, wheel), "body": Block(time, time, body)}


def _path(writer: Writer) -> Path:
    return Path(str(writer._path))


def _nothing(folder: Path) -> None:
    """Start from an empty folder."""


def _older(folder: Path) -> None:
    """Start from an older result with a torn journal of its last commit and a checkpoint, as a crash leaves them."""
    _broken_off(folder)
    journal = journal_of(folder / NAME)
    in_copy(lambda: _resumed(folder), lambda call: call.kind == "unlink" and call.path.suffix == ".journal")
    assert journal.exists()


def _broken_off(folder: Path) -> None:
    """Start from a run that died after its first checkpoint."""
    left = [2]

    def after_the_first(call: Call) -> bool:
        left[0] -= call.kind == "rename" and str(call.target).endswith(".checkpoint")
        return left[0] == 0

    in_copy(lambda: _fresh(folder), after_the_first)
    assert len(checkpoint_paths(folder / NAME)) == 1


SESSIONS: dict[str, tuple[Callable[[Path], None], Callable[[Path], None]]] = {
    "a new file": (_fresh, _nothing),
    "instead of an older one": (lambda folder: _fresh(folder, force=True), _older),
    "resuming after a death": (_resumed, _broken_off),
}


def _try(
    name: str,
    session: Callable[[Path], None],
    prepare: Callable[[Path], None],
    folder: Path,
    stride: int,
    found: Boundaries,
) -> None:
    """Let a session die before every call."""
    template = new_folder(folder / "template")
    prepare(template)
    calls, states = states_of(session, shutil.copytree(template, folder / "whole"))
    journals: set[bytes] = set()
    found.sessions[name] = len(calls)
    for n in range(0, len(calls), stride):
        for torn in (False, True) if calls[n].startswith("write") else (False,):
            here = shutil.copytree(template, folder / "here")
            in_copy(lambda: session(here), at_call(n), torn)  # noqa: B023
            done = sum(end <= n for end, _ in states) - 1
            allowed = [states[k][1] for k in (done, done + 1) if k < len(states)]
            found.deaths += 1
            where = f"{name}, {'in' if torn else 'before'} call {n} ({calls[n]})"
            check_left(here, allowed, where, found, journals)
            shutil.rmtree(here)


def states_of(session: Callable[[Path], None], folder: Path) -> tuple[list[str], list[tuple[int, Any]]]:
    """Calls of a whole session, and the state of its file at every commit with the number of calls before it.

    Args:
        session: Function to call in a copy of this process.
        folder: Working folder.
    """
    from tiengine.result_files import output_file

    file = folder / "calls.txt"
    commit, complete = output_file.OutputFile.commit, output_file.OutputFile.complete
    calls: list[str] = []

    def kept(of: Any) -> Any:
        def call(self: Any, *rest: Any) -> Any:
            answer = of(self, *rest)
            with suppress(FileNotFoundError):  # the file still has its temporary name
                shutil.copy(folder / NAME, folder / f"state.{len(calls)}")
            return answer

        return call

    def whole() -> None:
        output_file.OutputFile.commit, output_file.OutputFile.complete = kept(commit), kept(complete)  # type: ignore[method-assign]
        session(folder)
        os.write(os.open(file, os.O_CREAT | os.O_WRONLY), "\n".join(calls).encode())

    before = _settled(shutil.copytree(folder, folder.with_name("before")))

    def note(call: Call) -> bool:
        calls.append(call.words)
        return False

    status = in_copy(whole, note)
    if status:
        raise RuntimeError(f"an undisturbed session ended with exit status {status}")
    ends = sorted(int(each.suffix[1:]) for each in folder.glob("state.*"))
    states = [(0, before), *((end, contents(folder / f"state.{end}")) for end in ends)]
    return file.read_text().splitlines(), states


def check_left(
    folder: Path, allowed: list[Any], where: str, found: Boundaries, journals: set[bytes] | None = None
) -> None:
    """Check the files of a dead session.

    Args:
        folder: Its working folder.
        allowed: States that its file may have, that of the last commit first.
        where: Description for messages.
        found: Findings to add to.
        journals: Journals whose application was interrupted before; None interrupts none.
    """
    path = folder / NAME
    if not journal_of(path).exists():
        left = _state(folder)
        if left not in allowed:
            found.wrong.append(f"{where}: neither before nor after the commit")
            return
    else:
        found.by_journal += not reads(path, lambda contents: contents in allowed)
        journal = journal_of(path).read_bytes()
        if journals is not None and journal not in journals:
            journals.add(journal)
            _die_completing(folder, allowed, where, found)
        with suppress(InputError):
            results.open(path).close()
        left = _state(folder)
        if left not in allowed:
            found.wrong.append(f"{where}: the journal does not help")
            return
    found.as_before += left == allowed[0]
    found.as_after += left != allowed[0]
    if path.exists():
        _check_going_on(path, where, found)


def _check_going_on(path: Path, where: str, found: Boundaries) -> None:
    """The checkpoint fits the file; nothing else is left after the run has been continued."""
    try:
        with Writer.resume(path, GROUPS) as writer:
            for each in checkpoint_paths(path):
                writer.rewind(0, Checkpoint.read(each).facts["rows"])
        for each in checkpoint_paths(path):
            each.unlink()
    except InputError as error:
        if "complete" not in str(error):
            found.wrong.append(f"{where}: {error}")
    left = [name for name in litter(path) if not name.startswith(("calls", "state"))]
    found.wrong += [f"{where}: left {name}" for name in left]


def _die_completing(folder: Path, allowed: list[Any], where: str, found: Boundaries) -> None:
    """Apply the journal and die before every call of that."""
    n = 0
    while True:
        again = shutil.copytree(folder, folder.with_name("again"))
        status = in_copy(lambda: results.open(again / NAME).close(), at_call(n))  # noqa: B023
        found.twice += status == DIED
        results.open(again / NAME).close()
        if _state(again) not in allowed:
            found.wrong.append(f"{where}: other contents after the journal was interrupted before call {n}")
        shutil.rmtree(again)
        n += 1
        if status != DIED:
            return


def _state(folder: Path) -> Any:
    """Contents of the file; None if there is no file, a word if it does not open."""
    path = folder / NAME
    if not path.exists():
        return None
    try:
        return contents(path)
    except (OSError, KeyError, RuntimeError):
        return "torn"


def _settled(folder: Path) -> Any:
    """State of the file after a pending journal was applied."""
    if (folder / NAME).exists():
        results.open(folder / NAME).close()
    return _state(folder)


def new_folder(folder: Path) -> Path:
    """Make an empty folder."""
    folder.mkdir(parents=True)
    return folder


def memory_folder() -> str | None:
    """Folder in memory, where fsync takes no time; None if the system has none."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
