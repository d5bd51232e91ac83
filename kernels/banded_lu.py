"""LU of a banded matrix without pivoting: the rails' blocks are refactored whenever the speed changes."""

import taichi as ti

from tiengine.kernels.types import Reals2


@ti.kernel
def factorise(band_out: Reals2):
    """Replace a matrix by its factors.

    ``band_out[i, q]`` is A[i, i - k + q], shape (N, 2k + 1), on return L below the diagonal (its own is 1), then U.
    """
    ti.loop_config(serialize=True)
    for i in range(band_out.shape[0]):
        k = band_out.shape[1] // 2
        pivot = 1.0 / band_out[i, k]
        for m in range(1, ti.min(k, band_out.shape[0] - 1 - i) + 1):
            factor = band_out[i + m, k - m] * pivot
            band_out[i + m, k - m] = factor
            for q in range(1, k + 1):
                band_out[i + m, k - m + q] = band_out[i + m, k - m + q] - factor * band_out[i, k + q]
