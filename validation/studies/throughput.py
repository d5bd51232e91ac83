"""A thousand short trains as a study and as one ensemble: throughput, memory, and the time that a status takes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import psutil
import tomli_w

from tiengine.study.folder import Folder

__all__ = ["measure"]

SET: dict[str, Any] = {
    "train.distance": 20.0,
    "output.run_in": 2.0,
    "output.wheel_channels": ["vertical_force", "lateral_force"],
    "output.wheel_interval": 1e-3,
}
SCENARIO = "default"
EVERY = 2.0  # s between two looks at a running process


@dataclass(frozen=True)
class Cost:
    """Costs of a command with all its processes.

    Attributes:
        wall: Wall time [s].
        cpu: Processor time of all processes [s]; unlike the wall time it hardly depends on other programs.
        memory: Memory of all processes together, each tenth of the run [MB].
        status: Longest time that the status of the study took to read meanwhile [s].
    """

    wall: float
    cpu: float
    memory: list[float]
    status: float


def measure(folder: Path, trains: int, workers: int) -> dict[str, Any]:
    """Run an ensemble and a study of the same trains.

    A study evaluates the key figures of every train, an ensemble does not: they are evaluated from its file afterwards.

    Args:
        folder: New folder for both.
        trains: Number of trains.
        workers: Worker processes of each.
    """
    folder.mkdir()
    plan = folder / "plan.toml"
    settings = [f"--set={key}={json.dumps(value)}" for key, value in SET.items()]
    plan.write_text(tomli_w.dumps({"scenario": SCENARIO, "seeds": trains, "set": SET}), encoding="utf-8")
    count = f"--workers={workers}"
    command = [sys.executable, "-c", "from tiengine.cli.commands import main; main()"]
    ensemble = _watched(
        [*command, "run", SCENARIO, f"--set=ensemble.size={trains}", *settings, count, f"-o{folder / 'all.h5'}"], None
    )
    study = _watched([*command, "study", str(plan), f"-o{folder / 'study'}", count], folder / "study")
    evaluate = "from tiengine.result import open; from tiengine.study.figures import figures_of; import sys"
    code = f"{evaluate}; result = open(sys.argv[1]); print(len(figures_of(result)))"
    figures = _watched([sys.executable, "-c", code, str(folder / "all.h5")], None)
    return {
        "trains": trains,
        "workers": workers,
        "ensemble": asdict(ensemble),
        "study": asdict(study),
        "figures_of_ensemble": asdict(figures),
        "throughput_by_cpu": (ensemble.cpu + figures.cpu) / study.cpu,
        "throughput_by_cpu_without_figures": ensemble.cpu / (study.cpu - figures.cpu),
        "throughput_by_wall": (ensemble.wall + figures.wall / workers) / study.wall,
    }


def _watched(command: list[str], study: Path | None) -> Cost:
    """Run a command and watch it."""
    clock, before = time.perf_counter(), os.times()
    memory: list[float] = []
    status = 0.0
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None:
        time.sleep(EVERY)
        memory.append(_memory(process.pid))
        if study is not None and (study / "study.json").exists():
            began = time.perf_counter()
            Folder.open(study).status()
            status = max(status, time.perf_counter() - began)
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)}: exit status {process.returncode}")
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    tenth = max(len(memory) // 10, 1)
    return Cost(
        time.perf_counter() - clock, cpu, [max(memory[i : i + tenth]) for i in range(0, len(memory), tenth)], status
    )


def _memory(pid: int) -> float:
    """Memory of a process and its descendants [MB]."""
    total = 0
    try:
        parent = psutil.Process(pid)
        for each in (parent, *parent.children(recursive=True)):
            total += each.memory_info().rss
    except psutil.NoSuchProcess:
        pass
    return total / 1e6
