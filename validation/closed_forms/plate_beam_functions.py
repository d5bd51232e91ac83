"""Free rectangular plate by Leissa's own method: Ritz with products of free-free beam functions.

A. W. Leissa, The free vibration of rectangular plates, J. Sound Vib. 31 (1973) 257-293: 36 terms, six beam functions
in each direction. At their ends the functions carry no moment and no shear of a beam, which are not the natural
conditions of a plate (Poisson's terms are missing), so the frequencies lie above the exact ones, by up to 1.2 % for 36
terms; with more terms they decrease slowly. With six functions this module gives Leissa's printed values; Legendre
polynomials (``plate_ritz``) converge to the exact ones.

With t = x/L - 1/2 and cos(beta) cosh(beta) = 1, the elastic functions are
  cos(beta t)/cos(beta/2) + cosh(beta t)/cosh(beta/2),   sin(beta t)/sin(beta/2) + sinh(beta t)/sinh(beta/2).
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
import scipy.optimize

from tiengine.parameters.arrays import Reals

__all__ = ["leissa_parameters"]

POINTS = 60  # Gauss points: the sixth function has four half waves, its products eight


def leissa_parameters(aspect: float, nu: float, count: int, functions: int = 6) -> Reals:
    """Lowest elastic frequency parameters omega a^2 sqrt(rho h / D) of a free plate of sides a and b.

    Args:
        aspect: a/b.
        nu: Poisson's ratio.
        count: Number of parameters, without the three rigid motions.
        functions: Beam functions in each direction, including two rigid ones.

    Returns:
        Parameters, ascending, shape (count,).
    """
    X, Y = _integrals(aspect, functions), _integrals(1.0, functions)

    def plate(i: int, j: int, k: int, l: int) -> Reals:
        return np.asarray(np.kron(X[i][j], Y[k][l]), dtype=np.float64)

    cross = plate(2, 0, 0, 2)
    bending = plate(2, 2, 0, 0) + plate(0, 0, 2, 2) + nu * (cross + cross.T)
    K = bending + 2.0 * (1.0 - nu) * plate(1, 1, 1, 1)
    omega2 = scipy.linalg.eigvalsh(K, plate(0, 0, 0, 0), subset_by_index=(3, 2 + count))
    parameters: Reals = aspect**2 * np.sqrt(omega2)
    return parameters


def _integrals(size: float, functions: int) -> list[list[Reals]]:
    """Integrals over 0...size of products of i-th and j-th derivatives, [i][j] of shape (functions, functions)."""
    x, weight = np.polynomial.legendre.leggauss(POINTS)
    t = 0.5 * x
    values = np.stack([_function(m, t) for m in range(functions)], axis=1)
    values /= size ** np.arange(3.0)[:, None, None]
    return [[np.einsum("mq,nq,q->mn", a, b, weight) * size / 2.0 for b in values] for a in values]


def _function(m: int, t: Reals) -> Reals:
    """The m-th free-free beam function and two derivatives by t, shape (3, n); t = -1/2...1/2."""
    if m < 2:
        return np.stack([t**m, np.full_like(t, m), np.zeros_like(t)])
    guess = (m - 0.5) * np.pi
    beta = scipy.optimize.brentq(lambda b: np.cos(b) - 1.0 / np.cosh(b), guess - 0.1, guess + 0.1)
    half = beta / 2.0
    c, s, ch, sh = np.cos(beta * t), np.sin(beta * t), np.cosh(beta * t), np.sinh(beta * t)
    if m % 2 == 0:
        circular, hyperbolic = np.array([c, -s, -c]) / np.cos(half), np.array([ch, sh, ch]) / np.cosh(half)
    else:
        circular, hyperbolic = np.array([s, c, -s]) / np.sin(half), np.array([sh, ch, sh]) / np.sinh(half)
    function: Reals = beta ** np.arange(3.0)[:, None] * (circular + hyperbolic)
    return function
