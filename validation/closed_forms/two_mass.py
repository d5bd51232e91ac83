"""P2 resonance: the unsprung mass of a wheel on the rail, bouncing together on the track's spring.

H. H. Jenkins, J. E. Stephenson, G. A. Clayton, G. W. Morland, D. Lyon, The effect of track and vehicle parameters on
wheel/rail vertical dynamic forces, Railway Engineering Journal 3(1) (1974) 2-16: wheel (unsprung mass m_u), contact
spring k_H, equivalent track mass m_r on spring k_t and damper. The track is a beam EI with mass m per length on a
foundation k per length; its static shape under a load, exp(-x)(cos x + sin x) over x = beta |s| with beta^4 = k/(4 EI),
gives k_t = 8 EI beta^3 and, by kinetic energy, m_r = 3 m/(2 beta), the damper likewise c_t = 3 c/(2 beta). P2 is the
lower of the two natural frequencies (the upper is P1).

A better model, which shows the error of this one: the receptance alpha of a Timoshenko beam under its load on a damped
foundation in series with a slab on its bed. By Fourier transform along the rail, with k_b = k_bed + i omega c_bed -
omega^2 m_slab (a slab without bending stiffness: it follows the load) and K(omega) = 1/(1/(k + i omega c) + 1/k_b) - m
omega^2,

    alpha = 1/(2 pi) int B/D dxi,  B = EI xi^2 + kGA - rho I omega^2,  D = (kGA xi^2 + K) B - (kGA xi)^2,

i times the sum of the residues B/D' above the real axis (times exp(i xi d) at a distance d). Roughness z(omega) between
wheel and rail makes the force F = z/(alpha + 1/k_H + 1/(k_p + i omega c_p - m_u omega^2)), the primary suspension k_p,
c_p standing on a frame at rest; P2 is the lower peak of |F/z|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals

__all__ = ["WheelOnTrack", "beam_receptance", "force_per_roughness", "peak", "two_mass_frequencies"]


@dataclass(frozen=True)
class WheelOnTrack:
    """A wheel on a rail on a continuous foundation.

    Attributes:
        unsprung: Mass of a wheel with its share of the axle, m_u [kg].
        contact: Linearised contact spring k_H [N/m].
        EI: Bending stiffness of the rail [N m^2].
        m: Mass of the rail per length [kg/m].
        k: Foundation [N/m^2].
        c: Its damping [N s/m^2].
        kGA: Shear stiffness of the rail [N].
        rho_I: Its rotary inertia per length [kg m].
        bed: Stiffness below the foundation [N/m^2].
        bed_damping: Its damping [N s/m^2].
        bed_mass: Mass between foundation and bed per length [kg/m].
        primary_stiffness: Stiffness of the suspension above the wheel, k_p [N/m].
        primary_damping: c_p [N s/m].
    """

    unsprung: float
    contact: float
    EI: float
    m: float
    k: float
    c: float
    kGA: float = np.inf
    rho_I: float = 0.0
    bed: float = np.inf
    bed_damping: float = 0.0
    bed_mass: float = 0.0
    primary_stiffness: float = 0.0
    primary_damping: float = 0.0

    @property
    def beta(self) -> float:
        """Wave number of the static shape [1/m]."""
        return float((self.k / (4.0 * self.EI)) ** 0.25)

    @property
    def track_stiffness(self) -> float:
        """k_t [N/m]."""
        return 8.0 * self.EI * self.beta**3

    @property
    def track_mass(self) -> float:
        """m_r [kg]."""
        return 3.0 * self.m / (2.0 * self.beta)


def two_mass_frequencies(system: WheelOnTrack) -> tuple[float, float]:
    """Undamped frequencies P2 and P1 [Hz]."""
    k, K = system.contact, np.array([[system.contact, -system.contact], [-system.contact, system.contact]])
    K[1, 1] = k + system.track_stiffness
    root = np.sqrt([system.unsprung, system.track_mass])
    low, high = np.sqrt(np.linalg.eigvalsh(K / np.outer(root, root))) / (2.0 * np.pi)
    return float(low), float(high)


def beam_receptance(system: WheelOnTrack, frequency: Reals, distance: float = 0.0) -> NDArray[np.complex128]:
    """Deflection of the infinite rail under a harmonic force of 1 N, alpha [m/N], shape (n,).

    Args:
        system: Source of the track's data; an infinite kGA gives an Euler beam.
        frequency: Frequencies [Hz], shape (n,).
        distance: Distance from the force to the point of the deflection [m].
    """
    s, found = system, np.empty(len(frequency), dtype=np.complex128)
    flexible = 0.0 if np.isinf(s.kGA) else 1.0 / s.kGA
    for n, omega in enumerate(2.0 * np.pi * frequency):
        bed = s.bed + 1j * omega * s.bed_damping - s.bed_mass * omega**2
        K = 1.0 / (1.0 / (s.k + 1j * omega * s.c) + 1.0 / bed) - s.m * omega**2
        B = np.array([s.EI * flexible, 0.0, 1.0 - s.rho_I * omega**2 * flexible])  # over kGA, as is D
        slope = np.array([s.EI, 0.0, -s.rho_I * omega**2, 0.0, 0.0])
        D = np.polyadd(slope, K * B)
        roots = np.roots(D)
        above = roots[roots.imag > 0.0]
        found[n] = 1j * np.sum(np.polyval(B, above) / np.polyval(np.polyder(D), above) * np.exp(1j * above * distance))
    return found


def force_per_roughness(system: WheelOnTrack, frequency: Reals, *, lumped: bool = False) -> NDArray[np.complex128]:
    """Wheel force for a roughness of 1 m, F/z.

    Args:
        system: Wheel and track.
        frequency: Frequencies [Hz], shape (n,).
        lumped: Track as one mass, spring and damper instead of a beam.

    Returns:
        F/z [N/m], shape (n,).
    """
    s, omega = system, 2.0 * np.pi * frequency
    if lumped:
        reach = 3.0 / (2.0 * s.beta)
        track = 1.0 / (s.track_stiffness + reach * (1j * omega * s.c - s.m * omega**2))
    else:
        track = beam_receptance(s, frequency)
    wheel = 1.0 / (s.primary_stiffness + 1j * omega * s.primary_damping - s.unsprung * omega**2)
    return np.asarray(1.0 / (track + 1.0 / s.contact + wheel), dtype=np.complex128)


def peak(frequency: Reals, values: Reals) -> float:
    """Position of the largest value, by a parabola through it and its neighbours [unit of the frequency]."""
    i = int(np.clip(np.argmax(values), 1, len(values) - 2))
    before, here, after = values[i - 1 : i + 2]
    return float(
        frequency[i] + 0.5 * (before - after) / (before - 2.0 * here + after) * (frequency[i] - frequency[i - 1])
    )
