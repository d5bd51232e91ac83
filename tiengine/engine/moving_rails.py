"""Blocks of the rails by powers of the speed, so that a change of speed costs a sum and a factorisation.

The flow C is in proportion to V, the softening of K to V^2; bands and coefficients are linear in the matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tiengine.engine.banded import BandedBlock, Factors, band_of, linear_coefficients
from tiengine.engine.spline_tables import HALF_WIDTHS
from tiengine.model.newmark import Newmark
from tiengine.parameters.arrays import Reals
from tiengine.track.rail_operators import RailOperators

__all__ = ["MovingRails"]


@dataclass(frozen=True, eq=False)
class MovingRails:
    """Both blocks of a rail.

    Attributes:
        band: A of the vertical and of the lateral block by powers of V, each of shape (3, N, 2k + 1).
        linear: K, C and A_s as :func:`tiengine.engine.banded.linear_coefficients` orders them, shape
            (3, n, N_COEFFICIENT).
    """

    band: tuple[Reals, Reals]
    linear: Reals

    @classmethod
    def of(cls, operators: RailOperators, stand_in: tuple[sp.csr_array, sp.csr_array], newmark: Newmark) -> MovingRails:
        """Pack the matrices.

        Args:
            operators: Of the window.
            stand_in: A_s of the vertical and of the lateral block.
            newmark: Step and coefficients.
        """
        vertical = _powers(operators.vertical(0.0), operators.vertical(1.0), stand_in[0])
        lateral = _powers(operators.lateral(0.0), operators.lateral(1.0), stand_in[1])
        bands = (
            np.stack([
                band_of(power.operator(newmark.beta_dt2, newmark.gamma_dt), half_width, power.held) for power in powers
            ])
            for powers, half_width in zip((vertical, lateral), HALF_WIDTHS, strict=True)
        )  # fmt: skip
        linear = np.stack([linear_coefficients(*pair) for pair in zip(vertical, lateral, strict=True)])
        return cls((next(bands), next(bands)), linear)

    def at(self, V: float) -> tuple[tuple[Factors, Factors], Reals]:
        """Factors of both blocks, and the coefficients of what they do not hold, at a speed [m/s]."""
        none = np.zeros(0, dtype=np.intp)
        vertical, lateral = (Factors.of_band(_sum(band, V), none) for band in self.band)
        return (vertical, lateral), _sum(self.linear, V)


def _sum(powers: Reals, V: float) -> Reals:
    total: Reals = powers[0] + V * powers[1] + V**2 * powers[2]
    return total


def _powers(
    rest: tuple[sp.csr_array, ...], moving: tuple[sp.csr_array, ...], stand_in: sp.csr_array
) -> tuple[BandedBlock, BandedBlock, BandedBlock]:
    """Powers of V of a block, from its M, C, K at rest and at 1 m/s."""
    M, _, elastic = rest
    nothing = sp.csr_array(M.shape)
    return (
        BandedBlock(M, nothing, elastic, stand_in),
        BandedBlock(nothing, moving[1], nothing, nothing),
        BandedBlock(nothing, nothing, sp.csr_array(moving[2] - elastic), nothing),
    )
