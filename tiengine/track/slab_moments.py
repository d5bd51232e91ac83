"""Bending moments of a slab from its coordinates.

    M_x = -D (w,xx + nu w,yy)        M_y = -D (w,yy + nu w,xx)        [N m/m]

with w positive down and D the plate's rigidity: a moment is positive where it stretches the underside. M_x bends the
slab along the track (stress in x), M_y across it.

They are taken at the 2 x 2 Gauss points of every element, where the second derivatives of its polynomial come closest
to those of the exact field (Barlow 1976: a cubic that meets its ends' values and slopes has the second derivative of a
quartic at these points and nowhere else). The error falls at least with the square of the element's size there. At the
nodes it is four to ten times as large, averaged over the elements that meet there (``tests/test_slab_moments.py``).

Under a point load the moment of a thin plate grows without bound (like a logarithm): at the fastenings the moment is
that of a load spread over an element, and the default mesh of 9 x 2 shows half of what forces spread over 0.35 m
give (docs/results.md).
"""

from __future__ import annotations

__all__ = []
