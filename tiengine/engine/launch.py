"""Launching a kernel many times with the same arrays.

A public Taichi call checks and packs every argument: about 13 µs per array. Here the launch context is built once and
launched repeatedly (0.5 µs per array). This is private API of the pinned Taichi; where it is not available, or if the
caller requires it, the public call does the same work.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import NDArray
from taichi.lang import impl

__all__ = ["Launch"]

TESTED = (1, 7, 4)


class Launch:
    """A kernel bound to its arguments, called without any.

    Attributes:
        compile_seconds: Wall time of compiling [s].
    """

    def __init__(self, kernel: Any, static: tuple[Any, ...], arrays: tuple[NDArray[Any], ...], *, public: bool = False):
        """Compile and bind.

        Args:
            kernel: A ``@ti.kernel`` whose template arguments come first.
            static: Values of the template arguments.
            arrays: C-contiguous NumPy arrays, kept alive here; their contents may change, they may not move.
            public: Use public calls only.
        """
        for array in arrays:
            if not array.flags.c_contiguous:
                raise ValueError("arrays of a launch must be C-contiguous")
        self._arrays = arrays
        clock = time.perf_counter()
        if public or tuple(ti.__version__) != TESTED:
            self._launch: Callable[[], Any] = lambda: kernel(*static, *arrays)
        else:
            self._launch = _bind(kernel._primal, static, arrays)
        self.compile_seconds = time.perf_counter() - clock

    def __call__(self) -> None:
        """Launch and wait."""
        self._launch()


def _bind(kernel: Any, static: tuple[Any, ...], arrays: tuple[NDArray[Any], ...]) -> Callable[[], Any]:
    """Build the launch context once, as ``Kernel.launch_kernel`` does at every call."""
    compiled = kernel.compiled_kernels[kernel.ensure_compiled(*static, *arrays)]
    program = impl.get_runtime().prog
    data = program.compile_kernel(program.config(), program.get_device_caps(), compiled)
    context = compiled.make_launch_context()
    for i, array in enumerate(arrays):
        if array.size > np.iinfo(np.int32).max:
            raise ValueError("an array of a launch must have fewer than 2^31 entries")
        context.set_arg_external_array_with_shape((i,), int(array.ctypes.data), array.nbytes, array.shape, 0)
    return lambda: program.launch_kernel(data, context)
