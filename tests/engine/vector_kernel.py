"""A kernel of vectors; Taichi reads annotations as they are, so this module does not postpone them."""

from typing import Any

import taichi as ti


def doubling(lanes: int) -> Any:
    vectors = ti.types.ndarray(dtype=ti.types.vector(lanes, ti.f64), ndim=1)
    numbers = ti.types.ndarray(dtype=ti.f64, ndim=1)

    @ti.kernel
    def double(x: vectors, factor: numbers):
        ti.loop_config(serialize=True)
        for i in range(factor.shape[0]):
            x[i] = 2.0 * x[i] + factor[i] * x[i]
            x[i][1] = x[i][0] - x[i][1]

    return double
