# mypy: disable-error-code="valid-type, index, attr-defined"
"""Sums of squares of the state of the spline step, by which a run is watched (``spline_layout`` has the arrays)."""

from typing import Any

import taichi as ti

from tiengine.kernels import spline_layout as at


def squares_kernel(lanes: int, blocks: int) -> Any:
    """Make the kernel for a number of lanes of the rails and of vectors in a row of a car."""
    lane_vectors = ti.types.ndarray(dtype=ti.types.vector(lanes, ti.f64), ndim=1)
    eights = ti.types.ndarray(dtype=ti.types.vector(8, ti.f64), ndim=1)

    @ti.kernel
    def sum_squares(rail: lane_vectors, slab: eights, car: eights, of_rails_out: lane_vectors, of_others_out: eights):
        """Sum the squares of rows U, V and A, lane by lane: of the rails, then of slabs and cars, shape (3,) each."""
        ti.loop_config(serialize=True)
        for row in range(3):
            of_rails, of_others = ti.Vector.zero(ti.f64, lanes), ti.Vector.zero(ti.f64, 8)
            for i in range(rail.shape[0] // at.RAIL_ROWS):
                for f in ti.static(range(5)):
                    x = rail[i * at.RAIL_ROWS + 5 * row + f]
                    of_rails = of_rails + x * x
            for i in range(slab.shape[0] // at.SLAB_ROWS):
                x = slab[i * at.SLAB_ROWS + row]
                of_others = of_others + x * x
            for i in range(car.shape[0] // (at.CAR_ROWS * blocks)):
                for m in ti.static(range(blocks)):
                    x = car[(i * at.CAR_ROWS + row) * blocks + m]
                    of_others = of_others + x * x
            of_rails_out[row], of_others_out[row] = of_rails, of_others

    return sum_squares
