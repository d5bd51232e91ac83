"""Loads of a train whose bodies are measured from frames that move, each body's at its own chainage.

The frame of the track at a body may accelerate and turn: on a line with curves, or where the ground moves. Each body
then feels inertia forces; and the frames of two bodies that a connector joins lie against each other, which lengthens
the connector.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from tiengine.parameters.arrays import Reals
from tiengine.vehicle.given_loads import GivenLoads
from tiengine.vehicle.train import TrainModel

__all__ = ["FrameLoads"]


class FrameLoads(ABC):
    """Given loads of a train in moving frames; the same for all trains that are advanced together.

    Attributes:
        train: The train.
        sets: 1.
    """

    sets = 1

    def __init__(self, train: TrainModel) -> None:
        """Keep it."""
        self.train = train

    @abstractmethod
    def inertia(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> Reals:
        """Forces on every body beyond its weight, shape (steps, bodies, 5) [N, N m].

        Args:
            time: Since the start [s], shape (steps,).
            x: Chainage of the first vehicle's centre [m], shape (steps,).
            V: Speed [m/s], shape (steps, 1).
            V_rate: Its rate [m/s^2], shape (steps, 1).
        """

    @abstractmethod
    def offsets(self, time: Reals, x: Reals, V: Reals, reference: float | None = None) -> tuple[Reals, Reals]:
        """Motion of every body's frame against that of its vehicle's centre, and its rate, shape (steps, bodies, 5).

        Args:
            time: Since the start [s], shape (steps,).
            x: Chainage of the first vehicle's centre [m], shape (steps,).
            V: Speed [m/s], shape (steps, 1).
            reference: Place of the frame that all others are compared with, from the first vehicle's centre [m]; each
                body's own vehicle if None.
        """

    @abstractmethod
    def frame_rates(self, time: Reals, x: Reals, V: Reals) -> tuple[Reals, Reals]:
        """Yaw and roll rate of the frame at every wheelset [rad/s], shape (steps, W) each; arguments as before."""

    def along_track(self, x: Reals) -> Reals | float:
        """Generalised forces that push the train along the track, shape (steps, n); none by default.

        Args:
            x: Chainage of the first vehicle's centre [m], shape (steps,).
        """
        return 0.0

    @cached_property
    def _matrices(self) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array, sp.csr_array]:
        """K, C, C_speed of the train; elongations of its elements by its coordinates."""
        train = self.train
        count, width = train.element_index.shape
        entries = train.element_row.ravel(), (np.repeat(np.arange(count), width), train.element_index.ravel())
        rows = sp.csr_array(sp.coo_array(entries, shape=(count, train.n)))
        return sp.csr_array(train.K), sp.csr_array(train.C), sp.csr_array(train.C_speed), rows

    def __call__(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> GivenLoads:
        """Loads at a number of moments, see :class:`tiengine.vehicle.given_loads.LoadSource`."""
        train, V, V_rate = self.train, V[:, None], V_rate[:, None]
        K, C, C_speed, rows = self._matrices
        offset, rate = (self._padded(motion) for motion in self.offsets(time, x, V))
        force = self._padded(self.inertia(time, x, V, V_rate))
        force += self.along_track(x)
        turning = self.frame_rates(time, x, V)
        spinning = np.zeros_like(force)
        spinning[:, train.wheelset_dof[:, 4]], spinning[:, train.wheelset_dof[:, 2]] = turning
        force -= (K @ offset.T).T + (C @ rate.T).T + V * (C_speed @ spinning.T).T
        by_rate = train.element_kind == 0
        elongation = np.where(by_rate, (rows @ rate.T).T, (rows @ offset.T).T)
        self._between_cars(elongation, time, x, V)
        return GivenLoads(force[None], elongation[None], np.stack(turning, axis=2)[None])

    def _between_cars(self, elongation: Reals, time: Reals, x: Reals, V: Reals) -> None:
        """Elongations of elements between two vehicles, whose frames lie against that of the first of them."""
        train, rows = self.train, self._matrices[3]
        vehicle_x = np.repeat(train.body_vehicle_x, 5)
        for e in np.flatnonzero(train.element_between_cars):
            reference = float(vehicle_x[train.element_index[e, 0]])
            motions = self.offsets(time, x, V, reference)
            motion = self._padded(motions[0 if train.element_kind[e] else 1])
            elongation[:, e] = (rows[[e]] @ motion.T)[0]

    def _padded(self, bodies: Reals) -> Reals:
        """Coordinates of the train from those of the bodies, shape (steps, bodies, 5); internal states are zero."""
        out = np.zeros((len(bodies), self.train.n))
        out[:, : self.train.n_dof] = bodies.reshape(len(bodies), -1)
        return out
