"""Physical constants."""

from __future__ import annotations

__all__ = ["GRAVITY"]

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""
