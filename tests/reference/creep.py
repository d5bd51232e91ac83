"""Hertz force and Shen-Hedrick-Elkins creep forces of one wheel, written from the formulas in plain NumPy.

N = (delta/G)^(3/2);
f11 = S a b C11, f22 = S a b C22, f23 = S (a b)^1.5 C23, f33 = S (a b)^2 C33 with the shear modulus S;
Tx = -f11 xi_x, Ty = -f22 xi_y - f23 xi_s, Mz = f23 xi_y - f33 xi_s; T' = mu N (tau - tau^2/3 + tau^3/27) for
tau = T/(mu N) <= 3, else mu N (Shen, Hedrick and Elkins, 8th IAVSD, 1983).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def creep_force(
    delta: float,
    creepage: NDArray[np.float64],
    G: float,
    a1: float,
    b1: float,
    shear: float,
    C: tuple[float, float, float, float],
    friction: float,
) -> NDArray[np.float64]:
    """(N, Fx, Fy, Mz) on the wheel.

    Args:
        delta: Approach [m].
        creepage: Longitudinal, lateral [-], spin [1/m].
        G: Approach per N^(2/3).
        a1: Semi-axis along rolling per N^(1/3).
        b1: Semi-axis across per N^(1/3).
        shear: Shear modulus [Pa].
        C: Kalker's C11, C22, C23, C33.
        friction: mu.
    """
    if delta <= 0.0:
        return np.zeros(4)
    N = (delta / G) ** 1.5
    a, b = a1 * N ** (1 / 3), b1 * N ** (1 / 3)
    C11, C22, C23, C33 = C
    f11, f22 = shear * a * b * C11, shear * a * b * C22
    f23, f33 = shear * (a * b) ** 1.5 * C23, shear * (a * b) ** 2 * C33
    xi_x, xi_y, xi_s = creepage
    Tx, Ty, Mz = -f11 * xi_x, -f22 * xi_y - f23 * xi_s, f23 * xi_y - f33 * xi_s
    T = np.hypot(Tx, Ty)
    tau = T / (friction * N)
    reduced = friction * N * (tau - tau**2 / 3 + tau**3 / 27 if tau <= 3.0 else 1.0)
    e = reduced / T if T > 0.0 else 1.0
    return np.array([N, e * Tx, e * Ty, e * Mz])
