"""The changing data of a group of trains, and the window moving on.

Slabs stand still on the ground. Slot i of the state holds the slab whose index is congruent to i modulo the number of
slots, so that a slab keeps its place in memory while the window passes; when the rear slab is left behind, its slot is
cleared for the fresh one that enters at the front.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tiengine.kernels import layout as at
from tiengine.kernels.wheel_rail import COS, N_CONTACT
from tiengine.model.model import Model

__all__ = ["Position", "State", "positions"]


@dataclass(eq=False)
class State:
    """Arrays that a step changes; B trains, W wheelsets, shapes as the kernels read them.

    Attributes:
        motion: Rows of generalised coordinates, see ``layout``.
        seat_scale: Factors of the fastenings in the window, shape (B, seats, 2).
        design: Design of the slab in each slot, shape (B, slots).
        seat_force: F_V, F_L and roll moment M_b - a F_L of the seats on the rails, shape (B, 2, 3, seats).
        pressure: Largest and smallest mortar pressure of each slab [Pa], shape (B, slots, 2).
        contact, force, wheelset_force, rail_force: Contact; ``force`` starts the next solve.
        iterations: Most Newton iterations of each wheelset since last reset, shape (B, W).
        first_seat, first_slab: Rear seat and slab of the window.
    """

    motion: NDArray[np.float64]
    seat_scale: NDArray[np.float64]
    design: NDArray[np.int32]
    seat_force: NDArray[np.float64]
    pressure: NDArray[np.float64]
    contact: NDArray[np.float64]
    force: NDArray[np.float64]
    wheelset_force: NDArray[np.float64]
    rail_force: NDArray[np.float64]
    iterations: NDArray[np.int32]
    first_seat: int = -1
    first_slab: int = -1
    _blocks: dict[str, tuple[slice, tuple[int, ...]]] = field(default_factory=dict)

    @classmethod
    def at_rest(cls, model: Model) -> State:
        """All zero: nothing moves, no forces."""
        d = model.dims
        B, n, seats, W = int(d[at.TRAINS]), int(d[at.MODES]), int(d[at.SEATS]), int(d[at.WHEELSETS])
        slots, dofs, vehicle = int(d[at.SLOTS]), int(d[at.SLAB_DOFS]), int(d[at.VEHICLE_DOFS])
        columns = int(d[at.VEHICLES]) + B * vehicle
        blocks = {
            "vertical": (slice(0, int(d[at.LATERAL])), (B, 2, 2 * n)),
            "lateral": (slice(int(d[at.LATERAL]), int(d[at.SLABS])), (B, 2, 3 * n)),
            "slabs": (slice(int(d[at.SLABS]), int(d[at.VEHICLES])), (B, slots, dofs)),
            "vehicles": (slice(int(d[at.VEHICLES]), columns), (B, vehicle)),
        }
        return cls(
            motion=np.zeros((at.MOTION_ROWS, columns)),
            seat_scale=np.ones((B, seats, 2)),
            design=np.zeros((B, slots), dtype=np.int32),
            seat_force=np.zeros((B, 2, 3, seats)),
            pressure=np.zeros((B, slots, 2)),
            contact=_first_contact(B, W),
            force=np.zeros((B, W, 2, 4)),
            wheelset_force=np.zeros((B, W, 5)),
            rail_force=np.zeros((B, W, 2, 3)),
            iterations=np.zeros((B, W), dtype=np.int32),
            _blocks=blocks,
        )

    def view(self, row: int, block: str) -> NDArray[np.float64]:
        """One block of one row: vertical (B, 2, 2N), lateral (B, 2, 3N), slabs (B, slots, dofs), vehicles (B, n)."""
        columns, shape = self._blocks[block]
        return self.motion[row, columns].reshape(shape)

    def clear(self, train: int) -> None:
        """Take a train whose numbers ran away out of the way: nothing moves, no forces."""
        for row in (at.U, at.V, at.A):
            for block in self._blocks:
                self.view(row, block)[train] = 0.0
        for forces in (self.seat_force, self.pressure, self.force, self.wheelset_force, self.rail_force):
            forces[train] = 0.0
        self.contact[train] = _first_contact(1, self.contact.shape[1])[0]

    def enter(self, model: Model, first_seat: int, first_slab: int) -> None:
        """Move the window on to its rear seat and slab: drop what it leaves, bring fresh slabs in at rest.

        Args:
            model: Constant data.
            first_seat: Index of the rear seat.
            first_slab: Index of the rear slab.
        """
        if first_seat != self.first_seat:
            self.seat_scale[:] = model.ingredients.seat_factors(first_seat, self.seat_scale.shape[1])
            self.first_seat = first_seat
        if first_slab != self.first_slab:
            slots = self.design.shape[1]
            fresh = range(max(first_slab, self.first_slab + slots), first_slab + slots)
            for slab in fresh if self.first_slab >= 0 else range(first_slab, first_slab + slots):
                slot = slab % slots
                self.design[:, slot] = model.ingredients.designs.of_slab.get(slab, 0)
                for row in (at.U, at.V, at.A):
                    self.view(row, "slabs")[:, slot] = 0.0
            self.first_slab = first_slab


def _first_contact(B: int, W: int) -> NDArray[np.float64]:
    """Contact states with a level contact plane, for the first force directions."""
    contact = np.zeros((B, W, 2, N_CONTACT))
    contact[..., COS] = 1.0
    return contact


@dataclass(frozen=True, eq=False)
class Position:
    """The window at a row of instants.

    Attributes:
        clock: Rows for the kernels, see ``layout``; shape (steps, N_CLOCK).
    """

    clock: NDArray[np.float64]

    @property
    def first_seat(self) -> NDArray[np.int64]:
        """Index of the rear seat at each instant."""
        return self.clock[:, at.FIRST_SEAT].astype(np.int64)

    @property
    def first_slab(self) -> NDArray[np.int64]:
        """Index of the rear slab at each instant."""
        return self.clock[:, at.FIRST_SLAB].astype(np.int64)


def positions(model: Model, X: NDArray[np.float64], V: NDArray[np.float64], V_rate: NDArray[np.float64]) -> Position:
    """Where the window's seats and slabs stand.

    Seat j is at chainage (j + 1/2) d and enters at s = l; the rear seat has 0 < s_0 <= d. Slab K lies over
    K p < x < (K + 1) p.

    Args:
        model: Constant data.
        X: Chainage of the window's rear end [m], shape (steps,).
        V: Speed [m/s].
        V_rate: Its rate [m/s^2].
    """
    d, p = model.ingredients.slab.fastening_pitch, model.ingredients.slab.pitch
    clock = np.zeros((len(X), at.N_CLOCK))
    first = np.maximum(np.floor(X / d - 0.5).astype(np.int64) + 1, 0)
    clock[:, at.POSITION], clock[:, at.SPEED], clock[:, at.SPEED_RATE] = X, V, V_rate
    clock[:, at.FIRST_SEAT] = first
    clock[:, at.FIRST_SEAT_S] = (first + 0.5) * d - X
    clock[:, at.FIRST_SLAB] = np.floor(X / p)
    return Position(clock)
