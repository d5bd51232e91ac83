"""What can go wrong with the physics of a run, found chunk by chunk."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tiengine.kernels import layout as at
from tiengine.model import Model
from tiengine.stepper import Chunk

if TYPE_CHECKING:
    from tiengine.recorder import Recorder

__all__ = ["RunFailedError", "check_chunk"]

SIDES = ("left", "right")


class RunFailedError(RuntimeError):
    """A run that ended early: the message says where, when and why."""


def check_chunk(
    model: Model, chunk: Chunk, recorder: Recorder, first: int, position: NDArray[np.float64]
) -> dict[int, str]:
    """Look for numbers that ran away and for wheels that left the profile.

    Args:
        model: Constant data.
        chunk: Recorded buffers.
        recorder: Says which steps were recorded.
        first: Number of the chunk's first step, from 1.
        position: Chainage of the first vehicle's centre at each step [m], shape (steps,).

    Returns:
        A sentence for each train that failed, by its place in the chunk.
    """
    steps = np.arange(first, first + len(position))
    recorded = np.flatnonzero(steps % recorder.wheel_every == 0)
    table = model.given.contact
    limit = table.u_min + (table.values.shape[0] - 2) * table.du
    failed = {}
    for train, wheel in enumerate(chunk.wheel[:, : len(recorded)]):
        force, shift = wheel[..., at.NORMAL_FORCE], wheel[..., at.RELATIVE_SHIFT]
        wrong = ~np.isfinite(force) | ~np.isfinite(shift)
        if wrong.any():
            why = "numbers ran away; try a shorter time step or look at the irregularity"
        else:
            wrong = shift > limit
            why = f"derailed: lateral shift beyond {limit * 1e3:.1f} mm on the flange side"
        if wrong.any():
            row, wheelset, side = np.argwhere(wrong)[0]
            i = recorded[row]
            failed[train] = (
                f"wheelset {wheelset + 1} {SIDES[side]} {why}"
                f" (t = {steps[i] * recorder.dt:.4f} s, chainage {position[i]:.2f} m)"
            )
    return failed
