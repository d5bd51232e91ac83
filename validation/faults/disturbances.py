"""Signals, other programs on the same file, a clock that jumps, workers that die twice."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tiengine import result as results
from tiengine.parameters.errors import InputError
from validation.faults.contents import contents, reads, start_of
from validation.faults.kills import NAME, Yard
from validation.faults.launch import Process
from validation.faults.space import Check

__all__ = ["batch_disturbances", "disturbances"]

STATUS = {signal.SIGINT: 130, signal.SIGTERM: 143}


def disturbances(yard: Yard) -> list[Check]:
    """Disturb runs of one train."""
    found = [_signalled(yard, number, times, Process.signal) for number in STATUS for times in (1, 2)]
    return [*found, _paused(yard), _two_runs(yard), _two_resumes(yard), _read_meanwhile(yard), _clock_jumps(yard)]


def batch_disturbances(yard: Yard) -> list[Check]:
    """Disturb runs of trains in two workers."""
    found = [_signalled(yard, number, 1, Process.signal) for number in STATUS]
    found += [_signalled(yard, number, times, Process.signal_group) for number in STATUS for times in (1, 2)]
    return [*found, _paused(yard), _worker_killed_twice(yard)]


def _signalled(yard: Yard, number: signal.Signals, times: int, send: Callable[[Process, int], None]) -> Check:
    """Send a signal, once or twice, and resume."""
    folder = yard.place()
    process = yard.start(folder)
    yard.wait_for_samples(process, folder)
    for _ in range(times):
        send(process, number)
        time.sleep(0.05)
    whom = "the whole group" if send is Process.signal_group else "the process"
    words = f"{number.name} {'twice ' if times > 1 else ''}to {whom}, {yard.run.words}"
    status, said = process.wait(), process.said.strip()
    bad = [] if status == STATUS[number] else [f"exit status {status}, not {STATUS[number]}"]
    if (times == 1 and not said.endswith(f"resume with: tiengine resume {NAME}")) or "Traceback" in said:
        bad.append(f"said: {said[-300:]}")
    bad += [f"worker {each.pid} is left" for each in process.workers()] + yard.committed(folder, process)
    again = yard.go_on(folder)
    again.wait()
    bad += yard.wrong(folder, again)
    return {"words": words, "good": not bad, "status": status, "said": said, "wrong": bad}


def _paused(yard: Yard) -> Check:
    """Send SIGSTOP and, two seconds later, SIGCONT."""
    folder = yard.place()
    process = yard.start(folder)
    yard.wait_for_samples(process, folder)
    process.signal_group(signal.SIGSTOP)
    time.sleep(2.0)
    process.signal_group(signal.SIGCONT)
    process.wait()
    return _ended(f"SIGSTOP, after 2 s SIGCONT, {yard.run.words}", yard.wrong(folder, process))


def _two_runs(yard: Yard) -> Check:
    """Start another run on the same file, with and without --force: refused, the first is not disturbed."""
    folder, bad = yard.place(), []
    process = yard.start(folder)
    yard.wait_for_samples(process, folder)
    for extra in ((), ("--force",)):
        other = yard.start(folder, "copy", *extra)
        other.wait()
        if other.status != 2 or "error: " not in other.said or "\n" in other.said.strip():
            bad.append(f"second run {extra}: exit status {other.status}: {other.said}")
    alive = process.poll() is None
    process.wait()
    words = f"a second run at the same file, also with --force{'' if alive else ' (the first had ended)'}"
    return _ended(words, bad + yard.wrong(folder, process))


def _two_resumes(yard: Yard) -> Check:
    """Resume the same file twice at once: one is refused."""
    folder, bad = yard.place(), []
    process = yard.start(folder)
    yard.wait_for_samples(process, folder)
    process.kill()
    first = yard.resume(folder)
    while not (folder / f".{NAME}.lock").exists() and first.poll() is None:
        time.sleep(0.002)
    time.sleep(0.2)
    second = yard.resume(folder)
    if second.wait() != 2 or "another run is writing it" not in second.said:
        bad.append(f"second resume: exit status {second.status}: {second.said}")
    first.wait()
    return _ended("two processes that resume the same file at once", bad + yard.wrong(folder, first))


def _read_meanwhile(yard: Yard) -> Check:
    """Read the file continuously, by h5py and by tiengine.open, while it is written."""
    folder, bad = yard.place(), []
    process = yard.start(folder)
    yard.wait_for_file(process, folder)
    plain = [0, 0]
    opened = 0
    while process.poll() is None:
        plain[reads(folder / NAME, lambda left: not start_of(left, yard.reference))] += 1
        try:
            with results.open(folder / NAME) as result:
                result.finished  # noqa: B018
            opened += 1
        except InputError as error:
            bad.append(f"tiengine.open: {error}")
    missed, read = plain
    words = f"read {read} times by h5py ({missed} times it came in the middle of a commit), {opened} times"
    words += " by tiengine.open while it is written"
    return _ended(words, bad + yard.wrong(folder, process))


def _clock_jumps(yard: Yard) -> Check:
    """Let the clock jump by hours at every reading."""
    folder = yard.place()
    real, jumps = time.time, [0]

    def jumping() -> float:
        jumps[0] += 1
        return real() + (-1) ** jumps[0] * 3600.0 * jumps[0]

    time.time = jumping  # copies inherit it
    try:
        process = yard.start(folder)
    finally:
        time.time = real
    process.wait()
    return _ended("time.time jumps by hours, forwards and backwards, at every call", yard.wrong(folder, process))


def _worker_killed_twice(yard: Yard) -> Check:
    """Kill both workers of a task: its trains are marked, the others complete, exit status 1."""
    folder, bad = yard.place(), []
    process = yard.start(folder)
    victims: list[int] = []
    yard.wait_for_samples(process, folder)
    victims.append(process.workers()[0].pid)
    os.kill(victims[0], signal.SIGKILL)
    known = {each.pid for each in process.workers()} | set(victims)
    while len(victims) < 2 and process.poll() is None:
        new = [each.pid for each in process.workers() if each.pid not in known]
        if new:
            time.sleep(1.0)  # the second worker has the task by then
            os.kill(new[0], signal.SIGKILL)
            victims.append(new[0])
        time.sleep(0.002)
    status, said = process.wait(), process.said.strip()
    if status != 1 or "worker died twice" not in said or "Traceback" in said:
        bad.append(f"exit status {status}: {said[-300:]}")
    with results.open(folder / NAME) as result:
        failed = sorted(result.failures)
        bad += [] if len(failed) == 2 and result.finished else [f"failed: {failed}, finished: {result.finished}"]
    found = contents(folder / NAME)
    bad += start_of({name: value for name, value in found.items() if not _of(name, failed)}, yard.reference)
    whole = [name for name in yard.reference if "@" not in name and name.startswith("trains/")]
    others = sorted(name for name in whole if not _of(name, failed))
    bad += [f"not complete: {name}" for name in others if found.get(name) != yard.reference[name]][:5]
    bad += [f"left: {each.name}" for each in folder.iterdir() if each.name != NAME]
    words = "a worker killed, then the one that continued its trains: they are marked, the others complete"
    return {"words": words, "good": not bad, "status": status, "said": said, "wrong": bad}


def _of(name: str, trains: list[int]) -> bool:
    return any(name.startswith(f"trains/{train:03d}") for train in trains)


def _ended(words: str, bad: list[str]) -> Check:
    return {"words": words, "good": not bad, "wrong": bad}


def clock_readers(package: Path) -> list[str]:
    """Places in the source that read the time of day.

    Args:
        package: Folder of the source.
    """
    words = ("time.time(", "datetime.now", "datetime.utcnow", "time.ctime", "time.localtime")
    found: list[Any] = []
    for path in sorted(package.glob("*.py")):
        for i, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            found += [f"{path.name}:{i}" for word in words if word in line]
    return found
