"""Constant arrays of the spline step, their shapes, and how they are filled from matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from tiengine.engine.aligned import aligned_copy
from tiengine.engine.banded import BandedBlock, Factors, add_factors, linear_coefficients, wheel_rows
from tiengine.kernels import spline_layout as at
from tiengine.kernels.vehicle_columns import DAMPING_COLUMNS, INVERSE_COLUMNS, N_TABLES, STIFFNESS_COLUMNS

__all__ = ["HALF_WIDTHS", "CarTables", "RailTables", "SeatTables", "SlabTables", "Spans", "spans_of"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

HALF_WIDTHS = (7, 11)
"""Half widths of the bands of the rails' vertical and lateral block."""


@dataclass(frozen=True, eq=False)
class Spans:
    """The knots' spans, for values anywhere in the window.

    Attributes:
        span: Ends, polynomials, first of the four functions, shape (spans, N_SPAN).
    """

    span: Floats

    def at(self, s: Floats) -> tuple[NDArray[np.intp], Floats]:
        """First functions, and values and slopes of four, at given places; shapes (m,) and (m, 4, 2)."""
        k = np.clip(np.searchsorted(self.span[:, at.SPAN_FRONT], s), 0, len(self.span) - 1)
        t = s - self.span[k, at.SPAN_REAR]
        c = self.span[k, at.SPAN_POLYNOMIALS : at.SPAN_FIRST].reshape(-1, 4, 4)
        powers = np.stack([np.ones_like(t), t, t**2, t**3], axis=1)
        slopes = np.stack([np.zeros_like(t), np.ones_like(t), 2.0 * t, 3.0 * t**2], axis=1)
        values = np.stack([np.einsum("mfp,mp->mf", c, p) for p in (powers, slopes)], axis=2)
        return self.span[k, at.SPAN_FIRST].astype(np.intp), values


def spans_of(knots: Floats, combine: Floats | None = None) -> Spans:
    """Spans of cubic splines on a knot vector.

    Args:
        knots: All knots, outer ones included, simple within the window; the window is from the fourth to the last but
            three, and starts at 0.
        combine: Functions as combinations of the B-splines, shape (functions, B-splines): the identity if None. A span
            may touch four neighbouring functions at most.
    """
    count = len(knots) - 4
    weights = np.eye(count) if combine is None else combine
    breaks = np.unique(knots[3 : count + 1])
    span = np.zeros((len(breaks) - 1, at.N_SPAN))
    span[:, at.SPAN_REAR], span[:, at.SPAN_FRONT] = breaks[:-1], breaks[1:]
    spline = BSpline(knots, weights.T, 3)
    rear_values = [spline(breaks[:-1], nu) / factor for nu, factor in enumerate((1.0, 1.0, 2.0, 6.0))]
    for k, c in enumerate(np.stack(rear_values, axis=1)):  # c0..c3 by function
        touched = np.flatnonzero(np.abs(c).max(axis=0) > 0.0)
        first = min(int(touched.min()), c.shape[1] - 4)
        if touched.max() - first > 3:
            raise ValueError(f"span {k} touches functions {touched.min()} to {touched.max()}, may touch four")
        span[k, at.SPAN_POLYNOMIALS : at.SPAN_FIRST] = c[:, first : first + 4].T.ravel()
        span[k, at.SPAN_FIRST] = first
    return Spans(span)


@dataclass(frozen=True, eq=False)
class RailTables:
    """Tables that the rails' kernels read; they depend on the speed.

    Attributes:
        coefficient: See ``spline_layout``, shape (n N_COEFFICIENT,).
        wheel_place, wheel_rows: One-sided rows and columns, shapes (W, N_WHEEL_PLACE), (W longest N_WHEEL_FUNCTION,).
        wheel_shape: Values and slopes of four functions under the wheels, shape (W, 4, 2).
        coupling: See ``banded.WheelRows``, shape (W, 2, W, 3, 3).
    """

    coefficient: Floats
    wheel_place: Ints
    wheel_rows: Floats
    wheel_shape: Floats
    coupling: Floats

    @classmethod
    def of(
        cls,
        vertical: BandedBlock,
        lateral: BandedBlock,
        spans: Spans,
        wheel_s: Floats,
        beta_dt2: float,
        gamma_dt: float,
    ) -> RailTables:
        """Factorise at one speed.

        Args:
            vertical: Matrices of (w, theta_y).
            lateral: Matrices of (v, theta_z, theta_x).
            spans: The knots' spans.
            wheel_s: Wheels in the window [m], shape (W,).
            beta_dt2: beta dt^2 [s^2].
            gamma_dt: gamma dt [s].
        """
        factors = (
            Factors.of(vertical.operator(beta_dt2, gamma_dt), HALF_WIDTHS[0], vertical.held),
            Factors.of(lateral.operator(beta_dt2, gamma_dt), HALF_WIDTHS[1], lateral.held),
        )
        return cls.of_factors(factors, linear_coefficients(vertical, lateral), spans, wheel_s)

    @classmethod
    def of_factors(
        cls, factors: tuple[Factors, Factors], coefficient: Floats, spans: Spans, wheel_s: Floats
    ) -> RailTables:
        """Tables from the factors of both blocks and their linear coefficients; the latter are filled up.

        Other arguments as in :meth:`of`.
        """
        first, shape = spans.at(wheel_s)
        wheels = wheel_rows(factors, first, shape)
        add_factors(coefficient, factors)
        return cls(
            coefficient=aligned_copy(coefficient.ravel()),
            wheel_place=wheels.place,
            wheel_rows=wheels.rows.ravel(),
            wheel_shape=shape,
            coupling=wheels.coupling,
        )

    def refill(self, new: RailTables) -> None:
        """Take over the numbers of tables made at another speed, in place.

        Raises:
            ValueError: The wheels' rows have become longer than there is room for: bind anew.
        """
        needed, W = int(new.wheel_place[:, at.ROWS_COUNT].max()), len(self.wheel_place)
        mine = self.wheel_rows.reshape(W, -1, at.N_WHEEL_FUNCTION)
        if needed > mine.shape[1]:
            raise ValueError(f"wheel rows: {needed} functions, there is room for {mine.shape[1]}")
        mine[...] = 0.0
        mine[:, :needed] = new.wheel_rows.reshape(W, -1, at.N_WHEEL_FUNCTION)[:, :needed]
        self.coefficient[...], self.coupling[...] = new.coefficient, new.coupling
        self.wheel_place[...] = new.wheel_place


@dataclass(frozen=True, eq=False)
class SeatTables:
    """Seats of all trains.

    Attributes:
        point: Offset [m] and weight of the Gauss points, shape (points, 2).
        place, shape: Filled by the kernel, shapes (seats, N_SEAT_PLACE), (seats TOUCHED N_SEAT_SHAPE,).
    """

    point: Floats
    place: Ints
    shape: Floats

    @classmethod
    def of(cls, seats: int, length: float, spans: Spans, points: int = 5) -> SeatTables:
        """Empty tables.

        Args:
            seats: Seats in the window, those that reach into it included.
            length: Of a seat along the rail [m]; 0 for points.
            spans: The knots' spans.
            points: Gauss points.

        Raises:
            ValueError: A seat can touch more functions than there is room for.
        """
        if length > 0.0:
            x, weight = np.polynomial.legendre.leggauss(points)
            point = np.stack([0.5 * length * x, 0.5 * weight], axis=1)
        else:
            point = np.array([[0.0, 1.0]])
        rear, reach = spans.span[:, at.SPAN_REAR], point[-1, 0] - point[0, 0]
        most = 4 + max(int(np.searchsorted(rear, s + reach) - k - 1) for k, s in enumerate(rear))
        if most > at.TOUCHED - 1:
            raise ValueError(
                f"fastening.length = {length:g} m: touches up to {most} functions, must be {at.TOUCHED - 1} at most"
            )
        return cls(
            point=point,
            place=np.zeros((seats, at.N_SEAT_PLACE), dtype=np.int32),
            shape=np.zeros(seats * at.TOUCHED * at.N_SEAT_SHAPE),
        )


@dataclass(frozen=True, eq=False)
class SlabTables:
    """Bands of every slab design.

    Attributes:
        half_width: K of the bands.
        coefficient: Rows of K and C, shape (N, 2, 2K + 1), then L, 1/diagonal, U/diagonal, shape (N, 2K + 1), design by
            design, in a row.
        dofs: N.
        seat_index: Coordinates under each seat, shape (2, seats a slab, touched).
        seat_shape: Their shapes for w, then dw/dy, shape (2, 2, seats a slab, touched).
        seat_x: Seats from the slab's centre [m], shape (seats a slab,).
    """

    dofs: int
    half_width: int
    coefficient: Floats
    seat_index: NDArray[np.int32]
    seat_shape: Floats
    seat_x: Floats

    @classmethod
    def of(
        cls,
        designs: Sequence[tuple[Floats, Floats, Floats]],
        seat_index: NDArray[np.int32],
        seat_w: Floats,
        seat_slope: Floats,
        seat_x: Floats,
    ) -> SlabTables:
        """Factorise every design.

        Args:
            designs: For each design A with its own fastenings, and K and C of what A takes off at the predictors,
                shape (N, N) each; the sound design first.
            seat_index: Coordinates under the seats, shape (seats, 2, touched).
            seat_w: Shapes of w there, shape (seats, 2, touched).
            seat_slope: Shapes of dw/dy.
            seat_x: Seats from the slab's centre [m], shape (seats,).
        """
        width = max(_half_width(A) for A, _, _ in designs)
        rows = []
        for A, K, C in designs:
            factors = Factors.of(sp.csr_array(A), width)
            rows.append(np.stack([_band_rows(K, width), _band_rows(C, width)], axis=1).ravel())
            inverse = factors.inverse_diagonal[:, None]
            rows.append(np.hstack([factors.lower, inverse, factors.upper]).ravel())
        return cls(
            dofs=len(designs[0][0]),
            half_width=width,
            coefficient=aligned_copy(np.concatenate(rows)),
            seat_index=np.ascontiguousarray(seat_index.transpose(1, 0, 2), dtype=np.int32),
            seat_shape=np.ascontiguousarray(np.stack([seat_w, seat_slope]).transpose(0, 2, 1, 3)),
            seat_x=np.ascontiguousarray(seat_x),
        )


def _half_width(A: Floats) -> int:
    row, column = np.nonzero(A)
    return int(np.abs(row - column).max())


def _band_rows(A: Floats, width: int) -> Floats:
    """A[i, i - width + q], shape (N, 2 width + 1)."""
    wide = np.pad(A, ((0, 0), (width, width)))
    return np.stack([wide[i, i : i + 2 * width + 1] for i in range(len(A))])


@dataclass(frozen=True, eq=False)
class CarTables:
    """Inverses of every car by columns, and where the train's coordinates stand.

    Attributes:
        car: Coordinates of each car, by their index in the train.
        dofs: Most coordinates of a car.
        blocks: Vectors of eight in a row of a car.
        columns: -A^-1 K, -A^-1 C, A^-1 of each different car by columns, vectors, shape (vectors, 8).
        columns_start: First vector of each car's tables, shape (cars,).
        load_place: Places of the train's coordinates in a row of loads, shape (n,).
        vehicle_place: Places of the train's coordinates in row 0 of a train, shape (n,).
        wheelset_place: Places of y, z, roll, pitch, yaw, shape (W, 5).
        element_place: Places of the elements' coordinates, shape (n_e, 12).
        wheelset_compliance: A^-1 at the wheelsets, shape (W, 5, 5).
    """

    car: tuple[NDArray[np.intp], ...]
    dofs: int
    blocks: int
    columns: Floats
    columns_start: Ints
    load_place: Ints
    vehicle_place: Ints
    wheelset_place: Ints
    element_place: Ints
    wheelset_compliance: Floats

    @classmethod
    def of(
        cls,
        M: Floats,
        C: Floats,
        K: Floats,
        car: Sequence[NDArray[np.intp]],
        wheelset_dof: NDArray[np.int32],
        element_index: NDArray[np.int32],
        beta_dt2: float,
        gamma_dt: float,
    ) -> CarTables:
        """Invert every car's block; equal blocks share their tables.

        Args:
            M: Mass of the train, shape (n, n).
            C: Damping at this speed.
            K: Stiffness.
            car: Coordinates of each car in the train.
            wheelset_dof: y, z, roll, pitch, yaw of each wheelset, shape (W, 5).
            element_index: Coordinates of each nonlinear element, shape (n_e, 12).
            beta_dt2: beta dt^2 [s^2].
            gamma_dt: gamma dt [s].

        Raises:
            ValueError: M, C or K couples two cars.
        """
        number, local = np.zeros(len(M), dtype=np.intp), np.zeros(len(M), dtype=np.intp)
        for i, dof in enumerate(car):
            number[dof], local[dof] = i, np.arange(len(dof))
        for name, matrix in (("M", M), ("C", C), ("K", K)):
            row, column = np.nonzero(matrix)
            if (number[row] != number[column]).any():
                raise ValueError(f"train: {name} couples two cars; put what lies between them into explicit elements")
        dofs = max(len(dof) for dof in car)
        blocks = -(-dofs // 8)
        tables: dict[bytes, int] = {}
        columns: list[Floats] = []
        starts, inverses = [], []
        for dof in car:
            own = np.ix_(dof, dof)
            inverse = np.linalg.inv(M[own] + gamma_dt * C[own] + beta_dt2 * K[own])
            inverses.append(inverse)
            table = np.zeros((N_TABLES, 8 * blocks, 8 * blocks))
            for which, product in (
                (STIFFNESS_COLUMNS, -inverse @ K[own]),
                (DAMPING_COLUMNS, -inverse @ C[own]),
                (INVERSE_COLUMNS, inverse),
            ):
                table[which, : len(dof), : len(dof)] = product.T
            start = tables.setdefault(table.tobytes(), len(columns) * table.size // 8)
            if start == len(columns) * table.size // 8:
                columns.append(table)
            starts.append(start)
        stride = at.CAR_ROWS * blocks * 8
        place = (number * stride + local).astype(np.int32)
        compliance = np.stack([inverses[number[dof[0]]][np.ix_(local[dof], local[dof])] for dof in wheelset_dof])
        return cls(
            car=tuple(car),
            dofs=dofs,
            blocks=blocks,
            columns=aligned_copy(np.stack(columns).reshape(-1, 8)),
            columns_start=np.array(starts, dtype=np.int32),
            load_place=(number * 8 * blocks + local).astype(np.int32),
            vehicle_place=place,
            wheelset_place=place[wheelset_dof],
            element_place=place[element_index],
            wheelset_compliance=compliance,
        )

    def refill(self, new: CarTables) -> None:
        """Take over the numbers of tables made at another speed, in place."""
        self.columns[...], self.wheelset_compliance[...] = new.columns, new.wheelset_compliance
