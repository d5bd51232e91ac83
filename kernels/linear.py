"""Linear forces -(C v + K u) of slabs and vehicles at the predictors."""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array, Ints1, Ints2, Reals2, Reals4


@ti.func
def slab_linear_forces(b: int, dims: Array, design: Array, band: Array, motion: Array):
    """Write -(C v + K u) of every slab of train ``b`` into ``motion[LINEAR]``; banded matrices, one pair a design."""
    n, half = dims[at.SLAB_DOFS], dims[at.HALF_BAND]
    for slot in range(dims[at.SLOTS]):
        base = dims[at.SLABS] + (b * dims[at.SLOTS] + slot) * n
        kind = design[b, slot]
        for i in range(n):
            total = 0.0
            for j in range(ti.max(0, i - half), ti.min(n, i + half + 1)):
                m = j - i + half
                total += band[kind, 0, i, m] * motion[at.U_PREDICTED, base + j]
                total += band[kind, 1, i, m] * motion[at.V_PREDICTED, base + j]
            motion[at.LINEAR, base + i] = -total


@ti.func
def vehicle_linear_forces(b: int, V: float, dims: Array, K: Array, C: Array, C_speed: Array, motion: Array):
    """Write -((C + V C_speed) v + K u) of the vehicles of train ``b`` into ``motion[LINEAR]``."""
    n = dims[at.VEHICLE_DOFS]
    base = dims[at.VEHICLES] + b * n
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += K[i, j] * motion[at.U_PREDICTED, base + j]
            total += (C[i, j] + V * C_speed[i, j]) * motion[at.V_PREDICTED, base + j]
        motion[at.LINEAR, base + i] = -total


@ti.kernel
def linear_forces(
    V: float, dims: Ints1, design: Ints2, band: Reals4, K: Reals2, C: Reals2, C_speed: Reals2, motion: Reals2
):
    """Write the linear forces of all slabs and vehicles into ``motion[LINEAR]`` (serial; the step fuses this stage).

    Args:
        V: Speed [m/s].
        dims: Sizes and offsets, see ``layout``.
        design: Design of the slab in each slot, shape (trains, slots).
        band: K and C of each design by diagonals, shape (designs, 2, n, 2 half_band + 1).
        K: Vehicle stiffness, shape (n, n).
        C: Vehicle damping, shape (n, n).
        C_speed: Gyroscopic matrix per unit speed, shape (n, n).
        motion: Rows of motion; ``LINEAR`` is written for slabs and vehicles.
    """
    ti.loop_config(serialize=True)
    for b in range(dims[at.TRAINS]):
        slab_linear_forces(b, dims, design, band, motion)
        vehicle_linear_forces(b, V, dims, K, C, C_speed, motion)
