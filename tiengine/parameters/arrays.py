"""Types of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Flags", "Ints", "Reals"]

Reals = NDArray[np.float64]
"""Real numbers in double precision, of any shape."""

Ints = NDArray[np.int64]
"""Whole numbers, of any shape."""

Flags = NDArray[np.bool_]
"""True or false, of any shape."""
