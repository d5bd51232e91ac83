"""Loads of a train on ground that moves in time (MODEL §14).

Every body is measured from the ground at its own chainage, as on a line with curves. With Z the motion where the record
begins, c the speed at which it travels, tau = t - (x - x_0)/c, r = d tau/dt = 1 - V/c at the body, the frame moves by

    z = Z(tau),   dz/dt = r Z',   d2z/dt2 = r^2 Z'' - (Vdot/c) Z',   dz/dx = -Z'/c   (y likewise)

and turns with the slopes: yaw dy/dx, pitch -dz/dx. Without c all frames move alike, and what is left is -m Z''.
"""

from __future__ import annotations

import numpy as np

from tiengine.irregularity.base_motion import GroundRecord
from tiengine.model.frame_loads import FrameLoads
from tiengine.parameters.arrays import Reals
from tiengine.vehicle.given_loads import GivenLoads, no_loads
from tiengine.vehicle.train import TrainModel

__all__ = ["BaseMotionLoads"]

Y, Z, ROLL, PITCH, YAW = range(5)
AXES = {Z: 0, Y: 1}
"""Column of the record that moves each coordinate."""
TURNS = {PITCH: (0, 1.0), YAW: (1, -1.0)}
"""Column of the record that turns each coordinate, and the sign of Z'/c in it."""


class BaseMotionLoads(FrameLoads):
    """Given loads of a train on moving ground.

    Attributes:
        record: Motion of the ground.
    """

    def __init__(self, record: GroundRecord, train: TrainModel) -> None:
        """Keep both."""
        super().__init__(train)
        self.record = record
        self._slowness = 0.0 if record.motion.wave_speed is None else 1.0 / record.motion.wave_speed

    def __call__(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> GivenLoads:
        """Loads at a number of moments, see :class:`tiengine.vehicle.given_loads.LoadSource`."""
        if self._slowness:
            return super().__call__(time, x, V, V_rate)
        loads, mass = no_loads(self.train, len(x)), self._mass
        acceleration = self.record.at(time, 2)
        for axis, column in AXES.items():
            loads.force[0, :, axis : self.train.n_dof : 5] = -acceleration[:, column, None] * mass
        return loads

    @property
    def _mass(self) -> Reals:
        """Mass of every body [kg], shape (bodies,)."""
        return np.asarray(np.diag(self.train.M)[: self.train.n_dof : 5], np.float64)

    def motion(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> Reals:
        """Displacement, velocity and acceleration of the ground under every body, shape (steps, 3, bodies, 5).

        Arguments as in :meth:`inertia`.
        """
        at = x[:, None] + self.train.body_x
        q, tau = self._slowness, time[:, None] - self.record.delay(at)
        rate, slowed = (1.0 - V * q)[..., None], (V_rate * q)[..., None]
        found = np.zeros((len(x), 3, at.shape[1], 5))
        u, v, a, jerk = (self.record.at(tau, derivative) for derivative in range(4))
        for axis, column in AXES.items():
            found[..., axis] = np.stack([u, rate * v, rate**2 * a - slowed * v], axis=1)[..., column]
        for axis, (column, sign) in TURNS.items():
            turned = np.stack([v, rate * a, rate**2 * jerk - slowed * a], axis=1)
            found[..., axis] = sign * q * turned[..., column]
        return found

    def inertia(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> Reals:
        """See :class:`FrameLoads`."""
        sizes = np.column_stack([self._mass, self._mass, self.train.body_inertia])
        return np.asarray(-sizes * self.motion(time, x, V, V_rate)[:, 2], np.float64)

    def offsets(self, time: Reals, x: Reals, V: Reals, reference: float | None = None) -> tuple[Reals, Reals]:
        """See :class:`FrameLoads`."""
        own = x[:, None] + self.train.body_x
        centre = x[:, None] + (self.train.body_vehicle_x if reference is None else np.full(own.shape[1], reference))
        q, d = self._slowness, own - centre
        here, there = (time[:, None] - self.record.delay(at) for at in (own, centre))
        rate = 1.0 - V * q
        (u, v, a), (u0, v0, a0) = (
            [self.record.at(tau, derivative) for derivative in range(3)] for tau in (here, there)
        )
        offset, speed = np.zeros((2, *own.shape, 5))
        for axis, column in AXES.items():
            offset[..., axis] = (u - u0)[..., column] + q * d * v0[..., column]
            speed[..., axis] = rate * ((v - v0)[..., column] + q * d * a0[..., column])
        for axis, (column, sign) in TURNS.items():
            offset[..., axis] = sign * q * (v - v0)[..., column]
            speed[..., axis] = sign * q * rate * (a - a0)[..., column]
        return offset, speed

    def frame_rates(self, time: Reals, x: Reals, V: Reals) -> tuple[Reals, Reals]:
        """See :class:`FrameLoads`."""
        at = x[:, None] + self.train.wheelset_x
        q = self._slowness
        turning = -q * (1.0 - V * q) * self.record.at(time[:, None] - self.record.delay(at), 2)[..., 1]
        return turning, np.zeros_like(turning)
