"""Sines left out of the rails, following their forces at once: their part at seats and wheels.

With h(x) the compliance of the omitted sines at a distance x (``track.omitted_modes``), the rail at seat j moves beyond
its sines by

    r_j = sum over wheels of h(s_j - s_w) F_w - sum over seats of h(s_j - s_i) f_i

in each of w, v, theta_x, F and f being the forces of wheels and seats in that field. The seat's spring feels r_j, its
damper the rate of r_j at the seat, a fixed point of the track: by the backward formula of second order,

    dr/dt = (3 r - 4 r_n + r_(n-1)) / (2 dt).

The wheels' forces and those of other seats are taken at the iterate. A seat's own force is solved for, since its damper
against its own omitted sines has a time constant of c h(0), shorter than a step. The wheel's own part is in the
contact's compliance (``contact``); here it gets that of the seats' forces and of the other wheels'. Their slopes and
rates are left out: of the material rate of what a seat adds only h df/dt remains, its motion's parts cancel.

The rail's pull at the seats is changed in place, so that the forces that ``fastening`` takes from it are these.
"""

import taichi as ti

from tiengine.kernels import layout as at
from tiengine.kernels.types import Array, Ints1, Reals1, Reals2, Reals3, Reals4, Reals5, Template

NOW, BEFORE, EARLIER = 0, 1, 2
"""Last entries of ``omitted``: r at the iterate, at t_n, at t_(n-1)."""
SPACING = 2e-3
"""Distance of the points of ``by_wheel`` [m]."""


@ti.func
def between(x: float, table: Array):
    """Compliance in w, v, theta_x between a seat and a wheel at a distance x, from a table over it."""
    h = ti.Vector.zero(ti.f64, 3)
    place = ti.abs(x) / SPACING
    k = ti.cast(place, ti.i32)
    if k < table.shape[1] - 1:
        for m in ti.static(range(3)):
            h[m] = table[m, k] + (place - k) * (table[m, k + 1] - table[m, k])
    return h


@ti.func
def under_wheels(b: int, first: int, dims: Array, by_place: Array, rail_force: Array, base_out: Array, rail_out: Array):
    """Rails under the wheels but for the seats' part: sines (kept in ``base`` in the first pass), other wheels."""
    for w in range(dims[at.WHEELSETS]):
        for rail in range(2):
            for m in ti.static(range(3)):
                if first == 1:
                    base_out[b, w, rail, m] = rail_out[b, w, rail, m]
                total = base_out[b, w, rail, m]
                for k in range(dims[at.WHEELSETS]):
                    total += by_place[m, w, k] * rail_force[b, k, rail, m]
                rail_out[b, w, rail, m] = total


@ti.func
def free_motion(
    b: int, rail: int, j: int, s: float, dims: Array, by_wheel: Array, by_seat: Array, wheel_s: Array,
    rail_force: Array, seat_force: Array,
):  # fmt: skip
    """Motion of the omitted sines at seat j but for its own force: w, v, theta_x."""
    r = ti.Vector.zero(ti.f64, 3)
    for w in range(dims[at.WHEELSETS]):
        h = between(s - wheel_s[w], by_wheel)
        for m in ti.static(range(3)):
            r[m] += h[m] * rail_force[b, w, rail, m]
    reach = by_seat.shape[1] - 1
    for i in range(ti.max(0, j - reach), ti.min(dims[at.SEATS], j + reach + 1)):
        if i != j:
            for m in ti.static(range(3)):
                r[m] -= by_seat[m, ti.abs(i - j)] * seat_force[b, rail, m, i]
    return r


@ti.func
def own_forces(
    free: Template, history: Template, pull: Template, slab: Template, own: Template, factor: float, ground: float,
    rate: float, constants: Array,
):  # fmt: skip
    """Forces of a seat on the rail in w, v, theta_x, solved with the motion that they themselves cause.

    Args:
        free: Motion of the omitted sines without the seat's own force.
        history: Part of their rates that is known.
        pull: Forces by the rail's sines: vertical, lateral, moment.
        slab: Forces by the slab's motion, the same.
        own: h(0).
        factor: Of the fastening.
        ground: Factor of the absorbing zone's spring to the ground.
        rate: 3 / (2 dt).
        constants: Numbers, see ``layout``.
    """
    kv, cv = constants[at.K_VERTICAL], constants[at.C_VERTICAL]
    kl, cl = constants[at.K_LATERAL], constants[at.C_LATERAL]
    a, base2 = constants[at.ARM_FASTENING], constants[at.HALF_BASE] * constants[at.HALF_BASE]
    g, stiff, stiff_l = factor + ground, kv + cv * rate, kl + cl * rate
    foot, dfoot = free[1] - a * free[2], history[1] - a * history[2]
    vertical = g * (pull[0] + stiff * free[0] + cv * history[0]) - factor * slab[0]
    across = g * (pull[1] + stiff_l * foot + cl * dfoot) - factor * slab[1]
    moment = g * (pull[2] + base2 * (stiff * free[2] + cv * history[2])) - factor * slab[2]
    # F_L and M_b, of which v feels F_L and theta_x feels M_b - a F_L
    l_l, l_m = 1.0 + g * stiff_l * (own[1] + a * a * own[2]), -g * stiff_l * a * own[2]
    m_l, m_m = -g * base2 * stiff * a * own[2], 1.0 + g * base2 * stiff * own[2]
    determinant = l_l * m_m - l_m * m_l
    lateral = (m_m * across - l_m * moment) / determinant
    rolling = (l_l * moment - m_l * across) / determinant
    return ti.Vector([vertical / (1.0 + g * stiff * own[0]), lateral, rolling - a * lateral])


@ti.func
def add_at_seat(
    b: int, rail: int, j: int, s: float, factor: float, ground: float, answer: Template, dims: Array,
    constants: Array, by_wheel: Array, by_seat: Array, wheel_s: Array, rail_force: Array, seat_force: Array,
    omitted: Array, rail_pull_out: Array, rail_predicted_out: Array,
):  # fmt: skip
    """Pull of a rail at a seat in the window with its omitted sines; what the seat's force does under the wheels."""
    rate = 1.5 / constants[at.DT]
    pull, history = ti.Vector.zero(ti.f64, 3), ti.Vector.zero(ti.f64, 3)
    own = ti.Vector.zero(ti.f64, 3)
    for m in ti.static(range(3)):
        earlier, before = omitted[b, rail, m, j, EARLIER], omitted[b, rail, m, j, BEFORE]
        history[m] = rate / 3.0 * (earlier - 4.0 * before)
        pull[m] = rail_pull_out[b, rail, m, j]
        own[m] = by_seat[m, 0]
    free = free_motion(b, rail, j, s, dims, by_wheel, by_seat, wheel_s, rail_force, seat_force)
    force = own_forces(free, history, pull, answer, own, factor, ground, rate, constants)
    r = free - own * force
    dr = rate * r + history
    a, base2 = constants[at.ARM_FASTENING], constants[at.HALF_BASE] * constants[at.HALF_BASE]
    kv, cv = constants[at.K_VERTICAL], constants[at.C_VERTICAL]
    kl, cl = constants[at.K_LATERAL], constants[at.C_LATERAL]
    rail_pull_out[b, rail, 0, j] = pull[0] + kv * r[0] + cv * dr[0]
    rail_pull_out[b, rail, 1, j] = pull[1] + kl * (r[1] - a * r[2]) + cl * (dr[1] - a * dr[2])
    rail_pull_out[b, rail, 2, j] = pull[2] + base2 * (kv * r[2] + cv * dr[2])
    for m in ti.static(range(3)):
        omitted[b, rail, m, j, NOW] = r[m]
    for w in range(dims[at.WHEELSETS]):
        h = between(s - wheel_s[w], by_wheel)
        for m in ti.static(range(3)):
            rail_predicted_out[b, w, rail, m] = rail_predicted_out[b, w, rail, m] - h[m] * force[m]


@ti.kernel
def add_omitted_modes(
    parallel: Template,
    tick: Ints1,
    dims: Ints1,
    constants: Reals1,
    clock: Reals2,
    by_wheel: Reals2,
    by_seat: Reals2,
    by_place: Reals3,
    wheel_s: Reals1,
    scale: Reals3,
    slab_pull: Reals5,
    seat_force: Reals4,
    rail_force: Reals4,
    omitted: Reals5,
    base_out: Reals4,
    rail_pull_out: Reals4,
    rail_predicted_out: Reals4,
):
    """Add what the omitted sines contribute to the pull of the rails at the seats and to the rails under the wheels.

    Args:
        parallel: See ``step``.
        tick: Step and pass.
        dims: Sizes, see ``layout``.
        constants: Numbers, see ``layout``.
        clock: Places of the seats, see ``layout``.
        by_wheel: h between a seat and a wheel over their distance, shape (3, points).
        by_seat: h between seats over their distance in pitches, 0 for their own, shape (3, pitches).
        by_place: h between wheels, zero for their own, shape (3, wheelsets, wheelsets).
        wheel_s: Wheels in the window [m].
        scale: Factors of the fastenings, shape (trains, seats, 2).
        slab_pull: Forces by the slabs' motion, see ``fastening``.
        seat_force: Forces of the seats in w, v, theta_x at the iterate, shape (trains, 2, 3, seats).
        rail_force: Forces of the wheels in w, v, theta_x at the iterate, shape (trains, wheelsets, 2, 3).
        omitted: r of the seats, shape (trains, 2, 3, seats, 3).
        base_out: Rails under the wheels by their sines at the predictors, shape (trains, wheelsets, 2, 3).
        rail_pull_out: Forces at the seats by the rails, shape (trains, 2, 3, seats).
        rail_predicted_out: Rails under the wheels, see ``under_wheels``.
    """
    ti.loop_config(serialize=not parallel)
    for z in range(dims[at.TRAINS] * ti.static(512 if parallel else 1)):
        if z % ti.static(512 if parallel else 1) == 0:
            b = z // ti.static(512 if parallel else 1)
            row, first, iterate = tick[at.STEP], ti.cast(tick[at.PASS] == 0, ti.i32), ti.min(tick[at.PASS], 1)
            first_slab = ti.cast(clock[row, at.FIRST_SLAB], ti.i32)
            zone, length = constants[at.ABSORBING_ZONE], constants[at.LENGTH]
            base2 = constants[at.HALF_BASE] * constants[at.HALF_BASE]
            under_wheels(b, first, dims, by_place, rail_force, base_out, rail_predicted_out)
            for j in range(dims[at.SEATS]):
                s = clock[row, at.FIRST_SEAT_S] + j * constants[at.SPACING]
                number = ti.cast(clock[row, at.FIRST_SEAT], ti.i32) + j
                slab, seat = number // dims[at.SEATS_PER_SLAB], number % dims[at.SEATS_PER_SLAB]
                slot = slab % dims[at.SLOTS]
                depth = ti.max(0.0, zone - ti.min(s, length - s)) / ti.max(zone, 1e-9)
                for rail in range(2):
                    if first == 1:
                        for m in ti.static(range(3)):
                            omitted[b, rail, m, j, EARLIER] = omitted[b, rail, m, j, BEFORE]
                            omitted[b, rail, m, j, BEFORE] = omitted[b, rail, m, j, NOW]
                    answer = ti.Vector.zero(ti.f64, 3)  # none of rigid ground
                    if slab < first_slab + dims[at.SLOTS]:
                        answer[0] = slab_pull[iterate, b, slot, rail, seat]
                        answer[1] = slab_pull[iterate, b, slot, 4, seat]
                        answer[2] = base2 * slab_pull[iterate, b, slot, 2 + rail, seat]
                    if s < length:
                        add_at_seat(
                            b, rail, j, s, scale[b, j, rail], depth * depth, answer, dims, constants, by_wheel,
                            by_seat, wheel_s, rail_force, seat_force, omitted, rail_pull_out, rail_predicted_out,
                        )  # fmt: skip
