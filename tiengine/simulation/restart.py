"""Checkpoint of running trains: plain arrays that hold all that the coming steps depend on."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.errors import InputError
from tiengine.recording.guards import Watch
from tiengine.result_files.checkpoint import Checkpoint
from tiengine.simulation.time_loop import Run

__all__ = ["restore", "save"]

TRACKSIDE = "trackside."


def save(run: Run, loop: float) -> Checkpoint:
    """Make a checkpoint between two chunks of steps.

    Args:
        run: Running trains.
        loop: Wall time of the loop so far [s].
    """
    stepper, state = run.stepper, run.stepper.state
    arrays: dict[str, NDArray[Any]] = {f"state.{name}": value for name, value in state.arrays().items()}
    arrays |= {f"watch.{name}": value for name, value in _arrays_of(run.guard.watch).items()}
    arrays |= {f"{TRACKSIDE}{name}": value for name, value in run.trackside.saved().items()}
    facts = {
        "done": run.done,
        "position": run.position,
        "loop": loop,
        "speed": stepper.factored_speed,
        "first_seat": state.first_seat,
        "first_slab": state.first_slab,
        "steps": run.steps.tolist(),
        "alive": run.alive,
        "stopped": {str(place): step for place, step in run.guard.stopped.items()},
    }
    return Checkpoint(run.task.number, facts, arrays)


def restore(run: Run, saved: Checkpoint) -> None:
    """Continue from a checkpoint.

    Args:
        run: Trains of the same task at rest.
        saved: The checkpoint.

    Raises:
        InputError: It does not fit the scenario.
    """
    state, watch, facts = run.stepper.state, run.guard.watch, saved.facts
    try:
        for part, targets in (("state", state.arrays()), ("watch", _arrays_of(watch))):
            for name, target in targets.items():
                array = saved.arrays[f"{part}.{name}"]
                if array.shape != target.shape or array.dtype != target.dtype:
                    raise ValueError(f"{part}.{name}: shape {array.shape}, here {target.shape}")
                target[...] = array
        of_track = {key.removeprefix(TRACKSIDE): a for key, a in saved.arrays.items() if key.startswith(TRACKSIDE)}
        run.trackside.restore(of_track)
        state.first_seat, state.first_slab = int(facts["first_seat"]), int(facts["first_slab"])
        run.done, run.position = int(facts["done"]), float(facts["position"])
        run.alive, run.steps[:] = [int(b) for b in facts["alive"]], facts["steps"]
        run.guard.stopped = {int(place): int(step) for place, step in facts["stopped"].items()}
        run.stepper.factor(float(facts["speed"]))
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise InputError(f"checkpoint of task {saved.task}: does not fit the scenario ({error})") from None


def _arrays_of(watch: Watch) -> dict[str, NDArray[Any]]:
    """Arrays of the guard's memory, by name."""
    found: dict[str, NDArray[Any]] = {}
    for memory in (watch, watch.oscillation):
        values = {each.name: getattr(memory, each.name) for each in fields(memory)}
        found |= {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    return found
