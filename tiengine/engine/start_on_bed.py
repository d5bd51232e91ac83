r"""Where a bed without tension carries when the train starts (MODEL §7).

Beyond its state at rest a quadrature point of pressure p_0 pushes with max(0, p_0 + k u) - max(0, p_0): where it
carries, with k u + min(p_0, 0), else with -max(p_0, 0). The points that carry are found for standing wheels under their
static loads; the equilibrium of rolling, in which they differ little, then checks them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tiengine.parameters.arrays import Flags, Reals
from tiengine.track.slab_matrices import SlabMatrices, bed_points
from tiengine.track.unilateral import PushingSprings, at_rest

__all__ = ["BedAtStart"]


@dataclass(frozen=True, eq=False)
class BedAtStart:
    """Bed under the slabs of a window.

    Attributes:
        slabs: Matrices of the slabs.
        stiffness: k of each quadrature point with its area [N/m], shape (slabs, points).
        at_rest: Force of each at rest, negative where a gap is open [N], shape (slabs, points).
    """

    slabs: Sequence[SlabMatrices]
    stiffness: Reals
    at_rest: Reals

    @classmethod
    def of(cls, slabs: Sequence[SlabMatrices], stiffness: float, pressure: Sequence[Reals]) -> BedAtStart:
        """Take the slabs of a window.

        Args:
            slabs: Matrices of the slabs.
            stiffness: k_m [N/m^3].
            pressure: Pressure at rest under each [Pa], shape (n_el, n_q).
        """
        k = np.stack([(stiffness * slab.bed_factor * slab.bed_weight).ravel() for slab in slabs])
        rest = np.stack([(p * slab.bed_weight).ravel() for p, slab in zip(pressure, slabs, strict=True)])
        return cls(slabs, k, rest)

    def carrying(self, moved: Reals) -> Flags:
        """Points that carry when the slabs have moved from rest, shape (slabs, points).

        Args:
            moved: Coordinates of the slabs, shape (slabs, dofs).
        """
        carrying: Flags = self.at_rest + self.stiffness * (moved @ bed_points(self.slabs[0])) > 0.0
        return carrying

    def beds(self, carrying: Flags) -> list[Reals]:
        """Stiffness of the points that carry, and of the lateral bed; shape (dofs, dofs) for each slab.

        Args:
            carrying: As :meth:`carrying` gives them.
        """
        points = bed_points(self.slabs[0])
        beds = []
        for slab, k in zip(self.slabs, np.where(carrying, self.stiffness, 0.0), strict=True):
            bed = (points * k) @ points.T
            bed[-2:, -2:] = slab.K_bed[-2:, -2:]
            beds.append(bed)
        return beds

    def loads(self, carrying: Flags) -> Reals:
        """Constant forces on the slabs beyond those at rest, shape (slabs, dofs).

        Args:
            carrying: As :meth:`carrying` gives them.
        """
        rest = self.at_rest
        force = np.where(carrying, -np.minimum(rest, 0.0), np.maximum(rest, 0.0))
        loads: Reals = force @ bed_points(self.slabs[0]).T
        return loads

    def under(self, K: sp.csc_array, load: Reals) -> Flags:
        """Points that carry under a load on the track.

        Args:
            K: Stiffness of rails, fastenings, slabs and lateral bed, slabs last.
            load: Forces on rails and slabs, shape (unknowns,).
        """
        points, dofs = bed_points(self.slabs[0]), self.slabs[0].n
        first = K.shape[0] - len(self.slabs) * dofs
        rows = sp.block_diag([sp.csr_array(points.T)] * len(self.slabs), format="csr")
        rows = sp.csr_array(sp.hstack([sp.csr_array((rows.shape[0], first)), rows]))
        k, rest = self.stiffness.ravel(), self.at_rest.ravel()
        sound = k > 0.0
        springs = PushingSprings(rows[sound], k[sound], -rest[sound] / k[sound])
        total = load + rows.T @ np.maximum(rest, 0.0)
        q = at_rest(K, total, springs)
        return self.carrying(q[first:].reshape(len(self.slabs), dofs))
