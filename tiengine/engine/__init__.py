"""State of a run and its time step."""

from tiengine import kernels as kernels  # before Taichi: its package names a cache folder where there is none
