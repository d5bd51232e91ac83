"""Timoshenko beam: pinned modes, and a load that moves on an infinite one on a continuous foundation.

m w_tt = kGA (w'' - theta') - k w - c w_t + P delta,   rho I theta_tt = EI theta'' + kGA (w' - theta).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiengine.parameters.arrays import Reals

__all__ = ["Beam", "moving_load_deflection", "pinned_frequencies", "static_missing_share"]


@dataclass(frozen=True)
class Beam:
    """Stiffness and inertia of a beam.

    Attributes:
        EI: Bending stiffness [N m^2].
        kGA: Shear stiffness [N].
        m: Mass per length [kg/m].
        rho_I: Rotary inertia per length [kg m].
    """

    EI: float
    kGA: float
    m: float
    rho_I: float


def pinned_frequencies(beam: Beam, length: float, modes: int) -> Reals:
    """Frequencies of the pinned beam, both branches.

    m rho_I omega^4 - [m (EI k^2 + kGA) + rho_I kGA k^2] omega^2 + kGA EI k^4 = 0 with k = n pi / l.

    Args:
        beam: The beam.
        length: l [m].
        modes: Half waves n = 1..modes.

    Returns:
        Circular frequencies [rad/s], shape (2, modes): bending branch, shear branch.
    """
    k = np.arange(1, modes + 1) * np.pi / length
    a = beam.m * beam.rho_I
    b = beam.m * (beam.EI * k**2 + beam.kGA) + beam.rho_I * beam.kGA * k**2
    c = beam.kGA * beam.EI * k**4
    high = (b + np.sqrt(b**2 - 4.0 * a * c)) / (2.0 * a)
    return np.sqrt(np.stack([c / (a * high), high]))


def moving_load_deflection(beam: Beam, k: float, c: float, V: float, P: float, s: Reals) -> Reals:
    """Deflection of an infinite beam under a constant load that moves at V, in the load's frame.

    Fourier transform over s = x - V t turns the equations into w(xi) = P B / D with
    B = (EI - rho_I V^2) xi^2 + kGA and D = [(kGA - m V^2) xi^2 - i c V xi + k] B - kGA^2 xi^2;
    the inverse transform is the sum of residues above (s > 0) or below (s < 0) the real axis.

    Args:
        beam: The beam.
        k: Foundation [N/m^2].
        c: Its damping [N s/m^2], above 0 or V below the critical speed.
        V: Speed [m/s].
        P: Load [N].
        s: Positions ahead of the load [m], shape (n,).

    Returns:
        w [m], shape (n,).
    """
    B = np.array([beam.EI - beam.rho_I * V**2, 0.0, beam.kGA], dtype=complex)
    first = np.array([beam.kGA - beam.m * V**2, -1j * c * V, k])
    D = np.polysub(np.polymul(first, B), np.array([beam.kGA**2, 0.0, 0.0]))
    roots = np.roots(D)
    residue = np.polyval(B, roots) / np.polyval(np.polyder(D), roots)
    above = roots.imag > 0.0
    waves = residue * np.exp(1j * np.outer(s, roots))
    ahead, behind = 1j * waves[:, above].sum(axis=1), -1j * waves[:, ~above].sum(axis=1)
    return P * np.where(s >= 0.0, ahead.real, behind.real)


def static_missing_share(beam: Beam, length: float, modes: int, terms: int = 200_000) -> float:
    """Static compliance at mid-span that modes beyond ``modes`` would add [m/N].

    (2/l) times the sum over odd i of 1/(kGA k_i^2) + 1/(EI k_i^4), shear and bending.
    """
    i = np.arange(modes + 1, modes + terms)
    k = i[i % 2 == 1] * np.pi / length
    return float(2.0 / length * np.sum(1.0 / (beam.kGA * k**2) + 1.0 / (beam.EI * k**4)))
