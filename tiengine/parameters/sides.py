"""Sides of the track: their names and the sign of y, in the order of every array with a side index."""

from __future__ import annotations

__all__ = ["SIDES", "SIGNS"]

SIDES = ("left", "right")
"""Names, looking forward."""

SIGNS = (-1.0, 1.0)
"""Sign of y on each side: y points to the right."""
