"""kill -9 at random instants: remaining files, and whether the resumed run ends with the same bits."""

from __future__ import annotations

import shutil
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import psutil

from tiengine import result as results
from tiengine.parameters.errors import InputError
from tiengine.result_files.journal import journal_of
from validation.faults.contents import Contents, contents, differing, holds, litter, reads, start_of
from validation.faults.launch import Process, command, copied
from validation.faults.plan import Kill, Run
from validation.faults.record import Record, read

__all__ = ["Outcome", "Yard"]

NAME = "run.h5"
PATIENCE = 15.0  # s within which workers of a dead parent end: they notice at the end of their chunk
TRIES = 4  # repeats of a kill that came too late

Launch = Callable[[Path, str, Sequence[str]], Process]
LAUNCH: dict[str, Launch] = {"copy": copied, "command": command}


@dataclass
class Outcome:
    """Findings of a killed run.

    Attributes:
        kill: The kill.
        at: Instant after the start [s].
        phase: Phase of the run: "before", "set-up", "loop", "commit" (a journal existed).
        opens: Whether plain h5py opened the remaining file.
        mended: Whether the file opened only after the journal was applied.
        kept: Whether everything committed is in the file, bit by bit.
        lost_samples, lost_bytes: Data written since the last commit, of wheels and in all.
        resumed: How often the run was resumed.
        status: Last exit status.
        same: Whether the final file has the bits of the undisturbed run.
        wrong: Errors found.
    """

    kill: Kill
    at: float = 0.0
    phase: str = "before"
    opens: bool = True
    mended: bool = False
    kept: bool = True
    lost_samples: int = 0
    lost_bytes: int = 0
    resumed: int = 0
    status: int = 0
    same: bool = False
    wrong: list[str] = field(default_factory=list)

    @property
    def survived(self) -> bool:
        """Whether no error was found."""
        return self.same and self.kept and (self.opens or self.mended) and not self.wrong


class Yard:
    """A place where one run is repeatedly started, disturbed and compared.

    Attributes:
        folder: Parent of the folders of its runs.
        run: Run to disturb.
        reference: Contents of the file of an undisturbed run.
        instants: Times of the file, of the first samples and of the end of such a run [s], by kind of start.
    """

    def __init__(self, folder: Path, run: Run) -> None:
        """Run undisturbed in this process, which compiles the kernels."""
        self.folder, self.run = folder, run
        self._count = 0
        self.reference: Contents = self._undisturbed()
        self.instants: dict[str, tuple[float, float, float]] = {}

    def _undisturbed(self) -> Contents:
        """Run in this process, in which kernels remain compiled."""
        from tiengine.scenario.scenario import load_scenario
        from tiengine.simulation import simulate

        words = self.run.arguments
        settings = [words[i + 1] for i, word in enumerate(words) if word == "--set"]
        path = self.folder / "reference.h5"
        with simulate.run(load_scenario(self.run.scenario, settings), path, workers=1) as result:
            assert not result.failures, result.failures
        return contents(path)

    def place(self) -> Path:
        """Make an empty folder."""
        self._count += 1
        folder = self.folder / f"{self._count:04d}"
        folder.mkdir()
        return folder

    def start(self, folder: Path, how: str = "copy", *extra: str, event: int = 0) -> Process:
        """Start the run; a copy may stand still at an event of its writer."""
        return _launch(how, event)(folder, "run", [*self.run.arguments, "-o", NAME, *extra])

    def resume(self, folder: Path, how: str = "copy", event: int = 0) -> Process:
        """Start to resume it."""
        return _launch(how, event)(folder, "resume", ["resume", NAME, *self.run.effort])

    def go_on(self, folder: Path, how: str = "copy", event: int = 0) -> Process:
        """Resume, or start again if there is no file yet."""
        start = self.resume if (folder / NAME).exists() else self.start
        return start(folder, how, event=event)

    def clear(self, folder: Path) -> None:
        """Remove a folder and its logs."""
        shutil.rmtree(folder)
        for log in self.folder.glob(f"{folder.name}.*"):
            log.unlink()

    def measure(self, how: str) -> tuple[float, float, float]:
        """Instants of an undisturbed run [s]; it must have the same bits."""
        if how not in self.instants:
            folder = self.place()
            clock = time.perf_counter()
            process = self.start(folder, how)
            seen = [self._until(process, sign, folder) - clock for sign in (_exists, _loops)]
            process.wait()
            self.instants[how] = (seen[0], seen[1], time.perf_counter() - clock)
            bad = self.wrong(folder, process)
            if bad:
                raise RuntimeError(f"two undisturbed runs differ: {bad}; {process.said}")
            self.clear(folder)
        return self.instants[how]

    def perform(self, kill: Kill) -> Outcome:
        """Kill, inspect, resume, compare."""
        self.measure(kill.start)
        for attempt in range(TRIES):
            folder = self.place()
            outcome = Outcome(kill)
            process = self.start(folder, kill.start, event=kill.event)
            if self._kill(process, kill.moment, kill.part * 0.7**attempt, kill, folder, outcome):
                break
            self.clear(folder)
        else:
            outcome.wrong.append("ended before every kill")
            return outcome
        try:
            self._after(process, kill, folder, outcome)
        except Exception as error:
            outcome.wrong.append(f"{type(error).__name__}: {error}")
        if outcome.survived:
            self.clear(folder)
        return outcome

    def wait_for_file(self, process: Process, folder: Path) -> None:
        """Wait until a run has created its file."""
        self._until(process, _exists, folder)

    def wait_for_samples(self, process: Process, folder: Path) -> None:
        """Wait until a run has written samples."""
        self._until(process, _loops, folder)

    def committed(self, folder: Path, process: Process) -> list[str]:
        """Errors of an unfinished file."""
        outcome = Outcome(Kill("", "", "", "", 0.0, 0.0))
        self._look(process, folder, outcome)
        return outcome.wrong

    def wrong(self, folder: Path, process: Process) -> list[str]:
        """Differences from an undisturbed run, after exit status 0."""
        if process.status == 2 and _said_complete(process):
            pass  # it was killed after its last commit, while ending
        elif process.status != 0:
            return [f"exit status {process.status}: {process.said[-300:]}"]
        bad = differing(contents(folder / NAME), self.reference)
        return [f"other bits: {', '.join(bad[:5])}"] * bool(bad) + [f"left: {name}" for name in litter(folder / NAME)]

    def _after(self, process: Process, kill: Kill, folder: Path, outcome: Outcome) -> None:
        if kill.victim == "worker":
            process.wait()
            if process.status not in (0, 1):
                outcome.wrong.append(f"exit status {process.status}: {process.said[-300:]}")
        else:
            self._look(process, folder, outcome)
            process = self._go_on(kill.start, folder, outcome, kill.event if kill.again else 0)
            if kill.again:
                second = Outcome(kill)
                if self._kill(process, "loop", kill.then, kill, folder, second):
                    self._look(process, folder, second)
                    outcome.opens &= second.opens or second.mended
                    outcome.kept &= second.kept
                    outcome.wrong += second.wrong
                    process = self._go_on(kill.start, folder, outcome)
            process.wait()
        outcome.status = int(process.status or 0)
        bad = self.wrong(folder, process)
        outcome.same = not bad
        outcome.wrong += bad

    def _go_on(self, how: str, folder: Path, outcome: Outcome, event: int = 0) -> Process:
        outcome.resumed += 1
        return self.go_on(folder, how, event)

    def _kill(self, process: Process, moment: str, part: float, kill: Kill, folder: Path, outcome: Outcome) -> bool:
        """Kill at a moment; return whether it was still alive."""
        clock = time.perf_counter()
        exists, loops, ends = self.measure(kill.start)
        if kill.event:
            self._until(process, _stands, folder)
        elif moment == "before":
            time.sleep(part * exists)
        elif moment == "life":
            self._until(process, _exists, folder)
            time.sleep(part * (ends - exists))
        else:
            self._until(process, _loops, folder)
            time.sleep(part * (ends - loops) * (0.6 if moment == "commit" else 1.0))
        if moment == "commit" and not kill.event:
            self._until(process, _commits, folder)
        victims = process.workers()
        if process.poll() is not None or (kill.victim == "worker" and not victims):
            process.wait()
            return False
        outcome.at = time.perf_counter() - clock
        if kill.victim == "worker":
            which = int(np.random.default_rng(int(part * 1e9)).integers(len(victims)))
            outcome.phase = "loop" if read(process.log).loop else "set-up"
            victims[which].kill()
            return True
        process.signal(signal.SIGKILL)
        process.wait()
        left = psutil.wait_procs(victims, PATIENCE)[1]
        outcome.wrong += [f"worker {each.pid} outlives its parent" for each in left]
        return process.status == -signal.SIGKILL

    def _until(self, process: Process, sign: Callable[[Process, Path], bool], folder: Path) -> float:
        """Wait for a sign or the end; return the time."""
        while process.poll() is None and not sign(process, folder):
            if sign is not _commits:
                time.sleep(0.003)
        return time.perf_counter()

    def _look(self, process: Process, folder: Path, outcome: Outcome) -> None:
        """Inspect the files of the killed process."""
        path, noted = folder / NAME, read(process.log)
        if not path.exists():
            if noted.commits:
                outcome.kept = False
                outcome.wrong.append("no file after a commit")
            return
        outcome.phase = "commit" if journal_of(path).exists() else "loop" if noted.loop else "set-up"
        outcome.lost_samples += noted.lost_samples
        outcome.lost_bytes += noted.lost_bytes
        outcome.opens = reads(path, lambda left: not start_of(left, self.reference))
        left = contents(path) if outcome.opens else self._mended(path, outcome)
        if b"complete" in left.get("@status", ((), b""))[1]:
            outcome.phase = "after the end"
        outcome.kept = _kept(left, noted, self.reference, outcome)

    def _mended(self, path: Path, outcome: Outcome) -> Contents:
        """Open the file after its journal was applied."""
        had = journal_of(path).exists()
        try:
            results.open(path).close()
            left = contents(path)
        except (InputError, OSError) as error:
            outcome.wrong.append(f"{error}")
            return {}
        outcome.mended = had
        return left


def _kept(left: Contents, noted: Record, reference: Contents, outcome: Outcome) -> bool:
    bad = start_of(left, reference)
    if bad:
        outcome.wrong.append(f"other samples: {', '.join(bad[:5])}")
    enough = holds(left, noted.rows)
    if not enough:
        outcome.wrong.append("fewer samples than were committed")
    return enough and not bad


def _said_complete(process: Process) -> bool:
    """Whether there was nothing to resume any more."""
    return process.said.strip() == f"error: {NAME}: the run is complete; there is nothing to resume"


def _launch(how: str, event: int) -> Launch:
    """Start of a run that stands still at an event; 0 for none."""
    return partial(copied, event=event) if event else LAUNCH[how]


def _stands(process: Process, folder: Path) -> bool:
    return psutil.Process(process.pid).status() == psutil.STATUS_STOPPED


def _exists(process: Process, folder: Path) -> bool:
    return (folder / NAME).exists()


def _loops(process: Process, folder: Path) -> bool:
    return process.log.exists() and '"samples"' in process.log.read_text().rpartition('"samples": 0')[2]


def _commits(process: Process, folder: Path) -> bool:
    return any(each.name.endswith((".part", ".journal")) for each in folder.iterdir())
