"""Linear forces of the rails in the moving window: elasticity and the convective inertia.

Field by field, with mu the mass density of the field, l the window and G_ij = int W_i W_j' ds:

    f = -K_el u + mu (l/2) V^2 k^2 u + mu G (2 V du/dt + dV/dt u)

that is -(C v + K u) with C = -2 V mu G, K = K_el + mu (V^2 int W W'' - dV/dt G). G is dense (it couples odd with even
modes), so its product is the host's: ``flow`` is the factor, ``drift`` the product, all fields of all trains as
right-hand sides of one matrix. Their fields are in the order w, v, theta_x (sines), theta_y, theta_z (cosines).
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array

# Columns of ``stiffness[i, :]``: elastic coefficients of mode i, then the squared wave number.
WW, W_THETA, THETA_Y, VV, V_THETA, THETA_Z, TORSION, WAVE2 = range(8)


@ti.func
def convective_flow(b: int, n: int, lateral: int, V: float, V_rate: float, motion: Array, flow_out: Array):
    """2 V du/dt + dV/dt u of every field at the predictors, shape (5, trains, 2, n)."""
    u, v = ti.static(at.U_PREDICTED, at.V_PREDICTED)
    for rail in range(2):
        y = (b * 2 + rail) * 2 * n
        x = lateral + (b * 2 + rail) * 3 * n
        for i in range(n):
            flow_out[0, b, rail, i] = 2.0 * V * motion[v, y + i] + V_rate * motion[u, y + i]
            flow_out[3, b, rail, i] = 2.0 * V * motion[v, y + n + i] + V_rate * motion[u, y + n + i]
            flow_out[1, b, rail, i] = 2.0 * V * motion[v, x + i] + V_rate * motion[u, x + i]
            flow_out[4, b, rail, i] = 2.0 * V * motion[v, x + n + i] + V_rate * motion[u, x + n + i]
            flow_out[2, b, rail, i] = 2.0 * V * motion[v, x + 2 * n + i] + V_rate * motion[u, x + 2 * n + i]


@ti.func
def rail_linear_forces(b: int, dims: Array, V: float, constants: Array, stiffness: Array, drift: Array, motion: Array):
    """Write -(C v + K u) of both rails of train ``b`` at the predictors into ``motion[LINEAR]``."""
    n = dims[at.MODES]
    u = ti.static(at.U_PREDICTED)
    half = 0.5 * constants[at.LENGTH]
    m, I_y, I_z, J = constants[at.MASS], constants[at.INERTIA_Y], constants[at.INERTIA_Z], constants[at.INERTIA_X]
    for rail in range(2):
        w = (b * 2 + rail) * 2 * n
        v = dims[at.LATERAL] + (b * 2 + rail) * 3 * n
        for i in range(n):
            speed2 = half * V * V * stiffness[i, WAVE2]
            y, ty, l, tz, tx = w + i, w + n + i, v + i, v + n + i, v + 2 * n + i
            motion[at.LINEAR, y] = m * (speed2 * motion[u, y] + drift[0, b, rail, i]) - (
                stiffness[i, WW] * motion[u, y] + stiffness[i, W_THETA] * motion[u, ty]
            )
            motion[at.LINEAR, ty] = I_y * (speed2 * motion[u, ty] + drift[3, b, rail, i]) - (
                stiffness[i, W_THETA] * motion[u, y] + stiffness[i, THETA_Y] * motion[u, ty]
            )
            motion[at.LINEAR, l] = m * (speed2 * motion[u, l] + drift[1, b, rail, i]) - (
                stiffness[i, VV] * motion[u, l] + stiffness[i, V_THETA] * motion[u, tz]
            )
            motion[at.LINEAR, tz] = I_z * (speed2 * motion[u, tz] + drift[4, b, rail, i]) - (
                stiffness[i, V_THETA] * motion[u, l] + stiffness[i, THETA_Z] * motion[u, tz]
            )
            motion[at.LINEAR, tx] = (
                J * (speed2 * motion[u, tx] + drift[2, b, rail, i]) - stiffness[i, TORSION] * motion[u, tx]
            )
