"""Free rectangular plate by Ritz's method, independent of the engine.

w = sum q_mn P_m(2x/L) P_n(2y/B), products of Legendre polynomials. They satisfy no boundary condition,
which is right for free edges: their conditions, Poisson's terms included, come from the strain energy
  U = D/2 int [w_xx^2 + w_yy^2 + 2 nu w_xx w_yy + 2 (1 - nu) w_xy^2].
The kinetic energy has the rotary inertia rho h^3/12 as an option, the strain energy a Winkler bed k w^2/2. Frequencies
converge from above.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.polynomial import legendre
from numpy.typing import NDArray


def frequencies(
    length: float,
    width: float,
    rigidity: float,
    nu: float,
    mass_per_area: float,
    rotary: float,
    degree: int,
    bed: float = 0.0,
) -> NDArray[np.float64]:
    """Natural frequencies, including the three rigid modes.

    Args:
        length: L [m].
        width: B [m].
        rigidity: D [N m].
        nu: Poisson's ratio.
        mass_per_area: rho h [kg/m^2].
        rotary: rho h^3 / 12 [kg], 0 to leave rotary inertia out.
        degree: Highest Legendre polynomial in each direction.
        bed: Bed under the whole plate [N/m^3].

    Returns:
        Circular frequencies [rad/s], ascending, shape ((degree + 1)^2,).
    """
    X = _integrals(length, degree)
    Y = _integrals(width, degree)

    def plate(i: int, j: int, k: int, l: int) -> NDArray[np.float64]:
        return np.asarray(np.kron(X[i][j], Y[k][l]), dtype=np.float64)

    cross = plate(2, 0, 0, 2)
    bending = plate(2, 2, 0, 0) + plate(0, 0, 2, 2) + nu * (cross + cross.T)
    K = rigidity * (bending + 2.0 * (1.0 - nu) * plate(1, 1, 1, 1)) + bed * plate(0, 0, 0, 0)
    M = mass_per_area * plate(0, 0, 0, 0) + rotary * (plate(1, 1, 0, 0) + plate(0, 0, 1, 1))
    return np.sqrt(np.abs(scipy.linalg.eigvalsh(K, M)))


def _integrals(size: float, degree: int) -> list[list[NDArray[np.float64]]]:
    """Integrals over -size/2...size/2 of products of i-th and j-th derivatives, [i][j] of shape (p, p)."""
    x, weight = legendre.leggauss(degree + 1)
    values = []
    for order in range(3):
        coefficients = np.eye(degree + 1)
        derivative = legendre.legder(coefficients, order, scl=2.0 / size, axis=0) if order else coefficients
        values.append(legendre.legval(x, derivative))
    return [[np.einsum("mq,nq,q->mn", a, b, weight) * size / 2.0 for b in values] for a in values]
