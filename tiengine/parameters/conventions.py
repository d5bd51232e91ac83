"""Conventions shared by all wings: gravity and the order of the two sides."""

from __future__ import annotations

__all__ = ["GRAVITY", "SIDES"]

GRAVITY = 9.81
"""Acceleration of gravity g [m/s^2]."""

SIDES = ("left", "right")
"""Sides of the track, looking forward, in the order of every axis over sides: index 0 is left."""
