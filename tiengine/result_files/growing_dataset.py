"""Dataset that grows along its first axis, written by low-level calls of h5py.

The high-level ``dataset[end:] = values`` takes 0.4 ms, including the lookup by path; for 26 datasets per thousand steps
that is about 10 µs per step and train. The calls below take 0.04 ms.
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

__all__ = ["GrowingDataset"]


class GrowingDataset:
    """Open dataset to which samples are appended.

    Attributes:
        length: Number of samples written; the dataset may hold more from a run that is being resumed.
        sample_shape: Shape of one sample.
    """

    def __init__(self, dataset: Any, length: int = 0) -> None:
        """Take over a dataset of shape (n, ...) whose first axis may grow.

        Args:
            dataset: Dataset of h5py.
            length: Number of samples to keep, at most n; later ones are overwritten.
        """
        self._id = dataset.id
        self._held = int(dataset.shape[0])
        self.length = length
        self.sample_shape: tuple[int, ...] = tuple(dataset.shape[1:])

    def extend(self, values: NDArray[Any]) -> None:
        """Append samples.

        Args:
            values: Samples of any real type, shape (n, *sample_shape).

        Raises:
            OSError: The disk is full or has failed.
        """
        if not len(values):
            return
        start, self.length = self.length, self.length + len(values)
        if self.length > self._held:
            self._id.set_extent((self.length, *self.sample_shape))
            self._held = self.length
        selection = self._id.get_space()
        selection.select_hyperslab((start, *(0 for _ in self.sample_shape)), values.shape)
        self._id.write(h5py.h5s.create_simple(values.shape), selection, np.ascontiguousarray(values))
