"""Arrays whose memory starts at a multiple of 64 bytes.

A kernel in vector mode loads whole vectors by instructions that fault on a misaligned address, so every array of
vectors is made here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

__all__ = ["ALIGNMENT", "aligned_copy", "aligned_zeros", "is_aligned"]

ALIGNMENT = 64
"""Bytes: a vector of eight doubles."""


def aligned_zeros(shape: tuple[int, ...] | int, dtype: DTypeLike = np.float64) -> NDArray[Any]:
    """Zeros, C-contiguous, aligned to 64 bytes.

    Args:
        shape: Shape; an empty array is aligned too.
        dtype: Type of the entries.
    """
    item = np.dtype(dtype).itemsize
    count = int(np.prod(shape))
    room = np.zeros(count * item + ALIGNMENT, dtype=np.uint8)
    start = -room.ctypes.data % ALIGNMENT
    return room[start : start + count * item].view(dtype).reshape(shape)


def aligned_copy(array: NDArray[Any]) -> NDArray[Any]:
    """Copy of an array, C-contiguous, aligned to 64 bytes."""
    copy = aligned_zeros(array.shape, array.dtype)
    copy[...] = array
    return copy


def is_aligned(array: NDArray[Any]) -> bool:
    """Whether the array's memory starts at a multiple of 64 bytes."""
    return array.ctypes.data % ALIGNMENT == 0
