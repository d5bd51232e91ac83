"""Hertz contact of two bodies of the same material.

The gap between the undeformed bodies is A x^2 + B y^2, x along rolling. With kappa = (minor / major)
semi-axis, m = 1 - kappa^2, K(m) the complete elliptic integral of the first kind and D(m) = (K - E)/m
(Johnson, *Contact Mechanics*, 1985, Eqs. 4.26-4.28, written without differences that cancel as kappa -> 1)::

    larger/smaller of A, B = (K - D) / (kappa^2 D)
    major^3 = 3 N [D + (K - D)/kappa^2] / (2 pi E* (A + B)),   1/E* = 2 (1 - nu^2)/E
    delta   = 3 N K / (2 pi E* major)

The major semi-axis lies along the smaller curvature.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ellipkm1, elliprd

from tiengine.parameters.arrays import Reals

__all__ = ["hertz", "zhai_G"]


def hertz(A: ArrayLike, B: ArrayLike, E: float, nu: float) -> tuple[Reals, Reals, Reals]:
    """Semi-axes and approach of the contact ellipse, per power of the normal force N.

    Args:
        A: Longitudinal curvature of the gap, cos(gamma)/(2 r_c) for a wheel on a rail [1/m].
        B: Transverse curvature of the gap [1/m], broadcast against A.
        E: Young's modulus of both bodies [N/m^2].
        nu: Poisson's ratio of both bodies.

    Returns:
        ``(a1, b1, G)`` of the common shape of A and B: semi-axis along rolling a = a1 N^(1/3) [m/N^(1/3)],
        across b = b1 N^(1/3), approach delta = G N^(2/3) [m/N^(2/3)].

    Raises:
        ValueError: A curvature that is not positive.
    """
    A, B = np.broadcast_arrays(np.asarray(A, dtype=np.float64), np.asarray(B, dtype=np.float64))
    if not ((A > 0.0).all() and (B > 0.0).all()):
        raise ValueError("hertz: the curvatures A and B of the gap must be positive")
    kappa = _axis_ratio(np.maximum(A, B) / np.minimum(A, B))
    K, D = _integrals(kappa)
    stiffness = 2.0 * np.pi * E / (2.0 * (1.0 - nu**2))  # 2 pi E*
    major = (3.0 * (D + (K - D) / kappa**2) / (stiffness * (A + B))) ** (1.0 / 3.0)
    G = 3.0 * K / (stiffness * major)
    minor = kappa * major
    return np.where(A <= B, major, minor), np.where(A <= B, minor, major), G


def zhai_G(law: Literal["zhai_worn", "zhai_cone"], radius: ArrayLike) -> Reals:
    """Zhai's approach per N^(2/3) for a wheel radius [m/N^(2/3)].

    3.86 R^-0.115 e-8 for worn and 4.57 R^-0.149 e-8 for conical treads (Zhai, *Vehicle-Track Coupled
    Dynamics*, 2020).

    Args:
        law: ``"zhai_worn"`` or ``"zhai_cone"``.
        radius: Rolling radius R [m].
    """
    R = np.asarray(radius, dtype=np.float64)
    G: Reals = 3.86e-8 * R**-0.115 if law == "zhai_worn" else 4.57e-8 * R**-0.149
    return G


def _integrals(kappa: Reals) -> tuple[Reals, Reals]:
    """The elliptic integrals K(m) and D(m) for m = 1 - kappa^2."""
    return ellipkm1(kappa**2), elliprd(0.0, kappa**2, 1.0) / 3.0


def _axis_ratio(ratio: Reals) -> Reals:
    """Minor over major semi-axis for a ratio of curvatures >= 1.

    ln(ratio) falls with ln(kappa) at a slope between -4/3 (circle) and -2 (line contact); a step with the
    slope -5/3 therefore leaves at most a fifth of the error.
    """
    target = np.log(ratio)
    x = -0.6 * target
    for _ in range(26):  # 5^-26 of a first error below 10
        kappa = np.exp(x)
        K, D = _integrals(kappa)
        x = np.minimum(x + (np.log((K - D) / (kappa**2 * D)) - target) / (5.0 / 3.0), 0.0)
    return np.exp(x)
