"""Fastenings in the implicit blocks: smeared along the rails, exact under the slabs."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.model.newmark import Newmark, inverse
from tiengine.track.fastening import Fastening
from tiengine.track.rail import RailWindow


def smearing(window: RailWindow, spacing: float) -> float:
    """Factor on the smeared fastenings of A_s, so that the passes converge for any number of modes.

    For a single wave shape, discrete seats are between 0 and N d / l times as stiff as smeared ones (all waves of a set
    that coincide at the seats add up). The iteration contracts if A_s is at least half the upper bound; a larger A_s
    only slows it. Up to 2 / d modes per metre (3.2 for 0.63 m) the factor is one.
    """
    return max(1.0, 0.5 * window.modes * spacing / window.length)


def smeared_fastening(
    window: RailWindow, fastening: Fastening, spacing: float, newmark: Newmark
) -> tuple[float, float]:
    """A_s of a mode: vertical and lateral share of the smeared fastenings in the implicit rail blocks [kg].

    Args:
        window: The rail.
        fastening: Its fastenings.
        spacing: Seat pitch d [m].
        newmark: Step and coefficients.
    """
    per_mode = smearing(window, spacing) * window.length / (2.0 * spacing)
    kv = per_mode * (newmark.beta_dt2 * fastening.vertical_stiffness + newmark.gamma_dt * fastening.vertical_damping)
    kl = per_mode * (newmark.beta_dt2 * fastening.lateral_stiffness + newmark.gamma_dt * fastening.lateral_damping)
    return kv, kl


def rail_inverses(
    window: RailWindow, fastening: Fastening, spacing: float, newmark: Newmark, V: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inverses of the vertical (2N, 2N) and lateral (3N, 3N) rail blocks at speed V, smeared fastenings included.

    Args:
        window: The rail.
        fastening: Its fastenings.
        spacing: Seat pitch d [m].
        newmark: Step and coefficients.
        V: Speed [m/s].
    """
    n, (kv, kl) = window.modes, smeared_fastening(window, fastening, spacing, newmark)
    a, b = window.rail.arm_fastening, window.rail.half_base
    one, none = sp.eye_array(n), sp.csr_array((n, n))
    smeared_vertical = sp.block_diag([kv * one, none])
    smeared_lateral = sp.block_array(
        [[kl * one, None, -a * kl * one], [None, none, None], [-a * kl * one, None, (a**2 * kl + b**2 * kv) * one]]
    )
    return (
        inverse(newmark.operator(*window.vertical(V)) + smeared_vertical, "vertical rail"),
        inverse(newmark.operator(*window.lateral(V)) + smeared_lateral, "lateral rail"),
    )


def seat_inverse_terms(
    shapes: NDArray[np.float64], scale: NDArray[np.float64], fastening: Fastening, half_base: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and damping of a slab's own motion against its fastenings.

    Args:
        shapes: As from :func:`tiengine.track.slab_matrices.seat_shapes`, shape (n, 5 seats).
        scale: Factor of each fastening, shape (seats, 2).
        fastening: Their sound values.
        half_base: b [m].

    Returns:
        K and C, shape (n, n).
    """
    b2, (left, right) = half_base**2, scale.T

    def terms(vertical: float, lateral: float) -> NDArray[np.float64]:
        weights = [vertical * left, vertical * right, b2 * vertical * left, b2 * vertical * right]
        matrix: NDArray[np.float64] = (shapes * np.concatenate([*weights, lateral * (left + right)])) @ shapes.T
        return matrix

    return (
        terms(fastening.vertical_stiffness, fastening.lateral_stiffness),
        terms(fastening.vertical_damping, fastening.lateral_damping),
    )
