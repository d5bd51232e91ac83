# mypy: disable-error-code="valid-type, index, attr-defined"
"""State of the spline step as guards look at it: sums of squares, wheels (``spline_layout`` has the arrays)."""

from typing import Any

import taichi as ti

from tiengine.kernels import layout
from tiengine.kernels import spline_layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.kernels.types import Array, Template


@ti.func
def squares_of_rails(row: int, rail: Array, lanes: Template):
    """Sum the squares of row U, V or A of all rails, lane by lane."""
    total = ti.Vector.zero(ti.f64, lanes)
    for i in range(rail.shape[0] // at.RAIL_ROWS):
        for f in ti.static(range(5)):
            x = rail[i * at.RAIL_ROWS + 5 * row + f]
            total = total + x * x
    return total


@ti.func
def squares_of_others(row: int, slab: Array, car: Array, blocks: Template):
    """Sum the squares of row U, V or A of all slabs and cars, lane by lane."""
    total = ti.Vector.zero(ti.f64, 8)
    for i in range(slab.shape[0] // at.SLAB_ROWS):
        x = slab[i * at.SLAB_ROWS + row]
        total = total + x * x
    for i in range(car.shape[0] // (at.CAR_ROWS * blocks)):
        for m in ti.static(range(blocks)):
            x = car[(i * at.CAR_ROWS + row) * blocks + m]
            total = total + x * x
    return total


@ti.func
def magnitude(x: float):
    """Bits of |x| as an integer, which orders numbers as they are, infinity after them and what is no number last.

    The compiler takes it for granted that a comparison of numbers meets numbers only.
    """
    return ti.bit_cast(ti.cast(x, ti.f64), ti.i64) & ti.i64((1 << 63) - 1)


@ti.func
def needs_check(
    limits: Array, dims: Array, rail: Array, slab: Array, car: Array, contact: Array, force: Array, lanes: Template,
    blocks: Template,
):  # fmt: skip
    """Whether a number runs away, a wheel is off its rail, or one leaves the range of its contact table.

    Args:
        limits: See ``spline_layout``, shape (N_LIMITS,).
        dims: Sizes, see ``layout``.
        rail: State of the rails.
        slab: State of the slabs.
        car: State of the cars.
        contact: Contact states of the wheels.
        force: Their local forces.
        lanes: Lanes of the rails' vectors.
        blocks: Vectors in a row of a car.
    """
    found = 0
    for row in range(3):
        of_rails, of_others = squares_of_rails(row, rail, lanes), squares_of_others(row, slab, car, blocks)
        total = 0.0
        for lane in ti.static(range(lanes)):
            total += of_rails[lane]
        for lane in ti.static(range(8)):
            total += of_others[lane]
        if magnitude(total) >= magnitude(limits[at.SQUARES + row]):
            found = 1
    for b in range(dims[layout.TRAINS]):
        for w in range(dims[layout.WHEELSETS]):
            for side in range(2):
                shift, tilt = contact[b, w, side, wr.SHIFT], ti.abs(contact[b, w, side, wr.TILT])
                if force[b, w, side, 0] <= 0.0 or shift > limits[at.LARGEST_SHIFT]:
                    found = 1
                if tilt > limits[at.LARGEST_TILT] or shift < limits[at.SMALLEST_SHIFT]:
                    found = 1
    return found


def squares_kernel(lanes: int, blocks: int) -> Any:
    """Make the kernel that sums squares, for a number of lanes of the rails and of vectors in a row of a car."""
    lane_vectors = ti.types.ndarray(dtype=ti.types.vector(lanes, ti.f64), ndim=1)
    eights = ti.types.ndarray(dtype=ti.types.vector(8, ti.f64), ndim=1)

    @ti.kernel
    def sum_squares(rail: lane_vectors, slab: eights, car: eights, of_rails_out: lane_vectors, of_others_out: eights):
        """Sum the squares of rows U, V and A, lane by lane: of the rails, then of slabs and cars, shape (3,) each."""
        ti.loop_config(serialize=True)
        for row in range(3):
            of_rails_out[row] = squares_of_rails(row, rail, lanes)
            of_others_out[row] = squares_of_others(row, slab, car, blocks)

    return sum_squares
