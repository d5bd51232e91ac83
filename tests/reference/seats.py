"""Fastening forces at moving seats, seat by seat from their chainages; no tables, no angle addition.

Generalised coordinates of one train: rails (2, 5, N) in the order w, theta_y, v, theta_z, theta_x with
sin(i pi s/l), and slabs by index along the track.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.track.fastening import Fastening
from tiengine.track.rail import Rail
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices


@dataclass
class Seat:
    """One fastening: its place, the motion at it (displacement and material rate), its forces."""

    number: int
    side: int
    s: float
    rail: Reals  # (2, 3): w, v, theta_x and their material rates
    slab: Reals  # (2, 3): w, y, dw/dy and their rates; zero on rigid ground
    force: Reals  # F_V, F_L, M_b


def seats(
    X: float,
    V: float,
    length: float,
    rail: Rail,
    fastening: Fastening,
    slab: Slab,
    matrices: SlabMatrices,
    rails: Reals,
    slabs: dict[int, Reals],
    factor: Callable[[int, int], float],
) -> tuple[list[Seat], Reals, dict[int, Reals]]:
    """Every fastening of the window, and the generalised forces on rails and slabs.

    Args:
        X: Chainage of the window's rear end [m].
        V: Speed [m/s].
        length: Window [m].
        rail: Section.
        fastening: Sound fastening.
        slab: Slab.
        matrices: Shapes at its seats.
        rails: Displacements and rates, shape (2, 2, 5, N).
        slabs: Displacements and rates of the modelled slabs, shape (2, n) each.
        factor: Of seat number and side.

    Returns:
        The seats; forces on the rails, shape (2, 5, N); forces on the slabs by index.
    """
    N = rails.shape[-1]
    k = np.arange(1, N + 1) * np.pi / length
    found, on_rails, on_slabs = [], np.zeros((2, 5, N)), {i: np.zeros(q.shape[1]) for i, q in slabs.items()}
    d, pitch = slab.fastening_pitch, slab.pitch
    for number in range(int(np.floor(X / d)) - 2, int((X + length) / d) + 3):
        x = (number + 0.5) * d
        s = x - X
        if not 0.0 < s < length:
            continue
        index = int(np.floor(x / pitch))
        place = x - (index + 0.5) * pitch
        local = int(np.argmin(np.abs(matrices.seat_x - place)))
        assert abs(matrices.seat_x[local] - place) < 1e-6
        for side in range(2):
            shape, slope = np.sin(k * s), k * np.cos(k * s)
            fields = [0, 2, 4]
            u = rails[0, side, fields] @ shape
            Du = rails[1, side, fields] @ shape - V * rails[0, side, fields] @ slope
            under = np.zeros((2, 3))
            rows = np.zeros((3, matrices.n))
            rows[0, matrices.seat_index[local, side]] = matrices.seat_w[local, side]
            rows[1, -2:] = 1.0, place
            rows[2, matrices.seat_index[local, side]] = matrices.seat_slope[local, side]
            if index in slabs:
                under = slabs[index] @ rows.T
            e = np.array([u, Du])
            a, b = rail.arm_fastening, rail.half_base
            down = e[:, 0] - under[:, 0]
            across = e[:, 1] - a * e[:, 2] - under[:, 1]
            turn = e[:, 2] - under[:, 2]
            vertical = np.array([fastening.vertical_stiffness, fastening.vertical_damping])
            lateral = np.array([fastening.lateral_stiffness, fastening.lateral_damping])
            F_V, F_L = factor(number, side) * (vertical @ down), factor(number, side) * (lateral @ across)
            M_b = factor(number, side) * b**2 * (vertical @ turn)
            on_rails[side, 0] -= F_V * shape
            on_rails[side, 2] -= F_L * shape
            on_rails[side, 4] -= (M_b - a * F_L) * shape
            if index in slabs:
                on_slabs[index] += F_V * rows[0] + F_L * rows[1] + M_b * rows[2]
            found.append(Seat(number, side, s, e, under, np.array([F_V, F_L, M_b])))
    return found, on_rails, on_slabs
