"""One time step of a group of trains: explicit kernels, implicit solve, contact, pass by pass."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.kernels import layout as at
from tiengine.kernels import step as kernels
from tiengine.launch import Launch
from tiengine.model import Model
from tiengine.state import State, positions

__all__ = ["Chunk", "Stepper"]

REFACTOR = 1e-3
"""Relative change of speed at which the blocks are factorised anew; in between only A, not the forces, is stale."""


@dataclass(eq=False)
class Chunk:
    """What the kernels read and write over a number of steps.

    Attributes:
        clock: Window at the end of each step, shape (steps, N_CLOCK).
        irregularity: Track channels at the wheelsets, shape (B, steps, W, N_IRREGULARITY).
        wheel: Recorded wheel output, shape (B, rows, W, 2, N_WHEEL).
        body: Recorded displacement, velocity, acceleration of the bodies, shape (B, rows, 3, 5 bodies).
        mortar: Largest and smallest pressure of each slab [Pa], with the bodies, shape (B, rows, slots, 2).
    """

    clock: NDArray[np.float64]
    irregularity: NDArray[np.float64]
    wheel: NDArray[np.float64]
    body: NDArray[np.float64]
    mortar: NDArray[np.float64]

    @classmethod
    def empty(cls, model: Model, steps: int, wheel_rows: int, body_rows: int) -> Chunk:
        """Buffers for ``steps`` steps of which some are recorded."""
        d = model.dims
        B, W, bodies = int(d[at.TRAINS]), int(d[at.WHEELSETS]), int(d[at.BODIES])
        return cls(
            clock=np.zeros((steps, at.N_CLOCK)),
            irregularity=np.zeros((B, steps, W, at.N_IRREGULARITY)),
            wheel=np.zeros((B, max(wheel_rows, 1), W, 2, at.N_WHEEL)),
            body=np.zeros((B, max(body_rows, 1), 3, 5 * bodies)),
            mortar=np.zeros((B, max(body_rows, 1), int(d[at.SLOTS]), 2)),
        )


class Stepper:
    """Advances a state; binds the kernels to its arrays."""

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
        self._tick = np.zeros(at.N_TICK, dtype=np.int32)
        m, s, b = model, state, model.blocks
        train = m.given.train
        self._forces = Launch(
            kernels.explicit_forces,
            (parallel,),
            (
                self._tick, m.dims, m.constants, chunk.clock,
                m.stiffness, m.mass, m.G, m.gather_table, m.scatter_table, s.seat_scale, m.seat_index, m.seat_shape,
                m.seat_x, s.design, m.band, m.bed_index, m.bed_shape, m.bed_weight, m.bed_factor, m.bed_rest,
                m.bed_lateral_K, m.bed_lateral_C, m.bed_numbers, train.K, train.C, train.C_speed, m.vehicle_load,
                train.wheelset_dof, m.wheel, train.element_index, train.element_row, train.element_kind,
                train.element_linear, train.element_table, s.motion, s.modal, s.seat_motion, s.seat_force,
                s.pressure,
            ),
            public=public,
        )  # fmt: skip
        self._contact = Launch(
            kernels.contact_and_update,
            (parallel,),
            (
                self._tick, m.dims, m.constants, chunk.clock, m.given.contact.values, chunk.irregularity, m.wheel,
                train.wheelset_dof, m.wheel_shape, b.wheelset_compliance, b.rail_compliance, b.vertical_response,
                b.lateral_response, b.vehicle_response, s.motion, s.rail_free, s.contact, s.force, s.wheelset_force,
                s.rail_force, s.wheelset_before, s.rail_before, s.iterations, s.pressure, chunk.wheel, chunk.body,
                chunk.mortar,
            ),
            public=public,
        )  # fmt: skip
        self._speed = float("nan")
        self._views = {name: (self._flat(at.F, name), self._flat(at.X, name)) for name in _BLOCKS}
        self._window: tuple[int, int] | None = None
        self._odd: list[tuple[int, int, int]] = []

    def compile(self) -> float:
        """Compile both kernels by launching them for no train.

        Returns:
            Wall time [s]; small when Taichi finds them in its cache on disk.
        """
        clock = time.perf_counter()
        dims = self.model.dims
        trains, dims[at.TRAINS] = int(dims[at.TRAINS]), 0
        self._forces()
        self._contact()
        dims[at.TRAINS] = trains
        return time.perf_counter() - clock + self._forces.compile_seconds + self._contact.compile_seconds

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
        self.chunk.clock[: len(X)] = positions(self.model, X, V, V_rate).clock
        self.chunk.irregularity[:, : len(X)] = irregularity

    def step(self, i: int, wheel_row: int = -1, body_row: int = -1) -> None:
        """Advance to the end of step ``i`` of the chunk.

        Args:
            i: Row of the chunk.
            wheel_row: Row of the wheels' record to fill, -1 none.
            body_row: Row of the bodies' record to fill, -1 none.
        """
        clock, tick = self.chunk.clock, self._tick
        self._move(int(clock[i, at.FIRST_SEAT]), int(clock[i, at.FIRST_SLAB]), float(clock[i, at.SPEED]))
        tick[at.STEP], tick[at.WHEEL_RECORD], tick[at.BODY_RECORD] = i, wheel_row, body_row
        last = self.model.given.passes - 1
        for k in range(last + 1):
            tick[at.PASS], tick[at.LAST_PASS] = k, k == last
            self._forces()
            self._solve()
            self._contact()

    def _move(self, first_seat: int, first_slab: int, V: float) -> None:
        """Let seats and slabs in and out; factorise anew when the speed has changed enough."""
        if (first_seat, first_slab) != self._window:  # the first step too: the start has let the first slabs in
            self._window = first_seat, first_slab
            self.state.enter(self.model, first_seat, first_slab)
            self._odd = [(int(b), int(s), int(self.state.design[b, s])) for b, s in np.argwhere(self.state.design)]
        if V != self._speed and not abs(V - self._speed) < REFACTOR * self._speed:
            self.model.refactor(V)
            self._speed = V

    def _solve(self) -> None:
        """X = A^-1 F, block by block."""
        blocks, inverse, views = self.model.blocks, self.model.slab_inverse, self._views
        for name, A in (("vertical", blocks.vertical), ("lateral", blocks.lateral), ("vehicles", blocks.vehicle)):
            np.matmul(views[name][0], A, out=views[name][1])
        F, X = views["slabs"]
        np.matmul(F, inverse[0], out=X)
        slots = self.state.design.shape[1]
        for b, slot, kind in self._odd:
            np.matmul(F[b * slots + slot], inverse[kind], out=X[b * slots + slot])

    def _flat(self, row: int, block: str) -> NDArray[np.float64]:
        """A block as right-hand sides, shape (B m, n)."""
        view = self.state.view(row, block)
        return view.reshape(-1, view.shape[-1])


_BLOCKS = ("vertical", "lateral", "slabs", "vehicles")
