"""Tasks: trains of an ensemble that are advanced together.

Trains that share everything but their irregularity share matrices, clock and seat phase: they form a group. A group is
cut into tasks of equal size; the last task is padded with copies of its last train, which are not written. Tasks follow
from the scenario alone: BLAS adds in an order that depends on the number of right-hand sides, so that the bits of a
train depend on the number of trains in its task, but neither on which they are nor on the process that computes them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tiengine.irregularity.irregularity import IrregularityParams
from tiengine.irregularity.track_checks import shortest_wavelength
from tiengine.irregularity.track_function import TrackFunction, recorded_name
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario, to_toml

__all__ = ["TRAINS_TOGETHER", "Task", "likeness", "plan"]

TRAINS_TOGETHER = {"splines": 4, "sines": 16}
"""Most trains advanced together, by the rails' trial functions: the rails of four trains fill a vector of the spline
step, more only leave cores idle; the dense products of sines gain from every further train."""


@dataclass(frozen=True, eq=False)
class Task:
    """Trains that are advanced together.

    Attributes:
        number: Number of the task, from 0.
        scenario: Scenario of the first train; the others differ in their irregularity alone.
        trains: Numbers of the trains in the ensemble.
        tracks: Irregularity of every train, then of the copies that pad the task.
        functions: Functions that give the tracks; empty where none does.
    """

    number: int
    scenario: Scenario
    trains: tuple[int, ...]
    tracks: tuple[IrregularityParams, ...]
    functions: tuple[TrackFunction, ...] = ()

    @property
    def size(self) -> int:
        """Trains advanced together, copies included."""
        return len(self.tracks)


def plan(scenario: Scenario, together: int | None = None, functions: Sequence[TrackFunction] = ()) -> tuple[Task, ...]:
    """Cut an ensemble into tasks.

    Args:
        scenario: The whole ensemble.
        together: Most trains in a task; None takes ``TRAINS_TOGETHER``.
        functions: Function that gives the track of every train; empty where none does.

    Raises:
        InputError: A file of measured irregularity cannot be read, or the functions are not those of the scenario.
    """
    _check_functions(scenario, functions)
    together = together or TRAINS_TOGETHER[scenario.numerics.trial_functions]
    members = scenario.members
    groups: dict[str, list[int]] = {}
    for i, train in enumerate(members):
        groups.setdefault(likeness(train), []).append(i)
    tasks: list[Task] = []
    for group in groups.values():
        tasks += _tasks(members, functions, group, together, len(tasks))
    return tuple(tasks)


def _check_functions(scenario: Scenario, functions: Sequence[TrackFunction]) -> None:
    """Refuse missing functions, and others than the run was begun with."""
    named, found = scenario.irregularity.function, recorded_name(functions)
    if named is None and functions:
        raise InputError(f"irregularity: function {found!r}: must be left out; the run was begun without one")
    if named is not None and not functions:
        raise InputError(
            f"irregularity.function = {named!r}: the track is given by a Python function, which must be passed again:"
            " tiengine.resume(file, irregularity=function), or tiengine.run for a new run"
        )
    if named is not None and named != found:
        raise InputError(f"irregularity: function {found!r}: must be {named!r}, with which the run was begun")


def _tasks(
    members: tuple[Scenario, ...], functions: Sequence[TrackFunction], group: list[int], together: int, number: int
) -> list[Task]:
    """A group in tasks of equal size, counted from ``number``."""
    count = math.ceil(len(group) / together)
    size = math.ceil(len(group) / count)
    tasks: list[Task] = []
    for first in range(0, len(group), size):
        trains = tuple(group[first : first + size])
        padded = (*trains, *(trains[-1],) * (size - len(trains)))
        tracks = tuple(members[i].irregularity for i in padded)
        given = tuple(functions[i] for i in padded if functions)
        tasks.append(Task(number + len(tasks), members[trains[0]], trains, tracks, given))
    return tasks


def likeness(train: Scenario) -> str:
    """Text that is the same for trains of one group: the irregularity's shortest wave matters to the time step.

    Args:
        train: Scenario of one train.
    """
    shortest = shortest_wavelength(train.irregularity)
    others = train.model_copy(update={"irregularity": IrregularityParams(), "presets": {}})
    return f"{shortest!r}\n{to_toml(others)}"
