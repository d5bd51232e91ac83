"""Convergence study of the engine's settings."""
