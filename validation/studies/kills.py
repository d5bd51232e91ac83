"""A study killed by SIGKILL at random instants: the same bits, nothing lost, nothing complete run again."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import tomli_w

from tiengine.study.folder import Folder
from validation.studies.parts import bits

__all__ = ["measure"]

PLAN: dict[str, Any] = {
    "scenario": "default",
    "seeds": 12,
    "set": {"train.distance": 20.0, "output.run_in": 2.0, "output.precision": "double"},
    "factors": [
        {"key": "train.speed_kmh", "name": "speed", "values": [260.0, 270.0, 280.0, 290.0, 300.0, 310.0, 320.0, 330.0]}
    ],
}
"""96 trains in eight tasks of twelve, each of two chunks of steps."""

LATEST = 5.0  # s after the first worker has begun: within the first tasks or after some of them
BEGUN = 60.0  # s until it has at the latest


def measure(folder: Path, kills: int, seed: int = 1) -> dict[str, Any]:
    """Run a study without a break and one with kills.

    Args:
        folder: New folder for both.
        kills: Number of kills.
        seed: Selects their instants.
    """
    folder.mkdir()
    plan = folder / "plan.toml"
    plan.write_text(tomli_w.dumps(PLAN), encoding="utf-8")
    command = [sys.executable, "-c", "from tiengine.cli.commands import main; main()", "study"]
    subprocess.run([*command, str(plan), f"-o{folder / 'whole'}", "--quiet"], check=True)
    killed, dice = folder / "killed", random.Random(seed)
    instants: list[float] = []
    again: list[str] = []
    left: list[int] = []
    for _ in range(kills):
        before = _written(killed)
        start = (
            [*command, "resume", str(killed)]
            if (killed / "study.json").exists()
            else [*command, str(plan), f"-o{killed}"]
        )
        instants.append(dice.uniform(0.0, LATEST))
        process = subprocess.Popen([*start, "--checkpoint=0.3", "--quiet"], start_new_session=True)
        _wait_for_work(killed)
        time.sleep(instants[-1])
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        time.sleep(0.5)
        for each in killed.glob("parts/.*.lock"):  # of killed workers; they no longer lock anything
            each.unlink()
        again += [path for path, at in before.items() if _written(killed).get(path) != at]
        left.append(len(Folder.open(killed).left()) if (killed / "study.json").exists() else -1)
        if left[-1] == 0:
            break
    subprocess.run([*command, "resume", str(killed), "--quiet"], check=True)
    return {
        "kills": len(instants),
        "instants": [round(each, 2) for each in instants],
        "tasks_left_after_each": left,
        "complete_parts_written_again": again,
        "same_bits": bits(killed) == bits(folder / "whole"),
    }


def _wait_for_work(folder: Path) -> None:
    """Wait until a worker holds a part."""
    deadline = time.monotonic() + BEGUN
    while not list(folder.glob("parts/.*.lock")) and time.monotonic() < deadline:
        time.sleep(0.02)


def _written(folder: Path) -> dict[str, int]:
    """Instants at which the parts and records of complete tasks were written."""
    if not (folder / "study.json").exists():
        return {}
    opened = Folder.open(folder)
    paths = [
        path for task in opened.complete() for path in (opened.part(task), folder / "records" / f"{task:05d}.json")
    ]
    return {str(path): path.stat().st_mtime_ns for path in paths}
