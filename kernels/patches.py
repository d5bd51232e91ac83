"""Contact of a wheelset whose wheels have one patch each (``contact``) or two (``two_patches``).

The number is a constant of the compiled kernel, so that one patch costs what it costs without the choice.
"""

import taichi as ti

from tiengine.kernels import contact as ct
from tiengine.kernels import layout as at
from tiengine.kernels import two_patches as tp
from tiengine.kernels import under_wheels as uw
from tiengine.kernels import wheel_rail as wr
from tiengine.kernels.types import Array, Reals1, Reals2, Reals3, Reals4, Template


@ti.func
def solve_wheelset(
    b: int, wheelset: int, V: float, x_free: Template, dx_free: Template, free_l: Template, free_r: Template,
    irregularity: Template, dims: Array, constants: Array, wheel: Array, table: Array, wheelset_compliance: Array,
    rail_coupling: Array, contact: Array, force: Array, wheelset_force: Array, rail_force: Array, tolerance: float,
    patches: Template, own: Template,
):  # fmt: skip
    """Solve one wheelset with so many patches a wheel; returns the number of iterations."""
    count = 0
    if ti.static(patches == 1):
        count = ct.solve_wheelset(
            b, wheelset, V, x_free, dx_free, free_l, free_r, irregularity, dims, constants, wheel, table,
            wheelset_compliance, rail_coupling, contact, force, wheelset_force, rail_force, tolerance, own,
        )  # fmt: skip
    else:
        count = tp.solve_two(
            b, wheelset, V, x_free, dx_free, free_l, free_r, irregularity, dims, constants, wheel, table,
            wheelset_compliance, rail_coupling, contact, force, wheelset_force, rail_force, tolerance, own,
        )  # fmt: skip
    return count


@ti.func
def record_wheels(
    b: int, wheelset: int, row: int, contact: Array, force: Array, rail_force: Array, wheel_out: Array,
    patches: Template,
):  # fmt: skip
    """Record the output of both wheels of a wheelset and of their patches, see ``layout``."""
    ct.record_wheels(b, wheelset, row, contact, force, rail_force, wheel_out)
    if ti.static(patches == 2):
        for c in range(tp.PATCHES):
            side, first = c % 2, at.N_WHEEL + (c // 2) * at.N_PATCH
            wheel_out[b, row, wheelset, side, first + at.PATCH_NORMAL_FORCE] = force[b, wheelset, 2 + c, 0]
            wheel_out[b, row, wheelset, side, first + at.PATCH_POSITION_WHEEL] = contact[b, wheelset, 2 + c, wr.S_W]
            wheel_out[b, row, wheelset, side, first + at.PATCH_POSITION_RAIL] = contact[b, wheelset, 2 + c, wr.S_R]
            wheel_out[b, row, wheelset, side, first + at.PATCH_ANGLE] = ti.atan2(
                contact[b, wheelset, 2 + c, wr.SIN], contact[b, wheelset, 2 + c, wr.COS]
            )
            for m in ti.static(range(3)):
                at_creepage = first + at.PATCH_LONGITUDINAL_CREEPAGE + m
                at_force = first + at.PATCH_LONGITUDINAL_CREEP_FORCE + m
                wheel_out[b, row, wheelset, side, at_creepage] = contact[b, wheelset, 2 + c, wr.XI_X + m]
                wheel_out[b, row, wheelset, side, at_force] = force[b, wheelset, 2 + c, 1 + m]


@ti.func
def one_at_given_motion(
    b: int, wheelset: int, V: float, rolls: int, x: Template, dx: Template, left: Template, right: Template,
    irregularity: Template, constants: Array, table: Array, wheel: Array, contact_out: Array, force_out: Array,
    wheelset_force_out: Array, rail_force_out: Array, own: Template,
):  # fmt: skip
    """Contact states and forces of a wheelset with one patch a wheel at given motions of it and its rails."""
    h_r, rails = constants[at.ARM_HEAD], [left, right]
    q = ti.Vector.zero(ti.f64, 5)
    for side in ti.static(range(2)):
        size = wr.size_of(wheelset, side, wheel, own)
        state = ct.state_of(side, V, size, x, dx, rails[side], irregularity, rolls, table, constants, 0)
        f, _ = wr.contact_law(state, constants[at.FRICTION])
        B, R = wr.force_directions(ti.static(2.0 * side - 1.0), size, h_r, wr.placing(state))
        q = q + B @ f
        ct.store_state(b, wheelset, side, state, contact_out)
        ct.store_force(b, wheelset, side, f, R @ f, force_out, rail_force_out)
    for m in ti.static(range(5)):
        wheelset_force_out[b, wheelset, m] = q[m]


@ti.kernel
def wheel_forces(
    patches: Template,
    own: Template,
    V: float,
    rolls: int,
    constants: Reals1,
    table: Reals3,
    wheel: Reals2,
    irregularity: Reals3,
    wheelset_u: Reals3,
    wheelset_v: Reals3,
    rail_motion: Reals4,
    contact_out: Reals4,
    force_out: Reals4,
    wheelset_force_out: Reals3,
    rail_force_out: Reals4,
):
    """Contact forces at given motions of wheels and rails, without any time step (start, references, tests).

    Args:
        patches: Patches a wheel can have, 1 or 2.
        own: 1 if wheels have radii and contact tables of their own.
        V: Speed [m/s].
        rolls: 1 if a cross level turns the railheads.
        constants: Numbers, see ``layout``.
        table: Contact geometry, shape (tables n_u, n_alpha, N_TABLE patches).
        wheel: Numbers of each wheelset, shape (wheelsets, N_WHEEL_NUMBERS).
        irregularity: Track channels, shape (trains, wheelsets, N_IRREGULARITY).
        wheelset_u: y, z, roll, pitch, yaw, shape (trains, wheelsets, 5).
        wheelset_v: Their rates.
        rail_motion: w, v, theta_x, their slopes, their rates at constant s, shape (trains, wheelsets, 2, 9).
        contact_out: Contact states, see ``wheel_rail``, shape (trains, wheelsets, CONTACT_ROWS, N_CONTACT).
        force_out: N, Fx, Fy, Mz on the wheels, shape (trains, wheelsets, CONTACT_ROWS, 4).
        wheelset_force_out: Generalised forces on y, z, roll, pitch, yaw, shape (trains, wheelsets, 5).
        rail_force_out: Generalised forces on w, v, theta_x, shape (trains, wheelsets, 2, 3).
    """
    ti.loop_config(serialize=True)
    for b in range(wheelset_u.shape[0]):
        for w in range(wheelset_u.shape[1]):
            channels = ti.Vector.zero(ti.f64, at.N_IRREGULARITY)
            for m in ti.static(range(at.N_IRREGULARITY)):
                channels[m] = irregularity[b, w, m]
            x, dx = ti.Vector.zero(ti.f64, 5), ti.Vector.zero(ti.f64, 5)
            for m in ti.static(range(5)):
                x[m] = wheelset_u[b, w, m]
                dx[m] = wheelset_v[b, w, m]
            left, right = uw.stored_rail(b, w, 0, rail_motion), uw.stored_rail(b, w, 1, rail_motion)
            if ti.static(patches == 1):
                one_at_given_motion(
                    b, w, V, rolls, x, dx, left, right, channels, constants, table, wheel, contact_out, force_out,
                    wheelset_force_out, rail_force_out, own,
                )  # fmt: skip
            else:
                tp.two_at_given_motion(
                    b, w, V, rolls, x, dx, left, right, channels, constants, table, wheel, contact_out, force_out,
                    wheelset_force_out, rail_force_out, own,
                )  # fmt: skip
