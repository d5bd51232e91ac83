"""Loads of a train on a line with curves, cant and gradients (MODEL §12).

Every body's coordinates are relative to the track frame at its own chainage. The frame accelerates and rolls with the
line, so each body feels inertia forces besides its weight; and the frames of two bodies that a connector joins lie
against each other as a rigid track would put them, which lengthens the connector.

With curvature kappa, roll phi, gradient i of the line at the body, h its height above the rails, ' = d/dx:

    y      m [(g cos i + V^2 i') sin phi - V^2 kappa cos phi - h (V^2 phi'' + Vdot phi')]
    z      m [(g cos i + V^2 i') cos phi - g + V^2 kappa sin phi]
    roll   -Jx (V^2 phi'' + Vdot phi'),   pitch  -Jy (V^2 i'' + Vdot i'),   yaw  -Jz (V^2 kappa' + Vdot kappa)

The frame of a body at x against that of its vehicle at X, d = x - X:

    y      int_X^x (x - s) kappa(s) ds + h (phi(x) - phi(X)),   yaw   int_X^x kappa ds,   roll  phi(x) - phi(X)
    z      -int_X^x (x - s) i'(s) ds,                           pitch i(x) - i(X)

Gravity along the track goes to the wheels as the inertia of a growing speed does
(:func:`tiengine.vehicle.assembly.grade_push`).
"""

from __future__ import annotations

import numpy as np

from tiengine.model.frame_loads import FrameLoads
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY
from tiengine.track.alignment import Alignment
from tiengine.vehicle.train import TrainModel

__all__ = ["CurveLoads", "frame_offsets"]

Y, Z, ROLL, PITCH, YAW = range(5)


class CurveLoads(FrameLoads):
    """Given loads of a train on an alignment.

    Attributes:
        alignment: The line.
    """

    def __init__(self, alignment: Alignment, train: TrainModel) -> None:
        """Keep both."""
        super().__init__(train)
        self.alignment = alignment

    def along_track(self, x: Reals) -> Reals:
        """Forces of gravity along the track, g sin(gradient) at every body."""
        grade = GRAVITY * np.sin(np.arctan(self.alignment.lines[2](x[:, None] + self.train.body_x)))
        return np.asarray(grade @ self.train.grade_force.T, np.float64)

    def inertia(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> Reals:
        """Inertia forces of the moving frame and gravity's change, see :class:`FrameLoads`."""
        train, (kappa, phi, grade) = self.train, self.alignment.lines
        at = x[:, None] + train.body_x
        mass = np.diag(train.M)[: train.n_dof : 5]
        Jx, Jy, Jz = train.body_inertia.T
        roll, bend = phi(at), V**2 * kappa(at)
        roll_rate2 = V**2 * phi(at, 2) + V_rate * phi(at, 1)
        weight = GRAVITY * np.cos(np.arctan(grade(at))) + V**2 * grade(at, 1)
        f = np.zeros((*at.shape, 5))
        f[..., Y] = mass * (weight * np.sin(roll) - bend * np.cos(roll) - train.body_height * roll_rate2)
        f[..., Z] = mass * (weight * np.cos(roll) - GRAVITY + bend * np.sin(roll))
        f[..., ROLL] = -Jx * roll_rate2
        f[..., PITCH] = -Jy * (V**2 * grade(at, 2) + V_rate * grade(at, 1))
        f[..., YAW] = -Jz * (V**2 * kappa(at, 1) + V_rate * kappa(at))
        return f

    def offsets(self, time: Reals, x: Reals, V: Reals, reference: float | None = None) -> tuple[Reals, Reals]:
        """See :class:`FrameLoads`."""
        return frame_offsets(self.alignment, self.train, x, V, reference)

    def frame_rates(self, time: Reals, x: Reals, V: Reals) -> tuple[Reals, Reals]:
        """See :class:`FrameLoads`."""
        kappa, phi, _ = self.alignment.lines
        at = x[:, None] + self.train.wheelset_x
        return V * kappa(at), V * phi(at, 1)


def frame_offsets(
    alignment: Alignment, train: TrainModel, x: Reals, V: Reals, reference: float | None = None
) -> tuple[Reals, Reals]:
    """Motion of every body's frame against that of its vehicle's centre, and its rate.

    Args:
        alignment: The line.
        train: Places of the bodies.
        x: Chainage of the first vehicle's centre [m], shape (steps,).
        V: Speed [m/s], shape (steps, 1).
        reference: Place of the frame that all others are compared with, from the first vehicle's centre [m]; each
            body's own vehicle if None.

    Returns:
        y, z, roll, pitch, yaw [m, rad], shape (steps, bodies, 5); their rates.
    """
    kappa, phi, grade = alignment.lines
    own = x[:, None] + train.body_x
    centre = x[:, None] + (train.body_vehicle_x if reference is None else np.full(len(train.body_x), reference))
    d = own - centre
    u, v = np.zeros((*own.shape, 5)), np.zeros((*own.shape, 5))
    roll, turn = phi(own) - phi(centre), kappa.integral(own) - kappa.integral(centre)
    roll_slope = phi(own, 1) - phi(centre, 1)
    u[..., Y] = kappa.twice(own) - kappa.twice(centre) - kappa.integral(centre) * d + train.body_height * roll
    v[..., Y] = turn - kappa(centre) * d + train.body_height * roll_slope
    u[..., Z] = -(grade.integral(own) - grade.integral(centre) - grade(centre) * d)
    v[..., Z] = -(grade(own) - grade(centre) - grade(centre, 1) * d)
    u[..., ROLL], v[..., ROLL] = roll, roll_slope
    u[..., PITCH], v[..., PITCH] = grade(own) - grade(centre), grade(own, 1) - grade(centre, 1)
    u[..., YAW], v[..., YAW] = turn, kappa(own) - kappa(centre)
    return u, V[..., None] * v
