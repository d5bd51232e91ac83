"""Forces of a bed whose ground moves in time on the slabs of the full-length model, in absolute coordinates.

    f = int N^T (k_m z_g + c_m dz_g/dt),   laterally k_y int (y_g, x y_g) and the same for damping

The straight line that fits the ground under a slab moves it as a rigid body: exact, by the bed's matrices. What is
left, the curvature of the ground under one slab, is summed over the bed's sampling points.
"""

from __future__ import annotations

import numpy as np

from tiengine.irregularity.base_motion import GroundRecord
from tiengine.parameters.arrays import Reals
from validation.msm.model import FullTrack
from validation.msm.plate import ModalSlab

__all__ = ["ForcedBed"]


class ForcedBed:
    """Bed of all slabs on moving ground."""

    def __init__(self, track: FullTrack, record: GroundRecord, pitch: float) -> None:
        """Keep the record and find the rigid motions of the slabs.

        Args:
            track: The track.
            record: Motion of the ground.
            pitch: Of the slabs [m].
        """
        self.track, self.record, self.pitch = track, record, pitch
        self._lines = [_line_fit(group.slab) for group in track.groups]

    def push(self, time: float, load: Reals) -> None:
        """Add the forces at a time [s] to those of all slabs, shape (slabs, m + 2)."""
        mortar = self.track.mortar
        for group, (modes, fit) in zip(self.track.groups, self._lines, strict=True):
            slab = group.slab
            x = self.track.rear + (group.index[:, None] + 0.5) * self.pitch + slab.bed_x
            at = time - self.record.delay(x)
            for derivative, matrix, k in (
                (0, slab.stiffness, mortar.stiffness),
                (1, slab.damping, mortar.damping),
            ):
                z, y = np.moveaxis(self.record.at(at, derivative), -1, 0)
                line, side = z @ fit, y @ fit  # value at the centre and slope, shape (slabs, 2)
                rigid = np.concatenate([line @ modes, side], axis=1)
                load[group.index] += rigid @ matrix.T
                bent = z - line[:, :1] - line[:, 1:] * slab.bed_x
                load[group.index, :-2] += k * slab.bed_area * (bent * slab.bed_factor) @ slab.bed.T


def _line_fit(slab: ModalSlab) -> tuple[Reals, Reals]:
    """Modal coordinates of w = 1 and w = x, shape (2, m); what fits such a line to values at the bed's points."""
    straight = np.stack([np.ones_like(slab.bed_x), slab.bed_x])
    modes = np.zeros((2, len(slab.omega)))  # three rigid modes come first
    modes[:, :3] = np.linalg.lstsq(slab.bed[:3].T, straight.T, rcond=None)[0].T
    return modes, np.linalg.pinv(straight)
