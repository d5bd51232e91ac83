"""The spline step, bound to its arrays: one launch advances all trains of a group by one step or several."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.load_rows import LoadRows
from tiengine.engine.lookout import Lookout
from tiengine.engine.spline_arrays import SplineArrays
from tiengine.engine.spline_tables import RailTables, SeatTables, SlabTables, Spans
from tiengine.engine.vector_mode import VectorLaunch
from tiengine.kernels import layout
from tiengine.kernels import spline_layout as at
from tiengine.kernels.spline_step import step_kernel

__all__ = ["Bed", "Contact", "SplineStep", "Suspension"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Suspension:
    """Nonlinear elements, see ``tiengine.kernels.suspension``; places are in ``CarTables``.

    Attributes:
        row: Elongation by coordinate, shape (n_e, 12).
        kind: 0 force of the rate, 1 of the elongation, shape (n_e,).
        linear: Slope that stands in C or K, shape (n_e,).
        table: Points (abscissa, force), shape (n_e, points, 2).
    """

    row: Floats
    kind: Ints
    linear: Floats
    table: Floats


@dataclass(frozen=True, eq=False)
class Contact:
    """Arrays that the contact solve reads and leaves, shapes as ``engine.sine_state`` and ``model.model`` have them.

    Attributes:
        wheel: Numbers of each wheelset, shape (W, N_WHEEL_NUMBERS).
        table: Contact geometry, shape (tables n_u, n_alpha, N_TABLE patches).
        contact: Contact states, shape (B, W, CONTACT_ROWS, N_CONTACT).
        force: N, Fx, Fy, Mz on the wheels, shape (B, W, CONTACT_ROWS, 4).
        wheelset_force: On y, z, roll, pitch, yaw, shape (B, W, 5).
        rail_force: On w, v, theta_x, shape (B, W, 2, 3).
        iterations: Most Newton iterations, shape (B, W).
    """

    wheel: Floats
    table: Floats
    contact: Floats
    force: Floats
    wheelset_force: Floats
    rail_force: Floats
    iterations: Ints

    @property
    def patches(self) -> int:
        """Patches a wheel can have."""
        return int(self.table.shape[2]) // layout.N_TABLE

    @property
    def own(self) -> int:
        """1 if wheels have radii and contact tables of their own."""
        return int(self.wheel[0, layout.RADIUS_LEFT] > 0.0)


@dataclass(frozen=True, eq=False)
class Bed:
    """Bed of the slabs where it is not wholly implicit, shapes as ``model.model`` has them.

    Attributes:
        index, shape, weight: Quadrature.
        factor: Factors by design.
        rest: Pressures at rest of the slab in each slot [Pa], shape (slots, n_el, n_q); set as slabs enter.
        lateral_K, lateral_C: Lateral bed by design, shape (designs, 2, 2).
        numbers: k_m, c_m, explicit, no tension.
        pressure: Largest and smallest pressure of each slab [Pa], shape (B, slots, 2); filled.
    """

    index: Ints
    shape: Floats
    weight: Floats
    factor: Floats
    rest: Floats
    lateral_K: Floats
    lateral_C: Floats
    numbers: Floats
    pressure: Floats


class SplineStep:
    """Whole steps in one launch.

    Attributes:
        state: What is advanced, in place.
        job: First step, number of steps, stages (``spline_layout``) of the next launch.
        limits: Limits of a sound state, see ``spline_layout``, shape (N_LIMITS,).
        one_chunk: Whether all trains are in one chunk, so that a launch can stop between two steps.
        record: Row of the bodies' record that each step fills, -1 for none, shape (steps,).
        launch: The bound kernel; ``launch.vector_mode`` tells how it was compiled.
    """

    def __init__(
        self,
        state: SplineArrays,
        dims: Ints,
        constants: Floats,
        passes: int,
        rails: RailTables,
        spans: Spans,
        seats: SeatTables,
        slabs: SlabTables,
        suspension: Suspension,
        contact: Contact,
        clock: Floats,
        irregularity: Floats,
        wheel_record: Floats,
        body_record: Floats,
        slab_record: Floats,
        bed: Bed,
        loads: LoadRows,
        slab_inertia: Floats | None = None,
    ):
        """Bind.

        Args:
            state: What is advanced.
            dims: TRAINS, WHEELSETS, SEATS_PER_SLAB, SLOTS, MORTAR_MODE, CROSS_LEVEL_ROLLS are read, see ``layout``.
            constants: Numbers, see ``layout``.
            passes: Passes a step.
            rails: Tables of the rails.
            spans: The knots' spans.
            seats: Tables of the seats.
            slabs: Tables of the slabs.
            suspension: Nonlinear elements.
            contact: Arrays of the contact.
            clock: Window at the end of each step, shape (steps, N_CLOCK); loads of rails follow where the ground moves.
            irregularity: Track channels at the wheelsets, shape (B, steps, W, N_IRREGULARITY or N_SHAPED).
            wheel_record: Wheel output of every step, shape (B, steps, W, 2, N_WHEEL_RECORD).
            body_record: Displacement, velocity, acceleration of the bodies, shape (B, rows, 3, 5 bodies).
            slab_record: Displacement, velocity, acceleration of every slab coordinate where the bodies are recorded,
                vectors, shape (B rows groups N 3, 8).
            bed: Bed, read if MORTAR_MODE is not 0.
            loads: Loads of cars and slabs.
            slab_inertia: Inertia force of a slab's coordinates by unit acceleration of the ground, shape (N,), where it
                moves in time.
        """
        cars = state.cars
        size = np.zeros(at.N_SIZE, dtype=np.int32)
        size[at.CHUNKS], size[at.FUNCTIONS] = -(-2 * state.trains // state.lanes), state.functions
        size[at.SEATS], size[at.SLAB_DOFS], size[at.PASSES] = len(seats.place), state.slab_dofs, passes
        size[at.GROUPS] = -(-int(dims[layout.SLOTS]) // 8)
        size[at.CARS], size[at.CAR_DOFS], size[at.ELEMENTS] = len(cars.car), cars.dofs, len(suspension.kind)
        size[at.LOAD_STEP], size[at.LOAD_TRAIN] = loads.step // 8, loads.train // 8
        size[at.LOAD_GROUND] = loads.ground // 8
        moving = slab_inertia is not None
        slab_rows = np.zeros((4, slabs.dofs))  # the last is read where the ground moves
        slab_rows[3] = slab_inertia if slab_inertia is not None else 0.0
        car_load = loads.array.reshape(-1, 8)
        self.state, self.size = state, size
        self.job = np.zeros(at.N_JOB, dtype=np.int32)
        self.job[at.STEPS], self.job[at.STAGES] = 1, at.ALL_STAGES
        self.limits, self._stopped = np.zeros(at.N_LIMITS), np.full(1, -1, dtype=np.int32)
        self.one_chunk = bool(size[at.CHUNKS] == 1)
        self.record = np.full(len(clock), -1, dtype=np.int32)
        arrays = (
            self.job, self.limits, self._stopped, self.record, size, dims, constants, clock,
            state.rail, rails.coefficient,
            state.seat, state.seat_play, seats.point, spans.span, seats.place, seats.shape,
            state.slab, state.slab_seat, state.slab_design, slab_record, slabs.coefficient,
            slabs.seat_index, slabs.seat_shape, slabs.seat_x,
            state.car, cars.columns, car_load, cars.columns_start, cars.vehicle_place, cars.wheelset_place,
            cars.element_place,
            suspension.row, suspension.kind, suspension.linear, suspension.table,
            state.under, rails.wheel_place, rails.wheel_shape, rails.wheel_rows, contact.wheel, contact.table,
            irregularity, cars.wheelset_compliance, rails.coupling, contact.contact, contact.force,
            contact.wheelset_force, contact.rail_force, contact.iterations, wheel_record,
            body_record, bed.index, bed.shape, bed.weight, bed.factor, bed.rest, bed.lateral_K, bed.lateral_C,
            bed.numbers, slab_rows, bed.pressure,
        )  # fmt: skip
        vectors = (state.rail, state.seat, state.seat_play, state.under, state.slab, state.slab_seat,
                   state.slab_design, slab_record, state.car, cars.columns, car_load)  # fmt: skip
        shaped = int(irregularity.shape[-1] > layout.N_IRREGULARITY)
        self.launch = VectorLaunch(
            step_kernel,
            (
                state.lanes,
                slabs.half_width,
                cars.blocks,
                contact.patches,
                shaped,
                int(moving),
                contact.own,
                int(state.some_hang),
            ),
            arrays,
            frozenset(i for i, array in enumerate(arrays) if any(array is vector for vector in vectors)),
        )

    def __call__(self, first: int, steps: int = 1) -> None:
        """Advance to the end of step ``first + steps - 1`` of the chunk; no seat or slab may enter within."""
        self.job[at.FIRST_STEP], self.job[at.STEPS] = first, steps
        self.launch()

    def up_to_check(self, first: int, steps: int, lookout: Lookout) -> tuple[int, bool]:
        """Advance likewise, but not beyond a step after which a guard must check the state.

        Args:
            first: Row of the first step.
            steps: Steps at most.
            lookout: Where to stop; its limits must be in :attr:`limits`.

        Returns:
            Row of the next step, and whether the state must be checked before it.
        """
        self.job[at.LOOK_EVERY], self.job[at.STEPS_BEFORE] = lookout.every, lookout.steps_before
        self.job[at.LOOK_ALWAYS], self._stopped[0] = lookout.always, -1
        self(first, steps)
        stopped, self._stopped[0], self.job[at.LOOK_EVERY] = int(self._stopped[0]), -1, 0
        return (stopped + 1, True) if stopped >= 0 else (first + steps, False)
