"""Full disks, read-only disks, and estimates of the space that a run needs."""

from __future__ import annotations

import errno
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate
from tiengine.simulation.disk_space import estimated_bytes
from validation.faults.kills import NAME, Yard
from validation.faults.launch import Process

__all__ = ["Check", "disk_full", "estimates", "read_only", "refused_at_the_start", "small_disk"]

Check = dict[str, Any]
"""An experiment (``words``), whether it succeeded (``good``), and a note."""

DISK = 64_000_000  # bytes
LEFT = (0, 60_000, 150_000, 300_000, 600_000, 1_000_000, 1_600_000, 2_500_000, 3_400_000, 4_200_000)
"""Bytes left on a disk after a run has created its file; the complete file takes 4.8 MB, its checkpoint 0.2 MB."""

SIZES = (
    ("paper", "train.distance=100"),
    ("paper", "train.distance=400"),
    ("default", "train.distance=60"),
    ("default", "train.distance=60", 'output.precision="double"', "output.envelopes=false"),
    ("paper", "train.distance=200", "output.wheel_interval=0.001", "output.deflection_interval=0.02"),
    ("braking", "train.distance=100", 'gauges=[{name="post",on="rail",chainage=50,side="left"}]'),
    ("smooth", "train.distance=100", "ensemble.size=2"),
)
"""Scenario and settings of runs whose size is estimated."""


@contextmanager
def small_disk(folder: Path, size: int = DISK) -> Iterator[bool]:
    """Mount a small file system in a folder; return whether that succeeded (it needs root)."""
    words = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    mounted = shutil.which("mount") is not None and subprocess.run(words, capture_output=True).returncode == 0
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", "-l", str(folder)], check=True)


def disk_full(yard: Yard, left: int) -> Check:
    """Run with only the given bytes left after the file exists; then make room, and resume."""
    words = f"disk full: {left / 1e6:.2f} MB left once the file is there"
    folder = yard.place()
    with small_disk(folder) as mounted:
        if not mounted:
            return _skipped(words)
        process = yard.start(folder)
        yard.wait_for_file(process, folder)
        ballast = folder / "ballast"
        _fill(ballast, left)
        status = process.wait()
        bad, said = _stopped_clearly(process), process.said.strip()
        before = yard.committed(folder, process)
        ballast.unlink()
        resumed = yard.go_on(folder)
        resumed.wait()
        bad += before + yard.wrong(folder, resumed)
    return {"words": words, "good": not bad, "status": status, "said": said, "wrong": bad}


def refused_at_the_start(yard: Yard) -> Check:
    """Run on a disk that is too small from the beginning."""
    folder = yard.place()
    words = "disk too small from the beginning: refused, saying how much is missing"
    with small_disk(folder, 1_000_000) as mounted:
        if not mounted:
            return _skipped(words)
        process = yard.start(folder)
        process.wait()
        bad = _stopped_clearly(process)
        if "are missing" not in process.said or list(folder.iterdir()):
            bad.append(f"not refused: {process.said}, {list(folder.iterdir())}")
    return {"words": words, "good": not bad, "status": process.status, "said": process.said.strip(), "wrong": bad}


def read_only(yard: Yard) -> list[Check]:
    """Run and resume in a read-only folder; resume again after it has become writable."""
    folder, checks = yard.place(), []
    with small_disk(folder) as mounted:
        if not mounted:
            return [_skipped("read-only folder")]
        process = yard.start(folder)
        yard.wait_for_samples(process, folder)
        process.kill()
        left = (folder / NAME).read_bytes()
        tries: tuple[tuple[str, Callable[[], Process]], ...] = (
            ("resume in a read-only folder", lambda: yard.resume(folder)),
            ("run into a read-only folder", lambda: yard.start(folder, "copy", "-o", "other.h5")),
            ("run over a file in a read-only folder", lambda: yard.start(folder, "copy", "--force")),
        )
        subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=True)
        for words, start in tries:
            process = start()
            process.wait()
            bad = _stopped_clearly(process)
            if (folder / NAME).read_bytes() != left:
                bad.append("the file has changed")
            checks.append(
                {"words": words, "good": not bad, "status": process.status, "said": process.said.strip(), "wrong": bad}
            )
        subprocess.run(["mount", "-o", "remount,rw", str(folder)], check=True)
        process = yard.resume(folder)
        process.wait()
        bad = yard.wrong(folder, process)
        checks.append({"words": "resume once it can be written to", "good": not bad, "wrong": bad})
    return checks


def estimates(folder: Path) -> list[Check]:
    """Compare estimated and true sizes of some runs."""
    found = []
    for i, (name, *settings) in enumerate(SIZES):
        scenario = load_scenario(name, settings)
        path = folder / f"size{i}.h5"
        simulate.run(scenario, path, workers=1).close()
        true, estimate = path.stat().st_size, estimated_bytes(scenario)
        path.unlink()
        words = f"estimated size: {' '.join((name, *settings))}"
        off = estimate / true - 1.0
        good = 0.0 <= off <= 0.1
        found.append({"words": words, "good": good, "true": true, "estimate": estimate, "off": off, "wrong": []})
    return found


def _fill(ballast: Path, left: int) -> None:
    """Write a file that leaves the given bytes on its disk."""
    with ballast.open("wb", buffering=0) as file:
        try:
            while True:
                free = shutil.disk_usage(ballast.parent).free - left
                if free < 4096 or not file.write(bytes(min(free, 1_000_000))):
                    return
        except OSError as error:
            if error.errno != errno.ENOSPC:
                raise


def _stopped_clearly(process: Process) -> list[str]:
    """Errors in the way a run ended that could not continue."""
    said = process.said.strip()
    bad = [f"exit status {process.status}"] if process.status != 2 else []
    if not said.startswith("error: ") or "\n" in said:
        bad.append(f"said: {said[-400:]}")
    return bad


def _skipped(words: str) -> Check:
    return {"words": f"{words} (skipped: nothing can be mounted here)", "good": None, "wrong": []}
