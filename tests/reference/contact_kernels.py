"""Kernels that call the contact law alone, many wheels at a time (for finite differences)."""

import taichi as ti

from tiengine.kernels import wheel_rail as wr
from tiengine.kernels.types import Real, Reals2, Reals3


@ti.kernel
def laws(friction: Real, states: Reals2, force: Reals2, derivative: Reals3):
    """Force (N, Fx, Fy, Mz) and its derivatives by (delta, xi_x, xi_y, xi_s) of every row of ``states``."""
    ti.loop_config(serialize=True)
    for i in range(states.shape[0]):
        state = ti.Vector.zero(ti.f64, wr.N_CONTACT)
        for m in ti.static(range(wr.N_CONTACT)):
            state[m] = states[i, m]
        f, D = wr.contact_law(state, friction)
        for m in ti.static(range(4)):
            force[i, m] = f[m]
            for n in ti.static(range(4)):
                derivative[i, m, n] = D[m, n]
