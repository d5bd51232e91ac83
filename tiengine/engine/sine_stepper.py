"""The step with sines: explicit kernels, implicit solve by dense inverses, contact, pass by pass."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.bed_pressure import fill_pressures
from tiengine.engine.chunk import Chunk
from tiengine.engine.launch import Launch
from tiengine.engine.load_rows import LoadRows
from tiengine.engine.scratch import Scratch
from tiengine.engine.sine_state import SineState
from tiengine.engine.stepper import Call, Stage, Stepper
from tiengine.kernels import layout as at
from tiengine.kernels import omitted_modes
from tiengine.kernels import step as kernels
from tiengine.model.omitted_tables import OmittedTables
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals

__all__ = ["SineStepper"]

REFACTOR = 1e-3
"""Relative change of speed at which the matrices that depend on it are made again; in between the implicit blocks and
the small gyroscopic coupling of the wheelsets' mean spin are off by a thousandth, all other forces are not."""


class SineStepper(Stepper):
    """Advances a state of sine coefficients; binds the kernels to its arrays.

    Attributes:
        model: Constant data.
        scratch: Work arrays shared by the stages.
    """

    state: SineState

    def __init__(
        self, model: SineModel, state: SineState, chunk: Chunk, *, parallel: bool = False, public: bool = False
    ):
        """Bind.

        Args:
            model: Constant data.
            state: Is advanced in place.
            chunk: Buffers.
            parallel: Trains in parallel in Taichi (worth it for many trains only).
            public: Public Taichi calls only.
        """
        super().__init__(model.ingredients, state, chunk)
        self.model, self.scratch = model, Scratch.of(model)
        passes = model.ingredients.passes
        self._tick = np.zeros((passes, at.N_TICK), dtype=np.int32)
        self._tick[:, at.PASS] = np.arange(passes)
        self._tick[-1, at.LAST_PASS] = 1
        n = model.ingredients.train.n
        self.loads = LoadRows(
            model.ingredients, model.vehicle_load, np.arange(n, dtype=np.int32), n, 1, len(chunk.clock)
        )
        self._tick[:, at.LOAD_STEP], self._tick[:, at.LOAD_TRAIN] = self.loads.step, self.loads.train
        self._launches: list[Launch] = []
        self._parallel, self._public = parallel, public
        self.factored_speed = float("nan")
        self._window = (-1, -1)
        self._odd: list[tuple[int, int]] = []
        self._explicit_bed = int(model.dims[at.MORTAR_MODE]) > 0
        self._force, self._acceleration = (
            {block: _rows(state.view(row, block)) for block in _BLOCKS} for row in (at.F, at.A)
        )
        self.bind()

    def _stages(self) -> Iterator[Stage]:
        """Stages of the step in their order; :mod:`tiengine.kernels.step` gives the equations."""
        self._launches.clear()
        yield "window and seats", self._enter
        yield from self._predict()
        yield from self._linear_forces()
        for number, tick in enumerate(self._tick):
            yield from self._motion_at_seats(number)
            if self.model.omitted is not None:
                yield "seats", self._bind_omitted(tick, self.model.omitted)
            if self._explicit_bed:
                yield "mortar", self._bind_mortar(number)
            yield "forces and contact", self._bind_forces(tick, number)
            yield from self._solve()
            yield from self._correct()
            if not tick[at.LAST_PASS]:
                yield "factors", self._bind_factors(tick)
        yield "recording", self._record_bodies

    def _enter(self) -> None:
        """Begin a step: let seats and slabs in and out where they change."""
        i = self.rows.step
        if self.moves[i]:
            self.move(i)
        self._tick[:, at.STEP] = i

    def _predict(self) -> Iterator[Stage]:
        """Predictors; shapes of the seats at their places at the end, factors of the products, rails under wheels."""
        motion = self.state.motion
        predictor = self.ingredients.newmark.predictor
        yield "predict", _product(predictor, motion[at.U : at.A + 1], motion[at.U_PREDICTED : at.LINEAR])
        yield "prepare", self._bind_prepare()

    def _linear_forces(self) -> Iterator[Stage]:
        """Convective flow of the rails; accelerations of slabs and trains by their own stiffness and damping."""
        m, k, motion, a = self.model, self.scratch, self.state.motion, self._acceleration
        own = slice(int(m.dims[at.SLABS]), None)  # columns of slabs and trains
        yield "rails", _product(_rows(k.flow[:3]), m.flow_sine, _rows(k.drift[:3]))
        yield "rails", _product(_rows(k.flow[3:]), m.flow_cosine, _rows(k.drift[3:]))
        for row, target, slab, train in zip(
            (at.U_PREDICTED, at.V_PREDICTED), (motion[at.LINEAR, own], k.damped), m.slab_linear,
            m.blocks.vehicle_linear, strict=True,
        ):  # fmt: skip
            of_slabs, of_trains = target[: a["slabs"].size], target[a["slabs"].size :]
            slabs, trains = (_rows(self.state.view(row, block)) for block in ("slabs", "vehicles"))
            yield "slabs", self._by_design(slabs, slab, of_slabs.reshape(a["slabs"].shape))
            yield "trains", _product(trains, train, of_trains.reshape(a["vehicles"].shape))
        yield "slabs", partial(np.add, motion[at.LINEAR, own], k.damped, motion[at.LINEAR, own])

    def _motion_at_seats(self, number: int) -> Iterator[Stage]:
        """Forces at the seats by the motion of rails and slabs, slabs at the predictors in the first pass."""
        m, k = self.model, self.scratch
        pull = k.slab_pull[min(number, 1)]
        yield "seats", _product(_rows(k.rail_factor), k.seat_shape, _rows(k.rail_pull))
        yield "seats", _product(_rows(k.slab_factor), m.slab_seats, pull.reshape(self._seats_on_slabs.shape))

    def _solve(self) -> Iterator[Stage]:
        """Accelerations a = A^-1 F, block by block."""
        m, blocks, motion, F, a = self.model, self.model.blocks, self.state.motion, self._force, self._acceleration
        own = slice(int(m.dims[at.SLABS]), None)
        yield "solve", _product(F["vertical"], blocks.vertical, a["vertical"])
        yield "solve", _product(F["lateral"], blocks.lateral, a["lateral"])
        yield "solve", _product(F["vehicles"], blocks.vehicle, a["vehicles"])
        yield "solve", self._by_design(self._seats_on_slabs, m.slab_push, a["slabs"])
        if self._explicit_bed:
            yield "solve", self._by_design(F["slabs"], m.slab_inverse, a["slabs"], add=True)
        yield "solve", partial(np.add, motion[at.A, own], motion[at.LINEAR, own], motion[at.A, own])

    def _correct(self) -> Iterator[Stage]:
        """Displacements and velocities at the end of the step."""
        motion = self.state.motion
        yield "correct", _product(self.ingredients.newmark.corrector, motion[at.A : at.LINEAR], motion[at.U : at.A])

    @property
    def _seats_on_slabs(self) -> Reals:
        """Forces of the seats on the slabs as right-hand sides, shape (B slots, 5 seats a slab)."""
        return self.scratch.slab_force.reshape(len(self._acceleration["slabs"]), -1)

    def _launch(self, kernel: Any, *arrays: NDArray[Any], static: tuple[Any, ...] = ()) -> Launch:
        launch = Launch(kernel, (self._parallel, *static), arrays, public=self._public)
        self._launches.append(launch)
        return launch

    def _bind_prepare(self) -> Launch:
        m, k = self.model, self.scratch
        return self._launch(
            kernels.prepare, self._tick[0], m.dims, m.constants, self.chunk.clock, m.seat_table, m.wheel_shape,
            self.state.motion, k.seat_shape, k.flow, k.rail_factor, k.slab_factor, k.rail_predicted,
        )  # fmt: skip

    def _bind_factors(self, tick: NDArray[np.int32]) -> Launch:
        m, k = self.model, self.scratch
        return self._launch(
            kernels.factors,
            tick,
            m.dims,
            m.constants,
            self.chunk.clock,
            self.state.motion,
            k.rail_factor,
            k.slab_factor,
        )

    def _bind_omitted(self, tick: NDArray[np.int32], tables: OmittedTables) -> Launch:
        m, s, k = self.model, self.state, self.scratch
        return self._launch(
            omitted_modes.add_omitted_modes, tick, m.dims, m.constants, self.chunk.clock, tables.by_wheel,
            tables.by_seat, tables.by_place, tables.wheel_s, s.seat_scale, k.slab_pull, s.seat_force, s.rail_force,
            s.omitted, k.sines_under, k.rail_pull, k.rail_predicted,
        )  # fmt: skip

    def _bind_forces(self, tick: NDArray[np.int32], number: int) -> Launch:
        m, s, k, b, chunk = self.model, self.state, self.scratch, self.model.blocks, self.chunk
        train, table = self.ingredients.train, self.ingredients.contact_values
        return self._launch(
            kernels.forces_and_contact, tick, _ITERATE if number else _PREDICTED, m.dims, m.constants, chunk.clock,
            m.stiffness, k.drift, s.seat_scale, k.seat_shape, k.rail_pull, k.slab_pull, self.loads.array,
            train.wheelset_dof, m.wheel, train.element_index, train.element_row, train.element_kind,
            train.element_linear, train.element_table, table, chunk.irregularity, m.wheel_shape, b.wheelset_compliance,
            b.rail_coupling, b.rail_answer, b.vehicle_answer, s.motion, s.seat_force, k.slab_force, k.rail_predicted,
            s.contact, s.force, s.wheelset_force, s.rail_force, s.iterations, chunk.wheel,
            static=(self.ingredients.contact.patches, int(self.ingredients.contacts is not None)),
        )  # fmt: skip

    def _bind_mortar(self, number: int) -> Launch:
        m, s = self.model, self.state
        return self._launch(
            kernels.mortar_forces, _ITERATE if number else _PREDICTED, m.dims, s.design, m.bed_index, m.bed_shape,
            m.bed_weight, m.bed_factor, m.bed_rest, m.bed_lateral_K, m.bed_lateral_C, m.bed_numbers, s.motion,
            s.pressure,
        )  # fmt: skip

    def _record_bodies(self) -> None:
        """Copy the bodies' motion and the bed's, if this step records them."""
        row = self.rows.body
        if row < 0:
            return
        chunk, state = self.chunk, self.state
        for kind in range(3):
            chunk.body[:, row, kind] = state.body_motion(kind)
            chunk.slab[:, row, kind] = state.slab_motion(kind)
        chunk.rear_slab[row] = state.first_slab
        if self._explicit_bed:
            chunk.mortar[:, row] = state.pressure

    def finish(self, body_rows: int) -> None:
        """Compute the pressures of a wholly implicit bed."""
        self.chunk.filled = body_rows
        if not self._explicit_bed:  # else they are known from the forces
            fill_pressures(self.model, self.chunk)

    def _by_design(
        self, factor: NDArray[np.float64], matrices: NDArray[np.float64], out: NDArray[np.float64], add: bool = False
    ) -> Call:
        """Product of all slabs with the sound design's matrix, then of those that have another with their own."""
        slots = self.state.slots
        sound, target = matrices[0], np.empty_like(out) if add else out

        def product() -> None:
            np.dot(factor, sound, out=target)
            for slot, kind in self._odd:
                target[slot::slots] = factor[slot::slots] @ matrices[kind]
            if add:
                np.add(out, target, out=out)

        return product

    def compile(self) -> float:
        """Compile all kernels by launching them for no train.

        Returns:
            Wall time [s]; small when Taichi finds them in its cache on disk.
        """
        clock = time.perf_counter()
        dims = self.model.dims
        trains, dims[at.TRAINS] = int(dims[at.TRAINS]), 0
        for launch in self._launches:
            launch()
        dims[at.TRAINS] = trains
        return time.perf_counter() - clock + sum(launch.compile_seconds for launch in self._launches)

    def move(self, i: int) -> None:
        """Let seats and slabs in and out at step ``i``; factorise again when the speed has changed enough."""
        clock = self.chunk.clock[i]
        window, V = (int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB])), float(clock[at.SPEED])
        if window != self._window:  # the first step too: the start has let the first slabs in
            self._window = window
            self.state.enter(*window)
            self._odd = [(int(slot), int(self.state.design[0, slot])) for slot in np.flatnonzero(self.state.design[0])]
        factored = self.factored_speed
        if V != factored and not abs(V - factored) < REFACTOR * factored:
            self.factor(V)

    def factor(self, V: float) -> None:
        """Make the matrices that depend on the speed V [m/s]."""
        self.model.refactor(V)
        self.factored_speed = V


def _rows(array: NDArray[np.float64]) -> NDArray[np.float64]:
    return array.reshape(-1, array.shape[-1])


def _product(factor: NDArray[np.float64], matrix: NDArray[np.float64], out: NDArray[np.float64]) -> Call:
    """The call that fills ``out`` with factor @ matrix."""
    return partial(np.dot, factor, matrix, out)


_BLOCKS = ("vertical", "lateral", "slabs", "vehicles")
_PREDICTED = np.array([at.U_PREDICTED, at.V_PREDICTED], dtype=np.int32)
_ITERATE = np.array([at.U, at.V], dtype=np.int32)
