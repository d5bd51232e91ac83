"""Profiling: where the time of a step goes, held against the machine."""

from tiengine import kernels as kernels  # before Taichi: its package names a cache folder where there is none
