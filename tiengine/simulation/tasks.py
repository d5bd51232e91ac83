"""Tasks: trains of an ensemble that are advanced together.

Trains that share everything but their irregularity share matrices, clock and seat phase: they form a group. A group is
cut into tasks of equal size; the last task is padded with copies of its last train, which are not written. Tasks follow
from the scenario alone: BLAS adds in an order that depends on the number of right-hand sides, so that the bits of a
train depend on the number of trains in its task, but neither on which they are nor on the process that computes them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from tiengine.irregularity.irregularity import IrregularityParams, make_irregularity
from tiengine.scenario.scenario import Scenario, to_toml

__all__ = ["TRAINS_TOGETHER", "Task", "plan"]

TRAINS_TOGETHER = 16
"""Most trains advanced together."""


@dataclass(frozen=True, eq=False)
class Task:
    """Trains that are advanced together.

    Attributes:
        number: Number of the task, from 0.
        scenario: Scenario of the first train; the others differ in their irregularity alone.
        trains: Numbers of the trains in the ensemble.
        tracks: Irregularity of every train, then of the copies that pad the task.
    """

    number: int
    scenario: Scenario
    trains: tuple[int, ...]
    tracks: tuple[IrregularityParams, ...]

    @property
    def size(self) -> int:
        """Trains advanced together, copies included."""
        return len(self.tracks)


def plan(scenario: Scenario, together: int = TRAINS_TOGETHER) -> tuple[Task, ...]:
    """Cut an ensemble into tasks.

    Args:
        scenario: The whole ensemble.
        together: Most trains in a task.

    Raises:
        InputError: A file of measured irregularity cannot be read.
    """
    members = scenario.members
    groups: dict[str, list[int]] = {}
    for i, train in enumerate(members):
        groups.setdefault(_shared(train), []).append(i)
    tasks: list[Task] = []
    for group in groups.values():
        tasks += _tasks(members, group, together, len(tasks))
    return tuple(tasks)


def _tasks(members: tuple[Scenario, ...], group: list[int], together: int, number: int) -> list[Task]:
    """A group in tasks of equal size, counted from ``number``."""
    count = math.ceil(len(group) / together)
    size = math.ceil(len(group) / count)
    tasks: list[Task] = []
    for first in range(0, len(group), size):
        trains = tuple(group[first : first + size])
        padded = (*trains, *(trains[-1],) * (size - len(trains)))
        tasks.append(
            Task(number + len(tasks), members[trains[0]], trains, tuple(members[i].irregularity for i in padded))
        )
    return tasks


def _shared(train: Scenario) -> str:
    """Text that is the same for trains of one group: the irregularity's shortest wave matters to the time step."""
    track = train.irregularity
    shortest = track.shortest_wavelength if track.file is None else make_irregularity(track, 0.0).shortest_wavelength
    others = train.model_copy(update={"irregularity": IrregularityParams(), "presets": {}})
    return f"{shortest!r}\n{to_toml(others)}"
