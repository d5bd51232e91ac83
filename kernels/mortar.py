"""Mortar bed under a slab: Winkler pressure and its generalised force.

The state is measured from rest under the slab's own weight. At a quadrature point of area dA the pressure
beyond that of the weight is p = factor (k w + c dw/dt), positive when the slab presses down; the bed resists:
f_i -= N_i p dA. A bed that cannot pull carries max(0, p_0 + p) in total, p_0 being the pressure under the
weight, so its force beyond that of rest is max(0, p_0 + p) - max(0, p_0). Where a gap is open at rest p_0 is
negative, -factor k times its height: the bed carries once the gap has closed. Spring and damper together never
pull, so that the bed only takes energy: it gives back no more than its spring holds. Total pressures are reported;
under a void they are zero.

Plate DOFs of a slab come first, then its rigid lateral displacement and yaw.
"""

import taichi as ti

from tiengine.kernels.types import Array, Ints1, Ints2, Real, Reals1, Reals2, Reals3


@ti.func
def bed_force_and_pressure(
    # Model:
    design,
    rest_row,
    index: Array,
    shape: Array,
    weight: Array,
    factor: Array,
    rest_pressure: Array,
    lateral_K: Array,
    lateral_C: Array,
    k,
    c,
    explicit,
    no_tension,
    # State:
    base,
    n,
    motion: Array,
    row_u,
    row_v,
    row_f,
):
    """Add the bed's force on one slab and return its extreme contact pressures.

    Args:
        design: Which slab design, first index of the tables of designs.
        rest_row: Row of the pressures at rest.
        index: Plate DOFs of each element, shape (n_el, 12).
        shape: Deflection shapes at the quadrature points, shape (n_q, 12).
        weight: Areas of the quadrature points [m^2], shape (n_q,).
        factor: Bed factor, shape (n_design, n_el, n_q).
        rest_pressure: Pressure at rest, negative where a gap is open [Pa], shape (rows, n_el, n_q).
        lateral_K: Lateral bed on (lateral displacement, yaw) [N/m, N, N m], shape (n_design, 2, 2).
        lateral_C: The same for damping [N s/m, N s, N m s], shape (n_design, 2, 2).
        k: Bed stiffness per area [N/m^3].
        c: Bed damping per area [N s/m^3].
        explicit: 1: add the whole force of the bed, lateral included. 0: the linear bed belongs to the
            implicit part; add only the deviation of a bed without tension from it.
        no_tension: 1: the bed does not pull.
        base: Column of the slab's first DOF.
        n: DOFs of the slab; the last two are lateral displacement and yaw.
        motion: State, one column a DOF.
        row_u: Row of the displacements [m, rad].
        row_v: Row of the velocities [m/s, rad/s].
        row_f: Row of the generalised forces [N, N m], added to.

    Returns:
        Vector (largest, smallest) total contact pressure, weight included [Pa].
    """
    largest = -1.0e300
    smallest = 1.0e300
    for e in range(index.shape[0]):
        # k w + c dw/dt is linear in the DOFs: one product with the shapes instead of two
        z = ti.Vector([0.0] * 12)
        F = ti.Vector([0.0] * 12)
        for i in ti.static(range(12)):
            z[i] = k * motion[row_u, base + index[e, i]] + c * motion[row_v, base + index[e, i]]
        for q in range(weight.shape[0]):
            linear = 0.0
            for i in ti.static(range(12)):
                linear += shape[q, i] * z[i]
            linear *= factor[design, e, q]
            rest = rest_pressure[rest_row, e, q]
            total = rest + linear
            carried = linear
            if no_tension == 1 and (total < 0.0 or rest < 0.0):
                carried = ti.max(total, 0.0) - ti.max(rest, 0.0)
                total = ti.max(total, 0.0)
            largest = ti.max(largest, total)
            smallest = ti.min(smallest, total)
            p = carried
            if explicit == 0:
                p = carried - linear  # exactly zero where the bed is in contact
            if p != 0.0:
                for i in ti.static(range(12)):
                    F[i] += weight[q] * p * shape[q, i]
        for i in ti.static(range(12)):
            motion[row_f, base + index[e, i]] = motion[row_f, base + index[e, i]] - F[i]
    if explicit == 1:
        side = base + n - 2
        for i in ti.static(range(2)):
            lateral = 0.0
            for j in ti.static(range(2)):
                lateral += lateral_K[design, i, j] * motion[row_u, side + j]
                lateral += lateral_C[design, i, j] * motion[row_v, side + j]
            motion[row_f, side + i] = motion[row_f, side + i] - lateral
    return ti.Vector([largest, smallest])


@ti.kernel
def add_bed_forces(
    # Model:
    trains: int,
    n_train: int,
    n: int,
    start: Ints1,
    design: Ints2,
    index: Ints2,
    shape: Reals2,
    weight: Reals1,
    factor: Reals3,
    rest_pressure: Reals3,
    lateral_K: Reals3,
    lateral_C: Reals3,
    k: Real,
    c: Real,
    explicit: int,
    no_tension: int,
    # State:
    motion_out: Reals2,
    # Out:
    pressure_out: Reals3,
):
    """Apply :func:`bed_force_and_pressure` to every slab of every train.

    Args:
        trains: Trains advanced together.
        n_train: DOFs a train.
        n: DOFs a slab.
        start: First DOF of each slab within a train, shape (n_slab,).
        design: Design of each slab, shape (trains, n_slab).
        index: Plate DOFs of each element, shape (n_el, 12).
        shape: Deflection shapes at the quadrature points, shape (n_q, 12).
        weight: Areas of the quadrature points [m^2], shape (n_q,).
        factor: Bed factor, shape (n_design, n_el, n_q).
        rest_pressure: Pressure at rest by design [Pa], shape (n_design, n_el, n_q).
        lateral_K: Lateral bed [N/m, N, N m], shape (n_design, 2, 2).
        lateral_C: Lateral bed's damping [N s/m, N s, N m s], shape (n_design, 2, 2).
        k: Bed stiffness per area [N/m^3].
        c: Bed damping per area [N s/m^3].
        explicit: 1: the whole force; 0: only the deviation from the linear bed.
        no_tension: 1: the bed does not pull.
        motion_out: Rows displacement, velocity (read) and force (added to), shape (3, trains n_train).
        pressure_out: Largest and smallest contact pressure [Pa], shape (trains, n_slab, 2).
    """
    ti.loop_config(serialize=True)
    for b in range(trains):
        for s in range(start.shape[0]):
            p = bed_force_and_pressure(
                design[b, s],
                design[b, s],
                index,
                shape,
                weight,
                factor,
                rest_pressure,
                lateral_K,
                lateral_C,
                k,
                c,
                explicit,
                no_tension,
                b * n_train + start[s],
                n,
                motion_out,
                0,
                1,
                2,
            )
            pressure_out[b, s, 0] = p[0]
            pressure_out[b, s, 1] = p[1]
