"""A point load on an infinite thin plate on a Winkler bed (Hertz 1884, Westergaard 1926).

D lap lap w + k w = P delta has, with the radius of relative stiffness l = (D/k)^(1/4), the solution
  w(r) = -P l^2 / (2 pi D) kei(r/l),   w(0) = P l^2 / (8 D) = P / (8 sqrt(k D)).

A mesh of thin plate elements whose plane waves have the stiffness D q^4 (1 - c q^2 h^2) instead of D q^4 deflects more
under the load: to first order in c, with waves up to the mesh's shortest, q = pi/h,
  e = P c h^2 / (2 pi D) int_0^(pi/h) q^7 / (q^4 + l^-4)^2 dq = P c h^2 / (2 pi D) [ln(pi l/h) - 1/4].
"""

from __future__ import annotations

import numpy as np
from scipy.special import kei

from tiengine.parameters.arrays import Reals

__all__ = ["mesh_excess", "point_load_deflection"]


def point_load_deflection(load: float, rigidity: float, bed: float, r: Reals) -> Reals:
    """Deflection of the infinite plate.

    Args:
        load: P [N].
        rigidity: D [N m].
        bed: k [N/m^3].
        r: Distances from the load [m], shape (n,).

    Returns:
        w [m], shape (n,).
    """
    radius = (rigidity / bed) ** 0.25
    w: Reals = -load * radius**2 / (2.0 * np.pi * rigidity) * kei(np.asarray(r) / radius)
    return w


def mesh_excess(dispersion: float, ratio: float) -> float:
    """Excess of a mesh's deflection under the load, relative to the exact one.

    Args:
        dispersion: c, mean over the directions of the waves.
        ratio: h/l, element over radius of relative stiffness.
    """
    return float(4.0 / np.pi * dispersion * ratio**2 * (np.log(np.pi / ratio) - 0.25))
