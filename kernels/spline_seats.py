"""Seats under rails in splines: where they stand, what the rails pull, what the fastenings answer.

A seat acts on the rail over a length, as the mean over a few Gauss points; the points outside the window take no part,
so that a seat comes and goes by its parts. Its mean shape over the functions it touches, and the shape's slope times -V
for the damper's material rate, are made once a step for all trains. Signs as MODEL section 3.

The slab's own share of a fastening stands in the slab's implicit block. The force on the slab is therefore taken with
the slab at its predictor, that on the rail with the slab at the iterate.

A hanging seat has a play g either way before it carries. With e = k u + rest, u its stretch since the train came and
``rest`` k u at rest before, its spring holds e - min(max(e, -k g), k g), a share of e that goes up from nothing as the
gap closes; damping, lateral force and couple are the same share of a sound seat's. Of the slab's motion in e the
damper's part is not taken off: some micrometres. The slab's part of a hanging seat is explicit.
"""

import taichi as ti

from tiengine.kernels import layout
from tiengine.kernels import spline_layout as at
from tiengine.kernels.types import Array, Template

# Vectors of a seat in ``seat``: forces on the rail F_V, F_L, roll moment M_b - a F_L; on the slab F_V, F_L, M_b; what
# the slabs' motion takes off (vertical, lateral, moment) at the predictors, at the iterate; factor of the fastening;
# smallest and largest force on the rail at a step's end since the host last set them.
ON_RAIL, ON_SLAB, PULL_PREDICTED, PULL_ITERATE, FACTOR, SMALLEST, LARGEST, N_SEAT = 0, 3, 6, 9, 12, 13, 16, 19

# Vectors of a seat in ``play``: k g, 0 of a seat that does not hang, and k u at rest, 0 likewise [N].
PLAY, REST, N_PLAY = 0, 1, 2


@ti.func
def share_carried(e: Template, play: Template):
    """Share of e that a spring with play holds; e and play in N, vectors."""
    size = ti.max(e, -1.0 * e)  # the compiler knows no absolute value of vectors
    share = ti.max(size - play, 0.0) / ti.max(size, 1e-12)
    return ti.select(play > 0.0, share, 1.0)


@ti.func
def span_from(k: int, s: float, span: Array):
    """Span of the knots that holds s, at or in front of span k."""
    found = k
    while found < span.shape[0] - 1 and s > span[found, at.SPAN_FRONT]:
        found += 1
    return found


@ti.func
def first_function(k: int, span: Array):
    """First of the four functions of a span."""
    return ti.cast(span[k, at.SPAN_FIRST], ti.i32)


@ti.func
def add_point(j: int, k: int, t: float, weight: float, curvature: float, place: Array, span: Array, shape_out: Array):
    """Add the values and slopes at t in span k to a seat's shape: (value, slope) in its first two numbers.

    ``curvature`` is the mean square of the points' offsets, for a seat that lies in one span; else 0.
    """
    start = (j * at.TOUCHED + first_function(k, span) - place[j, at.TOUCH_FIRST]) * at.N_SEAT_SHAPE
    for f in ti.static(range(4)):
        c = at.SPAN_POLYNOMIALS + 4 * f
        c0, c1, c2, c3 = span[k, c], span[k, c + 1], span[k, c + 2], span[k, c + 3]
        value = ((c3 * t + c2) * t + c1 + 3.0 * c3 * curvature) * t + c0 + c2 * curvature
        slope = (3.0 * c3 * t + 2.0 * c2) * t + c1 + 3.0 * c3 * curvature
        m = start + f * at.N_SEAT_SHAPE
        shape_out[m] = shape_out[m] + weight * value
        shape_out[m + 1] = shape_out[m + 1] + weight * slope


@ti.func
def seat_shapes(
    s0: float, first_seat: int, first_slab: int, slots: int, V: float, size: Array, dims: Array, constants: Array,
    point: Array, span: Array, place_out: Array, shape_out: Array,
):  # fmt: skip
    """Functions that each seat touches, its numbers for them, and its place on the slabs.

    Args:
        s0: Rear seat in the window [m]; seats may stand outside it.
        first_seat: Index of the rear seat along the track.
        first_slab: Index of the rear slab.
        slots: Slabs in memory.
        V: Speed [m/s].
        size: Sizes, see ``spline_layout``.
        dims: Sizes, see ``layout``.
        constants: Numbers, see ``layout``.
        point: Offset [m] and weight of the Gauss points, ascending, shape (points, 2).
        span: Ends, polynomials and first function of the spans, shape (spans, N_SPAN).
        place_out: Functions touched and place on the slabs, shape (seats, N_SEAT_PLACE); filled.
        shape_out: Numbers of each seat and function, shape (seats TOUCHED N_SEAT_SHAPE,); filled.
    """
    length = constants[layout.LENGTH]
    kv, cv = constants[layout.K_VERTICAL], constants[layout.C_VERTICAL]
    kl, cl = constants[layout.K_LATERAL], constants[layout.C_LATERAL]
    per_slab, points = dims[layout.SEATS_PER_SLAB], point.shape[0]
    spread, reached = 0.0, 0
    for g in range(points):
        spread += point[g, 1] * point[g, 0] * point[g, 0]
    for j in range(size[at.SEATS]):
        s = s0 + j * constants[layout.SPACING]
        rear, front = ti.max(s + point[0, 0], 0.0), ti.min(s + point[points - 1, 0], length)
        count = 0
        if rear <= front:
            reached = span_from(reached, rear, span)  # seats ascend
            k, last = reached, span_from(reached, front, span)
            place_out[j, at.TOUCH_FIRST] = first_function(k, span)
            count = first_function(last, span) + 4 - first_function(k, span)
            for m in range(count * at.N_SEAT_SHAPE):
                shape_out[j * at.TOUCHED * at.N_SEAT_SHAPE + m] = 0.0
            if k == last and s + point[0, 0] >= 0.0 and s + point[points - 1, 0] <= length:
                add_point(j, k, s - span[k, at.SPAN_REAR], 1.0, spread, place_out, span, shape_out)
            else:
                for g in range(points):
                    x = s + point[g, 0]
                    if x >= 0.0 and x <= length:
                        while k < last and x > span[k, at.SPAN_FRONT]:
                            k += 1
                        add_point(j, k, x - span[k, at.SPAN_REAR], point[g, 1], 0.0, place_out, span, shape_out)
            for q in range(count):
                m = (j * at.TOUCHED + q) * at.N_SEAT_SHAPE
                N, D = shape_out[m], -V * shape_out[m + 1]
                shape_out[m + at.PULL_U], shape_out[m + at.PULL_V] = kv * N + cv * D, cv * N
                shape_out[m + at.SIDE_U], shape_out[m + at.SIDE_V] = kl * N + cl * D, cl * N
        place_out[j, at.TOUCH_COUNT] = count
        slab = (first_seat + j) // per_slab
        slot = slab % slots
        place_out[j, at.SEAT_GROUP], place_out[j, at.SEAT_SLOT] = slot // 8, slot % 8
        place_out[j, at.SEAT_ROW] = (first_seat + j) % per_slab
        place_out[j, at.MODELLED] = ti.cast(count > 0 and slab >= first_slab and slab < first_slab + slots, ti.i32)


@ti.func
def seat_forces(
    c: int, first: int, row_u: int, row_v: int, s0: float, last_pass: int, size: Array, constants: Array, place: Array,
    shape: Array, rail: Array, seat: Array, play: Array, hanging: Template, lanes: Template,
):  # fmt: skip
    """Force of every fastening at the rails' rows ``row_u`` and ``row_v``; loads on the rails.

    Args:
        c: Chunk.
        first: Place of its first function in ``rail``.
        row_u: Row of the displacements.
        row_v: Row of the velocities.
        s0: Rear seat in the window [m].
        last_pass: 1 in the last pass, whose forces are kept as extremes.
        size: Sizes, see ``spline_layout``.
        constants: Numbers, see ``layout``.
        place: From :func:`seat_shapes`.
        shape: From :func:`seat_shapes`.
        rail: State of the rails; SEAT_LOAD is added to.
        seat: Vectors of the seats, see this module, shape (chunks seats N_SEAT,).
        play: Vectors of hanging seats, see this module, shape (chunks seats N_PLAY,); read if ``hanging``.
        hanging: 1 if some seats hang.
        lanes: Lanes of a vector.
    """
    zero = ti.Vector.zero(ti.f64, lanes)
    arm, base2 = constants[layout.ARM_FASTENING], constants[layout.HALF_BASE] * constants[layout.HALF_BASE]
    zone, length = constants[layout.ABSORBING_ZONE], constants[layout.LENGTH]
    u, v = 5 * row_u, 5 * row_v
    for j in range(size[at.SEATS]):
        vertical, lateral, moment, spring = zero, zero, zero, zero
        start = (first + place[j, at.TOUCH_FIRST]) * at.RAIL_ROWS
        count = place[j, at.TOUCH_COUNT]
        for q in range(count):
            k = start + q * at.RAIL_ROWS
            m = (j * at.TOUCHED + q) * at.N_SEAT_SHAPE
            x, dx = rail[k + u + at.THETA_X], rail[k + v + at.THETA_X]
            vertical = vertical + shape[m + at.PULL_U] * rail[k + u] + shape[m + at.PULL_V] * rail[k + v]
            if ti.static(hanging == 1):
                spring = spring + constants[layout.K_VERTICAL] * shape[m] * rail[k + u]
            moment = moment + shape[m + at.PULL_U] * x + shape[m + at.PULL_V] * dx
            foot, dfoot = rail[k + u + at.V_LATERAL] - arm * x, rail[k + v + at.V_LATERAL] - arm * dx
            lateral = lateral + shape[m + at.SIDE_U] * foot + shape[m + at.SIDE_V] * dfoot
        moment = base2 * moment
        s = s0 + j * constants[layout.SPACING]
        inside = ti.max(0.0, ti.min(s, length - s))  # a seat's middle may stand outside
        depth = ti.max(0.0, zone - inside) / ti.max(zone, 1e-9)  # no zone: no depth
        ground = depth * depth  # to the ground: swallows waves before the window's end sends them back
        p = (c * size[at.SEATS] + j) * N_SEAT
        factor = seat[p + FACTOR]
        seat[p + ON_SLAB] = factor * (vertical - seat[p + PULL_PREDICTED])
        seat[p + ON_SLAB + 1] = factor * (lateral - seat[p + PULL_PREDICTED + 1])
        seat[p + ON_SLAB + 2] = factor * (moment - seat[p + PULL_PREDICTED + 2])
        F_V = factor * (vertical - seat[p + PULL_ITERATE])
        F_L = factor * (lateral - seat[p + PULL_ITERATE + 1])
        M = factor * (moment - seat[p + PULL_ITERATE + 2])
        if ti.static(hanging == 1):
            m = (c * size[at.SEATS] + j) * N_PLAY
            g, rest = play[m + PLAY], play[m + REST]
            share = share_carried(spring - seat[p + PULL_ITERATE] + rest, g)
            held = factor * share_carried(rest, g) * rest
            F_V, F_L, M = share * (F_V + factor * rest) - held, share * F_L, share * M
            seat[p + ON_SLAB] = ti.select(g > 0.0, F_V, seat[p + ON_SLAB])
            seat[p + ON_SLAB + 1] = ti.select(g > 0.0, F_L, seat[p + ON_SLAB + 1])
            seat[p + ON_SLAB + 2] = ti.select(g > 0.0, M, seat[p + ON_SLAB + 2])
        F_V, F_L = F_V + ground * vertical, F_L + ground * lateral
        M = M + ground * moment - arm * F_L
        seat[p + ON_RAIL], seat[p + ON_RAIL + 1], seat[p + ON_RAIL + 2] = F_V, F_L, M
        if last_pass == 1:
            for m in ti.static(range(3)):
                seat[p + SMALLEST + m] = ti.min(seat[p + SMALLEST + m], seat[p + ON_RAIL + m])
                seat[p + LARGEST + m] = ti.max(seat[p + LARGEST + m], seat[p + ON_RAIL + m])
        for q in range(count):
            k = start + q * at.RAIL_ROWS
            N = shape[(j * at.TOUCHED + q) * at.N_SEAT_SHAPE]
            rail[k + at.LOAD_W] = rail[k + at.LOAD_W] - N * F_V
            rail[k + at.LOAD_V] = rail[k + at.LOAD_V] - N * F_L
            rail[k + at.LOAD_X] = rail[k + at.LOAD_X] - N * M


@ti.func
def pulls_of_slabs(
    c: int, trains: Template, initial: int, size: Array, dims: Array, base2: float, place: Array, slab_seat: Array,
    seat: Array, lanes: Template,
):  # fmt: skip
    """Put what the slabs' motion takes off the seats into the rails' lanes; zero where the ground is rigid.

    Args:
        c: Chunk.
        trains: Trains of a chunk.
        initial: 1 in the first pass: the slabs are at the predictors.
        size: Sizes, see ``spline_layout``.
        dims: Sizes, see ``layout``.
        base2: b^2 [m^2].
        place: From :func:`seat_shapes`.
        slab_seat: Five rows a seat of each group of slabs, see ``banded_slab``.
        seat: Vectors of the seats.
        lanes: Lanes of a vector.
    """
    per_slab, seats, groups = dims[layout.SEATS_PER_SLAB], size[at.SEATS], size[at.GROUPS]
    for j in range(seats):
        p = (c * seats + j) * N_SEAT
        if place[j, at.MODELLED] == 1:
            slot, row = place[j, at.SEAT_SLOT], place[j, at.SEAT_ROW]
            for t in range(trains):
                g = ((c * trains + t) * groups + place[j, at.SEAT_GROUP]) * at.SLAB_SEAT_ROWS * per_slab + row
                y = slab_seat[g + 4 * per_slab][slot]
                for r in ti.static(range(2)):
                    seat[p + PULL_ITERATE][2 * t + r] = slab_seat[g + r * per_slab][slot]
                    seat[p + PULL_ITERATE + 1][2 * t + r] = y
                    seat[p + PULL_ITERATE + 2][2 * t + r] = base2 * slab_seat[g + (2 + r) * per_slab][slot]
        else:
            for m in ti.static(range(3)):
                seat[p + PULL_ITERATE + m] = ti.Vector.zero(ti.f64, lanes)
        if initial == 1:
            for m in ti.static(range(3)):
                seat[p + PULL_PREDICTED + m] = seat[p + PULL_ITERATE + m]


@ti.func
def loads_on_slabs(c: int, trains: Template, size: Array, dims: Array, place: Array, seat: Array, slab_seat: Array):
    """Put the seats' forces into the slabs' slots; arguments as in :func:`pulls_of_slabs`."""
    per_slab, seats, groups = dims[layout.SEATS_PER_SLAB], size[at.SEATS], size[at.GROUPS]
    rows = at.SLAB_SEAT_ROWS * per_slab
    start = c * trains * groups * rows
    for k in range(start, start + trains * groups * rows):
        slab_seat[k] = ti.Vector.zero(ti.f64, 8)
    for j in range(seats):
        if place[j, at.MODELLED] == 1:
            p = (c * seats + j) * N_SEAT + ON_SLAB
            slot, row = place[j, at.SEAT_SLOT], place[j, at.SEAT_ROW]
            for t in range(trains):
                g = ((c * trains + t) * groups + place[j, at.SEAT_GROUP]) * rows + row
                for r in ti.static(range(2)):
                    slab_seat[g + r * per_slab][slot] = seat[p][2 * t + r]
                    slab_seat[g + (2 + r) * per_slab][slot] = seat[p + 2][2 * t + r]
                slab_seat[g + 4 * per_slab][slot] = seat[p + 1][2 * t] + seat[p + 1][2 * t + 1]
