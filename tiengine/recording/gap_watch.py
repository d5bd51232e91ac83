"""Gaps of a scenario that close: those under slabs and of hanging seats, each reported once a train."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tiengine.engine.state import DISPLACEMENT
from tiengine.engine.stepper import Stepper
from tiengine.parameters.arrays import Flags, Reals
from tiengine.parameters.conventions import SIDES
from tiengine.recording.slab_openings import opening_at_rest
from tiengine.scenario.tables import Track
from tiengine.track.defects import RAILS
from tiengine.track.slab_matrices import bed_points

__all__ = ["GapWatch"]

CARRIES = 1.0  # N: a hanging seat that carries more has closed


@dataclass(frozen=True, eq=False)
class GapWatch:
    """Looks at the gaps in the window.

    Attributes:
        stepper: Its state is looked at.
        slabs: Slabs over gaps, by index.
        seats: Hanging seats, index and side.
        rest: Opening at rest of each slab where it is largest [m], and slab coordinates to w there, shape (dofs,).
    """

    stepper: Stepper
    slabs: tuple[int, ...]
    seats: tuple[tuple[int, int], ...]
    rest: tuple[tuple[float, Reals], ...]

    @classmethod
    def of(cls, track: Track, stepper: Stepper) -> GapWatch:
        """Find the gaps of a track.

        Args:
            track: Of the scenario.
            stepper: Is watched.
        """
        slabs = tuple(sorted({void.slab for void in track.mortar_voids if void.gap}))
        seats = sorted(
            {
                (seat, side)
                for row in track.failed_fastenings
                if row.gap
                for seat in range(row.seats[0], row.seats[1] + 1)
                for side in RAILS[row.rail]
            }
        )
        rest = []
        for slab in slabs:
            opening = opening_at_rest(stepper, slab)
            place = int(opening.argmax())
            rest.append((float(opening[place]), bed_points(stepper.ingredients.designs.matrices[0])[:, place]))
        return cls(stepper, slabs, tuple(seats), tuple(rest))

    @property
    def count(self) -> int:
        """Number of gaps."""
        return len(self.slabs) + len(self.seats)

    def closed(self) -> Flags:
        """Gaps that are closed now, False out of the window; shape (B, gaps)."""
        state = self.stepper.state
        closed: Flags = np.zeros((state.trains, self.count), dtype=np.bool_)
        under = [i for i, slab in enumerate(self.slabs) if state.first_slab <= slab < state.first_slab + state.slots]
        if under:
            motion = state.slab_motion(DISPLACEMENT)
            for i in under:
                opening, shape = self.rest[i]
                closed[:, i] = motion[:, self.slabs[i] % state.slots] @ shape >= opening
        places = [(i, seat - state.first_seat, side) for i, (seat, side) in enumerate(self.seats, len(self.slabs))]
        near = [each for each in places if 0 <= each[1] < self.stepper.ingredients.seats]
        if near:
            forces = state.seat_forces
            for i, place, side in near:
                closed[:, i] = np.abs(forces[:, side, 0, place]) > CARRIES
        return closed

    def fresh(self, closed: Flags, known: Flags) -> Iterator[tuple[int, str, str]]:
        """Yield train, side and words of gaps that close for the first time; they are then known.

        Args:
            closed: From :meth:`closed`.
            known: Those that have closed before, shape (B, gaps); added to.
        """
        for train, i in np.argwhere(closed & ~known).tolist():
            if i < len(self.slabs):
                yield train, "", f"the gap under slab {self.slabs[i]} has closed"
            else:
                seat, side = self.seats[i - len(self.slabs)]
                yield train, SIDES[side], f"seat {seat} {SIDES[side]}, which hangs, has closed its gap"
        known |= closed
