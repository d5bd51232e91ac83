"""One time step of a group of trains: explicit kernels, implicit solve, contact, pass by pass."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.launch import Launch
from tiengine.engine.scratch import Scratch
from tiengine.engine.state import State, positions
from tiengine.kernels import layout as at
from tiengine.kernels import step as kernels
from tiengine.model.model import Model

__all__ = ["Chunk", "Stepper"]

REFACTOR = 1e-3
"""Relative change of speed at which what depends on it is made anew; in between the implicit blocks and the small
gyroscopic coupling of the wheelsets' mean spin are a thousandth old, all other forces are not."""


@dataclass(eq=False)
class Chunk:
    """What the kernels read and write over a number of steps.

    Attributes:
        clock: Window at the end of each step, shape (steps, N_CLOCK).
        irregularity: Track channels at the wheelsets, shape (B, steps, W, N_IRREGULARITY).
        wheel: Recorded wheel output, shape (B, rows, W, 2, N_WHEEL).
        body: Recorded displacement, velocity, acceleration of the bodies, shape (B, rows, 3, 5 bodies).
        mortar: Largest and smallest pressure of each slab [Pa], with the bodies, shape (B, rows, slots, 2).
        bed: What the bed feels then, k u + c v of all slab coordinates, shape (B, rows, slots dofs).
        design: Design of the slab in each slot then, shape (rows, slots).
    """

    clock: NDArray[np.float64]
    irregularity: NDArray[np.float64]
    wheel: NDArray[np.float64]
    body: NDArray[np.float64]
    mortar: NDArray[np.float64]
    bed: NDArray[np.float64]
    design: NDArray[np.int32]

    @classmethod
    def empty(cls, model: Model, steps: int, wheel_rows: int, body_rows: int) -> Chunk:
        """Buffers for ``steps`` steps of which some are recorded."""
        d = model.dims
        B, W, bodies, slots = (int(d[size]) for size in (at.TRAINS, at.WHEELSETS, at.BODIES, at.SLOTS))
        return cls(
            clock=np.zeros((steps, at.N_CLOCK)),
            irregularity=np.zeros((B, steps, W, at.N_IRREGULARITY)),
            wheel=np.zeros((B, max(wheel_rows, 1), W, 2, at.N_WHEEL)),
            body=np.zeros((B, max(body_rows, 1), 3, 5 * bodies)),
            mortar=np.zeros((B, max(body_rows, 1), slots, 2)),
            bed=np.zeros((B, max(body_rows, 1), slots * int(d[at.SLAB_DOFS]))),
            design=np.zeros((max(body_rows, 1), slots), dtype=np.int32),
        )


class Stepper:
    """Advances a state; binds the kernels to its arrays.

    Attributes:
        scratch: What the stages leave for one another.
        stages: Name and call of what one step does, pass by pass, in this order; those who watch the step add theirs.
        factored_speed: Speed for which what depends on it was made [m/s].
        asked: Rows that the step is to fill: of the chunk, of the wheels' record, of the bodies' (-1 none).
    """

    def __init__(self, model: Model, state: State, chunk: Chunk, *, parallel: bool = False, public: bool = False):
        """Bind.

        Args:
            model: Constant data.
            state: What is advanced, in place.
            chunk: Buffers.
            parallel: Trains in parallel in Taichi (worth it for many trains only).
            public: Public Taichi calls only.
        """
        self.model, self.state, self.chunk = model, state, chunk
        self.scratch = Scratch.of(model)
        self._tick = np.zeros((model.ingredients.passes, at.N_TICK), dtype=np.int32)
        self._tick[:, at.PASS] = np.arange(model.ingredients.passes)
        self._tick[-1, at.LAST_PASS] = 1
        self._launches: list[Launch] = []
        self._parallel, self._public = parallel, public
        self.factored_speed = float("nan")
        self._window = (-1, -1)
        self._odd: list[tuple[int, int]] = []
        self._slabs = slice(int(model.dims[at.SLABS]), int(model.dims[at.VEHICLES]))
        self._moves = np.zeros(0, dtype=np.bool_)
        self.asked = (-1, -1, -1)
        self._vehicles = [state.view(row, "vehicles") for row in (at.U, at.V, at.A)]
        self.stages = tuple(self._stages())

    def _launch(self, kernel: Any, *arrays: NDArray[Any]) -> Launch:
        launch = Launch(kernel, (self._parallel,), arrays, public=self._public)
        self._launches.append(launch)
        return launch

    def _stages(self) -> Iterator[tuple[str, Callable[[], object]]]:
        """The step: see :mod:`tiengine.kernels.step`."""
        m, k, blocks, motion = self.model, self.scratch, self.model.blocks, self.state.motion
        newmark = m.ingredients.newmark
        F, a = ({block: self._flat(row, block) for block in _BLOCKS} for row in (at.F, at.A))
        own = slice(int(m.dims[at.SLABS]), None)  # columns of slabs and trains
        rails, slabs, forces = _rows(k.rail_factor), _rows(k.slab_factor), k.slab_force.reshape(len(a["slabs"]), -1)

        yield "predict", _product(newmark.predictor, motion[at.U : at.A + 1], motion[at.U_PREDICTED : at.LINEAR])
        yield "prepare", self._bind_prepare()
        yield "rails", _product(_rows(k.flow[:3]), m.flow_sine, _rows(k.drift[:3]))
        yield "rails", _product(_rows(k.flow[3:]), m.flow_cosine, _rows(k.drift[3:]))
        for row, target, slab, train in zip(
            (at.U_PREDICTED, at.V_PREDICTED), (motion[at.LINEAR, own], k.damped), m.slab_linear, blocks.vehicle_linear,
            strict=True,
        ):  # fmt: skip
            of_slabs, of_trains = target[: a["slabs"].size], target[a["slabs"].size :]
            yield "slabs", self._by_design(self._flat(row, "slabs"), slab, of_slabs.reshape(a["slabs"].shape))
            yield "trains", _product(self._flat(row, "vehicles"), train, of_trains.reshape(a["vehicles"].shape))
        yield "slabs", partial(np.add, motion[at.LINEAR, own], k.damped, motion[at.LINEAR, own])
        for i, tick in enumerate(self._tick):
            yield "seats", _product(rails, k.seat_shape, _rows(k.rail_pull))
            yield "seats", _product(slabs, m.slab_seats, k.slab_pull[min(i, 1)].reshape(forces.shape))
            if int(m.dims[at.MORTAR_MODE]) > 0:
                yield "mortar", self._bind_mortar(_ITERATE if i else _PREDICTED)
            yield "forces and contact", self._bind_forces(tick, _ITERATE if i else _PREDICTED)
            yield "solve", _product(F["vertical"], blocks.vertical, a["vertical"])
            yield "solve", _product(F["lateral"], blocks.lateral, a["lateral"])
            yield "solve", _product(F["vehicles"], blocks.vehicle, a["vehicles"])
            yield "solve", self._by_design(forces, m.slab_push, a["slabs"])
            if int(m.dims[at.MORTAR_MODE]) > 0:
                yield "solve", self._by_design(F["slabs"], m.slab_inverse, a["slabs"], add=True)
            yield "solve", partial(np.add, motion[at.A, own], motion[at.LINEAR, own], motion[at.A, own])
            yield "correct", _product(newmark.corrector, motion[at.A : at.LINEAR], motion[at.U : at.A])
            if not tick[at.LAST_PASS]:
                yield "factors", self._bind_factors(tick)
        yield "recording", self._record_bodies

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

    def _bind_forces(self, tick: NDArray[np.int32], rows: NDArray[np.int32]) -> Launch:
        m, s, k, b, train = self.model, self.state, self.scratch, self.model.blocks, self.model.ingredients.train
        return self._launch(
            kernels.forces_and_contact, tick, rows, m.dims, m.constants, self.chunk.clock, m.stiffness, k.drift,
            s.seat_scale, k.seat_shape, k.rail_pull, k.slab_pull, m.vehicle_load, train.wheelset_dof, m.wheel,
            train.element_index, train.element_row, train.element_kind, train.element_linear, train.element_table,
            m.ingredients.contact.values, self.chunk.irregularity, m.wheel_shape, b.wheelset_compliance, b.rail_coupling,
            b.rail_answer, b.vehicle_answer, s.motion, s.seat_force, k.slab_force, k.rail_predicted, s.contact, s.force,
            s.wheelset_force, s.rail_force, s.iterations, self.chunk.wheel,
        )  # fmt: skip

    def _bind_mortar(self, rows: NDArray[np.int32]) -> Launch:
        m, s = self.model, self.state
        return self._launch(
            kernels.mortar_forces, rows, m.dims, s.design, m.bed_index, m.bed_shape, m.bed_weight, m.bed_factor,
            m.bed_rest, m.bed_lateral_K, m.bed_lateral_C, m.bed_numbers, s.motion, s.pressure,
        )  # fmt: skip

    def _record_bodies(self) -> None:
        """Copy the bodies' motion and what the bed feels, if this step is asked for them."""
        row = self.asked[2]
        if row < 0:
            return
        chunk, bodies = self.chunk, self.chunk.body.shape[-1]
        for kind, view in enumerate(self._vehicles):
            chunk.body[:, row, kind] = view[:, :bodies]
        if int(self.model.dims[at.MORTAR_MODE]) > 0:
            chunk.mortar[:, row] = self.state.pressure
        else:
            np.dot(self.model.bed_numbers[:2], self.state.motion[at.U : at.A, self._slabs], self.scratch.bed_motion)
            chunk.bed[:, row] = self.scratch.bed_motion.reshape(len(chunk.bed), -1)
            chunk.design[row] = self.state.design[0]

    def fill_pressures(self, rows: int) -> None:
        """Extreme pressures of a bed that is wholly implicit in the first ``rows`` of the bodies' record.

        At rest they are the slab's weight's; k u + c v adds to that. One product for a whole chunk of steps.
        """
        m, chunk = self.model, self.chunk
        if rows == 0 or int(m.dims[at.MORTAR_MODE]) > 0:  # then they are known from the forces
            return
        kinds = chunk.design[:rows].ravel()
        factor, rest = (given.reshape(len(given), -1)[kinds] for given in (m.bed_factor, m.bed_rest))
        for bed, out in zip(chunk.bed[:, :rows], chunk.mortar[:, :rows], strict=True):
            pressure = bed.reshape(len(kinds), -1) @ m.bed_points
            pressure *= factor
            pressure += rest
            out[..., 0] = pressure.max(axis=1).reshape(out.shape[:2])
            out[..., 1] = pressure.min(axis=1).reshape(out.shape[:2])

    def _by_design(
        self, factor: NDArray[np.float64], matrices: NDArray[np.float64], out: NDArray[np.float64], add: bool = False
    ) -> Callable[[], object]:
        """Product of all slabs with the sound design's matrix, then of those that have another with their own."""
        slots = self.state.design.shape[1]
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

    def load(
        self,
        X: NDArray[np.float64],
        V: NDArray[np.float64],
        V_rate: NDArray[np.float64],
        irregularity: NDArray[np.float64],
    ) -> None:
        """Fill the chunk for the coming steps.

        Args:
            X: Chainage of the window's rear end at the end of each step [m], shape (steps,).
            V: Speed [m/s].
            V_rate: Its rate [m/s^2].
            irregularity: Track channels, shape (B, steps, W, N_IRREGULARITY).
        """
        clock = positions(self.model, X, V, V_rate).clock
        self.chunk.clock[: len(X)] = clock
        self.chunk.irregularity[:, : len(X)] = irregularity
        changes = np.diff(clock[:, [at.FIRST_SEAT, at.FIRST_SLAB, at.SPEED]], axis=0).any(axis=1)
        self._moves = np.concatenate([[True], changes])

    def step(self, i: int, wheel_row: int = -1, body_row: int = -1) -> None:
        """Advance to the end of step ``i`` of the chunk.

        Args:
            i: Row of the chunk.
            wheel_row: Row of the wheels' record to fill, -1 none.
            body_row: Row of the bodies' record to fill, -1 none.
        """
        if self._moves[i]:
            self.move(i)
        self._tick[:, _ASKED] = i, wheel_row
        self.asked = i, wheel_row, body_row
        for _, stage in self.stages:
            stage()

    def move(self, i: int) -> None:
        """Let seats and slabs in and out at step ``i``; factorise anew when the speed has changed enough."""
        clock = self.chunk.clock[i]
        window, V = (int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB])), float(clock[at.SPEED])
        if window != self._window:  # the first step too: the start has let the first slabs in
            self._window = window
            self.state.enter(self.model, *window)
            self._odd = [(int(slot), int(self.state.design[0, slot])) for slot in np.flatnonzero(self.state.design[0])]
        factored = self.factored_speed
        if V != factored and not abs(V - factored) < REFACTOR * factored:
            self.factor(V)

    def factor(self, V: float) -> None:
        """Make anew what depends on the speed V [m/s]."""
        self.model.refactor(V)
        self.factored_speed = V

    def _flat(self, row: int, block: str) -> NDArray[np.float64]:
        """A block as right-hand sides, shape (B m, n)."""
        return _rows(self.state.view(row, block))


def _rows(array: NDArray[np.float64]) -> NDArray[np.float64]:
    return array.reshape(-1, array.shape[-1])


def _product(
    factor: NDArray[np.float64], matrix: NDArray[np.float64], out: NDArray[np.float64]
) -> Callable[[], object]:
    """The call that fills ``out`` with factor @ matrix."""
    return partial(np.dot, factor, matrix, out)


_BLOCKS = ("vertical", "lateral", "slabs", "vehicles")
_PREDICTED = np.array([at.U_PREDICTED, at.V_PREDICTED], dtype=np.int32)
_ITERATE = np.array([at.U, at.V], dtype=np.int32)
_ASKED = [at.STEP, at.WHEEL_RECORD]
