"""The step with splines: all trains of a group advanced by one launch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tiengine.engine.aligned import aligned_zeros
from tiengine.engine.bed_pressure import fill_pressures
from tiengine.engine.chunk import Chunk
from tiengine.engine.load_rows import LoadRows
from tiengine.engine.lookout import Lookout
from tiengine.engine.moving_ground import MovingGround
from tiengine.engine.spline_state import SplineState
from tiengine.engine.spline_step import SplineStep, Suspension
from tiengine.engine.stepper import Plan, Rows, Stage, Stepper
from tiengine.kernels import layout as at
from tiengine.model.spline_model import SplineModel
from tiengine.parameters.arrays import Flags, Reals
from tiengine.vehicle.given_loads import GivenLoads

__all__ = ["SplineStepper"]

Window = tuple[int, int]
"""Rear seat and slab."""

REFACTOR = 1e-3
"""Relative change of speed at which the tables that depend on it are made again; in between the convective terms of
the rails and the gyroscopic pair of the wheelsets' mean spin are off by a thousandth, all other forces are not. The
rails' inertia -mu dV/dt u' is left out: at 1.5 m/s^2 it moves a rail by 3e-6 of its deflection at most (MODEL §1)."""


class SplineStepper(Stepper):
    """Advances a state of spline coefficients.

    Attributes:
        model: Constant data.
        launch: The step, bound to the arrays of state and chunk.
        ground: Forces on rails and slabs where the ground moves in time, else None.
    """

    state: SplineState

    def __init__(self, model: SplineModel, state: SplineState, chunk: Chunk):
        """Bind.

        Args:
            model: Constant data.
            state: Is advanced in place.
            chunk: Buffers.
        """
        super().__init__(model.ingredients, state, chunk)
        self.model, train, tables = model, model.ingredients.train, state.tables
        rows = chunk.body.shape[1] * state.held.groups * state.held.slab_dofs * 3
        self._slab_record = aligned_zeros((state.trains * rows, 8))
        cars = tables.cars
        width = 8 * cars.blocks * len(cars.car)
        moving = model.ingredients.moving_ground
        self.ground = None if moving is None else MovingGround(moving.record, model.ingredients)
        slots = 8 * state.held.groups if self.ground else 0
        self.loads = LoadRows(model.ingredients, model.vehicle_load, cars.load_place, width, 8, len(chunk.clock), slots)
        self.launch = SplineStep(
            state.held, model.dims, model.constants, model.ingredients.passes, tables.rails, tables.spans,
            tables.seats, tables.slabs,
            Suspension(train.element_row, train.element_kind, train.element_linear, train.element_table),
            state.wheels, chunk.clock, chunk.irregularity, chunk.wheel, chunk.body,
            self._slab_record, state.bed, self.loads, None if self.ground is None else self.ground.slab_inertia,
        )  # fmt: skip
        self._compiled = self.launch.launch.compile_seconds
        self.factored_speed = float("nan")
        self._window = (-1, -1)
        self._first = 0
        self._lookout: Lookout | None = None
        self._planned: Plan | None = None
        self._stays_end = np.zeros(0, dtype=np.bool_)
        self._explicit_bed = int(model.dims[at.MORTAR_MODE]) > 0
        self.bind()

    def load(
        self, X: Reals, V: Reals, V_rate: Reals, irregularity: Reals, given: GivenLoads | None = None,
        time: Reals | None = None,
    ) -> None:  # fmt: skip
        """See :meth:`Stepper.load`; where the ground moves, rails and slabs are loaded as well."""
        super().load(X, V, V_rate, irregularity, given, time)
        if self.ground is not None:
            assert time is not None
            clock = self.chunk.clock[: len(X)]
            clock[:, at.N_CLOCK :] = self.ground.on_rails(time, X)
            self.loads.move_ground(self.ground.under_slabs(time, clock[:, at.FIRST_SLAB]))

    def seat_extremes_due(self, plan: Plan) -> Flags:
        """Steps after which the seats move on, and the last of a chunk: launches keep the extremes until then."""
        if self._planned is not plan:
            self._planned, self._stays_end = plan, self._ends_of_stays(plan)
        return self._stays_end

    def _ends_of_stays(self, plan: Plan) -> Flags:
        """Find the steps after which window or tables change, once for all that ask about a plan."""
        due = np.ones(len(self.moves) + 1, dtype=np.bool_)
        window, factored = self._window, self.factored_speed
        for i in np.flatnonzero(self.moves).tolist():
            if i >= plan.step[0]:
                due[i], window, factored = self._changes(i, window, factored)
        due[:-1] &= self.moves
        return due[plan.step + 1]

    def take(self, plan: Plan) -> None:
        """Take the planned steps, each launch up to the next one after which something reads the state."""
        due = [each(plan) for each in self.due]
        pressures = (plan.body >= 0) & self._explicit_bed
        reads = np.logical_or.reduce([pressures, self.seat_extremes_due(plan), *due])
        reads[-1:] = True
        self._will_record(plan)
        first = 0
        for last in np.flatnonzero(reads).tolist():
            self._first, self.rows = int(plan.step[first]), Rows(*(int(values[last]) for values in plan))
            self.call((*self.stages, *(w for w, each in zip(self.watchers, due, strict=True) if each[last])))
            first = last + 1
        self._planned = None  # the next one may be the same object, from another place

    def _will_record(self, plan: Plan) -> None:
        """Set the rows of the record that steps fill, and the rear slab then."""
        self.launch.record[plan.step] = plan.body
        taken = plan.body >= 0
        self.chunk.rear_slab[plan.body[taken]] = self.chunk.clock[plan.step[taken], at.FIRST_SLAB]

    def step(self, i: int, wheel_row: int = -1, body_row: int = -1) -> None:
        """Take one step."""
        self._first = i
        self._will_record(Plan(*(np.array([row]) for row in (i, wheel_row, body_row))))
        super().step(i, wheel_row, body_row)

    def _stages(self) -> Iterator[Stage]:
        """Stages of the step in their order; :mod:`tiengine.kernels.spline_step` gives the equations."""
        yield "window and seats", self._enter
        yield "step", self._advance
        if self._explicit_bed:
            yield "recording", self._record_pressure

    def _enter(self) -> None:
        """Let seats and slabs in and out where they change; factorise again when the speed has changed enough."""
        if not self.moves[self._first]:
            return
        _, window, V = self._changes(self._first, self._window, self.factored_speed)
        if window != self._window:
            self._window = window
            self.state.enter(*window)
        if V != self.factored_speed:
            self.factor(V)

    def _changes(self, i: int, window: Window, factored: float) -> tuple[bool, Window, float]:
        """Whether anything changes before step ``i``, its rear seat and slab, the speed that its tables are made for.

        Args:
            i: Row of the chunk.
            window: Rear seat and slab before it.
            factored: Speed that the tables were made for before it [m/s].
        """
        clock = self.chunk.clock[i]
        moved, V = (int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB])), float(clock[at.SPEED])
        if abs(V - factored) < REFACTOR * factored:
            V = factored
        return moved != window or V != factored, moved, V

    def look_out(self, lookout: Lookout) -> bool:
        """Let launches stop where a guard must check the state; see the base class."""
        if not self.launch.one_chunk:
            return False
        self._lookout = lookout
        self.launch.limits[:] = lookout.limits
        return True

    def _advance(self) -> None:
        """Take the steps of a launch, in several ones where a guard must check the state in between."""
        first, end = self._first, self.rows.step + 1
        if self._lookout is None:
            self.launch(first, end - first)
        else:
            while first < end:
                first, check = self.launch.up_to_check(first, end - first, self._lookout)
                if check:
                    self._lookout.check(first - 1)

    def _record_pressure(self) -> None:
        """Keep the pressures of an explicit bed if this step records the bodies."""
        if self.rows.body >= 0:
            self.chunk.mortar[:, self.rows.body] = self.state.bed.pressure

    def finish(self, body_rows: int) -> None:
        """Put the record of the slabs into the chunk; pressures of a wholly implicit bed."""
        self.chunk.filled = body_rows
        held, slots = self.state.held, self.state.slots
        shape = (held.trains, -1, held.groups, held.slab_dofs, 3, 8)
        recorded = self._slab_record.reshape(shape)[:, :body_rows].transpose(0, 1, 2, 4, 5, 3)
        for group in range(held.groups):  # without a copy of the record in between
            first = 8 * group
            lanes = min(slots - first, 8)
            self.chunk.slab[:, :body_rows, :, first : first + lanes] = recorded[:, :, group, :, :lanes]
        if not self._explicit_bed:  # else they are known from the forces
            fill_pressures(self.model, self.chunk)

    def compile(self) -> float:
        """Wall time of compiling the kernel [s]; it was compiled when it was bound."""
        return self._compiled

    def factor(self, V: float) -> None:
        """Make the tables that depend on the speed V [m/s]."""
        self.state.tables.factor(V)
        self.factored_speed = V
