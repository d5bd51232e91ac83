r"""A constant load that moves on an infinite Timoshenko rail on discrete damped springs, by Floquet's transform.

The rail of ``closed_forms/timoshenko`` stands on seats at x = n d, each a spring k and a damper c on rigid ground,
without mass. The load P is at x = V t. The history at one seat repeats at the next one d / V later,

    F_n(t) = R(t - n d / V)

so that all seats' forces are one unknown function R: L. Jezequel, Response of periodic systems to a moving load,
J. Appl. Mech. 48 (1981) 613-618; the same for a rail on sleepers: A. Nordborg, Vertical rail vibrations: pointforce
excitation, Acustica 84 (1998) 280-288. With w^(x, omega) = int w exp(-i omega t) dt, Z = k + i omega c and

    H(kappa) = B / D,  B = EI kappa^2 + S - rho I omega^2,  D = (S kappa^2 - m omega^2) B - S^2 kappa^2
    g(x)     = -i sum_j B(kappa_j) / D'(kappa_j) exp(-i kappa_j |x|),   D(kappa_j) = 0, Im kappa_j < 0

the load alone deflects the free rail by (P / V) H(omega / V) exp(-i omega x / V), a point force by g. Therefore

    R^ = Z (P / V) H(omega / V) / (1 + Z sum_n g(n d) exp(-i omega n d / V))

and each of the four sums is geometric. H has poles on the real axis (waves of the free rail as slow as the load), which
cancel in R^; everything is evaluated at omega - i eta, where there are no poles and outgoing waves decay, and
R is the inverse transform times exp(eta t). The deflection at x, when the load is there, is

    w = 1 / (2 pi) int [ (P / V) H(omega / V) - R^ sum_n g(x - n d) exp(i omega (x - n d) / V) ] d omega .

R is not smooth. A kink of the shear strain travels with the load; when it crosses a seat, the material rate at the
seat's damper jumps, and R jumps down by

    J = c V P / (S - m V^2) / (1 + c / (2 sqrt(S m)))

(the second factor: the jump's own shear waves). The jump at a seat reaches its neighbours as a smaller one.

A seat with a length presses at the points x_n + xi_g, with the shares a_g of its force, and its elongation is the same
mean of the rail's deflection: the load alone moves it by m(omega / V) = sum_g a_g cos(omega xi_g / V) times as much,
its neighbours and itself by g's mean over both sets of points.

| here | the engine |
|---|---|
| w, R, P positive down, seat force on the ground | w, F_V |
| x - V t = 0 under the load | s = l / 2 |
| S | kappa G A |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from validation.closed_forms.timoshenko import Beam

__all__ = ["Seats", "deflection_under_load", "free_rail", "jump", "load_transfer", "seat_force", "waves"]

Complexes = NDArray[np.complex128]

POINTS = 2**17  # of the inverse transform
DISTANCE = 80.0  # m: the load's distance in the inverse transform; a seat far from the load carries no force
DECAY = 0.06  # 1/m: eta / V; less than the decay of R over distance


@dataclass(frozen=True)
class Seats:
    """Supports of the rail.

    Attributes:
        pitch: d [m].
        stiffness: k [N/m].
        damping: c [N s/m], above 0.
        offset: Points xi_g at which a seat presses, from its middle and symmetric about it, within d / 2 [m].
        share: Shares a_g of its force there, of sum one.
    """

    pitch: float
    stiffness: float
    damping: float
    offset: tuple[float, ...] = (0.0,)
    share: tuple[float, ...] = (1.0,)

    def impedance(self, omega: Complexes) -> Complexes:
        """Z = k + i omega c [N/m]."""
        return self.stiffness + 1j * omega * self.damping


def load_transfer(beam: Beam, kappa: Complexes, omega: Complexes) -> Complexes:
    """H = B / D [m^2/N]: deflection of the free rail under a force exp(i omega t - i kappa x) per length."""
    B = beam.EI * kappa**2 + beam.kGA - beam.rho_I * omega**2
    return B / ((beam.kGA * kappa**2 - beam.m * omega**2) * B - beam.kGA**2 * kappa**2)


def waves(beam: Beam, omega: Complexes) -> tuple[Complexes, Complexes]:
    """Wave numbers that decay away from a point force, and their amplitudes.

    Args:
        beam: The rail.
        omega: Frequencies with a negative imaginary part, or a rail with losses [rad/s], shape (n,).

    Returns:
        kappa_j [1/m] and -i B / D' [m/N], shape (2, n) each.
    """
    a = beam.kGA * beam.EI
    b = -(beam.kGA * beam.rho_I + beam.m * beam.EI) * omega**2
    c = beam.m * omega**2 * (beam.rho_I * omega**2 - beam.kGA)
    root = np.sqrt(b * b - 4.0 * a * c)
    squares = np.stack([-b + root, -b - root]) / (2.0 * a)
    kappa = np.sqrt(squares)
    kappa = np.where(kappa.imag > 0.0, -kappa, kappa)
    B = beam.EI * squares + beam.kGA - beam.rho_I * omega**2
    return kappa, -1j * B / (4.0 * a * squares * kappa + 2.0 * b * kappa)


def free_rail(beam: Beam, seats: Seats, omega: Complexes, phase: Complexes, x: float) -> Complexes:
    """Sum of g(x - n d) exp(-i phase n) over all seats n [m/N], shape (n,).

    Args:
        beam: The rail.
        seats: Source of the pitch d.
        omega: Frequencies [rad/s].
        phase: Lag from seat to seat [rad], omega d / V for a moving load.
        x: Position from seat 0 [m].
    """
    turns, x = divmod(x, seats.pitch)
    kappa, amplitude = waves(beam, omega)
    behind, ahead = np.exp(-1j * (kappa * seats.pitch - phase)), np.exp(-1j * (kappa * seats.pitch + phase))
    near = np.exp(-1j * kappa * x) / (1.0 - behind) + np.exp(1j * kappa * x) * ahead / (1.0 - ahead)
    total: Complexes = np.sum(amplitude * near, axis=0) * np.exp(-1j * phase * turns)
    return total


def _frequencies(V: float) -> Complexes:
    """Frequencies of the inverse transform, on a line below the real axis [rad/s]."""
    real = 2.0 * np.pi * np.fft.fftfreq(POINTS, DISTANCE / (V * POINTS))
    return np.asarray(real - 1j * DECAY * V, dtype=np.complex128)


def _seat_spectrum(beam: Beam, seats: Seats, V: float, P: float, omega: Complexes) -> Complexes:
    """R^ [N s]."""
    Z, alone = seats.impedance(omega), P / V * load_transfer(beam, omega / V, omega)
    lag, x, a = omega * seats.pitch / V, np.array(seats.offset), np.array(seats.share)
    transfer = np.tensordot(a, np.cos(np.multiply.outer(x, omega) / V), 1)
    apart, which = np.unique(np.subtract.outer(x, x).round(12), return_inverse=True)  # some pairs are as far apart
    weight = np.bincount(which.ravel(), np.outer(a, a).ravel())
    own = sum(b * free_rail(beam, seats, omega, lag, float(y)) for y, b in zip(apart, weight, strict=True))
    found: Complexes = Z * alone * transfer / (1.0 + Z * own)
    return found


def seat_force(beam: Beam, seats: Seats, V: float, P: float, x: Reals) -> Reals:
    """Force of a seat over the position of the load.

    Args:
        beam: The rail.
        seats: Its supports.
        V: Speed [m/s].
        P: Load [N].
        x: Load ahead of the seat, V t [m], within 40 m, shape (n,).

    Returns:
        R [N], shape (n,).
    """
    omega = _frequencies(V)
    spectrum = _seat_spectrum(beam, seats, V, P, omega) * (-1.0) ** np.arange(POINTS)  # t = 0 in the middle
    distance = (np.arange(POINTS) - POINTS // 2) * (DISTANCE / POINTS)
    history = (np.fft.ifft(spectrum) * (POINTS * V / DISTANCE)).real * np.exp(DECAY * distance)
    return np.interp(x, distance, history)


def deflection_under_load(beam: Beam, seats: Seats, V: float, P: float, x: Reals) -> Reals:
    """Deflection of the rail under the load.

    Args:
        beam: The rail.
        seats: Its supports.
        V: Speed [m/s].
        P: Load [N].
        x: Load ahead of a seat [m], periodic with the pitch, shape (n,).

    Returns:
        w [m], shape (n,).
    """
    omega = _frequencies(V)
    alone = P / V * load_transfer(beam, omega / V, omega)
    R, lag = _seat_spectrum(beam, seats, V, P, omega), omega * seats.pitch / V
    # beyond the highest wave number of the sum only the kink of the shear strain remains
    beyond = P / (np.pi * (beam.kGA - beam.m * V**2)) * DISTANCE / (np.pi * POINTS)
    found = []
    for place in np.mod(x, seats.pitch):
        points = zip(seats.offset, seats.share, strict=True)
        spread = sum(a * free_rail(beam, seats, omega, lag, place - x) for x, a in points)
        carried = R * spread * np.exp(1j * omega * place / V)
        found.append(float(np.sum(alone - carried).real) * V / DISTANCE + beyond)
    return np.array(found)


def jump(beam: Beam, seats: Seats, V: float, P: float) -> float:
    """Jump J by which the seat force falls when the load crosses the seat [N]."""
    strain = P / (beam.kGA - beam.m * V**2)
    own = 1.0 + seats.damping / (2.0 * np.sqrt(beam.kGA * beam.m))
    return float(seats.damping * V * strain / own)
