r"""Matrices of one rail in the moving window from any trial functions: a Timoshenko beam with convective inertia.

The inertia of a field of mass density mu is mu (d2u/dt2 - 2 V du'/dt + V^2 u'' - dV/dt u'), projected on the trial
functions f of the field (MODEL §1):

    M = mu int f f,    C = V mu ([f f](l) - 2 int f f'),    K = K_el - mu (V^2 int f' f' + dV/dt int f f')

[f f](l) stands for rail that enters at rest (``trial_functions``), with splines only.

| symbol | meaning |
|---|---|
| w, v; theta_y, theta_z; theta_x | displacements, slopes of the section, torsion |
| EI, kappa G A, GK | bending, shear and St Venant's torsional stiffness |
| K_el | S (w' - theta)^2 + EI theta'^2, S = kappa G A; GK theta_x'^2 |

Unknowns stand function by function: (w, theta_y) of function 0, of function 1, ...; (v, theta_z, theta_x) likewise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.track.rail import Rail
from tiengine.track.trial_functions import FieldProducts, TrialFunctions

__all__ = ["LATERAL_FIELDS", "VERTICAL_FIELDS", "RailOperators", "interleaved"]

VERTICAL_FIELDS, LATERAL_FIELDS = 2, 3
Block: TypeAlias = "sp.csr_array | None"
Matrices: TypeAlias = "tuple[sp.csr_array, sp.csr_array, sp.csr_array]"


def interleaved(blocks: Sequence[Sequence[Block]]) -> sp.csr_array:
    """One matrix from blocks by field, the fields of a function side by side.

    Args:
        blocks: Rows of (n, n) blocks, ``None`` for zero, as many rows as columns.

    Returns:
        Shape (fields n, fields n).
    """
    fields, n = len(blocks), next(block.shape[0] for row in blocks for block in row if block is not None)
    total = sp.csr_array((fields * n, fields * n))
    for i, row in enumerate(blocks):
        for j, block in enumerate(row):
            if block is not None:
                place = sp.coo_array(([1.0], ([i], [j])), shape=(fields, fields))
                total = total + sp.csr_array(sp.kron(block, place))
    total.eliminate_zeros()
    return total


@dataclass(frozen=True, eq=False)
class RailOperators:
    """Matrices of a rail.

    Attributes:
        rail: Section.
        functions: Trial functions of all its fields, n each.
    """

    rail: Rail
    functions: TrialFunctions

    def vertical(self, V: float, V_rate: float = 0.0) -> Matrices:
        """M, C, K of (w, theta_y) at speed V [m/s] and rate V_rate [m/s^2]; each (2n, 2n)."""
        r = self.rail
        m, rotary = r.densities[:2]
        K = self._beam(r.kappa_vertical * r.G * r.A, r.E * r.Iy)
        return self._moving(K, (m, rotary), V, V_rate)

    def lateral(self, V: float, V_rate: float = 0.0) -> Matrices:
        """M, C, K of (v, theta_z, theta_x) at speed V [m/s] and rate V_rate [m/s^2]; each (3n, 3n)."""
        r = self.rail
        m, rotary, polar = r.densities[2:]
        K = self._beam(r.kappa_lateral * r.G * r.A, r.E * r.Iz)
        torsion = r.GK * self.functions.products.displacement.slopes
        return self._moving([[*K[0], None], [*K[1], None], [None, None, torsion]], (m, rotary, polar), V, V_rate)

    def foundation(self, vertical: float, lateral: float) -> tuple[sp.csr_array, sp.csr_array]:
        """Fastenings smeared along the rail: springs of a stiffness per length where the fastenings act.

        The same form serves dampers, and Newmark's mix of both (the stand-in A_s of the explicit half).

        Args:
            vertical: Of both half springs under the foot together [N/m^2].
            lateral: [N/m^2].

        Returns:
            Of (w, theta_y), shape (2n, 2n), and of (v, theta_z, theta_x), shape (3n, 3n).
        """
        a, b, one = self.rail.arm_fastening, self.rail.half_base, self.functions.products.displacement.values
        across, turn = lateral * one, (a**2 * lateral + b**2 * vertical) * one
        return (
            interleaved([[vertical * one, None], [None, None]]),
            interleaved([[across, None, -a * across], [None, None, None], [-a * across, None, turn]]),
        )

    def under(
        self, s: NDArray[np.float64], derivative: int = 0, over: float = 0.0
    ) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """Rows that give w from the vertical unknowns, v and theta_x from the lateral ones.

        Args:
            s: Places [m], shape (k,).
            derivative: Order of the derivative by s.
            over: Length of rail over which the mean is taken [m].

        Returns:
            Shapes (k, 2n), (k, 3n), (k, 3n).
        """
        phi = sp.csr_array(self.functions.shape(s, derivative, over))
        placed = (np.array([[1.0, 0.0]]), np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]))
        w, v, x = (sp.csr_array(sp.kron(phi, sp.csr_array(field))) for field in placed)
        return w, v, x

    def _beam(self, S: float, EI: float) -> list[list[Block]]:
        """Elastic blocks of a displacement and its slope."""
        p = self.functions.products
        shear = sp.csr_array(-S * p.shear)
        return [
            [S * p.displacement.slopes, shear],
            [sp.csr_array(shear.T), S * p.slope.values + EI * p.slope.slopes],
        ]

    def _moving(self, K: list[list[Block]], densities: Sequence[float], V: float, V_rate: float) -> Matrices:
        """Inertia of the fields, with its convective terms, added to an elastic stiffness."""
        p = self.functions.products
        kinds: tuple[FieldProducts, ...] = (p.displacement, p.slope, p.displacement)
        fields = list(zip(densities, kinds, strict=False))
        M = _diagonal([mu * f.values for mu, f in fields])
        flow = _diagonal([mu * f.flow for mu, f in fields])
        softening = _diagonal([mu * f.slopes for mu, f in fields])
        entry = _diagonal([mu * f.entry for mu, f in fields])
        return (
            M,
            sp.csr_array(V * entry - 2.0 * V * flow),
            sp.csr_array(interleaved(K) - V**2 * softening - V_rate * flow),
        )


def _diagonal(blocks: Sequence[sp.csr_array]) -> sp.csr_array:
    """Fields that are not joined, interleaved."""
    n = len(blocks)
    return interleaved([[block if i == j else None for j in range(n)] for i, block in enumerate(blocks)])
