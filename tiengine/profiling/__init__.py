"""Profiling: time of each stage of the step, compared with the roofline of the machine."""

from tiengine import kernels as kernels  # before Taichi: its package names a cache folder where there is none
