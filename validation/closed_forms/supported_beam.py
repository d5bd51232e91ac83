r"""Simply supported beam under a force, mass or sprung mass that moves at constant speed.

L. Fryba, Vibration of solids and structures under moving loads (3rd ed., 1999), ch. 1 (force), 2 (mass, sprung mass).
Euler beam, modes sin(k_i x), k_i = i pi / l, omega_i = k_i^2 sqrt(EI / m), Omega_i = k_i V, beam at rest at t = 0:

    force:        w = 2 P / (m l) sum_i sin(k_i x) [sin Omega_i t - (Omega_i / omega_i) sin omega_i t]
                                                                          / (omega_i^2 - Omega_i^2)
    mass:         q_i'' + omega_i^2 q_i = 2 / (m l) sin(k_i V t) F,  F = M [g - (w_tt + 2 V w_xt + V^2 w_xx)(V t, t)]
    sprung mass:  F = M g + k (z - w) + c (z' - w_t - V w_x),  M z'' = M g - F, z from its position on a beam at rest

The latter two are integrated with SciPy's explicit DOP853, which is unrelated to the engine's method. The mass's own
acceleration is eliminated from F first, so that the system is an explicit one:

    F = M (g - a) / (1 + 2 M / (m l) sum sin^2 k_i V t)
    a = sum_i [-omega_i^2 q_i sin k_i V t + 2 V k_i q_i' cos k_i V t - V^2 k_i^2 q_i sin k_i V t]

The Timoshenko beam has the same modes in w, each with two frequencies (``timoshenko.pinned_frequencies``) whose free
motions are orthogonal: theta = r w with r = kGA k_i / (EI k_i^2 + kGA - rho I omega^2), mass m + rho I r^2
instead of m. Signs: down positive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY
from validation.closed_forms.timoshenko import Beam, pinned_frequencies

__all__ = ["Crossing", "force_euler", "force_timoshenko", "moving_mass", "sprung_mass"]

RTOL = 1e-7  # of the integration, a hundred times finer than what it judges


@dataclass(frozen=True)
class Crossing:
    """A beam and the mass that crosses it.

    Attributes:
        EI: Bending stiffness [N m^2].
        m: Mass per length [kg/m].
        length: l [m].
        V: Speed [m/s].
        mass: M [kg]; its weight is the force.
        stiffness: k of the sprung mass [N/m].
        damping: c of the sprung mass [N s/m].
    """

    EI: float
    m: float
    length: float
    V: float
    mass: float
    stiffness: float = 0.0
    damping: float = 0.0

    @property
    def duration(self) -> float:
        """Time on the beam [s]."""
        return self.length / self.V

    @property
    def weight(self) -> float:
        """M g [N]."""
        return self.mass * GRAVITY

    def wave_numbers(self, modes: int) -> Reals:
        """k_i [1/m], shape (modes,)."""
        return np.arange(1.0, modes + 1) * np.pi / self.length

    def frequencies(self, modes: int) -> Reals:
        """omega_i [rad/s], shape (modes,)."""
        found: Reals = self.wave_numbers(modes) ** 2 * np.sqrt(self.EI / self.m)
        return found


def force_euler(crossing: Crossing, x: float, t: Reals, modes: int) -> Reals:
    """Deflection at x under a force that moves at V [m], shape of t; while it is on the beam."""
    k, omega = crossing.wave_numbers(modes), crossing.frequencies(modes)
    Omega = k * crossing.V
    scale = 2.0 * crossing.weight / (crossing.m * crossing.length) / (omega**2 - Omega**2) * np.sin(k * x)
    found: Reals = (np.sin(np.outer(t, Omega)) - Omega / omega * np.sin(np.outer(t, omega))) @ scale
    return found


def force_timoshenko(beam: Beam, crossing: Crossing, x: float, t: Reals, modes: int) -> Reals:
    """Deflection at x of a Timoshenko beam under a moving force [m], shape of t; both branches."""
    k, total = crossing.wave_numbers(modes), np.zeros(len(t))
    Omega = k * crossing.V
    for omega in pinned_frequencies(beam, crossing.length, modes):
        slope = beam.kGA * k / (beam.EI * k**2 + beam.kGA - beam.rho_I * omega**2)  # theta per w of the free motion
        mass = beam.m + beam.rho_I * slope**2
        scale = 2.0 * crossing.weight / (mass * crossing.length) / (omega**2 - Omega**2) * np.sin(k * x)
        total += (np.sin(np.outer(t, Omega)) - Omega / omega * np.sin(np.outer(t, omega))) @ scale
    return total


def moving_mass(crossing: Crossing, x: float, t: Reals, modes: int) -> Reals:
    """Deflection at x under a mass that stays on the beam.

    Args:
        crossing: Beam and mass.
        x: Position [m].
        t: Instants while it is on the beam [s], ascending, shape (n,).
        modes: Modes of the beam.

    Returns:
        w [m], shape (n,).
    """
    k, V, M = crossing.wave_numbers(modes), crossing.V, crossing.mass
    stiffness, share = crossing.frequencies(modes) ** 2, 2.0 / (crossing.m * crossing.length)

    def rate(time: float, state: Reals) -> Reals:
        q, v = state[:modes], state[modes:]
        sine, cosine = np.sin(k * V * time), np.cos(k * V * time)
        without = 2.0 * V * (k * cosine) @ v - ((stiffness + (V * k) ** 2) * sine) @ q
        F = M * (GRAVITY - without) / (1.0 + M * share * sine @ sine)
        return np.concatenate([v, share * F * sine - stiffness * q])

    return _integrate(rate, 2 * modes, t)[:modes].T @ np.sin(k * x)


def sprung_mass(crossing: Crossing, x: float, t: Reals, modes: int) -> tuple[Reals, Reals]:
    """Deflection at x, and displacement of the sprung mass, which arrives at rest in its static position.

    Args:
        crossing: Beam, mass, spring and damper.
        x: Position [m].
        t: Instants while it is on the beam [s], ascending, shape (n,).
        modes: Modes of the beam.

    Returns:
        w [m] and the mass's displacement [m], shape (n,) each.
    """
    k, V, M = crossing.wave_numbers(modes), crossing.V, crossing.mass
    stiffness, share = crossing.frequencies(modes) ** 2, 2.0 / (crossing.m * crossing.length)

    def rate(time: float, state: Reals) -> Reals:
        q, z, v, speed = state[:modes], state[modes], state[modes + 1 : -1], state[-1]
        sine, cosine = np.sin(k * V * time), np.cos(k * V * time)
        pressed = crossing.stiffness * (z - sine @ q) + crossing.damping * (speed - sine @ v - V * (k * cosine) @ q)
        bent = share * (crossing.weight + pressed) * sine - stiffness * q
        return np.concatenate([v, [speed], bent, [-pressed / M]])

    found = _integrate(rate, 2 * modes + 2, t)
    return found[:modes].T @ np.sin(k * x), found[modes]


def _integrate(rate: Callable[[float, Reals], Reals], size: int, t: Reals) -> Reals:
    """Integrate from rest; shape (size, n)."""
    found = solve_ivp(rate, (0.0, float(t[-1])), np.zeros(size), method="DOP853", t_eval=t, rtol=RTOL, atol=1e-13)
    if not found.success:
        raise RuntimeError(found.message)
    values: Reals = found.y
    return values
