"""Inverses of the implicit blocks at one speed, and the contact's compliance that follows from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.fastening import Fastening
from tiengine.integrator import Newmark, inverse, rail_inverses
from tiengine.rail import RailWindow
from tiengine.train import TrainModel

__all__ = ["Blocks"]


@dataclass(frozen=True, eq=False)
class Blocks:
    """What depends on the speed; refilled in place when it has changed by a set amount.

    Attributes:
        vertical: Inverse of the rail's vertical block, shape (2N, 2N), transposed for right multiplication.
        lateral: Inverse of the rail's lateral block, shape (3N, 3N), transposed.
        vehicle: Inverse of the train's block, shape (n, n), transposed.
        vertical_response: a of the rail by unit vertical forces at the wheels, shape (2N, W).
        lateral_response: a by unit lateral forces and roll moments, wheel by wheel, shape (3N, 2W).
        vehicle_response: a of the train by unit forces on y, z, roll, pitch, yaw of the wheelsets, shape (n, 5W).
        wheelset_compliance: The same at the wheelsets themselves, shape (W, 5, 5).
        rail_compliance: a and its slope a' under a wheel by forces there, in w, v, theta_x, shape (W, 2, 3, 3).
    """

    vertical: NDArray[np.float64]
    lateral: NDArray[np.float64]
    vehicle: NDArray[np.float64]
    vertical_response: NDArray[np.float64]
    lateral_response: NDArray[np.float64]
    vehicle_response: NDArray[np.float64]
    wheelset_compliance: NDArray[np.float64]
    rail_compliance: NDArray[np.float64]

    @classmethod
    def empty(cls, modes: int, wheelsets: int, vehicle: int) -> Blocks:
        """Arrays to be filled."""
        n, w = modes, wheelsets
        return cls(
            vertical=np.zeros((2 * n, 2 * n)),
            lateral=np.zeros((3 * n, 3 * n)),
            vehicle=np.zeros((vehicle, vehicle)),
            vertical_response=np.zeros((2 * n, w)),
            lateral_response=np.zeros((3 * n, 2 * w)),
            vehicle_response=np.zeros((vehicle, 5 * w)),
            wheelset_compliance=np.zeros((w, 5, 5)),
            rail_compliance=np.zeros((w, 2, 3, 3)),
        )

    def fill(
        self,
        window: RailWindow,
        fastening: Fastening,
        spacing: float,
        train: TrainModel,
        newmark: Newmark,
        V: float,
        wheel_shape: NDArray[np.float64],
    ) -> None:
        """Factorise at speed V.

        Args:
            window: The rail.
            fastening: Its fastenings.
            spacing: Seat pitch [m].
            train: The vehicles.
            newmark: Step and coefficients.
            V: Speed [m/s].
            wheel_shape: sin(k_i s) and its slope under the wheels, shape (2, W, N).
        """
        vertical, lateral = rail_inverses(window, fastening, spacing, newmark, V)
        A = newmark.operator(sp.csr_array(train.M), sp.csr_array(train.C + V * train.C_speed), sp.csr_array(train.K))
        vehicle = inverse(A, "vehicle")
        self.vertical[:], self.lateral[:], self.vehicle[:] = vertical.T, lateral.T, vehicle.T
        n, value, slope = window.modes, wheel_shape[0], wheel_shape[1]
        self.vertical_response[:] = vertical[:, :n] @ value.T
        self.lateral_response[:, 0::2] = lateral[:, :n] @ value.T
        self.lateral_response[:, 1::2] = lateral[:, 2 * n :] @ value.T
        self.vehicle_response[:] = vehicle[:, train.wheelset_dof.ravel()]
        for w, dof in enumerate(train.wheelset_dof):
            self.wheelset_compliance[w] = vehicle[np.ix_(dof, dof)]
            across = self.lateral_response[:, 2 * w : 2 * w + 2]
            for kind, shape in enumerate((value[w], slope[w])):
                self.rail_compliance[w, kind, 0, 0] = shape @ self.vertical_response[:n, w]
                self.rail_compliance[w, kind, 1, 1:] = shape @ across[:n]
                self.rail_compliance[w, kind, 2, 1:] = shape @ across[2 * n :]
