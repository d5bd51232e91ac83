"""Linear forces of the rails in the moving window: elasticity and the convective inertia.

Field by field, with mu the mass density of the field, l the window and G_ij = int W_i W_j' ds:

    f = -K_el u + mu (l/2) V^2 k^2 u + mu G (2 V du/dt + dV/dt u)

that is -(C v + K u) with C = -2 V mu G, K = K_el + mu (V^2 int W W'' - dV/dt G). G couples odd with even modes only.
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array, Ints1, Reals1, Reals2, Reals3, Template

# Columns of ``stiffness[i, :]``: elastic coefficients of mode i, then the squared wave number.
WW, W_THETA, THETA_Y, VV, V_THETA, THETA_Z, TORSION, WAVE2 = range(8)


@ti.func
def prepare_flow(start: int, count: int, V: float, V_rate: float, motion: Array):
    """Leave 2 V du/dt + dV/dt u in row X, which is free before the implicit solve."""
    for i in range(start, start + count):
        motion[at.X, i] = 2.0 * V * motion[at.V_PREDICTED, i] + V_rate * motion[at.U_PREDICTED, i]


@ti.func
def field_force(
    base: int, n: int, i: int, V: float, half_mass: float, per_length: float, k2: float, G: Array, kind: Template,
    motion: Array,
):  # fmt: skip
    """Convective force of one field: half_mass = mu l/2; kind 0 sine, 1 cosine."""
    flow = 0.0
    for j in range(n):
        flow += G[kind, i, j] * motion[at.X, base + j]
    return half_mass * (V * V * k2 * motion[at.U_PREDICTED, base + i] + per_length * flow)


@ti.func
def rail_linear_forces(
    b: int,
    n: int,
    lateral: int,
    V: float,
    V_rate: float,
    length: float,
    stiffness: Array,
    mass: Array,
    G: Array,
    motion: Array,
):
    """Write -(C v + K u) of both rails of train ``b`` at the predictors into ``motion[LINEAR]``."""
    per_length = 2.0 / length
    u = ti.static(at.U_PREDICTED)
    for rail in range(2):
        w = (b * 2 + rail) * 2 * n
        v = lateral + (b * 2 + rail) * 3 * n
        prepare_flow(w, 2 * n, V, V_rate, motion)
        prepare_flow(v, 3 * n, V, V_rate, motion)
        for i in range(n):
            k2 = stiffness[i, WAVE2]
            y, ty, l, tz, tx = w + i, w + n + i, v + i, v + n + i, v + 2 * n + i
            motion[at.LINEAR, y] = field_force(w, n, i, V, mass[0], per_length, k2, G, 0, motion) - (
                stiffness[i, WW] * motion[u, y] + stiffness[i, W_THETA] * motion[u, ty]
            )
            motion[at.LINEAR, ty] = field_force(w + n, n, i, V, mass[1], per_length, k2, G, 1, motion) - (
                stiffness[i, W_THETA] * motion[u, y] + stiffness[i, THETA_Y] * motion[u, ty]
            )
            motion[at.LINEAR, l] = field_force(v, n, i, V, mass[2], per_length, k2, G, 0, motion) - (
                stiffness[i, VV] * motion[u, l] + stiffness[i, V_THETA] * motion[u, tz]
            )
            motion[at.LINEAR, tz] = field_force(v + n, n, i, V, mass[3], per_length, k2, G, 1, motion) - (
                stiffness[i, V_THETA] * motion[u, l] + stiffness[i, THETA_Z] * motion[u, tz]
            )
            motion[at.LINEAR, tx] = (
                field_force(v + 2 * n, n, i, V, mass[4], per_length, k2, G, 0, motion)
                - stiffness[i, TORSION] * motion[u, tx]
            )


@ti.kernel
def rail_forces(
    V: float, V_rate: float, dims: Ints1, constants: Reals1, stiffness: Reals2, mass: Reals1, G: Reals3, motion: Reals2
):
    """Write the linear forces of all rails at the predictors into ``motion[LINEAR]`` (serial; the step fuses this).

    Args:
        V: Speed [m/s].
        V_rate: Its rate [m/s^2].
        dims: Sizes and offsets, see ``layout``.
        constants: Numbers, see ``layout``.
        stiffness: Elastic coefficients by mode, shape (modes, 8).
        mass: mu l/2 of w, theta_y, v, theta_z, theta_x, shape (5,).
        G: int W_i W_j' of sines and cosines, shape (2, modes, modes).
        motion: Rows of motion; ``LINEAR`` is written for the rails.
    """
    ti.loop_config(serialize=True)
    for b in range(dims[at.TRAINS]):
        rail_linear_forces(
            b, dims[at.MODES], dims[at.LATERAL], V, V_rate, constants[at.LENGTH], stiffness, mass, G, motion
        )
