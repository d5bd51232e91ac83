"""Steady deflection of an infinite beam on an elastic foundation under a moving load.

In the frame of the load s = x - V t nothing depends on time, so the material rate is D = -V d/ds. With
w = (1/2 pi) int W(kappa) exp(i kappa s) d kappa

    Timoshenko:  m D^2 w - S (w'' - theta') + k w + c D w = P delta(s)
                 rho I D^2 theta - EI theta'' - S (w' - theta) = 0
    Euler:       EI w'''' + m D^2 w + k w + c D w = P delta(s)

become W = P n(kappa) / d(kappa) with polynomials n (degree 2 or 0) and d (degree 4); d(kappa) = 0 is the
characteristic quartic. The integral is the sum of the residues at its roots: upper half-plane ahead of the load,
lower behind (Fryba, *Vibration of Solids and Structures under Moving Loads*, 1999, ch. 13 for the Euler beam).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial as poly
from numpy.typing import NDArray


@dataclass(frozen=True)
class Bed:
    """Beam and bed: EI, shear stiffness S (None: Euler), mass m, rotary inertia, bed k and c per length."""

    EI: float
    S: float | None
    m: float
    rotary: float
    k: float
    c: float


def deflection(beam: Bed, V: float, P: float, s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Deflection [m] at distances s [m] ahead of the load.

    Args:
        beam: Beam and bed.
        V: Speed [m/s], below the critical one.
        P: Load [N].
        s: Places, 1-D.
    """
    across = np.array([beam.k, -1j * beam.c * V, -beam.m * V**2])
    if beam.S is None:
        over, under = np.array([1.0 + 0j]), poly.polyadd(across, [0, 0, 0, 0, beam.EI])
    else:
        over = np.array([beam.S, 0.0, beam.EI - beam.rotary * V**2], dtype=complex)
        under = poly.polysub(poly.polymul(poly.polyadd(across, [0, 0, beam.S]), over), [0, 0, beam.S**2])
    roots = poly.polyroots(under)
    weight = 1j * P * poly.polyval(roots, over) / poly.polyval(roots, poly.polyder(under))
    ahead = roots.imag > 0.0
    waves = np.exp(1j * np.multiply.outer(s, roots))
    with np.errstate(over="ignore", invalid="ignore"):
        front = np.sum(np.where(ahead, weight, 0.0) * np.where(ahead, waves, 0.0), axis=1)
        rear = -np.sum(np.where(ahead, 0.0, weight) * np.where(ahead, 0.0, waves), axis=1)
    found: NDArray[np.float64] = np.where(s >= 0.0, front, rear).real
    return found
