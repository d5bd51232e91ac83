"""Bending moments of a slab from its DOFs.

    M_x = -D (w,xx + nu w,yy)        M_y = -D (w,yy + nu w,xx)        [N m/m]

with w positive down and D the plate's rigidity: a moment is positive where it stretches the underside. M_x bends the
slab along the track (stress in x), M_y across it.

They are evaluated at the 2 x 2 Gauss points of every element, where the second derivatives of its polynomial are
closest to those of the exact field (Barlow 1976: a cubic that matches values and slopes at its ends has the second
derivative of a quartic at these points only). The error falls at least with the square of the element size there. At
the nodes it is four to ten times as large, averaged over the elements that meet there
(``tests/track/test_slab_moments.py``).

Under a point load the moment of a thin plate grows without bound (like a logarithm): at the fastenings the moment is
that of a load spread over an element, and the default mesh of 9 x 2 shows half of what forces spread over 0.35 m
give (docs/results.md).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiengine.track.plate_shapes import WXX, WYY, element_dofs, tabulate_shapes
from tiengine.track.slab import Slab

__all__ = ["GAUSS_POINTS", "moment_operator"]


GAUSS_POINTS = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)]) / np.sqrt(3.0)
"""Local coordinates of an element's points, shape (4, 2)."""


def moment_operator(slab: Slab, points: NDArray[np.float64] = GAUSS_POINTS) -> NDArray[np.float64]:
    """Build the operator from slab DOFs to bending moments.

    Args:
        slab: The slab.
        points: Local coordinates -1...1 in each element, shape (points, 2).

    Returns:
        M_x and M_y at the points of all elements [N m/m per m, or per rad], shape (dofs, 2, elements * points).
    """
    table, index = tabulate_shapes(slab, points), element_dofs(slab)
    along, across = -slab.rigidity * table[:, WXX], -slab.rigidity * table[:, WYY]
    moments = np.stack([along + slab.nu * across, across + slab.nu * along])
    operator = np.zeros((slab.plate_dofs + 2, 2, len(index), len(points)))
    for element, dofs in enumerate(index):
        operator[dofs, :, element] = moments.transpose(2, 0, 1)
    return operator.reshape(len(operator), 2, -1)
