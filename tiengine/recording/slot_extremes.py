"""Running extremes of slabs in memory, by slot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals

__all__ = ["SlotExtremes"]


@dataclass(eq=False)
class SlotExtremes:
    """Running extremes by slot (see :mod:`tiengine.engine.state`); slabs that leave are reduced and put aside.

    Attributes:
        largest, smallest: Extremes of the slab in each slot, shape (B, slots, points).
        starts: First point of each quantity; a quantity's points are reduced to one when a slab leaves.
        first_slab: Rear slab, -1 before the first sample.
    """

    largest: NDArray[np.float64]
    smallest: NDArray[np.float64]
    starts: tuple[int, ...] = (0,)
    first_slab: int = -1
    _left: list[tuple[int, NDArray[np.float64]]] = field(default_factory=list)

    @classmethod
    def of(cls, trains: int, slots: int, points: int, starts: tuple[int, ...] = (0,)) -> SlotExtremes:
        """Extremes before the first sample."""
        shape = (trains, slots, points)
        return cls(np.full(shape, -np.inf), np.full(shape, np.inf), starts)

    def move(self, first_slab: int) -> None:
        """Put aside the slabs behind a new rear slab; their slots start again."""
        if first_slab == self.first_slab:
            return
        slots = self.largest.shape[1]
        for slab in range(self.first_slab, min(first_slab, self.first_slab + slots)) if self.first_slab >= 0 else ():
            largest, smallest = self.largest[:, slab % slots], self.smallest[:, slab % slots]
            reduced = np.maximum.reduceat(largest, self.starts, -1), np.minimum.reduceat(smallest, self.starts, -1)
            self._left.append((slab, np.stack(reduced)))
            largest[:], smallest[:] = -np.inf, np.inf
        self.first_slab = first_slab

    def add(self, largest: Reals, smallest: Reals, trains: slice = slice(None)) -> None:
        """Take in new values.

        Args:
            largest: Largest values of the slabs in all slots since the last call, shape (B, slots, points).
            smallest: Smallest values.
            trains: Those of these trains.
        """
        np.maximum(self.largest[trains], largest, out=self.largest[trains])
        np.minimum(self.smallest[trains], smallest, out=self.smallest[trains])

    def take(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Slabs put aside since the last call: their indices (n,), largest and smallest (B, n, quantities)."""
        left, self._left = self._left, []
        none = np.empty((2, len(self.largest), 0, len(self.starts)))
        largest, smallest = np.concatenate([none, *(extremes[:, :, None] for _, extremes in left)], axis=2)
        return np.array([slab for slab, _ in left], dtype=np.int64), largest, smallest

    def put_aside_all(self) -> None:
        """Put aside all slabs."""
        if self.first_slab >= 0:
            self.move(self.first_slab + self.largest.shape[1])

    def saved(self) -> dict[str, NDArray[np.float64]]:
        """Values that the coming slabs depend on, when nothing is put aside."""
        return {"largest": self.largest, "smallest": self.smallest, "first": np.array(float(self.first_slab))}

    def restore(self, saved: Mapping[str, NDArray[np.float64]]) -> None:
        """Continue from the values of :meth:`saved`."""
        self.largest[:], self.smallest[:] = saved["largest"], saved["smallest"]
        self.first_slab = int(saved["first"])
