r"""Receptance of an infinite Timoshenko rail on discrete damped springs, by the transfer matrix of a span.

All quantities vary as exp(i omega t). The state y = (w, theta, M, Q), M = EI theta', Q = S (w' - theta), obeys y' = A
y with

    w' = theta + Q / S,  theta' = M / EI,  M' = -Q - rho I omega^2 theta,  Q' = -m omega^2 w,

a seat adds Z w = (k + i omega c) w to Q, a unit force reduces Q by 1. From just ahead of a load, the state one pitch
further is T y, T = exp(A (d - x)) J exp(A x), x being the distance from the load to the seat. Of T's eigenvectors two
decay ahead (|lambda| < 1), two behind; the state jumps by (0, 0, 0, -1) from a sum of the latter to a sum of the
former: four equations, no truncation (D. J. Mead, Free wave propagation in periodically supported, infinite beams, J.
Sound Vib. 11 (1970) 181-197; T. X. Wu and D. J. Thompson, A double Timoshenko beam model for vertical vibration
analysis of railway track at high frequencies, J. Sound Vib. 224 (1999) 329-348). A loss factor eta makes EI and S
complex, E (1 + i eta); without one the receptance at mid-span is infinite at the pinned-pinned frequency, whose wave
is a standing one with nodes on the seats. Signs: w and force down.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from validation.closed_forms.floquet import Seats
from validation.closed_forms.timoshenko import Beam

__all__ = ["receptance"]

Complexes = NDArray[np.complex128]


def receptance(beam: Beam, seats: Seats, loss: float, x: float, frequencies: Reals) -> Complexes:
    """Deflection under a unit force.

    Args:
        beam: The rail.
        seats: Its supports.
        loss: Loss factor eta of the rail [-].
        x: From the load ahead to the next seat [m], 0 over a seat, d / 2 at mid-span.
        frequencies: [Hz], shape (n,).

    Returns:
        w [m/N], shape (n,).
    """
    return np.array([_point(beam, seats, loss, x, 2.0 * np.pi * f) for f in frequencies])


def _point(beam: Beam, seats: Seats, loss: float, x: float, omega: float) -> complex:
    """One frequency; states in units (1, 1 / d, EI / d^2, EI / d^3) so that the matrix is balanced."""
    d, EI, S = seats.pitch, beam.EI * (1.0 + 1j * loss), beam.kGA * (1.0 + 1j * loss)
    A = np.zeros((4, 4), dtype=complex)
    A[0, 1], A[0, 3] = 1.0, beam.EI / (S * d**2)
    A[1, 2] = beam.EI / EI
    A[2, 3], A[2, 1] = -1.0, -beam.rho_I * omega**2 * d**2 / beam.EI
    A[3, 0] = -beam.m * omega**2 * d**4 / beam.EI
    seat = np.eye(4, dtype=complex)
    seat[3, 0] = (seats.stiffness + 1j * omega * seats.damping) * d**3 / beam.EI
    before, after = scipy.linalg.expm(A * x / d), scipy.linalg.expm(A * (1.0 - x / d))
    growth, shapes = np.linalg.eig(after @ seat @ before)
    shapes = shapes[:, np.argsort(np.abs(growth))]  # two that decay ahead, two that decay behind
    amplitude = np.linalg.solve(shapes * np.array([1.0, 1.0, -1.0, -1.0]), np.array([0.0, 0.0, 0.0, -1.0]))
    return complex(shapes[0, :2] @ amplitude[:2]) * d**3 / beam.EI
