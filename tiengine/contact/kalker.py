"""Kalker's creepage and spin coefficients of linear rolling contact.

Table E.3 of Kalker, *Three-Dimensional Elastic Bodies in Rolling Contact* (1990), as printed: C11, C22, C23
compared with the source of eve70a/CONTACT, C33 at nu = 0.25 with zzh158shallow-tech/JBG_SDITT, C33 at nu = 0
and 0.5 with no second source. Between the table's entries: 1/C is quadratic in nu through 0, 0.25, 0.5 (as in
CONTACT); then ln C is a monotone piecewise cubic (PCHIP, C1) in ln(a/b). Beyond a/b = 0.1 and 10: Kalker's
asymptotes for a slender ellipse, which miss the last entries of the table by up to 10 % (C33; others 6 %):
see :func:`asymptote_mismatch`. So that the coefficients stay continuous, an asymptote is multiplied by
(table / asymptote)^(g/0.1) with g the smaller of a/b, b/a: exact at the table's end, the pure asymptote as
g -> 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator

from tiengine.parameters.arrays import Reals

__all__ = ["asymptote_mismatch", "kalker"]

# rows: a/b = 0.1, 0.2 ... 1.0, then 1/0.9, 1/0.8 ... 1/0.1
_TENTHS = np.arange(1, 11) / 10.0
_RATIO = np.concatenate([_TENTHS, 1.0 / _TENTHS[-2::-1]])

# fmt: off
_C11 = np.array([  # nu = 0, 0.25, 0.5
    [2.51, 3.31, 4.85], [2.59, 3.37, 4.81], [2.68, 3.44, 4.80], [2.78, 3.53, 4.82], [2.88, 3.62, 4.83],
    [2.98, 3.72, 4.91], [3.09, 3.81, 4.97], [3.19, 3.91, 5.05], [3.29, 4.01, 5.12], [3.40, 4.12, 5.20],
    [3.51, 4.22, 5.30], [3.65, 4.36, 5.42], [3.82, 4.54, 5.58], [4.06, 4.78, 5.80], [4.37, 5.10, 6.11],
    [4.84, 5.57, 6.57], [5.57, 6.34, 7.34], [6.96, 7.78, 8.82], [10.7, 11.7, 12.9],
])
_C22 = np.array([
    [2.51, 2.52, 2.53], [2.59, 2.63, 2.66], [2.68, 2.75, 2.81], [2.78, 2.88, 2.98], [2.88, 3.01, 3.14],
    [2.98, 3.14, 3.31], [3.09, 3.28, 3.48], [3.19, 3.41, 3.65], [3.29, 3.54, 3.82], [3.40, 3.67, 3.98],
    [3.51, 3.81, 4.16], [3.65, 3.99, 4.39], [3.82, 4.21, 4.67], [4.06, 4.50, 5.04], [4.37, 4.90, 5.56],
    [4.84, 5.48, 6.31], [5.57, 6.40, 7.51], [6.96, 8.14, 9.79], [10.7, 12.8, 16.0],
])
_C23 = np.array([
    [0.334, 0.473, 0.731], [0.483, 0.603, 0.809], [0.607, 0.715, 0.889], [0.720, 0.823, 0.977],
    [0.827, 0.929, 1.07], [0.930, 1.03, 1.18], [1.03, 1.14, 1.29], [1.13, 1.25, 1.40], [1.23, 1.36, 1.51],
    [1.33, 1.47, 1.63], [1.44, 1.59, 1.77], [1.58, 1.75, 1.94], [1.76, 1.95, 2.18], [2.01, 2.23, 2.50],
    [2.35, 2.62, 2.96], [2.88, 3.24, 3.70], [3.79, 4.32, 5.01], [5.72, 6.63, 7.89], [12.2, 14.6, 18.0],
])
_C33 = np.array([
    [6.42, 8.28, 11.7], [3.46, 4.27, 5.66], [2.49, 2.96, 3.72], [2.02, 2.32, 2.77], [1.74, 1.93, 2.22],
    [1.56, 1.68, 1.86], [1.43, 1.50, 1.60], [1.34, 1.37, 1.42], [1.27, 1.27, 1.27], [1.21, 1.19, 1.16],
    [1.16, 1.11, 1.06], [1.10, 1.04, 0.954], [1.05, 0.965, 0.852], [1.01, 0.892, 0.751],
    [0.958, 0.819, 0.650], [0.912, 0.747, 0.549], [0.868, 0.674, 0.446], [0.828, 0.601, 0.341],
    [0.795, 0.526, 0.228],
])
# fmt: on
_TABLE = np.stack([_C11, _C22, _C23, _C33])  # (4 coefficients, 19 ratios, 3 Poisson's ratios)
_SLENDER = 0.1


def kalker(ratio: ArrayLike, nu: float) -> Reals:
    """Coefficients C11, C22, C23, C33.

    They enter as f11 = G a b C11, f22 = G a b C22, f23 = G (ab)^1.5 C23, f33 = G (ab)^2 C33.

    Args:
        ratio: a/b, the semi-axis along rolling over that across; any positive value, shape (...).
        nu: Poisson's ratio, 0 to 0.5.

    Returns:
        The four coefficients, shape (..., 4).
    """
    r = np.asarray(ratio, dtype=np.float64)
    log_C = PchipInterpolator(np.log(_RATIO), np.log(_at_poisson(nu)), axis=1)
    C: Reals = np.exp(log_C(np.log(np.clip(r, _SLENDER, 1.0 / _SLENDER))))
    mismatch = asymptote_mismatch(nu)
    for end, beyond in enumerate((r < _SLENDER, r > 1.0 / _SLENDER)):
        g = np.minimum(r[beyond], 1.0 / r[beyond])
        C[:, beyond] = _asymptote(g, nu, end) * mismatch[end][:, None] ** (g / _SLENDER)
    return np.moveaxis(C, 0, -1)


def asymptote_mismatch(nu: float) -> Reals:
    """Table over asymptote at a/b = 0.1 and a/b = 10.

    Args:
        nu: Poisson's ratio.

    Returns:
        The jump that is smoothed out, shape (2 ends, 4 coefficients).
    """
    table = _at_poisson(nu)
    g = np.array([_SLENDER])
    return np.stack([table[:, -end] / _asymptote(g, nu, end)[:, 0] for end in (0, 1)])


def _at_poisson(nu: float) -> Reals:
    """The table at nu: 1/C quadratic through nu = 0, 0.25, 0.5; shape (4, 19)."""
    weights = np.array([8.0 * (nu - 0.25) * (nu - 0.5), -16.0 * nu * (nu - 0.5), 8.0 * nu * (nu - 0.25)])
    C: Reals = 1.0 / ((1.0 / _TABLE) @ weights)
    return C


def _asymptote(g: Reals, nu: float, end: int) -> Reals:
    """Kalker's limits for a slender ellipse, g = min(a/b, b/a) -> 0, shape (4, n); end 0: a < b, 1: a > b."""
    L = np.log(16.0 / g**2)
    if end == 0:
        C11 = np.full_like(g, np.pi**2 / 4.0 / (1.0 - nu))
        C22 = np.full_like(g, np.pi**2 / 4.0)
        C23 = np.pi * np.sqrt(g) / (3.0 * (1.0 - nu)) * (1.0 + nu * (0.5 * L + np.log(4.0) - 5.0))
        C33 = np.pi**2 / (16.0 * (1.0 - nu) * g)
    else:
        c = 3.0 - np.log(4.0)
        D = (1.0 - nu) * L + 2.0 * nu
        S = (1.0 - nu) * L - 2.0 + 4.0 * nu
        C11 = 2.0 * np.pi / ((L - 2.0 * nu) * g) * (1.0 + c / (L - 2.0 * nu))
        C22 = 2.0 * np.pi / (D * g) * (1.0 + (1.0 - nu) * c / D)
        C23 = 2.0 * np.pi / (3.0 * g**1.5 * S)
        C33 = np.pi / 4.0 * (1.0 - nu * (L - 2.0) / S)
    return np.stack([C11, C22, C23, C33])
