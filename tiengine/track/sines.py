"""The paper's trial functions: sin(k_i s) for displacements, cos(k_i s) for slopes, k_i = i pi / l, i = 1..N."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.track.seat_points import mean_cosine
from tiengine.track.trial_functions import FieldProducts, Products

__all__ = ["Sines", "sine_products"]


def sine_products(modes: int) -> NDArray[np.float64]:
    """Compute the products G_ij = int W_i W_j' ds, independent of the window's length.

    Returns:
        For sin(k_i s): 2 i j / (i^2 - j^2); for cos(k_i s): 2 j^2 / (i^2 - j^2); zero for i + j even. Shape (2, N, N).
    """
    i = np.arange(1, modes + 1)[:, None]
    j = np.arange(1, modes + 1)[None, :]
    odd = (i + j) % 2 == 1
    denominator = np.where(odd, i**2 - j**2, 1)
    return np.stack([np.where(odd, 2 * i * j / denominator, 0.0), np.where(odd, 2 * j**2 / denominator, 0.0)])


@dataclass(frozen=True)
class Sines:
    """Sines and cosines on a window; every function touches every point.

    Attributes:
        length: Window l [m].
        modes: N.
    """

    length: float
    modes: int

    @property
    def count(self) -> int:
        """Functions of a field."""
        return self.modes

    @property
    def wave_numbers(self) -> NDArray[np.float64]:
        """k_i [1/m], shape (N,)."""
        return np.arange(1.0, self.modes + 1.0) * (np.pi / self.length)

    @cached_property
    def products(self) -> Products:
        """Integrals of the functions: diagonal but for the flow."""
        half, k = self.length / 2.0, self.wave_numbers
        values = sp.csr_array(sp.diags_array(np.full(self.modes, half)))
        slopes = sp.csr_array(sp.diags_array(half * k**2))
        none = sp.csr_array((self.modes, self.modes))
        of_sines, of_cosines = (FieldProducts(values, sp.csr_array(G), slopes, none) for G in sine_products(self.modes))
        return Products(of_sines, of_cosines, sp.csr_array(sp.diags_array(half * k)))

    def shape(self, s: NDArray[np.float64], derivative: int = 0, over: float = 0.0) -> NDArray[np.float64]:
        """See :class:`tiengine.track.trial_functions.TrialFunctions`; beyond the ends the sines continue."""
        k, phase = self.wave_numbers, np.multiply.outer(s, self.wave_numbers)
        found: NDArray[np.float64] = (k * np.cos(phase) if derivative else np.sin(phase)) * mean_cosine(k, over)
        return found

    def slope_shape(self, s: NDArray[np.float64], derivative: int = 0) -> NDArray[np.float64]:
        """See :class:`tiengine.track.trial_functions.TrialFunctions`."""
        k, phase = self.wave_numbers, np.multiply.outer(s, self.wave_numbers)
        found: NDArray[np.float64] = -k * np.sin(phase) if derivative else np.cos(phase)
        return found
