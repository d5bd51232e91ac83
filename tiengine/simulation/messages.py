"""What the trains of a task send to whoever writes the file; it may come from another process.

One :class:`Begun`, then an :class:`Advanced` for every thousand steps, a :class:`Saved` now and then, and one
:class:`Ended`, or :class:`Paused` where they were asked to stop; :class:`Lost` where they could not be set up or died.
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
        facts: What is known of each train from the beginning, by its number.
    """

    task: int
    labels: TrainLabels
    facts: dict[int, dict[str, Any]]


@dataclass(frozen=True, eq=False)
class Advanced:
    """Trains have advanced by some steps.

    Attributes:
        time: Simulated since the beginning [s].
        blocks: Samples of each train that runs, by its number; a train that fails is in it for the last time.
        failed: Why trains failed in these steps.
        events: What happened to trains in them.
    """

    time: float
    blocks: dict[int, dict[str, Block]]
    failed: dict[int, str]
    events: dict[int, list[Event]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Saved:
    """What trains need to go on from here.

    Attributes:
        trains: Their numbers.
        checkpoint: Of their task; the receiver adds how far the file has come.
    """

    trains: tuple[int, ...]
    checkpoint: Checkpoint


@dataclass(frozen=True)
class Paused:
    """Trains that stopped because they were asked to, after they were saved.

    Attributes:
        trains: Their numbers.
    """

    trains: tuple[int, ...]


@dataclass(frozen=True)
class Costs:
    """Wall times [s] of a task, and the memory of the process that did it.

    Attributes:
        process: Its number.
        jit: Compiling kernels.
        setup: Everything else before the loop.
        loop: The loop, with the time that the receiver of its messages took.
        memory: Peak of the process so far [MB].
    """

    process: int
    jit: float
    setup: float
    loop: float
    memory: float


@dataclass(frozen=True, eq=False)
class Ended:
    """Trains have run to the end of their way, or failed.

    Attributes:
        task: Number of their task.
        facts: What is known of each train at the end, by its number.
        costs: Of all of them.
    """

    task: int
    facts: dict[int, dict[str, Any]]
    costs: Costs


@dataclass(frozen=True)
class Lost:
    """Trains that stop here, whatever they have sent.

    Attributes:
        trains: Their numbers.
        why: A sentence.
        refused: Whether their scenario is to blame.
    """

    trains: tuple[int, ...]
    why: str
    refused: bool = False


Message = Begun | Advanced | Saved | Paused | Ended | Lost
