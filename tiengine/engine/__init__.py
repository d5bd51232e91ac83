"""The changing data of a run and the time step."""

from tiengine import kernels as kernels  # before Taichi: its package names a cache folder where there is none
