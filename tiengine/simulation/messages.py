"""Messages of the trains of a task to the collector, possibly from another process.

One :class:`Begun`, then an :class:`Advanced` for every thousand steps, a :class:`Saved` for every checkpoint, and one
:class:`Ended`, or :class:`Paused` after a request to stop; :class:`Lost` where they could not be set up or died.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from tiengine.result_files.checkpoint import Checkpoint
from tiengine.result_files.events import Event
from tiengine.result_files.layout import Block, TrainLabels

__all__ = ["Advanced", "Begun", "Costs", "Ended", "Lost", "Message", "Paused", "Saved"]


@dataclass(frozen=True, eq=False)
class Begun:
    """Trains are about to run.

    Attributes:
        task: Number of their task.
        labels: Labels of each of them.
        facts: Facts of each train that are known from the start, by its number.
    """

    task: int
    labels: TrainLabels
    facts: dict[int, dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Advanced:
    """Trains have advanced by some steps.

    Attributes:
        time: Simulated time since the start [s].
        blocks: Samples of each train that runs, by its number; a train that fails is in it for the last time.
        failed: Reasons why trains failed in these steps, by their number.
        events: Events of trains in these steps, by their number.
    """

    time: float
    blocks: dict[int, dict[str, Block]]
    failed: dict[int, str]
    events: dict[int, list[Event]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Saved:
    """Checkpoint of trains.

    Attributes:
        trains: Their numbers.
        checkpoint: Checkpoint of their task; the receiver adds the length of the file's datasets.
    """

    trains: tuple[int, ...]
    checkpoint: Checkpoint


@dataclass(frozen=True)
class Paused:
    """Trains that stopped on request, after they were saved.

    Attributes:
        trains: Their numbers.
    """

    trains: tuple[int, ...]


@dataclass(frozen=True)
class Costs:
    """Wall times [s] of a task, and the memory of its process.

    Attributes:
        process: Number of the process.
        jit: Compiling kernels.
        setup: Everything else before the loop.
        loop: The loop, with the time that the receiver of its messages took.
        memory: Peak memory of the process so far [MB].
    """

    process: int
    jit: float
    setup: float
    loop: float
    memory: float


@dataclass(frozen=True, eq=False)
class Ended:
    """Trains have run their whole distance, or failed.

    Attributes:
        task: Number of their task.
        facts: Facts of each train at the end, by its number.
        costs: Costs of all of them.
    """

    task: int
    facts: dict[int, dict[str, Any]]
    costs: Costs


@dataclass(frozen=True)
class Lost:
    """Trains that end here without an :class:`Ended`.

    Attributes:
        trains: Their numbers.
        why: A sentence with the reason.
        refused: Whether their scenario was refused.
    """

    trains: tuple[int, ...]
    why: str
    refused: bool = False


Message = Begun | Advanced | Saved | Paused | Ended | Lost
