"""State of the step with splines: physical quantities from the arrays that its kernel reads and writes.

When the window leaves its rear slab behind, the slab's slot is cleared for the one that enters at the front.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.aligned import aligned_zeros
from tiengine.engine.model_tables import ModelTables
from tiengine.engine.spline_arrays import SplineArrays
from tiengine.engine.spline_step import Bed, Contact
from tiengine.engine.state import ACCELERATION, DISPLACEMENT, VELOCITY, State
from tiengine.engine.vector_mode import VectorLaunch, lanes_for
from tiengine.kernels import layout
from tiengine.kernels import spline_layout as at
from tiengine.kernels import spline_seats as seats
from tiengine.kernels.spline_squares import squares_kernel
from tiengine.kernels.wheel_rail import COS, N_CONTACT, SHIFT, TILT
from tiengine.model.spline_model import SplineModel
from tiengine.parameters.arrays import Reals

__all__ = ["SplineState"]

ROWS = {DISPLACEMENT: at.U, VELOCITY: at.V, ACCELERATION: at.A}
FIELDS = {"vertical": slice(at.W, at.THETA_Y + 1), "lateral": slice(at.V_LATERAL, at.THETA_X + 1)}


@dataclass(eq=False)
class SplineState(State):
    """Arrays that a step changes; B trains, W wheelsets.

    Attributes:
        tables: Constant data and tables.
        held: SplineArrays of rails, slabs and cars.
        wheels: Arrays of the contact.
        bed: Bed of the slabs and its pressures.
        first_seat, first_slab: Rear seat and slab of the window.
    """

    tables: ModelTables
    held: SplineArrays
    wheels: Contact
    bed: Bed
    first_seat: int = -1
    first_slab: int = -1

    @classmethod
    def at_rest(cls, model: SplineModel, lanes: int | None = None) -> SplineState:
        """All zero: nothing moves, no forces.

        Args:
            model: Constant data.
            lanes: Of the rails' vectors; by default as many as suit the number of trains.
        """
        g, tables = model.ingredients, ModelTables.of(model)
        B, W = g.trains, len(g.wheel_s)
        rows = layout.CONTACT_ROWS[g.contact.patches]
        held = SplineArrays.at_rest(
            B, lanes or lanes_for(B), model.functions.count, g.seats, W, g.slots, tables.slabs, tables.cars,
            g.seat_plays is not None,
        )  # fmt: skip
        wheels = Contact(
            wheel=model.wheel,
            table=g.contact_values,
            contact=_first_contact(B, W, rows),
            force=np.zeros((B, W, rows, 4)),
            wheelset_force=np.zeros((B, W, 5)),
            rail_force=np.zeros((B, W, 2, 3)),
            iterations=np.zeros((B, W), dtype=np.int32),
        )
        bed = Bed(
            model.bed_index, model.bed_shape, model.bed_weight, model.bed_factor,
            np.zeros((g.slots, *model.bed_rest.shape[1:])),
            model.bed_lateral_K, model.bed_lateral_C, model.bed_numbers, np.zeros((B, g.slots, 2)),
        )  # fmt: skip
        return cls(tables, held, wheels, bed)

    @property
    def iterations(self) -> NDArray[np.int32]:  # type: ignore[override]
        """Most Newton iterations of each wheelset since the last reset, shape (B, W)."""
        return self.wheels.iterations

    @property
    def trains(self) -> int:
        """Trains advanced together, B."""
        return self.held.trains

    @property
    def slots(self) -> int:
        """Slabs in memory."""
        return int(self.bed.pressure.shape[1])

    @property
    def normal_force(self) -> Reals:
        """Normal force of every wheel [N], shape (B, W, 2)."""
        return self.wheels.force[..., :2, 0]

    @property
    def forces_on_rails(self) -> Reals:
        """Vertical, lateral and roll force of every wheel on its rail, shape (B, W, 2, 3)."""
        return self.wheels.rail_force

    @property
    def relative_shift(self) -> Reals:
        """Outward shift of every wheel against its rail [m], shape (B, W, 2)."""
        return self.wheels.contact[..., :2, SHIFT]

    @property
    def relative_tilt(self) -> Reals:
        """Outward tilt of every wheel against its rail [rad], shape (B, W, 2)."""
        return self.wheels.contact[..., TILT]

    @property
    def seat_forces(self) -> Reals:
        """Forces of the rails on the seats, copied: shape (B, 2, 3, seats)."""
        return self.held.seats(seats.ON_RAIL, 3)

    def widen(self, smallest: Reals, largest: Reals) -> None:
        """Widen extremes by the seats' forces of all steps since the last call."""
        np.minimum(smallest, self.held.seats(seats.SMALLEST, 3), out=smallest)
        np.maximum(largest, self.held.seats(seats.LARGEST, 3), out=largest)
        self.held.forget_extremes()

    def body_motion(self, kind: int) -> Reals:
        """Motion of the bodies, shape (B, 5 bodies)."""
        return self.held.vehicles(ROWS[kind])[:, : self.tables.model.ingredients.train.n_dof]

    def slab_motion(self, kind: int) -> Reals:
        """Motion of the slabs' coordinates, copied: shape (B, slots, dofs)."""
        rows = self.held.slabs(ROWS[kind])
        return rows.reshape(len(rows), -1, rows.shape[-1])[:, : self.slots]

    def rail_motion(self, side: int, s: float) -> Reals:
        """Motion of a rail at a place in the window, shape (2, 3, 3, B)."""
        functions, place = self.tables.model.functions.displacement, np.array([s])
        first = int(functions.weights(place)[0][0])
        weights = np.stack([functions.weights(place, derivative)[1][0] for derivative in range(3)], axis=1)
        found = np.empty((2, len(ROWS), 3, self.trains))
        for kind, row in ROWS.items():
            near = self.held.rails(row, first, len(weights))[:, side]
            for direction, field in enumerate((at.V_LATERAL, at.W)):
                found[direction, kind] = (near[..., field] @ weights).T
        return found

    def rail_deflection(self, s: Reals) -> Callable[[], Reals]:
        """Bind the vertical deflection of both rails to fixed places in the window."""
        shape = np.ascontiguousarray(self.tables.model.functions.shape(s).T)
        return lambda: np.asarray(np.ascontiguousarray(self.held.rails(at.U)[..., at.W]) @ shape)

    def squares(self) -> tuple[float, float, float]:
        """Sums of the squares of all coordinates, of their rates and of their second rates."""
        launch, of_rails, of_others = self._squares
        launch()
        u, v, a = (of_rails.sum(axis=1) + of_others.sum(axis=1)).tolist()
        return u, v, a

    @cached_property
    def _squares(self) -> tuple[VectorLaunch, Reals, Reals]:
        """The launch that sums squares, and its results by lanes."""
        held = self.held
        arrays = held.rail, held.slab, held.car, aligned_zeros((3, held.lanes)), aligned_zeros((3, 8))
        numbers = held.lanes, held.cars.blocks
        return VectorLaunch(squares_kernel, numbers, arrays, frozenset(range(5))), *arrays[3:]

    def part(self, train: int, name: str) -> Reals:
        """Coordinates of a part of one train, and their first and second rates."""
        return np.stack([self._rows_of(row, name)[train] for row in ROWS.values()])

    def _rows_of(self, row: int, name: str) -> Reals:
        if name == "vehicles":
            return self.held.vehicles(row)
        if name == "slabs":
            rows = self.held.slabs(row)
            return rows.reshape(len(rows), -1, rows.shape[-1])[:, : self.slots]
        rails = self.held.rails(row)[..., FIELDS[name]]
        return rails.reshape(*rails.shape[:2], -1)

    def put(self, kind: int, name: str, values: Reals) -> None:
        """Fill the coordinates of a part of all trains, or their rates."""
        row = ROWS[kind]
        values = np.broadcast_to(values, self._rows_of(row, name).shape)
        if name == "vehicles":
            self.held.set_vehicles(row, values)
        elif name == "slabs":
            target = self.held.slabs(row)
            for slot in range(self.slots):
                target[:, slot // 8, slot % 8] = values[:, slot]
        else:
            rails = self.held.rails(row)
            rails[..., FIELDS[name]] = values.reshape(*values.shape[:2], self.held.functions, -1)
            self.held.set_rails(row, rails)

    def put_contact(self, contact: Reals, local: Reals, wheelset: Reals, rail: Reals) -> None:
        """Take over contact states and forces, from which the next solve starts."""
        self.wheels.force[:], self.wheels.contact[:] = local, contact
        self.wheels.wheelset_force[:], self.wheels.rail_force[:] = wheelset, rail

    def clear(self, train: int) -> None:
        """Take a train whose numbers ran away out of the way: nothing moves, no forces."""
        self.held.clear(train)
        wheels = self.wheels
        for forces in (self.bed.pressure, wheels.force, wheels.wheelset_force, wheels.rail_force):
            forces[train] = 0.0
        wheels.contact[train] = _first_contact(1, *wheels.contact.shape[1:3])[0]

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """All arrays that the coming steps depend on, by name."""
        held, wheels = self.held, self.wheels
        return {
            "rail": held.rail,
            "seat": held.seat,
            "slab": held.slab,
            "slab_design": held.slab_design,
            "car": held.car,
            "pressure": self.bed.pressure,
            "bed_rest": self.bed.rest,
            "seat_play": held.seat_play,
            "contact": wheels.contact,
            "force": wheels.force,
            "wheelset_force": wheels.wheelset_force,
            "rail_force": wheels.rail_force,
            "iterations": wheels.iterations,
        }

    def enter(self, first_seat: int, first_slab: int) -> None:
        """Move the window on to its rear seat and slab: drop the slabs that it leaves, bring new ones in at rest."""
        ingredients = self.tables.model.ingredients
        if first_seat != self.first_seat:
            factors = ingredients.seat_factors(first_seat, ingredients.seats)
            self.held.set_seat_factors(np.broadcast_to(factors, (self.trains, *factors.shape)))
            if self.held.some_hang:
                self.held.set_seat_plays(*ingredients.hanging_seats(first_seat))
            self.first_seat = first_seat
        if first_slab != self.first_slab:
            slots = self.slots
            fresh = range(max(first_slab, self.first_slab + slots), first_slab + slots)
            for slab in fresh if self.first_slab >= 0 else range(first_slab, first_slab + slots):
                self.held.enter_slab(slab % slots, ingredients.designs.of_slab.get(slab, 0))
                self.bed.rest[slab % slots] = ingredients.pressure_at_rest(slab)
            self.first_slab = first_slab


def _first_contact(B: int, W: int, rows: int) -> Reals:
    """Contact states with a level contact plane, for the first force directions."""
    contact = np.zeros((B, W, rows, N_CONTACT))
    contact[..., COS] = 1.0
    return contact
