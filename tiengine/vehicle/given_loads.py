"""Given loads of a train: forces on its coordinates that are known functions of time, chainage and speed.

Curves, gradients and wind act this way. They are evaluated for all steps of a chunk at once; the kernels read a row of
numbers a step. A train without such loads has one row, its gravity, for all steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.vehicle.train import TrainModel

__all__ = ["GivenLoads", "LoadSource", "no_loads", "sum_of_loads"]


@dataclass(frozen=True, eq=False)
class GivenLoads:
    """Loads over a number of steps; T is 1 if they are the same for all trains advanced together, else their number.

    Attributes:
        force: Generalised forces beyond gravity, shape (T, steps, n) [N, N m].
        elongation: Elongations of the nonlinear elements, or their rates for those of the rate, that the frames of
            their bodies make, shape (T, steps, n_e) [m, m/s].
        frame_rate: Yaw and roll rate of the track frame at each wheelset, shape (T, steps, W, 2) [rad/s].
    """

    force: Reals
    elongation: Reals
    frame_rate: Reals

    @property
    def sets(self) -> int:
        """T."""
        return len(self.force)


class LoadSource(Protocol):
    """Maker of given loads."""

    @property
    def sets(self) -> int:
        """T of its loads."""

    def __call__(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> GivenLoads:
        """Loads at a number of moments.

        Args:
            time: Since the start [s], shape (steps,).
            x: Chainage of the first vehicle's centre [m], shape (steps,).
            V: Speed [m/s], shape (steps,).
            V_rate: Its rate [m/s^2], shape (steps,).
        """


def no_loads(train: TrainModel, steps: int) -> GivenLoads:
    """Loads that are all zero, the same for all trains."""
    return GivenLoads(
        np.zeros((1, steps, train.n)),
        np.zeros((1, steps, len(train.element_kind))),
        np.zeros((1, steps, len(train.wheelset_x), 2)),
    )


def sum_of_loads(
    sources: Sequence[LoadSource], train: TrainModel, time: Reals, x: Reals, V: Reals, V_rate: Reals
) -> GivenLoads:
    """Sum of the loads of all sources; arguments as in :class:`LoadSource`."""
    total = no_loads(train, len(x))
    for source in sources:
        more = source(time, x, V, V_rate)
        total = GivenLoads(
            total.force + more.force, total.elongation + more.elongation, total.frame_rate + more.frame_rate
        )
    return total
