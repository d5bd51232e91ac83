"""Runs as processes that can be killed: the command itself, or a copy of this process with its kernels compiled.

The command takes about 10 s to start, nearly all of it for importing and compiling. A copy (fork) of a process that
has run the scenario before starts at once, does the same and writes the same bits, so that most of its life is spent
where files are written. Taichi's threads do not survive in a copy; with one thread only the plates' shape functions
need them, whose results are kept.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

__all__ = ["Process", "command", "copied"]

ROOT = Path(__file__).resolve().parents[2]


@dataclass
class Process:
    """A started process.

    Attributes:
        pid: Process id.
        log: Its log (:mod:`validation.faults.record`).
        words: File of its stderr.
        status: Exit status, negative for a signal; None while it runs.
    """

    pid: int
    log: Path
    words: Path
    status: int | None = None

    def poll(self) -> int | None:
        """Exit status; None while it runs."""
        if self.status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.status = os.waitstatus_to_exitcode(status)
        return self.status

    def wait(self, seconds: float = 120.0) -> int:
        """Wait for the exit status; a process that does not end in time is killed and counts as killed."""
        deadline = time.monotonic() + seconds
        while self.poll() is None:
            if time.monotonic() > deadline:
                self.signal(signal.SIGKILL)
            time.sleep(0.01)
        return int(self.status or 0)

    def signal(self, number: int) -> None:
        """Send a signal if the process still runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def signal_group(self, number: int) -> None:
        """Send a signal to the process and all its descendants."""
        if self.poll() is None:
            os.killpg(self.pid, number)

    def kill(self) -> int:
        """Send SIGKILL and return the exit status."""
        self.signal(signal.SIGKILL)
        return self.wait()

    def workers(self) -> list[psutil.Process]:
        """Descendants that compute."""
        with suppress(psutil.NoSuchProcess):
            below = psutil.Process(self.pid).children(recursive=True)
            return [each for each in below if "resource_tracker" not in _command_of(each)]
        return []

    @property
    def said(self) -> str:
        """Text that it wrote to stderr."""
        return self.words.read_text(errors="replace") if self.words.exists() else ""


def command(folder: Path, name: str, words: Sequence[str]) -> Process:
    """Start ``tiengine WORDS...``.

    Args:
        folder: Working folder.
        name: Name of its log, which is next to the folder.
        words: Arguments.
    """
    log, said = _beside(folder, name)
    call = [sys.executable, "-m", "validation.faults.record", str(log), *words]
    search = {"PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"}
    with said.open("wb") as file:
        started = subprocess.Popen(
            call, cwd=folder, env=os.environ | search, stdout=file, stderr=file, start_new_session=True
        )
    started.returncode = 0  # this class waits for the process
    return Process(started.pid, log, said)


def copied(folder: Path, name: str, words: Sequence[str], event: int = 0) -> Process:
    """Start ``tiengine WORDS...`` as a copy of this process, which must have run the scenario before.

    Args:
        folder: Working folder.
        name: Name of its log.
        words: Arguments.
        event: Event of its writer at which it stands still (:mod:`validation.faults.record`); 0 for none.
    """
    log, said = _beside(folder, name)
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if not pid:
        status = 70
        try:
            status = _as_command(folder, log, said, words, event)
        finally:
            os._exit(status)
    return Process(pid, log, said)


def _as_command(folder: Path, log: Path, said: Path, words: Sequence[str], event: int) -> int:
    """Run the command in a copy."""
    import logging

    import click

    from tiengine.cli.commands import main
    from tiengine.simulation import worker
    from validation.faults.record import recorded

    os.setsid()
    os.chdir(folder)
    file = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(file, 1)
    os.dup2(file, 2)
    logging.disable()
    recorded(log, event)
    worker.multiprocessing = _Copies()  # type: ignore[assignment,attr-defined]
    try:
        main(list(words), prog_name="tiengine", standalone_mode=True)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    except click.Abort:
        code = 1
    except BaseException:
        import traceback

        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    return code


class _Copies:
    """Substitute for ``multiprocessing`` in :mod:`tiengine.simulation.worker`: workers own only a pipe."""

    def __init__(self) -> None:
        self._fork = multiprocessing.get_context("fork")

    def get_context(self, name: str) -> _Copies:
        return self

    def Pipe(self) -> Any:
        return self._fork.Pipe()

    def parent_process(self) -> Any:
        return multiprocessing.parent_process()

    def Process(self, target: Callable[..., None], args: tuple[Any, ...], **options: Any) -> Any:
        return self._fork.Process(target=_alone, args=(target, args), **options)


def _alone(target: Callable[..., None], args: tuple[Any, ...]) -> None:
    """Close files that a spawned process would not have, in particular locks and pipes of others."""
    parent = multiprocessing.parent_process()
    kept = {0, 1, 2, args[0].fileno(), getattr(parent, "sentinel", None)}
    for number in [int(name) for name in os.listdir("/proc/self/fd")]:
        if number not in kept:
            with suppress(OSError):
                os.close(number)
    target(*args)


def _beside(folder: Path, name: str) -> tuple[Path, Path]:
    log, said = (folder.with_name(f"{folder.name}.{name}.{kind}") for kind in ("log", "said"))
    log.unlink(missing_ok=True)
    return log, said


def _command_of(process: psutil.Process) -> str:
    with suppress(psutil.NoSuchProcess, psutil.AccessDenied):
        return " ".join(process.cmdline())
    return ""
