"""Measured roofline of one core, with NumPy and its BLAS.

A roof is the best of many repeats, so that other load on the machine matters little. Everything runs on one thread, as
the step's products do, into arrays that exist already. Bytes are those of the named operands; a write that first
fetches its cache line counts once.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from threadpoolctl import threadpool_limits

__all__ = ["Roofs", "measure_roofs"]

SECONDS = 0.15  # of repeats per roof
DGEMM = 800
SMALL_ROWS, SMALL = 16, 120
"""A small product like the step's: right-hand sides of 16 rails on a block of 60 modes."""
GEMV = 350  # a matrix of 0.98 MB, as the blocks of one train's whole solve
L2_FALLBACK, L3_FALLBACK = 2**19, 2**25  # bytes, where the system does not describe its caches
SHARE_OF_L2 = 0.5  # filled by a triad: other data of the program are there too
TIMES_L3 = 4  # size of a triad from main memory over that of the last cache


@dataclass(frozen=True)
class Roofs:
    """Measured roofs of one core.

    Attributes:
        dgemm_gflops: Product of two 800 x 800 matrices.
        small_dgemm_gflops: Product of a 16 x 120 and a 120 x 120 matrix.
        gemv_gb_per_s: A 350 x 350 matrix read once for one vector, as the solve of a single train reads its blocks.
        triad_l2_gb_per_s: a = b + s c from the second-level cache.
        triad_dram_gb_per_s: a = b + s c from main memory.
    """

    dgemm_gflops: float
    small_dgemm_gflops: float
    gemv_gb_per_s: float
    triad_l2_gb_per_s: float
    triad_dram_gb_per_s: float

    def floor_s(self, flops: float, read_bytes: float) -> float:
        """Least time [s] for a number of operations on a number of bytes: the slower of dgemm and gemv."""
        return max(flops / self.dgemm_gflops, read_bytes / self.gemv_gb_per_s) * 1e-9


@cache
def measure_roofs(l2_bytes: int = 0, l3_bytes: int = 0) -> Roofs:
    """Measure all roofs, once per process.

    Args:
        l2_bytes: Second-level cache of a core, 0 if unknown.
        l3_bytes: Last cache, 0 if unknown.
    """
    l2, l3 = l2_bytes or L2_FALLBACK, l3_bytes or L3_FALLBACK
    with threadpool_limits(1):
        return Roofs(
            dgemm_gflops=_product_gflops(DGEMM, DGEMM),
            small_dgemm_gflops=_product_gflops(SMALL_ROWS, SMALL),
            gemv_gb_per_s=_gemv(),
            triad_l2_gb_per_s=_triad(int(SHARE_OF_L2 * l2)),
            triad_dram_gb_per_s=_triad(TIMES_L3 * l3),
        )


def _product_gflops(rows: int, n: int) -> float:
    """Rate of the product (rows, n) times (n, n) [GFLOP/s]."""
    a, b, out = np.ones((rows, n)), np.ones((n, n)), np.empty((rows, n))
    return 2.0 * rows * n * n / _best_ns(lambda: np.matmul(a, b, out=out))


def _gemv() -> float:
    """Rate at which a matrix in the cache is read [GB/s]."""
    A, x, out = np.ones((GEMV, GEMV)), np.ones(GEMV), np.empty(GEMV)
    return A.nbytes / _best_ns(lambda: np.dot(A, x, out=out))


def _triad(total: int) -> float:
    """Rate of a = b + s c on three arrays of ``total`` bytes [GB/s]; NumPy's two sweeps move five arrays."""
    b, c, a = (np.ones(max(total // 24, 1)) for _ in range(3))

    def triad() -> None:
        np.multiply(c, 3.0, out=a)
        np.add(a, b, out=a)

    return 5.0 * a.nbytes / _best_ns(triad)


def _best_ns(call: Callable[[], object]) -> float:
    """Shortest of the repeats within the allowed time, at least three [ns]."""
    clock, end, best, repeats = time.perf_counter_ns, time.perf_counter() + SECONDS, float("inf"), 0
    while repeats < 3 or time.perf_counter() < end:
        start = clock()
        call()
        best = min(best, clock() - start)
        repeats += 1
    return best
