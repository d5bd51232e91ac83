"""Taichi CPU kernels: what moves or is nonlinear. They import no host code."""
