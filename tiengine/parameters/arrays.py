"""Types of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Reals"]

Reals = NDArray[np.float64]
"""Real numbers in double precision, of any shape."""
