"""Motions of wheelsets on their rails, handed to the contact kernel many at a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.equilibrium import ContactForces, evaluate_contact
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.model.model import Model

from .models import V350

SIGMA = np.array([-1.0, 1.0])
Y, Z, ROLL, PITCH, YAW = range(5)
W_, V_, TX, DW, DV, DTX, RW, RV, RTX = range(9)  # rail: values, slopes, rates at constant s
SINKING = 8e-5  # m: about 70 kN


def with_friction(model: Model, friction: float) -> Model:
    constants = model.constants.copy()
    constants[at.FRICTION] = friction
    return replace(model, constants=constants)


class Wheelsets:
    """Motions of B wheelsets on their rails; wheelset 0 of each train is looked at, the others stand by."""

    def __init__(self, count: int) -> None:
        self.u, self.v = np.zeros((count, 4, 5)), np.zeros((count, 4, 5))
        self.rail = np.zeros((count, 4, 2, 9))
        self.track = np.zeros((count, 4, at.N_IRREGULARITY))

    def evaluate(self, model: Model, V: float = V350) -> ContactForces:
        return evaluate_contact(model, V, self.track, self.u, self.v, self.rail)

    def penetration(self, model: Model) -> NDArray[np.float64]:
        """Vertical penetration p = delta / cos gamma, shape (B, 2)."""
        contact = self.evaluate(model).contact[:, 0]
        return contact[..., wr.DELTA] / np.cos(self.gamma(contact))

    def gamma(self, contact: NDArray[np.float64]) -> NDArray[np.float64]:
        """Contact angle in the rail's frame from that in the track's."""
        turned = self.rail[:, 0, :, TX] + self.track[:, 0, at.CROSS_LEVEL, None]
        return np.arctan2(contact[..., wr.SIN], contact[..., wr.COS]) + SIGMA * turned

    def sink(self, model: Model, depth: float) -> None:
        """Press each wheelset down until its deeper wheel penetrates by ``depth`` vertically."""
        self.u[:, 0, Z] += depth - self.penetration(model).max(axis=1)


def scattered(seed: int, count: int) -> Wheelsets:
    """Random but possible motions: both rails, wheelset and track, every coordinate and rate."""
    rng = np.random.default_rng(seed)
    x = Wheelsets(count)
    x.u[:, 0] = rng.uniform(-1, 1, (count, 5)) * [6e-3, 0, 2e-3, 0.1, 5e-3]
    x.v[:, 0] = rng.uniform(-1, 1, (count, 5)) * [0.1, 0.1, 0.05, 0.5, 0.1]
    x.rail[:, 0] = rng.uniform(-1, 1, (count, 2, 9)) * [
        1e-3, 5e-4, 2e-3, 1e-3, 1e-3, 2e-3, 0.05, 0.05, 0.2
    ]  # fmt: skip
    x.track[:, 0] = rng.uniform(-1, 1, (count, 8)) * [3e-3, 2e-3, 1.5e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3]
    return x
