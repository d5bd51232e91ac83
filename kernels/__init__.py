"""Taichi CPU kernels of moving and nonlinear parts. They import no host code."""
