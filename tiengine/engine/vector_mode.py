"""Kernels whose vectors stay vectors.

Taichi takes every small vector apart into numbers before it makes code. With an undocumented switch of its compile
configuration (``real_matrix_scalarize``) a vector of two, four or eight doubles stays one machine vector, and the
step's recurrences run 2-4 times faster. The switch is set around the compilation of single kernels, since others do
not compile with it. The same source compiled without it does the same work: that is taken if ``TIENGINE_VECTOR=0``,
if the compilation in vector mode raises, if this is not the Taichi the switch was tried with, or if an array of
vectors is not aligned.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
import taichi as ti
from numpy.typing import NDArray
from taichi.lang import impl

from tiengine.engine.aligned import is_aligned
from tiengine.engine.launch import TESTED

__all__ = ["VectorLaunch", "lanes_for", "vector_mode_wanted"]


def vector_mode_wanted() -> bool:
    """Whether kernels are to be compiled in vector mode: unless ``TIENGINE_VECTOR`` is 0."""
    return os.environ.get("TIENGINE_VECTOR", "1") != "0" and tuple(ti.__version__) == TESTED


def lanes_for(trains: int) -> int:
    """Lanes of the rails' vectors, two a train: 2 for one train, 8 for more."""
    return 2 if trains == 1 else 8


class VectorLaunch:
    """A kernel of vectors, bound to its arrays; call it without arguments.

    Attributes:
        vector_mode: Whether it was compiled in vector mode.
        compile_seconds: Wall time of compiling [s].
    """

    def __init__(
        self,
        make: Callable[..., Any],
        numbers: tuple[int, ...],
        arrays: tuple[NDArray[Any], ...],
        vector_arrays: frozenset[int],
    ):
        """Compile and bind.

        Args:
            make: Makes the ``@ti.kernel`` for given numbers of lanes and the like; the kernel takes arrays only.
            numbers: What it is made for.
            arrays: C-contiguous NumPy arrays, kept alive here; their contents may change, they may not move. An array
                of vectors has the lanes last.
            vector_arrays: Which of them are arrays of vectors.
        """
        for i, array in enumerate(arrays):
            if not array.flags.c_contiguous:
                raise ValueError(f"array {i} of a launch must be C-contiguous")
            if array.size > np.iinfo(np.int32).max:
                raise ValueError(f"array {i} of a launch has {array.size} entries, must have fewer than 2^31")
        self._arrays = arrays
        clock = time.perf_counter()
        self.vector_mode = vector_mode_wanted() and all(is_aligned(arrays[i]) for i in vector_arrays)
        if self.vector_mode:
            try:
                self._launch = _bind(_kernel(make, numbers, True), arrays, vector_arrays, True)
            except Exception:  # whatever a Taichi that cannot do it raises: the same source works without
                self.vector_mode = False
        if not self.vector_mode:
            self._launch = _bind(_kernel(make, numbers, False), arrays, vector_arrays, False)
        self.compile_seconds = time.perf_counter() - clock

    def __call__(self) -> None:
        """Launch and wait."""
        self._launch()


@cache
def _kernel(make: Callable[..., Any], numbers: tuple[int, ...], vector_mode: bool) -> Any:
    """One kernel a mode: Taichi remembers what it made of a kernel whatever the switch says later."""
    return make(*numbers)


@contextmanager
def _compile_options(vector_mode: bool) -> Iterator[None]:
    """Set what these kernels are compiled with, in both copies of Taichi's configuration.

    Its own search for common expressions is left to LLVM: on kernels of this size it takes three quarters of the time
    of compiling, and the code comes out no faster.
    """
    wanted = {"real_matrix_scalarize": not vector_mode, "advanced_optimization": False}
    configurations = (impl.get_runtime().prog.config(), impl.current_cfg())
    before = [{name: getattr(configuration, name) for name in wanted} for configuration in configurations]
    for configuration in configurations:
        for name, value in wanted.items():
            setattr(configuration, name, value)
    try:
        yield
    finally:
        for configuration, values in zip(configurations, before, strict=True):
            for name, value in values.items():
                setattr(configuration, name, value)


def _bind(
    kernel: Any, arrays: tuple[NDArray[Any], ...], vector_arrays: frozenset[int], vector_mode: bool
) -> Callable[[], Any]:
    """Compile, and build the launch context once; a public call where Taichi is another one."""
    if tuple(ti.__version__) != TESTED:
        return lambda: kernel(*arrays)
    primal = kernel._primal
    with _compile_options(vector_mode):
        compiled = primal.compiled_kernels[primal.ensure_compiled(*arrays)]
        program = impl.get_runtime().prog
        data = program.compile_kernel(program.config(), program.get_device_caps(), compiled)
    context = compiled.make_launch_context()
    for i, array in enumerate(arrays):
        shape = array.shape[:-1] if i in vector_arrays else array.shape
        context.set_arg_external_array_with_shape((i,), int(array.ctypes.data), array.nbytes, shape, 0)
    return lambda: program.launch_kernel(data, context)
