"""Size and duration of a study, estimated before it runs."""

from __future__ import annotations

import shutil
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tiengine.parameters.errors import InputError, RunFailedError
from tiengine.scenario.scenario import Scenario, duration, load_scenario
from tiengine.simulation.disk_space import estimated_bytes, size_text
from tiengine.study.design import Design

__all__ = ["Estimate", "check_space", "estimate", "estimated_size"]

MOST_LOOKED_AT = 20  # tasks; others are taken to be like their neighbours
SHORT = 4.0  # m, distance of the timing


@dataclass(frozen=True)
class Estimate:
    """Size and duration of a study.

    Attributes:
        points, trains, tasks: Numbers.
        size: Bytes of all parts.
        seconds: Wall time on one core [s]; NaN if it was not timed.
        workers: Processes on this machine.
    """

    points: int
    trains: int
    tasks: int
    size: int
    seconds: float
    workers: int

    def rows(self) -> list[tuple[str, str]]:
        """Descriptions and values."""
        here = self.seconds / min(self.workers, self.tasks)
        return [
            ("points", str(self.points)),
            ("trains", str(self.trains)),
            ("tasks", f"{self.tasks}, of up to 16 trains each"),
            ("size of the results", size_text(self.size)),
            ("wall time on one core", _time(self.seconds)),
            (f"wall time here, {self.workers} workers", _time(here)),
        ]


def _time(seconds: float) -> str:
    """Duration in seconds, minutes or hours."""
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"


def estimate(design: Design, workers: int) -> Estimate:
    """Estimate a study; a task is run over a few metres for its speed.

    Args:
        design: The study, with a scenario.
        workers: Processes on this machine.
    """
    chosen, weights = _chosen(design)
    simulated = [sum(duration(train) for train in each.members) for each in chosen]
    setup, rate = _timed(chosen[0])
    seconds = setup * len(design.tasks) + rate * float(np.dot(weights, simulated))
    size = float(np.dot(weights, [estimated_bytes(each) for each in chosen]))
    return Estimate(len(design.points), len(design.members), len(design.tasks), round(size), seconds, workers)


def estimated_size(design: Design) -> int:
    """Bytes of all parts of a study, to about ten per cent if its trains are alike.

    Args:
        design: The study, with a scenario.
    """
    chosen, weights = _chosen(design)
    return round(float(np.dot(weights, [estimated_bytes(each) for each in chosen])))


def check_space(design: Design, folder: Path) -> None:
    """Refuse a study whose results will not fit on the disk.

    Args:
        design: The study.
        folder: Its folder, or that in which it will be.

    Raises:
        InputError: The free space is too small.
    """
    if design.base is None:
        return
    needed, free = estimated_size(design), shutil.disk_usage(folder).free
    if needed > free:
        raise InputError(
            f"output = '{folder}': needs about {size_text(needed)}, {size_text(free)} are free; record fewer channels,"
            " longer output intervals, or write to another disk"
        )


def _chosen(design: Design) -> tuple[list[Scenario], Sequence[float]]:
    """Scenarios of some tasks, evenly chosen, and the number of tasks that each stands for."""
    count = min(len(design.tasks), MOST_LOOKED_AT)
    places = np.linspace(0, len(design.tasks) - 1, count).round().astype(int)
    trains = [len(design.tasks[place]) for place in places]
    scale = len(design.members) / sum(trains)
    return [design.scenario(int(place)) for place in places], [scale] * count


def _timed(scenario: Scenario) -> tuple[float, float]:
    """Wall time of setting up a task [s], and of one second of one train [s/s]; kernels are compiled before."""
    from tiengine.simulation import simulate

    half = min(SHORT, scenario.train.distance) / 2.0
    walls: list[float] = []
    for distance in (half / 4.0, half, 2.0 * half):
        clock = time.perf_counter()
        with suppress(RunFailedError):  # all trains derailed, which takes about as long
            simulate.run(load_scenario(scenario, {"train.distance": distance}), workers=0).close()
        walls.append(time.perf_counter() - clock)
    simulated = sum(duration(train) for train in scenario.members) * half / scenario.train.distance
    rate = max(walls[2] - walls[1], 0.0) / simulated
    return max(walls[1] - rate * simulated, 0.0), rate
