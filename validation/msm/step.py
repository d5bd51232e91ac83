r"""One step of the full-length model: the engine's Newmark passes, on modes of the whole rail and of all slabs.

    A a^{k+1} = -(C v~ + K u~) + f(u^k, v^k) + A_s a^k,    k = 0, 1 from a^0 = 0

f contains seats, gravity, nonlinear suspension; contact is solved against the compliance at the step's end. The force
of a seat on the rail uses the rail's and the slab's iterates, its force on the slab the rail's iterate and the slab's
predictor, since the slab's operator contains its own side of the seat. On ground that moves in time all coordinates are
absolute, and the bed of the slabs is displaced.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tiengine.engine.launch import Launch
from tiengine.kernels import layout as at
from tiengine.kernels.wheel_rail import COS, N_CONTACT
from tiengine.model.newmark import inverse
from tiengine.parameters.arrays import Reals
from validation.msm import kernels
from validation.msm.ground import ForcedBed
from validation.msm.model import CL, CV, KL, KV, FullTrack

__all__ = ["Buffers", "FullState", "FullStepper"]


@dataclass(eq=False)
class FullState:
    """Data that a step changes.

    Attributes:
        rails: Rows of modal coordinates, shape (rows, 10, N), see ``kernels``.
        slabs: Displacement, velocity, acceleration, shape (3, slabs, m + 2).
        motion: Rows of the vehicle's coordinates, shape (rows, n).
        contact, force, wheelset_force, rail_force: Contact as in the engine's state, one train.
    """

    rails: Reals
    slabs: Reals
    motion: Reals
    contact: Reals
    force: Reals
    wheelset_force: Reals
    rail_force: Reals

    @classmethod
    def at_rest(cls, track: FullTrack) -> FullState:
        """All zero."""
        W = len(track.wheel)
        rows = at.CONTACT_ROWS[track.contact.patches]
        contact = np.zeros((1, W, rows, N_CONTACT))
        contact[..., COS] = 1.0
        return cls(
            rails=np.zeros((at.MOTION_ROWS, 10, track.modes)),
            slabs=np.zeros((3, track.slabs, track.slab_modes + 2)),
            motion=np.zeros((at.MOTION_ROWS, track.train.n)),
            contact=contact,
            force=np.zeros((1, W, rows, 4)),
            wheelset_force=np.zeros((1, W, 5)),
            rail_force=np.zeros((1, W, 2, 3)),
        )


@dataclass(frozen=True, eq=False)
class Buffers:
    """Inputs and records of a chunk of steps.

    Attributes:
        clock: Chainage of the first vehicle's centre, speed, its rate at the end of each step, shape (steps, N_CLOCK).
        irregularity: Track channels at the wheelsets, shape (1, steps, W, N_IRREGULARITY).
        wheel: Wheel output of every step, shape (1, steps, W, 2, N_WHEEL_RECORD).
        body: Recorded motion of the bodies, shape (1, rows, 3, 5 bodies).
        slabs: Displacement and velocity of the slabs, recorded with the bodies, shape (rows, 2, slabs, m + 2).
        time: End of each step since the start [s], shape (steps,); read where the ground moves.
    """

    clock: Reals
    irregularity: Reals
    wheel: Reals
    body: Reals
    slabs: Reals
    time: Reals

    @classmethod
    def empty(cls, track: FullTrack, steps: int, body_rows: int) -> Buffers:
        """Zeros."""
        W, bodies = len(track.wheel), len(track.train.body_names)
        return cls(
            clock=np.zeros((steps, at.N_CLOCK)),
            irregularity=np.zeros((1, steps, W, at.N_IRREGULARITY)),
            wheel=np.zeros((1, steps, W, 2, at.N_WHEEL_RECORD[track.contact.patches])),
            body=np.zeros((1, body_rows, 3, 5 * bodies)),
            slabs=np.zeros((body_rows, 2, track.slabs, track.slab_modes + 2)),
            time=np.zeros(steps),
        )


class FullStepper:
    """Stepper of a state, with kernels bound to its arrays.

    Attributes:
        bed: Bed on ground that moves in time; None on ground at rest.
        seat_force: Vertical force, moment, lateral force of the seats on slabs, shape (3, 2, slabs, seats per slab).
    """

    def __init__(self, track: FullTrack, state: FullState, buffers: Buffers, V: float) -> None:
        """Bind the kernels, and factorise the vehicle at its constant speed V [m/s]."""
        self.track, self.state, self.buffers = track, state, buffers
        self.bed: ForcedBed | None = None
        self._tick = np.zeros(at.N_TICK, dtype=np.int32)
        seats = track.transform.seats
        self._folded = np.zeros((6, seats))
        self._scattered = np.zeros((6, seats))
        S, n = state.slabs.shape[1:]
        self._predicted, self._linear, self._push = np.zeros((2, S, n)), np.zeros((S, n)), np.zeros((S, n))
        self._lateral = np.stack([np.ones_like(track.groups[0].slab.seat_x), track.groups[0].slab.seat_x])
        self._seat_rows = track.seat.transpose(1, 0, 2).reshape(track.slab_modes, -1)  # one product for all seats
        train, newmark = track.train, track.newmark
        operator = newmark.operator(
            sp.csr_array(train.M), sp.csr_array(train.C + V * train.C_speed), sp.csr_array(train.K)
        )
        self._vehicle = np.ascontiguousarray(inverse(operator, "vehicle"))
        self.seat_force = np.zeros((3, *track.seat_scale.shape))
        self._bind()

    def _bind(self) -> None:
        """Bind the launches of both kernels."""
        track, state, buffers, train = self.track, self.state, self.buffers, self.track.train
        W, modes = len(track.wheel), track.modes
        dof = train.wheelset_dof
        response = np.ascontiguousarray(self._vehicle[:, dof.ravel()])
        compliance = np.stack([self._vehicle[np.ix_(row, row)] for row in dof])
        target, sign = track.transform.target, track.transform.sign
        self._forces = Launch(
            kernels.explicit_forces,
            (),
            (
                self._tick, track.dims, track.constants, buffers.clock, track.numbers, track.stiffness, target, sign,
                train.K, train.C, train.C_speed, track.vehicle_load, dof, track.wheel, train.element_index,
                train.element_row, train.element_kind, train.element_linear, train.element_table, state.rails,
                self._folded, state.motion,
            ),
        )  # fmt: skip
        self._contact = Launch(
            kernels.implicit_and_contact,
            (track.contact.patches, int(track.wheel[0, at.RADIUS_LEFT] > 0.0)),
            (
                self._tick, track.dims, track.constants, buffers.clock, track.numbers, track.inverse, target, sign,
                self._scattered, track.contact_values, buffers.irregularity, track.wheel, train.wheelset_x, dof,
                response, compliance, state.rails, np.zeros((2, W, modes)), np.zeros((W, 2, W, 3, 3)), state.motion,
                np.zeros((1, W, 2, 9)), state.contact, state.force, state.wheelset_force, state.rail_force,
                np.zeros((1, W, 5)), np.zeros((1, W, 2, 3)), buffers.wheel,
            ),
        )  # fmt: skip

    def step(self, i: int, body_row: int = -1) -> None:
        """Advance to the end of step ``i`` of the chunk; with the row of the bodies' record to fill, -1 for none."""
        tick, last = self._tick, self.track.passes - 1
        tick[at.STEP] = i
        self._predict_slabs()
        if self.bed is not None:
            self.bed.push(self.buffers.time[i], self._linear)
        for k in range(last + 1):
            tick[at.PASS], tick[at.LAST_PASS] = k, k == last
            self._forces()
            self._seats(first=k == 0)
            self._solve_slabs()
            np.matmul(self._vehicle, self.state.motion[at.F], out=self.state.motion[at.A])
            self._contact()
        if body_row >= 0:
            self.buffers.slabs[body_row] = self.state.slabs[:2]
            self.buffers.body[0, body_row] = self.state.motion[: at.A + 1, : self.buffers.body.shape[-1]]

    def _predict_slabs(self) -> None:
        """Compute the predictors of the slabs and -(C v + K u) at them."""
        (u, v, a), newmark = self.state.slabs, self.track.newmark
        up, vp = self._predicted
        up[:] = u + newmark.dt * v + (0.5 - newmark.beta) * newmark.dt**2 * a
        vp[:] = v + (1.0 - newmark.gamma) * newmark.dt * a
        u[:], v[:], a[:] = up, vp, 0.0
        for group in self.track.groups:
            k = group.index
            self._linear[k] = -(up[k] @ group.slab.stiffness + vp[k] @ group.slab.damping)

    def _seats(self, *, first: bool) -> None:
        """Compute the forces of all seats on the rails' folded modes and on the slabs."""
        track = self.track
        slabs, per_slab = track.seat_scale.shape[1:]
        pull = np.zeros((6, slabs * per_slab))
        pull[:, : track.transform.seats] = track.transform.to_seats(self._folded)
        pull = pull.reshape(3, 2, slabs, per_slab)  # vertical, moment, lateral; side
        answer = self._slab_pull(*self._predicted)
        on_slab = track.seat_scale * (pull - answer)
        self._push_slabs(on_slab)
        on_rail = on_slab if first else track.seat_scale * (pull - self._slab_pull(*self.state.slabs[:2]))
        self.seat_force = on_rail
        flat = on_rail.reshape(6, -1)[:, : track.transform.seats]
        self._scattered[:] = track.transform.from_seats(flat)

    def _slab_pull(self, u: Reals, v: Reals) -> Reals:
        """Vertical force, moment and lateral force of the seats due to the slabs' motion, shape (3, 2, slabs, 9)."""
        track, m = self.track, self.track.slab_modes
        numbers = track.numbers
        plate = numbers[KV] * u[:, :m] + numbers[CV] * v[:, :m]
        rigid = (numbers[KL] * u[:, m:] + numbers[CL] * v[:, m:]) @ self._lateral
        out = np.empty((3, 2, *rigid.shape))
        out[:2] = (plate @ self._seat_rows).reshape(len(u), 2, 2, -1).transpose(1, 2, 0, 3)
        out[1] *= track.half_base**2
        out[2] = rigid
        return out

    def _push_slabs(self, force: Reals) -> None:
        """Generalised forces of the seats on the slabs, from (3, 2, slabs, 9)."""
        m, push = self.track.slab_modes, self._push
        by_slab = force[:2].transpose(2, 0, 1, 3).reshape(len(push), -1)
        np.matmul(by_slab, self._seat_rows.T, out=push[:, :m])
        push[:, m:] = force[2].sum(axis=0) @ self._lateral.T

    def _solve_slabs(self) -> None:
        """Compute the accelerations of the slabs, and apply their correctors."""
        (u, v, a), newmark = self.state.slabs, self.track.newmark
        load = self._linear + self._push
        for group in self.track.groups:
            a[group.index] = load[group.index] @ group.inverse
        up, vp = self._predicted
        u[:] = up + newmark.beta_dt2 * a
        v[:] = vp + newmark.gamma_dt * a
