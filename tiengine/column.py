"""A dataset that grows along its first axis.

h5py's ``dataset[end:] = values`` takes 0.4 ms, its lookup by path included; 26 of them for a thousand steps of every
train are 10 us a step. The calls below take 0.04 ms.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

__all__ = ["Column"]


class Column:
    """An open dataset, written at its end.

    Attributes:
        rest: Shape of one sample.
    """

    def __init__(self, dataset: Any) -> None:
        """Take over a dataset of shape (n, ...) whose first axis may grow.

        Args:
            dataset: The h5py dataset.
        """
        self._id = dataset.id
        self._length = int(dataset.shape[0])
        self.rest: tuple[int, ...] = tuple(dataset.shape[1:])

    def extend(self, values: NDArray[Any]) -> None:
        """Add samples.

        Args:
            values: Of any real type, shape (n, *rest).

        Raises:
            OSError: The disk is full or gone.
        """
        if not len(values):
            return
        start, self._length = self._length, self._length + len(values)
        self._id.set_extent((self._length, *self.rest))
        place = self._id.get_space()
        place.select_hyperslab((start, *(0 for _ in self.rest)), values.shape)
        self._id.write(h5py.h5s.create_simple(values.shape), place, np.ascontiguousarray(values))
