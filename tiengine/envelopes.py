"""Extremes of every seat and slab over a whole run.

Running extremes are kept of what the window holds. A seat or slab that it leaves behind is put aside and goes to the
file with the chunk; at the end of the run so do those still in the window, some of which the train has not passed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.state import State
from tiengine.engine.stepper import Stepper
from tiengine.kernels import layout as at
from tiengine.model.model import Model
from tiengine.result_files.layout import Block
from tiengine.scenario.scenario import Scenario
from tiengine.slot_extremes import SlotExtremes
from tiengine.track.plate_shapes import moment_operator

__all__ = ["SeatEnvelopes", "SlabEnvelopes", "watched_seats"]

Reals = NDArray[np.float64]


def watched_seats(model: Model) -> tuple[int, int]:
    """Places of the window (first, end) where forces are those of fastenings alone.

    Whatever the phase 0 < s_0 <= d of the seats, those in these places stand inside the window and outside its
    absorbing zones, where springs to the ground add to the forces on the rail.
    """
    zone, length, spacing = (float(model.constants[i]) for i in (at.ABSORBING_ZONE, at.LENGTH, at.SPACING))
    return math.ceil(zone / spacing - 1e-9), math.floor((length - zone) / spacing + 1e-9)


@dataclass(eq=False)
class SeatEnvelopes:
    """Extremes of the fastenings' forces over every step.

    Attributes:
        model, state: What is watched.
        largest, smallest: Of the seat at each place of the window, shape (B, 2, 3, seats), rows as
            ``State.seat_force``; places before the watched ones hold nothing of use.
        first_seat: Rear seat, -1 before the first step.
    """

    model: Model
    state: State
    largest: Reals
    smallest: Reals
    first_seat: int = -1
    _left: list[tuple[int, Reals]] = field(default_factory=list)

    @classmethod
    def of(cls, stepper: Stepper) -> SeatEnvelopes:
        """Nothing seen yet."""
        state = stepper.state
        return cls(
            stepper.model, state, np.full_like(state.seat_force, -np.inf), np.full_like(state.seat_force, np.inf)
        )

    @property
    def stage(self) -> str:
        """What its part of a step is called."""
        return "envelopes"

    def watch(self) -> None:
        """Take in the forces of a step."""
        if self.state.first_seat != self.first_seat:
            self._move(self.state.first_seat)
        np.maximum(self.largest, self.state.seat_force, out=self.largest)
        np.minimum(self.smallest, self.state.seat_force, out=self.smallest)

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """Seats that were left behind, train by train; neither times nor positions matter."""
        left, self._left = self._left, []
        none = np.empty((2, *self.largest.shape[:-1], 0))
        seats = np.concatenate([np.arange(0), *(first + np.arange(found.shape[-1]) for first, found in left)])
        largest, smallest = np.concatenate([none, *(found for _, found in left)], axis=-1)
        factor = np.concatenate([np.ones((0, 2)), *(self.model.given.seat_factors(int(seat), 1) for seat in seats)])
        chainage: Reals = (seats + 0.5) * float(self.model.constants[at.SPACING])
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

    def rest(self) -> list[Block]:
        """Seats still in the window."""
        first, end = watched_seats(self.model)
        if self.first_seat >= 0:
            self._put_aside(end - first)
        return self.blocks(np.zeros(0), np.zeros(0))

    def saved(self) -> dict[str, Reals]:
        """What the coming seats depend on, when nothing is put aside."""
        return {"largest": self.largest, "smallest": self.smallest, "first": np.array(float(self.first_seat))}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Go on from what :meth:`saved` gave."""
        self.largest[:], self.smallest[:] = saved["largest"], saved["smallest"]
        self.first_seat = int(saved["first"])

    def _put_aside(self, count: int) -> None:
        """The rear ``count`` of the watched seats."""
        first, _ = watched_seats(self.model)
        rear = slice(first, first + count)
        self._left.append((self.first_seat + first, np.stack([self.largest[..., rear], self.smallest[..., rear]])))

    def _move(self, first_seat: int) -> None:
        """Shift the seats to their new places; those that come to be watched begin anew."""
        _, end = watched_seats(self.model)
        passed = first_seat - self.first_seat
        if self.first_seat >= 0:
            self._put_aside(passed)
            for array, nothing in ((self.largest, -np.inf), (self.smallest, np.inf)):
                array[..., :-passed] = array[..., passed:]
                array[..., end - passed :] = nothing
        self.first_seat = first_seat


@dataclass(eq=False)
class SlabEnvelopes:
    """Extremes of every slab over the bodies' samples.

    Attributes:
        stepper: What is watched.
        void: Smallest factor of the voids under each slab that has one.
        shape: Deflection at the nodes and under the seats, moments at the points of :mod:`tiengine.track.slab_moments`.
        pressure: Of the mortar; it lags behind, as pressures come at the end of a chunk.
    """

    stepper: Stepper
    void: Mapping[int, float]
    shape: SlotExtremes
    pressure: SlotExtremes

    def __post_init__(self) -> None:
        """Buffers of a sample."""
        slabs = self.stepper.state.view(at.U, "slabs")
        self._operator, _ = _measures(self.stepper.model)
        self._motion = slabs.reshape(-1, slabs.shape[-1])
        self._felt = np.empty(self.shape.largest.shape)
        self._first: list[int] = []

    @classmethod
    def of(cls, scenario: Scenario, stepper: Stepper) -> SlabEnvelopes:
        """Nothing seen yet."""
        void: dict[int, float] = {}
        for each in scenario.track.mortar_voids:
            void[each.slab] = min(each.factor, void.get(each.slab, each.factor))
        operator, starts = _measures(stepper.model)
        trains, slots = stepper.state.design.shape
        shape = SlotExtremes.of(trains, slots, operator.shape[1], starts)
        return cls(stepper, void, shape, SlotExtremes.of(trains, slots, 1))

    @property
    def stage(self) -> str:
        """What its part of a step is called."""
        return "envelopes"

    def watch(self) -> None:
        """Take in the slabs' shape if the step is one that the bodies are asked for."""
        if self.stepper.asked[2] < 0:
            return
        first = self.stepper.state.first_slab
        self.shape.move(first)
        np.dot(self._motion, self._operator, self._felt.reshape(len(self._motion), -1))
        self.shape.add(self._felt, self._felt)
        self._first.append(first)

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """Slabs that were left behind, train by train; neither times nor positions matter."""
        first, mortar = np.array(self._first, dtype=np.int64), self.stepper.chunk.mortar
        self._first.clear()
        for slab in np.unique(first):
            rows = slice(*np.searchsorted(first, (slab, slab + 1)))  # the window never goes back
            self.pressure.move(int(slab))
            self.pressure.add(mortar[:, rows, :, :1].max(axis=1), mortar[:, rows, :, 1:].min(axis=1))
        return self._taken()

    def rest(self) -> list[Block]:
        """Slabs still in memory."""
        self.shape.leave()
        self.pressure.leave()
        return self._taken()

    def saved(self) -> dict[str, Reals]:
        """What the coming slabs depend on, when nothing is put aside."""
        rows = {"shape": self.shape.saved(), "pressure": self.pressure.saved()}
        return {f"{part}_{key}": value for part, saved in rows.items() for key, value in saved.items()}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Go on from what :meth:`saved` gave."""
        for part, extremes in (("shape_", self.shape), ("pressure_", self.pressure)):
            extremes.restore({key.removeprefix(part): saved[key] for key in saved if key.startswith(part)})

    def _taken(self) -> list[Block]:
        """What was put aside."""
        slab = self.stepper.model.given.slab
        slabs, largest, smallest = self.shape.take()
        _, *pressure = self.pressure.take()
        names = ("pressure", "deflection", "moment_x", "moment_y")
        columns = {
            f"{which}_{name}": values[..., i]
            for which, values in (
                ("largest", np.concatenate([pressure[0], largest], axis=-1)),
                ("smallest", np.concatenate([pressure[1], smallest], axis=-1)),
            )
            for i, name in enumerate(names)
        }
        factor = np.array([self.void.get(int(index), 1.0) for index in slabs])
        chainage = np.asarray((slabs + 0.5) * slab.pitch, np.float64)
        return [
            Block(slabs, chainage, {name: values[b] for name, values in columns.items()} | {"mortar_factor": factor})
            for b in range(len(largest))
        ]


def _measures(model: Model) -> tuple[Reals, tuple[int, int, int]]:
    """Slab coordinates to deflection, M_x, M_y, shape (dofs, points), and the first point of each.

    The deflection is taken at the nodes and under the fastenings: of a coarse mesh no node may be near these.
    """
    slab, seats = model.given.slab, 2 * model.given.slab.fastenings
    moments = moment_operator(slab)
    nodes = np.eye(len(moments))[:, : slab.plate_dofs : 3]
    places = np.hstack([nodes, model.slab_seats[:, :seats]])
    n, points = places.shape[1], moments.shape[2]
    return np.hstack([places, moments[:, 0], moments[:, 1]]), (0, n, n + points)
