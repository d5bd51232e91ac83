"""State arrays of the step with sines: rails by their modes, all trains in one row of coordinates.

When the window leaves its rear slab behind, the slab's slot is cleared for the one that enters at the front.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.state import ACCELERATION, DISPLACEMENT, VELOCITY, State
from tiengine.kernels import layout as at
from tiengine.kernels.wheel_rail import COS, N_CONTACT, SHIFT, TILT
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals

__all__ = ["SineState"]

ROWS = {DISPLACEMENT: at.U, VELOCITY: at.V, ACCELERATION: at.A}


@dataclass(eq=False)
class SineState(State):
    """Arrays that a step changes; B trains, W wheelsets, shapes as the kernels read them.

    Attributes:
        model: Constant data.
        motion: Rows of generalised coordinates, see ``layout``.
        seat_scale: Factors of the fastenings in the window, shape (B, seats, 2).
        design: Design of the slab in each slot, shape (B, slots).
        seat_force: F_V, F_L and roll moment M_b - a F_L of the seats on the rails, shape (B, 2, 3, seats).
        omitted: Motion of the sines left out at the seats, now and at the ends of the last two steps, shape
            (B, 2, 3, seats, 3); no seats if they are not added there.
        pressure: Largest and smallest mortar pressure of each slab [Pa], shape (B, slots, 2).
        contact, force, wheelset_force, rail_force: Contact; ``force`` starts the next solve.
        iterations: Most Newton iterations of each wheelset since the last reset, shape (B, W).
        first_seat, first_slab: Rear seat and slab of the window.
    """

    model: SineModel
    motion: NDArray[np.float64]
    seat_scale: NDArray[np.float64]
    design: NDArray[np.int32]
    seat_force: NDArray[np.float64]
    omitted: NDArray[np.float64]
    pressure: NDArray[np.float64]
    contact: NDArray[np.float64]
    force: NDArray[np.float64]
    wheelset_force: NDArray[np.float64]
    rail_force: NDArray[np.float64]
    iterations: NDArray[np.int32]
    first_seat: int = -1
    first_slab: int = -1
    _blocks: dict[str, tuple[slice, tuple[int, ...]]] = field(default_factory=dict)
    _bodies: slice = field(default_factory=lambda: slice(None))

    @classmethod
    def at_rest(cls, model: SineModel) -> SineState:
        """All zero: nothing moves, no forces."""
        d = model.dims
        B, n, seats, W = int(d[at.TRAINS]), int(d[at.MODES]), int(d[at.SEATS]), int(d[at.WHEELSETS])
        slots, dofs, vehicle = int(d[at.SLOTS]), int(d[at.SLAB_DOFS]), int(d[at.VEHICLE_DOFS])
        columns = int(d[at.VEHICLES]) + B * vehicle
        rows = at.CONTACT_ROWS[model.ingredients.contact.patches]
        blocks = {
            "vertical": (slice(0, int(d[at.LATERAL])), (B, 2, 2 * n)),
            "lateral": (slice(int(d[at.LATERAL]), int(d[at.SLABS])), (B, 2, 3 * n)),
            "slabs": (slice(int(d[at.SLABS]), int(d[at.VEHICLES])), (B, slots, dofs)),
            "vehicles": (slice(int(d[at.VEHICLES]), columns), (B, vehicle)),
        }
        return cls(
            model=model,
            motion=np.zeros((at.MOTION_ROWS, columns)),
            seat_scale=np.ones((B, seats, 2)),
            design=np.zeros((B, slots), dtype=np.int32),
            seat_force=np.zeros((B, 2, 3, seats)),
            omitted=np.zeros((B, 2, 3, 0 if model.omitted is None else seats, 3)),
            pressure=np.zeros((B, slots, 2)),
            contact=_first_contact(B, W, rows),
            force=np.zeros((B, W, rows, 4)),
            wheelset_force=np.zeros((B, W, 5)),
            rail_force=np.zeros((B, W, 2, 3)),
            iterations=np.zeros((B, W), dtype=np.int32),
            _blocks=blocks,
            _bodies=slice(0, 5 * int(d[at.BODIES])),
        )

    @property
    def trains(self) -> int:
        """Trains advanced together, B."""
        return len(self.design)

    @property
    def slots(self) -> int:
        """Slabs in memory."""
        return int(self.design.shape[1])

    @property
    def normal_force(self) -> Reals:
        """Normal force of every wheel [N], shape (B, W, 2)."""
        return self.force[..., :2, 0]

    @property
    def forces_on_rails(self) -> Reals:
        """Vertical, lateral and roll force of every wheel on its rail, shape (B, W, 2, 3)."""
        return self.rail_force

    @property
    def relative_shift(self) -> Reals:
        """Outward shift of every wheel against its rail [m], shape (B, W, 2)."""
        return self.contact[..., :2, SHIFT]

    @property
    def relative_tilt(self) -> Reals:
        """Outward tilt of every wheel against its rail [rad], shape (B, W, 2)."""
        return self.contact[..., TILT]

    @property
    def seat_forces(self) -> Reals:
        """Forces of the rails on the seats, shape (B, 2, 3, seats)."""
        return self.seat_force

    def body_motion(self, kind: int) -> Reals:
        """Motion of the bodies, shape (B, 5 bodies)."""
        return self.view(ROWS[kind], "vehicles")[:, self._bodies]

    def slab_motion(self, kind: int) -> Reals:
        """Motion of the slabs' coordinates, shape (B, slots, dofs)."""
        return self.view(ROWS[kind], "slabs")

    def rail_motion(self, side: int, s: float) -> Reals:
        """Motion of a rail at a place in the window, shape (2, 3, 3, B)."""
        n, k = self.model.window.modes, self.model.window.wave_numbers
        sine, cosine = np.sin(k * s), np.cos(k * s)
        shapes = np.stack([sine, k * cosine, -(k**2) * sine], axis=1)
        found = np.empty((2, len(ROWS), 3, self.trains))
        for direction, block in enumerate(("lateral", "vertical")):
            for kind, row in ROWS.items():
                found[direction, kind] = (self.view(row, block)[:, side, :n] @ shapes).T
        return found

    def rail_deflection(self, s: Reals) -> Callable[[], Reals]:
        """Bind the vertical deflection of both rails to fixed places in the window."""
        shape, rails = self.model.window.shape(s).T, self.view(at.U, "vertical")[..., : self.model.window.modes]
        return lambda: np.asarray(rails @ shape)

    def squares(self) -> tuple[float, float, float]:
        """Sums of the squares of all coordinates, of their rates and of their second rates."""
        u, v, a = (self.motion[row] for row in ROWS.values())
        return float(np.dot(u, u)), float(np.dot(v, v)), float(np.dot(a, a))

    def part(self, train: int, name: str) -> Reals:
        """Coordinates of a part of one train, and their first and second rates."""
        return np.stack([self.view(row, name)[train] for row in ROWS.values()])

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """All arrays, by name."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray) and value.size}

    def view(self, row: int, block: str) -> NDArray[np.float64]:
        """One block of one row: vertical (B, 2, 2N), lateral (B, 2, 3N), slabs (B, slots, dofs), vehicles (B, n)."""
        columns, shape = self._blocks[block]
        return self.motion[row, columns].reshape(shape)

    def put(self, kind: int, name: str, values: Reals) -> None:
        """Fill the coordinates of a part of all trains, or their rates."""
        self.view(ROWS[kind], name)[:] = values

    def put_contact(self, contact: Reals, local: Reals, wheelset: Reals, rail: Reals) -> None:
        """Take over contact states and forces, from which the next solve starts."""
        self.force[:], self.contact[:] = local, contact
        self.wheelset_force[:], self.rail_force[:] = wheelset, rail

    def clear(self, train: int) -> None:
        """Take a train whose numbers ran away out of the way: nothing moves, no forces."""
        for row in ROWS.values():
            for block in self._blocks:
                self.view(row, block)[train] = 0.0
        for forces in (self.seat_force, self.omitted, self.pressure, self.force, self.wheelset_force, self.rail_force):
            forces[train] = 0.0
        self.contact[train] = _first_contact(1, *self.contact.shape[1:3])[0]

    def enter(self, first_seat: int, first_slab: int) -> None:
        """Move the window on to its rear seat and slab: drop the slabs that it leaves, bring new ones in at rest."""
        ingredients = self.model.ingredients
        if first_seat != self.first_seat:
            self.seat_scale[:] = ingredients.seat_factors(first_seat, self.seat_scale.shape[1])
            if self.omitted.size and self.first_seat >= 0:
                self._shift_seats(first_seat - self.first_seat)
            self.first_seat = first_seat
        if first_slab != self.first_slab:
            slots = self.design.shape[1]
            fresh = range(max(first_slab, self.first_slab + slots), first_slab + slots)
            for slab in fresh if self.first_slab >= 0 else range(first_slab, first_slab + slots):
                slot = slab % slots
                self.design[:, slot] = ingredients.designs.of_slab.get(slab, 0)
                for row in ROWS.values():
                    self.view(row, "slabs")[:, slot] = 0.0
            self.first_slab = first_slab

    def _shift_seats(self, count: int) -> None:
        """Let so many seats leave at the rear: what is known of the others stays with them."""
        for values in (self.seat_force, self.omitted):
            seats = values.shape[3]
            values[:, :, :, : max(seats - count, 0)] = values[:, :, :, count:].copy()
            values[:, :, :, max(seats - count, 0) :] = 0.0


def _first_contact(B: int, W: int, rows: int) -> NDArray[np.float64]:
    """Contact states with a level contact plane, for the first force directions."""
    contact = np.zeros((B, W, rows, N_CONTACT))
    contact[..., COS] = 1.0
    return contact
