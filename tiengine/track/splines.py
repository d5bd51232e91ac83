r"""Cubic B-splines, C2, on knots that travel with the window (MODEL §1a).

From the m + 3 B-splines B_0 .. B_{m+2} on m spans with fourfold knots at the ends (C. de Boor, A practical guide to
splines, 1978, ch. IX-X) both kinds take n = m + 1 functions:

    phi_i = B_{i+1}                                     zero at the ends
    psi_0 = B_0 + B_1,  psi_i = B_{i+1},  psi_{n-1} = B_{m+1} + B_{m+2}      of zero derivative at the ends

phi_i and psi_i stand at the same place, so that the unknowns of a function side by side give matrices of half width
3 fields + fields - 1: 7 for (w, theta_y), 11 for (v, theta_z, theta_x). A point touches four functions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.parameters.errors import InputError
from tiengine.track.pieces import POWERS, Pieces
from tiengine.track.seat_points import seat_points
from tiengine.track.trial_functions import FieldProducts, Products

__all__ = ["Splines"]

TOUCHED = 4
GAUSS_POINTS = 4  # integrate products of two cubics exactly


@dataclass(frozen=True, eq=False)
class Splines:
    """Splines on given knots.

    Attributes:
        knots: Ascending from zero [m], at least four, shape (n,).
    """

    knots: NDArray[np.float64]
    _means: dict[float, Pieces] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Check the knots.

        Raises:
            InputError: Knots that no window of splines can have.
        """
        if len(self.knots) < TOUCHED or self.knots[0] != 0.0 or not np.all(np.diff(self.knots) > 0.0):
            raise InputError(f"splines: {len(self.knots)} knots must ascend from 0 m and be at least {TOUCHED}")

    @property
    def length(self) -> float:
        """Window l [m]."""
        return float(self.knots[-1])

    @property
    def count(self) -> int:
        """Functions of a field."""
        return len(self.knots)

    @cached_property
    def displacement(self) -> Pieces:
        """Functions phi by span."""
        c = _b_splines(self.knots)
        # the end spans are moved by one function, past the one that is left out
        c[0], c[-1] = np.roll(c[0], -1, axis=0), np.roll(c[-1], 1, axis=0)
        c[0, -1], c[-1, 0] = 0.0, 0.0
        return Pieces(self.knots, self._first, c)

    @cached_property
    def slope(self) -> Pieces:
        """Functions psi by span."""
        c = _b_splines(self.knots)
        head, tail = c[0].copy(), c[-1].copy()
        c[0] = [head[0] + head[1], head[2], head[3], np.zeros(POWERS)]
        c[-1] = [np.zeros(POWERS), tail[0], tail[1], tail[2] + tail[3]]
        return Pieces(self.knots, self._first, c)

    @property
    def _first(self) -> NDArray[np.int32]:
        """First function of every span."""
        spans = len(self.knots) - 1
        return np.clip(np.arange(spans) - 1, 0, self.count - TOUCHED).astype(np.int32)

    def spans_within(self, length: float) -> int:
        """Most knots that a length of rail [m] within the window lies over."""
        inner = self.knots[1:-1]
        return int((np.searchsorted(inner, inner + length, side="right") - np.arange(len(inner))).max())

    def seats(self, length: float) -> Pieces:
        """Mean of phi over a seat of a length [m] by the place of its middle; 0 for a point."""
        if length == 0.0:
            return self.displacement
        if length not in self._means:
            self._means[length] = self.displacement.mean(*seat_points(length), self.count)
        return self._means[length]

    def shape(self, s: NDArray[np.float64], derivative: int = 0, over: float = 0.0) -> NDArray[np.float64]:
        """See :class:`tiengine.track.trial_functions.TrialFunctions`; what lies beyond the ends counts as zero."""
        return self.seats(over).dense(np.asarray(s), self.count, derivative)

    def slope_shape(self, s: NDArray[np.float64], derivative: int = 0) -> NDArray[np.float64]:
        """See :class:`tiengine.track.trial_functions.TrialFunctions`."""
        return self.slope.dense(np.asarray(s), self.count, derivative)

    @cached_property
    def products(self) -> Products:
        """Integrals of the functions, banded."""
        phi, phi1, psi, psi1 = (
            p.coefficients @ self._powers(d) for p in (self.displacement, self.slope) for d in (0, 1)
        )
        none = sp.csr_array((self.count, self.count))
        return Products(
            FieldProducts(self._integral(phi, phi), self._integral(phi, phi1), self._integral(phi1, phi1), none),
            FieldProducts(
                self._integral(psi, psi), self._integral(psi, psi1), self._integral(psi1, psi1), self._entry()
            ),
            self._integral(phi1, psi),
        )

    def _entry(self) -> sp.csr_array:
        """psi_i psi_j at the front, where the last function alone is not zero."""
        last = [self.count - 1]
        value = self.slope_shape(np.array([self.length]))[0, -1]
        return sp.csr_array(sp.coo_array(([value**2], (last, last)), shape=(self.count, self.count)))

    def _powers(self, derivative: int) -> NDArray[np.float64]:
        """Derivatives of 1, x, x^2, x^3 at the Gauss points of every span, shape (spans, 4, points)."""
        x = 0.5 * np.diff(self.knots)[:, None] * (np.polynomial.legendre.leggauss(GAUSS_POINTS)[0] + 1.0)
        if derivative:
            return np.stack([np.zeros_like(x), np.ones_like(x), 2.0 * x, 3.0 * x**2], axis=1)
        return np.stack([np.ones_like(x), x, x**2, x**3], axis=1)

    def _integral(self, a: NDArray[np.float64], b: NDArray[np.float64]) -> sp.csr_array:
        """Integral of a_i b_j ds of functions given at the Gauss points, shape (spans, 4, points) each."""
        weight = 0.5 * np.diff(self.knots)[:, None] * np.polynomial.legendre.leggauss(GAUSS_POINTS)[1]
        local = np.einsum("sig,sg,sjg->sij", a, weight, b)
        index = self._first[:, None] + np.arange(TOUCHED)
        rows, columns = np.broadcast_to(index[:, :, None], local.shape), np.broadcast_to(index[:, None], local.shape)
        shape = (self.count, self.count)
        matrix = sp.csr_array(sp.coo_array((local.ravel(), (rows.ravel(), columns.ravel())), shape=shape))
        matrix.eliminate_zeros()
        return matrix


def _b_splines(knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of the four B-splines on every span by the Cox-de Boor recursion, shape (spans, 4, 4).

    On span p they are B_p .. B_{p+3}; x is counted from the span's rear knot.
    """
    spans = len(knots) - 1
    t = np.concatenate([np.repeat(knots[0], 3), knots, np.repeat(knots[-1], 3)])
    i = np.arange(spans) + 3
    basis = [np.tile([1.0, 0.0, 0.0, 0.0], (spans, 1))]
    for degree in range(1, 4):
        raised = [np.zeros((spans, POWERS)) for _ in range(degree + 1)]
        for r, lower in enumerate(basis):
            ahead, behind = t[i + r + 1], t[i + 1 - degree + r]
            share = lower / (ahead - behind)[:, None]
            times_x = np.roll(share, 1, axis=1)  # of degree < 3: nothing is rolled around
            raised[r] += (ahead - t[i])[:, None] * share - times_x
            raised[r + 1] += (t[i] - behind)[:, None] * share + times_x
        basis = raised
    return np.stack(basis, axis=1)
