r"""Infinite Euler beam on a continuous foundation under a load that moves at constant speed.

J. T. Kenney, Steady-state vibrations of beam on elastic foundation for moving load, J. Appl. Mech. 21 (1954) 359-364;
L. Fryba, Vibration of solids and structures under moving loads (3rd ed., 1999), ch. 13. With s = x - V t, everything
constant in time and ' = d/ds,

    EI w'''' + m V^2 w'' - c V w' + k w = P delta(s).

Without damping, with L^4 = k / (4 EI), V_cr^2 = sqrt(4 k EI) / m and V below it (Kenney's solution)

    w = P / (8 EI L^2 a) exp(-a |s|) [cos b s + (a / b) sin b |s|],  a, b = L sqrt(1 -+ (V / V_cr)^2).

With damping, r^4 + mu r^2 - gamma r + kappa = 0 (mu = m V^2 / EI, gamma = c V / EI, kappa = k / EI) has no cubic term,
so that it is (r^2 + 2 a r + p)(r^2 - 2 a r + q) with real a > 0 from the cubic y^3 + 2 mu y^2 + (mu^2 - 4 kappa) y -
gamma^2 = 0 in y = 4 a^2, p + q = mu + y, q - p = -gamma / (2 a): a wave on either side of the load, with amplitudes
from w, w', w'' continuous and EI w''' jumping by P. Signs: w and P down, s ahead of the load.
"""

from __future__ import annotations

import numpy as np

from tiengine.parameters.arrays import Reals

__all__ = ["critical_speed", "damped_deflection", "undamped_deflection"]


def critical_speed(EI: float, m: float, k: float) -> float:
    """Critical speed V_cr, above which the beam radiates waves [m/s]."""
    return float(np.sqrt(np.sqrt(4.0 * k * EI) / m))


def undamped_deflection(EI: float, m: float, k: float, V: float, P: float, s: Reals) -> Reals:
    """Kenney's deflection below the critical speed.

    Args:
        EI: Bending stiffness [N m^2].
        m: Mass per length [kg/m].
        k: Foundation [N/m^2].
        V: Speed [m/s].
        P: Load [N].
        s: Positions ahead of the load [m], shape (n,).

    Returns:
        w [m], shape (n,).
    """
    L, ratio = (k / (4.0 * EI)) ** 0.25, (V / critical_speed(EI, m, k)) ** 2
    a, b, far = L * np.sqrt(1.0 - ratio), L * np.sqrt(1.0 + ratio), np.abs(s)
    return P / (8.0 * EI * L**2 * a) * np.exp(-a * far) * (np.cos(b * far) + a / b * np.sin(b * far))


def damped_deflection(EI: float, m: float, k: float, c: float, V: float, P: float, s: Reals) -> Reals:
    """Deflection on a damped foundation at any speed.

    Args:
        EI: Bending stiffness [N m^2].
        m: Mass per length [kg/m].
        k: Foundation [N/m^2].
        c: Its damping [N s/m^2], above 0.
        V: Speed [m/s].
        P: Load [N].
        s: Positions ahead of the load [m], shape (n,).

    Returns:
        w [m], shape (n,).
    """
    mu, gamma, kappa = m * V**2 / EI, c * V / EI, k / EI
    cubic = np.roots([1.0, 2.0 * mu, mu**2 - 4.0 * kappa, -(gamma**2)])
    y = cubic[np.abs(cubic.imag) < 1e-9 * np.abs(cubic)].real.max()
    a = np.sqrt(y) / 2.0
    p, q = (mu + y + gamma / (2.0 * a)) / 2.0, (mu + y - gamma / (2.0 * a)) / 2.0
    ahead = -a + np.array([1.0, -1.0]) * np.sqrt(a**2 - p + 0j)
    behind = a + np.array([1.0, -1.0]) * np.sqrt(a**2 - q + 0j)
    powers = np.arange(4)[:, None]
    conditions = np.hstack([ahead**powers, -(behind**powers)])
    amplitude = np.linalg.solve(conditions, np.array([0.0, 0.0, 0.0, P / EI], dtype=complex))
    sides = [
        np.exp(np.outer(x, r)) @ A
        for x, r, A in ((np.maximum(s, 0.0), ahead, amplitude[:2]), (np.minimum(s, 0.0), behind, amplitude[2:]))
    ]
    return np.where(s >= 0.0, sides[0].real, sides[1].real)
