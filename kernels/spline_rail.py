"""A rail in splines: predictors, -(C v + K u), banded substitution, correctors, for all lanes of a chunk at once.

A = L U by functions; fields of a function together, so that A's band has a half width of 7 (w, theta_y) and 11 (v,
theta_z, theta_x). The vertical and the lateral block are independent and are swept side by side. What a row couples
with stays in registers: ``near`` are the fields of the three functions before, nearest first.

Vector mode (``tiengine.engine.vector_mode``) knows neither ``t -= x`` nor ``-x`` for vectors: write t = t - x.
"""

import taichi as ti

from tiengine.kernels import layout
from tiengine.kernels import spline_layout as at
from tiengine.kernels.types import Array, Template

FIRST_FIELD = (0, 2)  # of the vertical and of the lateral block
FIELDS = (2, 3)


@ti.func
def predict_function(rail: Array, k: int, dt: float, beta_dt2: float, gamma_dt: float):
    """Newmark's predictors of the function whose vectors start at ``k``."""
    half, rest = 0.5 * dt * dt - beta_dt2, dt - gamma_dt
    for f in ti.static(range(5)):
        v, a = rail[k + 5 * at.V + f], rail[k + 5 * at.A + f]
        rail[k + 5 * at.U_PREDICTED + f] = rail[k + 5 * at.U + f] + dt * v + half * a
        rail[k + 5 * at.V_PREDICTED + f] = v + rest * a


@ti.func
def predict(rail: Array, first: int, functions: int, dt: float, beta_dt2: float, gamma_dt: float):
    """Newmark's predictors of all functions; ``first`` is the first function's place."""
    for i in range(functions):
        predict_function(rail, (first + i) * at.RAIL_ROWS, dt, beta_dt2, gamma_dt)


@ti.func
def substitute(row: Template, near: Template, fields: Template, start: Template, k: int, coefficient: Array):
    """Take off what a function's fields couple with, field by field: the farthest first, the nearest last.

    Args:
        row: Right-hand sides of the fields in the order of elimination, list of vectors; changed.
        near: Results of the three functions eliminated before, nearest first, list of 3 ``fields`` vectors; changed.
        fields: Number of fields.
        start: Where each field's coefficients start.
        k: Where the function's coefficients start.
        coefficient: See ``spline_layout``.
    """
    for f in ti.static(range(fields)):
        c = k + start[f]
        total = coefficient[c + f + 3 * fields - 1] * near[3 * fields - 1]
        for q in ti.static(range(1, 3 * fields)):
            total = total + coefficient[c + f + 3 * fields - 1 - q] * near[3 * fields - 1 - q]
        for q in ti.static(range(f)):
            total = total + coefficient[c + f - 1 - q] * row[q]
        row[f] = row[f] - total
    for q in ti.static(range(2 * fields)):
        near[3 * fields - 1 - q] = near[2 * fields - 1 - q]
    for f in ti.static(range(fields)):
        near[fields - 1 - f] = row[f]


@ti.func
def forward(rail: Array, first: int, functions: int, coefficient: Array, initial: Template, lanes: Template):
    """Right-hand side and forward substitution, function by function, into row FORWARD_RESULT.

    Args:
        rail: State and forces of all chunks, see ``spline_layout``.
        first: Place of the chunk's first function.
        functions: n.
        coefficient: See ``spline_layout``, shape (n N_COEFFICIENT,).
        initial: 1 in the first pass, which makes -(C v~ + K u~); 0 later, when A_s a takes its place beside it.
        lanes: Lanes of a vector.
    """
    zero = ti.Vector.zero(ti.f64, lanes)
    near_vertical = [zero, zero, zero, zero, zero, zero]
    near_lateral = [zero, zero, zero, zero, zero, zero, zero, zero, zero]
    for i in range(functions):
        k = (first + i) * at.RAIL_ROWS
        c = i * at.N_COEFFICIENT
        a = [zero, zero, zero, zero, zero]
        if ti.static(initial == 1):
            for q in range(at.NEIGHBOURS):
                j = k + (q - at.REACH) * at.RAIL_ROWS
                m = c + at.LINEAR_START + q * at.N_LINEAR
                for p in ti.static(range(at.N_STIFFNESS)):
                    f, g = ti.static(at.STIFFNESS_PAIRS[p])
                    a[f] = a[f] - coefficient[m + p] * rail[j + 5 * at.U_PREDICTED + g]
                for p in ti.static(range(at.N_DAMPING)):
                    f, g = ti.static(at.DAMPING_PAIRS[p])
                    d = coefficient[m + at.N_STIFFNESS + p]
                    a[f] = a[f] - d * rail[j + 5 * at.V_PREDICTED + g]
            for f in ti.static(range(5)):
                rail[k + 5 * at.LINEAR + f] = a[f]
        else:
            for f in ti.static(range(5)):
                a[f] = rail[k + 5 * at.LINEAR + f]
            for q in ti.static(range(at.NEIGHBOURS)):
                j = k + (q - at.REACH) * at.RAIL_ROWS + 5 * at.A
                m = c + at.STAND_IN_START + q * at.N_STAND_IN
                for p in ti.static(range(at.N_STAND_IN)):
                    f, g = ti.static(at.STAND_IN_PAIRS[p])
                    a[f] = a[f] + coefficient[m + p] * rail[j + g]
        vertical = [a[0] + rail[k + at.LOAD_W], a[1]]
        lateral = [a[2] + rail[k + at.LOAD_V], a[3], a[4] + rail[k + at.LOAD_X]]
        for f in ti.static(range(at.LOAD_W, at.LOAD_X + 1)):
            rail[k + f] = zero
        substitute(vertical, near_vertical, 2, at.FORWARD_START[:2], c, coefficient)
        substitute(lateral, near_lateral, 3, at.FORWARD_START[2:], c, coefficient)
        for f in ti.static(range(2)):
            rail[k + 5 * at.FORWARD_RESULT + f] = vertical[f]
        for f in ti.static(range(3)):
            rail[k + 5 * at.FORWARD_RESULT + 2 + f] = lateral[f]


@ti.func
def add_ground_loads(rail: Array, first: int, functions: int, step: int, clock: Array, lanes: Template):
    """Add the inertia forces of a track on moving ground, which the host has summed up, to SEAT_LOAD.

    They stand in ``clock`` behind its own columns: on w of all functions, then on v.
    """
    for i in range(functions):
        k = (first + i) * at.RAIL_ROWS
        every = ti.Vector.one(ti.f64, lanes)
        rail[k + at.LOAD_W] = rail[k + at.LOAD_W] + clock[step, layout.N_CLOCK + i] * every
        rail[k + at.LOAD_V] = rail[k + at.LOAD_V] + clock[step, layout.N_CLOCK + functions + i] * every


@ti.func
def backward(
    rail: Array, first: int, functions: int, coefficient: Array, dt: float, beta_dt2: float, gamma_dt: float,
    ahead: int, lanes: Template,
):  # fmt: skip
    """Backward substitution of row FORWARD_RESULT to the acceleration, and Newmark's correctors.

    ``ahead`` is 1 if the next step's predictors are to be made too, which saves it a way through memory. They are made
    of the function before, from memory: from the numbers at hand the compiler would make other last bits.
    """
    zero = ti.Vector.zero(ti.f64, lanes)
    near_vertical = [zero, zero, zero, zero, zero, zero]
    near_lateral = [zero, zero, zero, zero, zero, zero, zero, zero, zero]
    for m in range(functions):
        i = functions - 1 - m
        k = (first + i) * at.RAIL_ROWS
        c = i * at.N_COEFFICIENT + at.BACKWARD_AT
        d = i * at.N_COEFFICIENT + at.INVERSE_DIAGONAL
        y = k + 5 * at.FORWARD_RESULT
        vertical = [rail[y + 1] * coefficient[d + 1], rail[y] * coefficient[d]]
        lateral = [
            rail[y + 4] * coefficient[d + 4],
            rail[y + 3] * coefficient[d + 3],
            rail[y + 2] * coefficient[d + 2],
        ]
        substitute(vertical, near_vertical, 2, at.BACKWARD_START[1::-1], c, coefficient)
        substitute(lateral, near_lateral, 3, at.BACKWARD_START[:1:-1], c, coefficient)
        a = [vertical[1], vertical[0], lateral[2], lateral[1], lateral[0]]
        for f in ti.static(range(5)):
            u = rail[k + 5 * at.U_PREDICTED + f] + beta_dt2 * a[f]
            v = rail[k + 5 * at.V_PREDICTED + f] + gamma_dt * a[f]
            rail[k + 5 * at.A + f], rail[k + 5 * at.U + f], rail[k + 5 * at.V + f] = a[f], u, v
        if ahead == 1 and m > 0:
            predict_function(rail, k + at.RAIL_ROWS, dt, beta_dt2, gamma_dt)
    if ahead == 1:
        predict_function(rail, first * at.RAIL_ROWS, dt, beta_dt2, gamma_dt)
