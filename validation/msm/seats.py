r"""Sums of the rails' sine modes at all seats of the track, by a sine transform.

With a rail of n whole seat pitches, L = n d, seats stand at (j + 1/2) d, and mode i is sin(i pi (j + 1/2)/n) there: the
discrete sine transform of type III from modes to seats, its transpose (type II) back. Modes beyond n fold onto lower
ones: i and 2 n - i agree at all seats, i and 2 n + i differ in sign. A product with the n by N matrix of sines would
read 9 MB; a transform of six rows takes tens of microseconds.

For a seat that presses on a length of rail the elongation is the mean of a mode over five Gauss points, symmetric
about its middle: the mode's value there times the mean of cos k_i xi, for sin k_i (x + xi) = sin k_i x cos k_i xi + an
odd part. The factor belongs to the mode, not to the seat, and the transform is unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals

__all__ = ["SeatTransform"]

SEAT_POINTS = 5


@dataclass(frozen=True, eq=False)
class SeatTransform:
    """Seat frequency to which each mode folds.

    Attributes:
        seats: Number n of seats.
        target: Folded mode less one, shape (N,).
        sign: 1, -1, or 0 where the mode vanishes at every seat, times its mean over a seat's length, shape (N,).
    """

    seats: int
    target: NDArray[np.int32]
    sign: Reals

    @classmethod
    def of(cls, seats: int, modes: int, seat_length: float = 0.0) -> SeatTransform:
        """Fold ``modes`` modes onto ``seats`` frequencies; the length of a seat is in pitches, 0 for a point."""
        i = np.arange(1, modes + 1)
        turns, rest = np.divmod(i, 2 * seats)
        sign = np.where(rest == 0, 0.0, np.where(turns % 2 == 0, 1.0, -1.0))
        folded = np.where(rest <= seats, rest, 2 * seats - rest)
        target = np.maximum(folded - 1, 0).astype(np.int32)
        if seat_length == 0.0:
            return cls(seats, target, sign)
        node, weight = np.polynomial.legendre.leggauss(SEAT_POINTS)
        phase = np.multiply.outer(i * (np.pi / seats), 0.5 * seat_length * node)
        return cls(seats, target, sign * (np.cos(phase) @ (0.5 * weight)))

    def to_seats(self, folded: Reals) -> Reals:
        """Sum over folded modes of a_i sin(i pi (j + 1/2)/n), shape (rows, n); ``folded`` is overwritten."""
        folded[:, -1] *= 2.0  # the transform counts its last term once and the others twice
        values: Reals = scipy.fft.dst(folded, type=3, axis=1, overwrite_x=True)
        values *= 0.5
        return values

    def from_seats(self, values: Reals) -> Reals:
        """Sum over seats of f_j sin(i pi (j + 1/2)/n), shape (rows, n)."""
        folded: Reals = scipy.fft.dst(values, type=2, axis=1)
        folded *= 0.5
        return folded
