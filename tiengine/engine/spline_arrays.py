"""State of a spline step: arrays of vectors, and their conversion to plain numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.aligned import aligned_zeros
from tiengine.engine.spline_tables import CarTables, SlabTables
from tiengine.kernels import spline_layout as at
from tiengine.kernels import spline_seats as seat_rows
from tiengine.kernels import spline_wheels as wheel_vectors

__all__ = ["SplineArrays"]

Floats = NDArray[np.float64]

NOTHING_SEEN = 1e300
"""N: beyond any force; infinities do not exist for code made with fast mathematics."""


@dataclass(frozen=True, eq=False)
class SplineArrays:
    """State of a spline step and access to its numbers; B trains in chunks of lanes / 2.

    Attributes:
        trains: B.
        lanes: Lanes of the rails' vectors.
        functions: n.
        rail: State of the rails, shape (vectors, lanes).
        seat: Vectors of the seats (``spline_seats``), shape (chunks seats N_SEAT, lanes).
        seat_play: Vectors of hanging seats (``spline_seats``), shape (chunks seats N_PLAY, lanes); a row if none hangs.
        under: Rails under the wheels (``spline_wheels``), shape (chunks W N_UNDER, lanes).
        slab: State of the slabs, shape (vectors, 8).
        slab_seat: Seats' rows of the slabs, shape (trains groups 5 seats a slab, 8), trains filled up to whole chunks.
        slab_design: Design of the slab in each slot, shape (trains groups, 8).
        car: State of the cars, shape (vectors, 8).
    """

    trains: int
    lanes: int
    functions: int
    slab_dofs: int
    half_width: int
    cars: CarTables
    rail: Floats
    seat: Floats
    seat_play: Floats
    under: Floats
    slab: Floats
    slab_seat: Floats
    slab_design: Floats
    car: Floats

    @classmethod
    def at_rest(
        cls, trains: int, lanes: int, functions: int, seats: int, wheelsets: int, slots: int, slabs: SlabTables,
        cars: CarTables, some_hang: bool = False,
    ) -> SplineArrays:  # fmt: skip
        """All zero, all fastenings sound, all slabs of the first design; seats may come to hang if ``some_hang``."""
        chunks, groups = -(-2 * trains // lanes), -(-slots // 8)
        whole = chunks * lanes // 2
        N, K, per_slab = slabs.dofs, slabs.half_width, len(slabs.seat_x)
        state = cls(
            trains=trains,
            lanes=lanes,
            functions=functions,
            slab_dofs=N,
            half_width=K,
            cars=cars,
            rail=aligned_zeros((chunks * (functions + 2 * at.REACH) * at.RAIL_ROWS, lanes)),
            seat=aligned_zeros((chunks * seats * seat_rows.N_SEAT, lanes)),
            seat_play=aligned_zeros((chunks * seats * seat_rows.N_PLAY if some_hang else 1, lanes)),
            under=aligned_zeros((chunks * wheelsets * wheel_vectors.N_UNDER, lanes)),
            slab=aligned_zeros((whole * groups * (N + 2 * K) * at.SLAB_ROWS, 8)),
            slab_seat=aligned_zeros((whole * groups * at.SLAB_SEAT_ROWS * per_slab, 8)),
            slab_design=aligned_zeros((whole * groups, 8)),
            car=aligned_zeros((whole * len(cars.car) * at.CAR_ROWS * cars.blocks, 8)),
        )
        state.set_seat_factors(np.ones((trains, seats, 2)))
        state.forget_extremes()
        return state

    def rails(self, row: int, first: int = 0, count: int | None = None) -> Floats:
        """A row of the rails, copied: shape (B, 2, n, 5), or of ``count`` functions from ``first`` on."""
        view = self._rail_view(row)[..., first : None if count is None else first + count, :]
        chunks, t, sides, n, five = view.shape
        return view.reshape(chunks * t, sides, n, five)[: self.trains].copy()

    def set_rails(self, row: int, values: Floats) -> None:
        """Fill a row of the rails from shape (B, 2, n, 5)."""
        view = self._rail_view(row)
        for b in range(self.trains):
            view[divmod(b, self.lanes // 2)] = values[b]

    def _rail_view(self, row: int) -> Floats:
        """A row of the rails as (chunk, train of the chunk, rail, function, field)."""
        padded = self.functions + 2 * at.REACH
        whole = self.rail.reshape(-1, padded, at.RAIL_ROWS, self.lanes // 2, 2)
        inner = whole[:, at.REACH : at.REACH + self.functions, 5 * row : 5 * row + 5]
        return inner.transpose(0, 3, 4, 1, 2)

    def slabs(self, row: int) -> Floats:
        """A row of the slabs as a view: shape (trains, groups, 8, N); slot s is (s // 8, s % 8)."""
        N, K = self.slab_dofs, self.half_width
        groups = len(self.slab_design) // self._whole
        whole = self.slab.reshape(self._whole, groups, N + 2 * K, at.SLAB_ROWS, 8)
        return whole[: self.trains, :, K : K + N, row].transpose(0, 1, 3, 2)

    @property
    def _whole(self) -> int:
        """Trains filled up to whole chunks."""
        return -(-2 * self.trains // self.lanes) * self.lanes // 2

    def vehicles(self, row: int) -> Floats:
        """A row of the trains' coordinates, copied: shape (B, n)."""
        view = self._car_view(row)
        out = np.zeros((self.trains, sum(len(dof) for dof in self.cars.car)))
        for i, dof in enumerate(self.cars.car):
            out[:, dof] = view[:, i, : len(dof)]
        return out

    def set_vehicles(self, row: int, values: Floats) -> None:
        """Fill a row of the trains' coordinates from shape (B, n)."""
        view = self._car_view(row)
        for i, dof in enumerate(self.cars.car):
            view[:, i, : len(dof)] = values[:, dof]

    @property
    def groups(self) -> int:
        """Groups of eight slots of a train."""
        return len(self.slab_design) // self._whole

    def _car_view(self, row: int) -> Floats:
        """A row of the cars as (train, car, coordinate)."""
        whole = self.car.reshape(self._whole, len(self.cars.car), at.CAR_ROWS, -1)
        return whole[: self.trains, :, row]

    def seats(self, first: int, count: int) -> Floats:
        """Vectors of the seats from ``first`` on (``spline_seats``), copied: shape (B, 2, count, seats)."""
        seats = len(self.seat) // (seat_rows.N_SEAT * (len(self.rail) // (self._padded * at.RAIL_ROWS)))
        whole = self.seat.reshape(-1, seats, seat_rows.N_SEAT, self.lanes // 2, 2)
        view = whole[:, :, first : first + count].transpose(0, 3, 4, 2, 1)
        return view.reshape(-1, 2, count, seats)[: self.trains].copy()

    def set_seat_factors(self, factors: Floats) -> None:
        """Factors of the fastenings in the window, shape (B, seats, 2)."""
        seats = factors.shape[1]
        whole = self.seat.reshape(-1, seats, seat_rows.N_SEAT, self.lanes // 2, 2)
        for b in range(self.trains):
            c, t = divmod(b, self.lanes // 2)
            whole[c, :, seat_rows.FACTOR, t] = factors[b]

    @property
    def some_hang(self) -> bool:
        """Whether seats may hang."""
        return len(self.seat_play) > 1

    def set_seat_plays(self, play: Floats, rest: Floats) -> None:
        """Play k_v g of the hanging seats in the window, and their k_v u at rest [N], shape (seats, 2) each."""
        vectors = self.seat_play.reshape(-1, len(play), seat_rows.N_PLAY, self.lanes // 2, 2)
        vectors[:, :, seat_rows.PLAY], vectors[:, :, seat_rows.REST] = play[:, None], rest[:, None]

    def forget_extremes(self) -> None:
        """Let the seats' smallest and largest forces start anew; rows SMALLEST, LARGEST of :meth:`seats`."""
        vectors = self.seat.reshape(-1, seat_rows.N_SEAT, self.lanes)
        vectors[:, seat_rows.SMALLEST : seat_rows.SMALLEST + 3] = NOTHING_SEEN
        vectors[:, seat_rows.LARGEST : seat_rows.LARGEST + 3] = -NOTHING_SEEN

    def enter_slab(self, slot: int, design: int) -> None:
        """Put a fresh slab at rest into a slot of every train."""
        self.slab_design.reshape(self._whole, -1)[:, slot] = design
        N, K = self.slab_dofs, self.half_width
        whole = self.slab.reshape(self._whole, -1, N + 2 * K, at.SLAB_ROWS, 8)
        whole[:, slot // 8, :, :, slot % 8] = 0.0

    def clear(self, train: int) -> None:
        """Take a train whose numbers ran away out of the way: nothing moves, no forces."""
        c, t = divmod(train, self.lanes // 2)
        self.rail.reshape(-1, self._padded * at.RAIL_ROWS, self.lanes)[c, :, 2 * t : 2 * t + 2] = 0.0
        chunks = len(self.rail) // (self._padded * at.RAIL_ROWS)
        seats = self.seat.reshape(chunks, -1, seat_rows.N_SEAT, self.lanes)
        seats[c, :, : seat_rows.FACTOR, 2 * t : 2 * t + 2] = 0.0
        for array in (self.slab, self.slab_seat, self.car):
            array.reshape(self._whole, -1)[train] = 0.0
        self.under.reshape(chunks, -1, self.lanes)[c, :, 2 * t : 2 * t + 2] = 0.0

    @property
    def _padded(self) -> int:
        return self.functions + 2 * at.REACH
