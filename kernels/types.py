"""Array types of the kernels: ``ti.types.ndarray`` at run time, NumPy arrays to the type checker.

Kernels take C-contiguous NumPy arrays without a copy. ``Real`` is the engine's working precision.
"""

from typing import TYPE_CHECKING, Any

import taichi as ti

Real = ti.f64

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Reals1 = NDArray[np.float64]
    Reals2 = NDArray[np.float64]
    Reals3 = NDArray[np.float64]
    Reals4 = NDArray[np.float64]
    Reals5 = NDArray[np.float64]
    Ints1 = NDArray[np.int32]
    Ints2 = NDArray[np.int32]
    Ints3 = NDArray[np.int32]
    Array = Any
    Template = Any
else:
    Reals1 = ti.types.ndarray(dtype=ti.f64, ndim=1)
    Reals2 = ti.types.ndarray(dtype=ti.f64, ndim=2)
    Reals3 = ti.types.ndarray(dtype=ti.f64, ndim=3)
    Reals4 = ti.types.ndarray(dtype=ti.f64, ndim=4)
    Reals5 = ti.types.ndarray(dtype=ti.f64, ndim=5)
    Ints1 = ti.types.ndarray(dtype=ti.i32, ndim=1)
    Ints2 = ti.types.ndarray(dtype=ti.i32, ndim=2)
    Ints3 = ti.types.ndarray(dtype=ti.i32, ndim=3)
    Array = ti.template()  # an array passed to a ti.func
    Template = ti.template()  # a vector, matrix or compile-time constant passed to a ti.func
