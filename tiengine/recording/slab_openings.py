"""Openings between slabs and a bed without tension: extremes while a slab is in memory, and how often it closes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tiengine.engine.stepper import Stepper
from tiengine.parameters.arrays import Flags, Reals
from tiengine.recording.slot_extremes import SlotExtremes
from tiengine.track.dead_state import DeadState
from tiengine.track.slab_matrices import bed_points

__all__ = ["SlabOpenings", "opening_at_rest"]

LARGEST, AT_PLACE, CLOSINGS = range(3)
"""Columns of the extremes: opening anywhere under the slab, at the place of the largest one at rest, closings there."""


def opening_at_rest(stepper: Stepper, slab: int) -> Reals:
    """Opening at the quadrature points of a slab's bed at rest [m], negative in contact, -inf over a void.

    Args:
        stepper: Gives the track.
        slab: Index of the slab; its bed has no tension.

    Returns:
        Shape (points,).
    """
    g = stepper.ingredients
    stiffness = g.mortar.stiffness * g.designs.matrices[g.designs.of_slab.get(slab, 0)].bed_factor.ravel()
    opening: Reals = np.full(len(stiffness), -np.inf)
    np.divide(-g.pressure_at_rest(slab).ravel(), stiffness, out=opening, where=stiffness > 0.0)
    return opening


class SlabOpenings:
    """Openings of the slabs in memory; those that are sound among sound ones are left out."""

    def __init__(self, stepper: Stepper, dead: DeadState) -> None:
        """Begin before the first sample.

        Args:
            stepper: Is watched.
            dead: State at rest of its slabs.
        """
        self._stepper, self._dead = stepper, dead
        trains, slots = stepper.state.trains, stepper.state.slots
        self._points = bed_points(stepper.ingredients.designs.matrices[0])
        self._extremes = SlotExtremes.of(trains, slots, 3, (LARGEST, AT_PLACE, CLOSINGS))
        self._closed: Flags = np.zeros((trains, slots), dtype=np.bool_)
        self._count = np.zeros((trains, slots))
        self._known: dict[int, tuple[Reals, int]] = {}

    def take_in(self, rear: int, motion: Reals) -> None:
        """Take in samples with one rear slab.

        Args:
            rear: Rear slab in memory.
            motion: Displacement, velocity, acceleration of the slabs' coordinates, shape (B, rows, 3, slots, dofs).
        """
        slots, moved_on = motion.shape[3], rear - self._extremes.first_slab
        for slab in range(rear - min(moved_on, slots), rear) if self._extremes.first_slab >= 0 else ():
            self._closed[:, slab % slots], self._count[:, slab % slots] = False, 0.0
        self._extremes.move(rear)
        nothing = np.zeros((len(motion), slots, 3))
        largest, smallest = nothing, nothing.copy()
        for slab in range(rear, rear + slots):
            slot = slab % slots
            if self._dead.of(slab) > 0:
                found = self._of_slab(slab, motion[:, :, 0, slot])
                largest[:, slot, LARGEST] = found[0].max(axis=1)
                smallest[:, slot, AT_PLACE] = found[1].min(axis=1)
                self._close(slot, found[1] <= 0.0)
        largest[..., CLOSINGS] = self._count
        self._extremes.add(largest, smallest)

    def _of_slab(self, slab: int, w: Reals) -> tuple[Reals, Reals]:
        """Opening of a slab: largest, and at the place of the largest one at rest [m], shape (B, rows) each."""
        rest, place = self._rest(slab)
        opening = np.maximum(rest - w @ self._points, 0.0)
        return opening.max(axis=2), opening[..., place]

    def _close(self, slot: int, closed: Flags) -> None:
        """Count how often a place closes, shape (B, rows)."""
        before = np.concatenate([self._closed[:, slot, None], closed[:, :-1]], axis=1)
        self._count[:, slot] += np.count_nonzero(closed & ~before, axis=1)
        self._closed[:, slot] = closed[:, -1]

    def _rest(self, slab: int) -> tuple[Reals, int]:
        """Opening of a slab at rest, and the point where it is largest; those of slabs of one kind are made once."""
        kind = self._dead.of(slab)
        if kind not in self._known:
            rest = opening_at_rest(self._stepper, slab)
            self._known[kind] = rest, int(rest.argmax())
        return self._known[kind]

    def put_aside_all(self) -> None:
        """Put aside all slabs."""
        self._extremes.put_aside_all()

    def take(self) -> dict[str, Reals]:
        """Columns of the slabs put aside since the last call, shape (B, slabs) each."""
        slabs, largest, smallest = self._extremes.take()
        at_rest = np.array([max(self._largest_at_rest(slab), 0.0) for slab in slabs])
        return {
            "opening_at_rest": np.broadcast_to(at_rest, largest.shape[:2]),
            "largest_opening": largest[..., LARGEST],
            "smallest_opening": smallest[..., AT_PLACE],
            "closings": largest[..., CLOSINGS],
        }

    def _largest_at_rest(self, slab: int) -> float:
        return float(self._rest(slab)[0].max()) if self._dead.of(slab) > 0 else 0.0

    def saved(self) -> dict[str, Reals]:
        """Values that the coming slabs depend on, when nothing is put aside."""
        own = {"closed": self._closed.astype(np.float64), "count": self._count}
        return own | {f"extremes_{key}": value for key, value in self._extremes.saved().items()}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Continue from the values of :meth:`saved`."""
        self._closed[:], self._count[:] = saved["closed"] > 0.0, saved["count"]
        prefix = "extremes_"
        self._extremes.restore({key.removeprefix(prefix): v for key, v in saved.items() if key.startswith(prefix)})
