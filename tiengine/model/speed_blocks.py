"""Inverses of the implicit blocks at one speed, and the contact's compliance that follows from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.model.implicit_seats import rail_inverses
from tiengine.model.newmark import Newmark, inverse
from tiengine.track.fastening import Fastening
from tiengine.track.rail import RailWindow
from tiengine.vehicle.train import TrainModel

__all__ = ["Blocks"]


@dataclass(frozen=True, eq=False)
class Blocks:
    """Matrices that depend on the speed; filled again in place when it has changed by a set amount.

    Attributes:
        vertical: Inverse of the rail's vertical block, shape (2N, 2N), transposed for right multiplication.
        lateral: Inverse of the rail's lateral block, shape (3N, 3N), transposed.
        vehicle: Inverse of the train's block, shape (n, n), transposed.
        vehicle_linear: Matrices from the train's u, and from its v, to its acceleration by its own stiffness and
            damping, shape (2, n, n).
        rail_answer: Rows of A^-1 of the rail's value and slope under the wheels: of w (2N), v (3N), theta_x (3N), shape
            (W, 2, 8N).
        vehicle_answer: Rows of A^-1 of y, z, roll, pitch, yaw of the wheelsets, shape (5W, n).
        wheelset_compliance: Their entries at the same wheelset, shape (W, 5, 5).
        rail_coupling: a and its slope a' under a wheel by forces under another of the same rail, in w, v, theta_x,
            shape (W, 2, W, 3, 3).
    """

    vertical: NDArray[np.float64]
    lateral: NDArray[np.float64]
    vehicle: NDArray[np.float64]
    vehicle_linear: NDArray[np.float64]
    rail_answer: NDArray[np.float64]
    vehicle_answer: NDArray[np.float64]
    wheelset_compliance: NDArray[np.float64]
    rail_coupling: NDArray[np.float64]

    @classmethod
    def empty(cls, modes: int, wheelsets: int, vehicle: int) -> Blocks:
        """Zeros, for :meth:`fill`."""
        n, w = modes, wheelsets
        return cls(
            vertical=np.zeros((2 * n, 2 * n)),
            lateral=np.zeros((3 * n, 3 * n)),
            vehicle=np.zeros((vehicle, vehicle)),
            vehicle_linear=np.zeros((2, vehicle, vehicle)),
            rail_answer=np.zeros((w, 2, 8 * n)),
            vehicle_answer=np.zeros((5 * w, vehicle)),
            wheelset_compliance=np.zeros((w, 5, 5)),
            rail_coupling=np.zeros((w, 2, w, 3, 3)),
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
        C = train.C + V * train.C_speed
        vehicle = inverse(newmark.operator(sp.csr_array(train.M), sp.csr_array(C), sp.csr_array(train.K)), "vehicle")
        self.vertical[:], self.lateral[:], self.vehicle[:] = vertical.T, lateral.T, vehicle.T
        self.vehicle_linear[:] = -np.stack([train.K.T, C.T]) @ vehicle.T
        self.vehicle_answer[:] = vehicle[train.wheelset_dof.ravel()]
        for w, dof in enumerate(train.wheelset_dof):
            self.wheelset_compliance[w] = vehicle[np.ix_(dof, dof)]
        n = window.modes
        sines = (vertical[:n], lateral[:n], lateral[2 * n :])  # rows of A^-1 of w, v, theta_x
        for kind, shape in enumerate(wheel_shape):
            self.rail_answer[:, kind] = np.hstack([shape @ rows for rows in sines])
        vertical_rows, v, x = np.split(self.rail_answer, [2 * n, 5 * n], axis=2)
        force = wheel_shape[0].T
        self.rail_coupling[..., 0, 0] = vertical_rows[..., :n] @ force
        for field, lateral_rows in ((1, v), (2, x)):
            self.rail_coupling[..., field, 1] = lateral_rows[..., :n] @ force
            self.rail_coupling[..., field, 2] = lateral_rows[..., 2 * n :] @ force
