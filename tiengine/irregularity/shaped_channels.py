"""Track channels of a run whose rails have shapes or whose wheels are out of round (``kernels.out_of_round``)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tiengine.irregularity.irregularity import Irregularity
from tiengine.irregularity.rail_shapes import RailShapes
from tiengine.kernels import layout as at
from tiengine.parameters.arrays import Reals

__all__ = ["ShapedChannels"]


class ShapedChannels:
    """Adds what either rail and the rolling of the wheels give to the channels of the irregularity."""

    def __init__(self, rails: RailShapes, begin: Reals, radius: Reals) -> None:
        """Keep the shapes.

        Args:
            rails: Shapes of the rails.
            begin: Chainage of every wheelset at the start of the run [m], shape (W,).
            radius: r0 of every wheelset [m], shape (W,).
        """
        self.rails, self._begin, self._radius = rails, begin, radius

    def joined(self, irregularity: Reals, tracks: Sequence[Irregularity], wheels: Reals) -> Reals:
        """Join the channels; shapes of rails and wheels grow in as the irregularity of the train does.

        Args:
            irregularity: Channels of each train, shape (B, steps, W, N_IRREGULARITY).
            tracks: Irregularity of each train.
            wheels: Chainages of the wheelsets [m], shape (steps, W).

        Returns:
            Shape (B, steps, W, N_SHAPED).
        """
        height, slope = self.rails.sample(wheels)
        aside, turn = self.rails.lateral(wheels)
        joined = np.empty((*irregularity.shape[:-1], at.N_SHAPED))
        joined[..., : at.N_IRREGULARITY] = irregularity
        joined[..., at.TURNED] = (wheels - self._begin) / self._radius
        for channels, track in zip(joined, tracks, strict=True):
            T, T_slope = track.grown(wheels)
            channels[..., at.RAIL_LEFT : at.RAIL_RIGHT + 1] = height * T[..., None]
            channels[..., at.RAIL_LEFT_SLOPE : at.RAIL_RIGHT_SLOPE + 1] = (
                slope * T[..., None] + height * T_slope[..., None]
            )
            channels[..., at.Y_A] += aside * T
            channels[..., at.Y_A_SLOPE] += turn * T + aside * T_slope
            channels[..., at.GROWN], channels[..., at.GROWN_SLOPE] = T, T_slope
        return joined
