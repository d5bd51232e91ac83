r"""Static compliance of the sines that a window leaves out, between its wheels and seats (MODEL §1a).

Waves shorter than the N-th sine follow their forces at once: neither inertia nor bed reaches them. What they add to the
deflection at a by a unit force at b is

    (2/l) sum over i > N of c_i sin k_i a sin k_i b,   c_i = 1/(kappa G A k_i^2) + 1/(EI k_i^4)   in w and v,

and 1/(GK k_i^2) in torsion. Written with the cosines of k_i (a - b) and k_i (a + b), only the first counts away from
the window's ends, so that it is one even function of the distance x = a - b,

    h(x) = (1/l) sum over i > N of c_i cos k_i x = (1/l) [sum over all i - sum over i <= N],

the first sum in closed form, theta = pi x / l:

    sum cos(i theta)/i^2 = pi^2/6 - pi theta/2 + theta^2/4
    sum cos(i theta)/i^4 = pi^4/90 - pi^2 theta^2/12 + pi theta^3/12 - theta^4/48

h(0) is what ``RailWindow.missing_compliance`` gives. A seat with a length takes the mean over its points
(``seat_points``). The tail, about sin(k_N x)/(k_N x) of h(0), is faded out, lest a seat that enters the window should
feel a jump.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.track.rail import Rail
from tiengine.track.seat_points import seat_points

__all__ = ["REACH", "OmittedModes"]

WHOLE, REACH = 4.0, 6.0
"""Distance up to which h counts in full, and beyond which not at all [m]; at 60 sines in 36 m, 5 and 3 % of h(0)."""


@dataclass(frozen=True)
class OmittedModes:
    """Sines beyond the N-th of a window.

    Attributes:
        rail: Section.
        length: Window l [m].
        modes: N.
        seat_length: Length of rail on which a seat presses [m].
    """

    rail: Rail
    length: float
    modes: int
    seat_length: float = 0.0

    def compliance(self, x: Reals, seats: int) -> Reals:
        """Deflection at a distance x [m] from a unit force.

        Args:
            x: Any shape.
            seats: How many of the two places are seats, 0 to 2; the others are wheels.

        Returns:
            Of w and v [m/N], theta_x [rad/(N m)], shape (3, ...).
        """
        return self._mean(x, seats, slope=False) * _fading(x)

    def slope(self, x: Reals, seats: int) -> Reals:
        """Derivative of :meth:`compliance` by x; zero at x = 0, where that of points has a kink."""
        return self._mean(x, seats, slope=True) * _fading(x) + self._mean(x, seats, slope=False) * _fading_slope(x)

    def _mean(self, x: Reals, seats: int, slope: bool) -> Reals:
        """Mean of h or of its slope over the points of so many seats."""
        offset, weight = np.zeros(1), np.ones(1)
        points = seat_points(self.seat_length)
        for _ in range(seats):
            offset = np.add.outer(offset, points[0]).ravel()
            weight = np.multiply.outer(weight, points[1]).ravel()
        found: Reals = np.tensordot(self._between_points(np.add.outer(np.asarray(x), offset), slope), weight, 1)
        return found

    def _between_points(self, x: Reals, slope: bool) -> Reals:
        """Evaluate h or its slope between points, shape (3, ...)."""
        r, k1 = self.rail, np.pi / self.length
        i = np.arange(1.0, self.modes + 1.0)
        theta = np.mod(k1 * np.abs(x), 2.0 * np.pi)
        if slope:
            waves = np.sin(np.multiply.outer(theta, i))
            squares = k1 * (0.5 * (np.pi - theta) - waves @ (1.0 / i))
            fourths = k1 * (np.pi**2 * theta / 6.0 - np.pi * theta**2 / 4.0 + theta**3 / 12.0 - waves @ (1.0 / i**3))
            squares, fourths = -np.sign(x) * squares, -np.sign(x) * fourths
        else:
            waves = np.cos(np.multiply.outer(theta, i))
            squares = np.pi**2 / 6.0 - np.pi * theta / 2.0 + theta**2 / 4.0 - waves @ (1.0 / i**2)
            fourths = np.pi**4 / 90.0 - np.pi**2 * theta**2 / 12.0 + np.pi * theta**3 / 12.0 - theta**4 / 48.0
            fourths = fourths - waves @ (1.0 / i**4)
        shear, bending = r.G * r.A * np.array([r.kappa_vertical, r.kappa_lateral]), r.E * np.array([r.Iy, r.Iz])
        across = np.multiply.outer(1.0 / (shear * k1**2), squares) + np.multiply.outer(1.0 / (bending * k1**4), fourths)
        found: Reals = np.concatenate([across, (squares / (r.GK * k1**2))[None]]) / self.length
        return found


def _fading(x: Reals) -> Reals:
    """Share of h that counts at a distance."""
    share: Reals = 0.5 + 0.5 * np.cos(np.pi * np.clip((np.abs(x) - WHOLE) / (REACH - WHOLE), 0.0, 1.0))
    return share


def _fading_slope(x: Reals) -> Reals:
    """Derivative of :func:`_fading`."""
    part = (np.abs(x) - WHOLE) / (REACH - WHOLE)
    inside = (part > 0.0) & (part < 1.0)
    slope: Reals = np.where(inside, -0.5 * np.pi / (REACH - WHOLE) * np.sin(np.pi * part) * np.sign(x), 0.0)
    return slope
