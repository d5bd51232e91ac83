"""The step with splines: all trains of a group advanced by one launch."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tiengine.engine.chunk import Chunk
from tiengine.engine.load_rows import LoadRows
from tiengine.engine.spline_state import SplineState
from tiengine.engine.spline_step import SplineStep, Suspension
from tiengine.engine.stepper import Stage, Stepper
from tiengine.kernels import layout as at
from tiengine.model.spline_model import SplineModel

__all__ = ["SplineStepper"]

REFACTOR = 1e-3
"""Relative change of speed at which the tables that depend on it are made again; in between the convective terms of
the rails and the gyroscopic pair of the wheelsets' mean spin are off by a thousandth, all other forces are not. The
rails' inertia -mu dV/dt u' is left out: at 1 m/s^2 it is a millionth of the fastenings' forces."""


class SplineStepper(Stepper):
    """Advances a state of spline coefficients.

    Attributes:
        model: Constant data.
        launch: The step, bound to the arrays of state and chunk.
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
        cars = tables.cars
        width = 8 * cars.blocks * len(cars.car)
        self.loads = LoadRows(model.ingredients, model.vehicle_load, cars.load_place, width, 8, len(chunk.clock))
        self.launch = SplineStep(
            state.held, model.dims, model.constants, model.ingredients.passes, tables.rails, tables.spans,
            tables.seats, tables.slabs,
            Suspension(train.element_row, train.element_kind, train.element_linear, train.element_table),
            state.wheels, chunk.clock, chunk.irregularity, chunk.wheel, chunk.body, state.bed,
            self.loads,
        )  # fmt: skip
        self._compiled = self.launch.launch.compile_seconds
        self.factored_speed = float("nan")
        self._window = (-1, -1)
        self._pending = 0
        self._explicit_bed = int(model.dims[at.MORTAR_MODE]) > 0
        rows, dofs = chunk.body.shape[1], state.tables.slabs.dofs
        groups = -(-state.slots // 8)
        self._bed = np.zeros((state.trains, rows, groups, dofs, 8))
        self._design = np.zeros((rows, state.slots), dtype=np.int64)
        self.bind()

    @property
    def seat_extremes_due(self) -> bool:
        """Whether the seats move on before the next step, or the chunk ends: the launch keeps extremes until then."""
        coming = self.rows.step + 1
        return coming >= len(self.moves) or self._changes(coming) != (False, False)

    def _stages(self) -> Iterator[Stage]:
        """Stages of the step in their order; :mod:`tiengine.kernels.spline_step` gives the equations."""
        yield "window and seats", self._enter
        yield "step", self._advance
        yield "recording", self._record_bed

    def _enter(self) -> None:
        """Let seats and slabs in and out where they change; factorise again when the speed has changed enough."""
        window, speed = self._changes(self.rows.step)
        clock = self.chunk.clock[self.rows.step]
        if window:
            self._window = int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB])
            self.state.enter(*self._window)
        if speed:
            self.factor(float(clock[at.SPEED]))

    def _changes(self, i: int) -> tuple[bool, bool]:
        """Whether seats or slabs move on, and whether tables are to be made for another speed, before step ``i``."""
        if not self.moves[i]:
            return False, False
        clock, factored = self.chunk.clock[i], self.factored_speed
        V = float(clock[at.SPEED])
        window = (int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB])) != self._window
        return window, V != factored and not abs(V - factored) < REFACTOR * factored

    def _advance(self) -> None:
        """Take this step, with those put off before it, unless nothing reads the state after it."""
        i, wheel_row, body_row = self.rows
        self.launch.record[i] = wheel_row, body_row
        self._pending += 1
        if body_row >= 0 or self.watched or self.seat_extremes_due:
            self.launch(i + 1 - self._pending, self._pending)
            self._pending = 0

    def _record_bed(self) -> None:
        """Keep the bed's motion, or its pressures, if this step records the bodies."""
        row = self.rows.body
        if row < 0:
            return
        state = self.state
        if self._explicit_bed:
            self.chunk.mortar[:, row] = state.bed.pressure
            return
        self._bed[:, row] = state.held.bed_motion(*self.model.bed_numbers[:2])
        self._design[row] = state.held.designs[: state.slots]

    def finish(self, body_rows: int) -> None:
        """Extreme pressures of a wholly implicit bed, where the bodies were recorded.

        At rest they are those of the slab's weight; k u + c v adds to them. One product for a whole chunk of steps.
        """
        m, rows = self.model, body_rows
        if rows == 0 or self._explicit_bed:  # then they are known from the forces
            return
        kinds = self._design[:rows].ravel()
        factor, at_rest = (values.reshape(len(values), -1)[kinds] for values in (m.bed_factor, m.bed_rest))
        for bed, out in zip(self._bed[:, :rows], self.chunk.mortar[:, :rows], strict=True):
            by_slot = bed.transpose(0, 1, 3, 2).reshape(rows, -1, bed.shape[2])[:, : self.state.slots]
            pressure = by_slot.reshape(len(kinds), -1) @ m.bed_points
            pressure *= factor
            pressure += at_rest
            out[..., 0] = pressure.max(axis=1).reshape(out.shape[:2])
            out[..., 1] = pressure.min(axis=1).reshape(out.shape[:2])

    def compile(self) -> float:
        """Wall time of compiling the kernel [s]; it was compiled when it was bound."""
        return self._compiled

    def factor(self, V: float) -> None:
        """Make the tables that depend on the speed V [m/s]."""
        self.state.tables.factor(V)
        self.factored_speed = V
