"""Banded blocks for the sweeps: factors, coefficients in the kernels' order, one-sided rows and columns.

A = L U by rows; the blocks of the rails and slabs are dominated by their mass and need no pivoting (condition 14-40).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from tiengine.kernels import spline_layout as at
from tiengine.kernels.banded_lu import factorise

__all__ = ["BandedBlock", "Factors", "WheelRows", "add_factors", "band_of", "linear_coefficients", "wheel_rows"]

NEGLIGIBLE = 1e-14  # of the largest entry: where a wheel's one-sided rows and columns are cut
ROOM = 12  # functions more than a wheel's rows need now: they change with the speed
FIELDS = (2, 3)  # of the vertical and the lateral block


@dataclass(frozen=True, eq=False)
class BandedBlock:
    """Matrices of one block of a rail, fields of a function side by side: (w, theta_y) or (v, theta_z, theta_x).

    Attributes:
        M: Mass, shape (N, N).
        C: Convection and damping.
        K: Stiffness, convective part included.
        A_s: Stand-in for the seats in A.
        held: Coordinates that are held at zero (functions that a pinned end takes away).
    """

    M: sp.sparray
    C: sp.sparray
    K: sp.sparray
    A_s: sp.sparray
    held: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))

    def operator(self, beta_dt2: float, gamma_dt: float) -> sp.csr_array:
        """M + gamma dt C + beta dt^2 K + A_s."""
        return sp.csr_array(self.M + gamma_dt * self.C + beta_dt2 * self.K + self.A_s)


@dataclass(frozen=True, eq=False)
class Factors:
    """L and U of a banded matrix.

    Attributes:
        band: ``band[i, q]`` is L[i, i - k + q] for q < k and U[i, i - k + q] from q = k on, shape (N, 2k + 1).
        held: Coordinates held at zero: their rows and columns are left out.
    """

    band: NDArray[np.float64]
    held: NDArray[np.intp]

    @classmethod
    def of(cls, A: sp.sparray, half_width: int, held: NDArray[np.intp] | None = None) -> Factors:
        """Factorise.

        Args:
            A: Square matrix, shape (N, N).
            half_width: k; entries farther from the diagonal must be zero.
            held: Coordinates whose rows and columns are left out.

        Raises:
            ValueError: An entry lies outside the band, or a pivot is not positive.
        """
        gone = np.zeros(0, dtype=np.intp) if held is None else held
        return cls.of_band(band_of(A, half_width, gone), gone)

    @classmethod
    def of_band(cls, band: NDArray[np.float64], gone: NDArray[np.intp]) -> Factors:
        """Factorise a band in place.

        Args:
            band: See :func:`band_of`.
            gone: Coordinates whose rows and columns are left out.

        Raises:
            ValueError: A pivot is not positive.
        """
        half_width = band.shape[1] // 2
        band[gone, half_width] = 1.0
        factorise(band)
        if not (band[:, half_width] > 0.0).all():
            worst = int(np.argmin(band[:, half_width]))
            raise ValueError(f"banded block: pivot {worst} is {band[worst, half_width]:.3g}, must be positive")
        return cls(band, gone)

    @property
    def half_width(self) -> int:
        """K."""
        return int(self.band.shape[1] // 2)

    @property
    def inverse_diagonal(self) -> NDArray[np.float64]:
        """1 / U[i, i], zero where the coordinate is held, shape (N,)."""
        inverse: NDArray[np.float64] = 1.0 / self.band[:, self.half_width]
        inverse[self.held] = 0.0
        return inverse

    @property
    def lower(self) -> NDArray[np.float64]:
        """L by rows, nearest first: L[i, i - 1 - q], shape (N, k)."""
        return self.band[:, self.half_width - 1 :: -1]

    @property
    def upper(self) -> NDArray[np.float64]:
        """U by rows, nearest first, divided by the diagonal: U[i, i + 1 + q] / U[i, i], shape (N, k)."""
        return self.band[:, self.half_width + 1 :] * self.inverse_diagonal[:, None]

    def row(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """One-sided rows U^-T w: w . A^-1 F = (U^-T w) . (L^-1 F); shape as ``weights``, (N, m)."""
        k, N = self.half_width, len(self.band)
        transposed = np.zeros((k + 1, N))
        for d in range(k + 1):
            transposed[d] = self.band[:, k + d]
        result: NDArray[np.float64] = solve_banded((k, 0), transposed, self._free(weights))
        return result

    def column(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """One-sided columns L^-1 w, shape as ``weights``, (N, m)."""
        k, N = self.half_width, len(self.band)
        lower = np.zeros((k + 1, N))
        lower[0] = 1.0
        for d in range(1, k + 1):
            lower[d, : N - d] = self.band[d:, k - d]
        result: NDArray[np.float64] = solve_banded((k, 0), lower, self._free(weights))
        return result

    def _free(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        free = weights.copy()
        free[self.held] = 0.0
        return free


def band_of(A: sp.sparray, half_width: int, held: NDArray[np.intp]) -> NDArray[np.float64]:
    """Entries of a banded matrix by rows: A[i, i - k + q], shape (N, 2k + 1); rows and columns of ``held`` are zero.

    Raises:
        ValueError: An entry lies outside the band.
    """
    entries = sp.coo_array(A)
    keep = ~(np.isin(entries.row, held) | np.isin(entries.col, held))
    row, column, value = entries.row[keep], entries.col[keep], entries.data[keep]
    far = np.abs(row - column) > half_width
    if np.any(value[far]):
        raise ValueError(f"banded block: an entry lies {np.abs(row - column).max()} off, the band has {half_width}")
    band = np.zeros((A.shape[0], 2 * half_width + 1))
    np.add.at(band, (row[~far], column[~far] - row[~far] + half_width), value[~far])
    return band


def add_factors(out: NDArray[np.float64], factors: tuple[Factors, Factors]) -> None:
    """Put the factors of both blocks into their places of ``spline_layout``; ``out`` has shape (n, N_COEFFICIENT)."""
    n = len(out)
    for start, fields, factor in zip((0, 2), FIELDS, factors, strict=True):
        lower, upper = (side.reshape(n, fields, -1) for side in (factor.lower, factor.upper))
        inverse = factor.inverse_diagonal.reshape(n, fields)
        for f in range(fields):
            count = 3 * fields + f
            first = at.FORWARD_START[start + f]
            out[:, first : first + count] = lower[:, f, :count]
            count = 3 * fields + fields - 1 - f
            first = at.BACKWARD_AT + at.BACKWARD_START[start + f]
            out[:, first : first + count] = upper[:, f, :count]
            out[:, at.INVERSE_DIAGONAL + start + f] = inverse[:, f]


def linear_coefficients(vertical: BandedBlock, lateral: BandedBlock) -> NDArray[np.float64]:
    """K, C and A_s of both blocks in the order of ``spline_layout``, shape (n, N_COEFFICIENT); linear in the matrices.

    Raises:
        ValueError: K, C or A_s couples fields that the kernel does not.
    """
    out = np.zeros((vertical.M.shape[0] // 2, at.N_COEFFICIENT))
    for start, fields, block in zip((0, 2), FIELDS, (vertical, lateral), strict=True):
        for matrix, pairs, offset, stride, name in (
            (block.K, at.STIFFNESS_PAIRS, at.LINEAR_START, at.N_LINEAR, "K"),
            (block.C, at.DAMPING_PAIRS, at.LINEAR_START + at.N_STIFFNESS, at.N_LINEAR, "C"),
            (block.A_s, at.STAND_IN_PAIRS, at.STAND_IN_START, at.N_STAND_IN, "A_s"),
        ):
            _by_neighbour(matrix, block.held, start, fields, pairs, out, offset, stride, name)
    return out


def _by_neighbour(
    matrix: sp.sparray, held: NDArray[np.intp], start: int, fields: int, pairs: tuple[tuple[int, int], ...],
    out: NDArray[np.float64], offset: int, stride: int, name: str,
) -> None:  # fmt: skip
    """Entries of a matrix by neighbour and pair of fields."""
    entries = sp.coo_array(matrix)
    keep = (entries.data != 0.0) & ~(np.isin(entries.row, held) | np.isin(entries.col, held))
    row, column, value = entries.row[keep], entries.col[keep], entries.data[keep]
    place = np.full((5, 5), -1)
    for p, pair in enumerate(pairs):
        place[pair] = p
    pair_of = place[start + row % fields, start + column % fields]
    apart = column // fields - row // fields + at.REACH
    if (pair_of < 0).any() or (np.abs(apart - at.REACH) > at.REACH).any():
        raise ValueError(f"rail block: {name} couples fields or functions that the step does not")
    np.add.at(out, (row // fields, offset + apart * stride + pair_of), value)


@dataclass(frozen=True, eq=False)
class WheelRows:
    """A rail's one-sided rows and columns under the wheels.

    Attributes:
        place: Ints of ``spline_layout``, shape (W, N_WHEEL_PLACE).
        rows: See ``spline_layout``, shape (W, longest, N_WHEEL_FUNCTION).
        coupling: Value and slope of w, v, theta_x under a wheel by unit forces on them under another, times A^-1,
            shape (W, 2, W, 3, 3).
    """

    place: NDArray[np.int32]
    rows: NDArray[np.float64]
    coupling: NDArray[np.float64]


def wheel_rows(factors: tuple[Factors, Factors], first: NDArray[np.intp], shape: NDArray[np.float64]) -> WheelRows:
    """Rows and columns for wheels that stand still.

    Args:
        factors: Of the vertical and the lateral block.
        first: First of the four functions that each wheel touches, shape (W,).
        shape: Their values and slopes, shape (W, 4, 2).
    """
    W, n = len(first), len(factors[0].band) // 2
    weights = np.zeros((n, 2, W))
    for w in range(W):
        weights[first[w] : first[w] + 4, :, w] = shape[w]
    rows = np.zeros((n, W, at.N_WHEEL_FUNCTION))
    coupling = np.zeros((W, 2, W, 3, 3))
    for block, fields, given, answer in ((0, 2, (0,), 0), (1, 3, (0, 2), 4)):
        by_row, by_column = [], []
        for f in given:
            spread = np.zeros((n, fields, 2 * W))
            spread[:, f] = weights.reshape(n, 2 * W)
            by_row.append(factors[block].row(spread.reshape(n * fields, -1)).reshape(n, fields, 2, W))
            force = spread.reshape(n * fields, 2, W)[:, 0]
            by_column.append(factors[block].column(force).reshape(n, fields, W))
        for a, row in enumerate(by_row):
            for kind in range(2):
                start = at.WHEEL_ROWS + answer + fields * (2 * a + kind)
                rows[:, :, start : start + fields] = row[:, :, kind].transpose(0, 2, 1)
        for a, column in enumerate(by_column):
            start = at.WHEEL_COLUMNS + 2 * block + fields * a
            rows[:, :, start : start + fields] = column.transpose(0, 2, 1)
        for a, row in enumerate(by_row):
            for g, column in enumerate(by_column):
                coupling[:, :, :, block + a, block + g] = np.einsum("nfkw,nfj->wkj", row, column)
    return _cut(rows, first, coupling)


def _cut(rows: NDArray[np.float64], first: NDArray[np.intp], coupling: NDArray[np.float64]) -> WheelRows:
    """Leave out what is negligible: far functions of the rows, wheels that do not feel each other."""
    W = rows.shape[1]
    largest = np.abs(rows).max(axis=(0, 1))
    felt = np.any(np.abs(rows) > NEGLIGIBLE * np.where(largest > 0.0, largest, 1.0), axis=2)
    place = np.zeros((W, at.N_WHEEL_PLACE), dtype=np.int32)
    near = np.any(np.abs(coupling) > NEGLIGIBLE * np.abs(coupling).max(axis=(0, 1, 2)), axis=(1, 3, 4))
    for w in range(W):
        last = int(np.flatnonzero(felt[:, w]).max())
        place[w, at.ROWS_FIRST], place[w, at.ROWS_COUNT] = first[w], last + 1 - first[w]
        place[w, at.WHEEL_FIRST] = first[w]
        wheels = np.flatnonzero(near[w])
        place[w, at.COUPLED_FIRST], place[w, at.COUPLED_END] = wheels.min(), wheels.max() + 1
    longest = min(len(rows), int(place[:, at.ROWS_COUNT].max()) + ROOM)
    short = np.zeros((W, longest, at.N_WHEEL_FUNCTION))
    for w in range(W):
        count = place[w, at.ROWS_COUNT]
        short[w, :count] = rows[first[w] : first[w] + count, w]
    return WheelRows(place, short, coupling)
