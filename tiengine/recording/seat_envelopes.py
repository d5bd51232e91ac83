"""Extremes of every seat over a whole run.

Running extremes are kept of all seats in the window. A seat that the window leaves behind is put aside and goes to the
file with the chunk; at the end of the run so do those still in the window, some of which the train has not passed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tiengine.engine.stepper import Plan, Stepper
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Flags, Reals
from tiengine.result_files.layout import Block

__all__ = ["SeatEnvelopes", "watched_seats"]


def watched_seats(ingredients: Ingredients) -> tuple[int, int]:
    """Places of the window (first, end) where the seats' forces are those of whole fastenings alone.

    Whatever the phase -r < s_0 <= d - r of the seats, which reach r along the rail, those in these places stand with
    their whole length inside the window and outside its absorbing zones, where springs to the ground add to the forces
    on the rail.
    """
    reach, length, spacing = ingredients.seat_reach, ingredients.length, ingredients.slab.fastening_pitch
    margin = max(ingredients.absorbing_zone, reach)
    return math.ceil((margin + reach) / spacing - 1e-9), math.floor((length - margin + reach) / spacing + 1e-9)


@dataclass(eq=False)
class SeatEnvelopes:
    """Extremes of the fastenings' forces over every step.

    Attributes:
        stepper: Is watched.
        largest, smallest: Extremes of the seat at each place of the window, shape (B, 2, 3, seats), rows as
            ``State.seat_forces``; places before the watched ones hold nothing of use.
        first_seat: Rear seat, -1 before the first step.
    """

    stepper: Stepper
    largest: Reals
    smallest: Reals
    first_seat: int = -1
    _left: list[tuple[int, Reals]] = field(default_factory=list)

    @classmethod
    def of(cls, stepper: Stepper) -> SeatEnvelopes:
        """Envelopes before the first step."""
        shape = stepper.state.seat_forces.shape
        return cls(stepper, np.full(shape, -np.inf), np.full(shape, np.inf))

    @property
    def stage(self) -> str:
        """Name of its stage of the step."""
        return "envelopes"

    def due(self, plan: Plan) -> Flags:
        """Steps after which the seats' extremes are taken."""
        return self.stepper.seat_extremes_due(plan)

    def watch(self) -> None:
        """Take in the forces of the steps since the last time."""
        state = self.stepper.state
        if state.first_seat != self.first_seat:
            self._move(state.first_seat)
        state.widen(self.smallest, self.largest)

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """Seats that were left behind, train by train; neither times nor positions matter."""
        ingredients = self.stepper.ingredients
        left, self._left = self._left, []
        none = np.empty((2, *self.largest.shape[:-1], 0))
        seats = np.concatenate([np.arange(0), *(first + np.arange(found.shape[-1]) for first, found in left)])
        largest, smallest = np.concatenate([none, *(found for _, found in left)], axis=-1)
        factor = np.concatenate([np.ones((0, 2)), *(ingredients.bound_factors(int(seat), 1) for seat in seats)])
        chainage: Reals = (seats + 0.5) * ingredients.slab.fastening_pitch
        return [
            Block(
                seats,
                chainage,
                {
                    "largest_vertical_force": largest[b, :, 0].T,
                    "smallest_vertical_force": smallest[b, :, 0].T,
                    "largest_lateral_force": largest[b, :, 1].T,
                    "smallest_lateral_force": smallest[b, :, 1].T,
                    "factor": factor,
                },
            )
            for b in range(len(largest))
        ]

    def remainder(self) -> list[Block]:
        """Seats still in the window."""
        first, end = watched_seats(self.stepper.ingredients)
        if self.first_seat >= 0:
            self._put_aside(end - first)
        return self.blocks(np.zeros(0), np.zeros(0))

    def saved(self) -> dict[str, Reals]:
        """Values that the coming seats depend on, when nothing is put aside."""
        return {"largest": self.largest, "smallest": self.smallest, "first": np.array(float(self.first_seat))}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Continue from the values of :meth:`saved`."""
        self.largest[:], self.smallest[:] = saved["largest"], saved["smallest"]
        self.first_seat = int(saved["first"])

    def _put_aside(self, count: int) -> None:
        """Put aside the rear ``count`` of the watched seats."""
        first, _ = watched_seats(self.stepper.ingredients)
        rear = slice(first, first + count)
        self._left.append((self.first_seat + first, np.stack([self.largest[..., rear], self.smallest[..., rear]])))

    def _move(self, first_seat: int) -> None:
        """Shift the seats to their new places; seats that enter the watched part start again."""
        _, end = watched_seats(self.stepper.ingredients)
        passed = first_seat - self.first_seat
        if self.first_seat >= 0:
            self._put_aside(passed)
            for array, nothing in ((self.largest, -np.inf), (self.smallest, np.inf)):
                array[..., :-passed] = array[..., passed:]
                array[..., end - passed :] = nothing
        self.first_seat = first_seat
