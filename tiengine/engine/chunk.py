"""Input and records of a number of steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiengine.kernels import layout as at
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Ints, Reals

__all__ = ["Chunk"]


@dataclass(eq=False)
class Chunk:
    """Buffers of a number of steps; the same for every kind of step.

    Attributes:
        clock: Window at the end of each step, shape (steps, N_CLOCK or more: loads of rails where the ground moves).
        irregularity: Track channels at the wheelsets, shape (B, steps, W, N_IRREGULARITY or N_SHAPED).
        wheel: Wheel output of every step, shape (B, steps, W, 2, N_WHEEL_RECORD).
        body: Recorded displacement, velocity, acceleration of the bodies, shape (B, rows, 3, 5 bodies).
        slab: Displacement, velocity, acceleration of the slabs' coordinates, with the bodies, shape (B, rows, 3, slots,
            dofs).
        rear_slab: Rear slab in memory then, shape (rows,); slab i is in slot i modulo their number.
        mortar: Largest and smallest pressure of each slab then [Pa], shape (B, rows, slots, 2).
        filled: Rows of the bodies' record that the last steps have filled.
    """

    clock: Reals
    irregularity: Reals
    wheel: Reals
    body: Reals
    slab: Reals
    rear_slab: Ints
    mortar: Reals
    filled: int = 0

    @classmethod
    def empty(cls, ingredients: Ingredients, steps: int, body_rows: int) -> Chunk:
        """Buffers for ``steps`` steps, some of which record the bodies."""
        train, B = ingredients.train, ingredients.trains
        W, bodies, rows, slots = len(train.wheelset_x), len(train.body_names), max(body_rows, 1), ingredients.slots
        return cls(
            clock=np.zeros((steps, at.N_CLOCK + ingredients.rail_loads)),
            irregularity=np.zeros((B, steps, W, ingredients.channels)),
            wheel=np.zeros((B, steps, W, 2, at.N_WHEEL_RECORD[ingredients.contact.patches])),
            body=np.zeros((B, rows, 3, 5 * bodies)),
            slab=np.zeros((B, rows, 3, slots, ingredients.designs.matrices[0].n)),
            rear_slab=np.zeros(rows, dtype=np.int64),
            mortar=np.zeros((B, rows, slots, 2)),
        )
