"""Loads of cars and slabs as the kernels read them: a row of numbers a step, or one row for all steps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.aligned import aligned_zeros
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Reals
from tiengine.vehicle.given_loads import GivenLoads

__all__ = ["LoadRows"]


class LoadRows:
    """Rows of loads, one after another in one array.

    First ``width`` numbers: force per unit rate of speed. Then rows: ``width`` forces, gravity among them; elongations
    of the nonlinear elements that the frames make; yaw rates of the wheelsets' frames, then roll rates; from a multiple
    of ``align`` on, the ground's acceleration under each slot, down, then to the right, where it moves.

    Attributes:
        array: All numbers; padding is zero.
        row: Numbers a row.
        ground: Place of the ground's accelerations in a row.
        step: Numbers from a step's row to the next step's; 0 if all have the same.
        train: Numbers from a train's rows to the next train's; 0 if all have the same.
    """

    def __init__(
        self, ingredients: Ingredients, constant: Reals, place: NDArray[np.int32], width: int, align: int, steps: int,
        slots: int = 0,
    ) -> None:  # fmt: skip
        """Make the rows for gravity alone.

        Args:
            ingredients: Train and its given loads.
            constant: Gravity, and force per unit rate of speed, shape (2, n).
            place: Place of each coordinate among the numbers of a train, shape (n,).
            width: Numbers of a train.
            align: Rows are padded to a multiple of this.
            steps: Of a chunk.
            slots: Slots of slabs whose ground moves, a multiple of ``align``.
        """
        train = ingredients.train
        self._place, self._width, self._gravity = place, width, constant[0].copy()
        self._elements, self._wheelsets = len(train.element_kind), len(train.wheelset_x)
        self.ground = -(-(width + self._elements + 2 * self._wheelsets) // align) * align
        self.row = self.ground + 2 * slots
        sets = ingredients.load_sets
        steps = steps if sets else 1
        self.step = self.row if sets else 0
        self.train = steps * self.row if sets > 1 else 0
        self.array: Reals = aligned_zeros(width + max(sets, 1) * steps * self.row)
        self.array[place] = constant[1]
        self._rows = self.array[width:].reshape(max(sets, 1), steps, self.row)
        self._rows[..., place] = self._gravity

    def move_ground(self, acceleration: Reals) -> None:
        """Put the ground's acceleration under the slots into the rows of the coming steps, shape (steps, slots, 2)."""
        steps, slots = acceleration.shape[:2]
        rows, half = self._rows[:, :steps], (self.row - self.ground) // 2
        for direction in range(2):
            first = self.ground + direction * half
            rows[..., first : first + slots] = acceleration[..., direction]

    def fill(self, loads: GivenLoads, steps: int) -> None:
        """Put the loads of the coming steps into the rows, in addition to gravity."""
        rows, first = self._rows[:, :steps], self._width + self._elements
        rows[..., self._place] = self._gravity + loads.force
        rows[..., self._width : first] = loads.elongation
        rows[..., first : first + self._wheelsets] = loads.frame_rate[..., 0]
        rows[..., first + self._wheelsets : first + 2 * self._wheelsets] = loads.frame_rate[..., 1]
