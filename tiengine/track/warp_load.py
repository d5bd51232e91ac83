"""Load of a temperature gradient on a slab's plate (MODEL §14).

With the curvature alpha T' of the slab that is free to move and the plate's rigidity D_0,

    f = alpha T' D_0 (1 + nu) int (N_xx + N_yy) dA
"""

from __future__ import annotations

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.track.mortar import GAUSS
from tiengine.track.plate_shapes import WXX, WYY, element_dofs, tabulate_shapes
from tiengine.track.slab import Slab

__all__ = ["warp_load"]


def warp_load(slab: Slab) -> Reals:
    """Load on a plate's coordinates per unit of curvature [N m, N m^2], shape (plate's DOFs,).

    Args:
        slab: The slab with its mesh.
    """
    node, weight = np.polynomial.legendre.leggauss(GAUSS)
    points = np.stack(np.meshgrid(node, node, indexing="ij"), axis=-1).reshape(-1, 2)
    area = np.outer(weight, weight).ravel() * slab.length * slab.width / (4.0 * slab.elements_x * slab.elements_y)
    table = tabulate_shapes(slab, points)
    of_element = slab.rigidity * (1.0 + slab.nu) * (area @ (table[:, WXX] + table[:, WYY]))
    index = element_dofs(slab)
    return np.asarray(np.bincount(index.ravel(), np.tile(of_element, len(index)), slab.plate_dofs), np.float64)
