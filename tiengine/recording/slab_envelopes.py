"""Extremes of every slab while it is in memory, in arrays of the window's size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.stepper import Stepper
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Reals
from tiengine.recording.slab_moments import SlabMoments
from tiengine.result_files.layout import Block
from tiengine.scenario.scenario import Scenario
from tiengine.track.slab_matrices import seat_shapes

__all__ = ["SlabEnvelopes", "SlotExtremes"]

ROWS = 25
"""Samples of a product: its result stays in the cache while it is searched."""


@dataclass(eq=False)
class SlotExtremes:
    """Running extremes by slot (see :mod:`tiengine.engine.state`); slabs that leave are reduced and put aside.

    Attributes:
        largest, smallest: Extremes of the slab in each slot, shape (B, slots, points).
        starts: First point of each quantity; a quantity's points are reduced to one when a slab leaves.
        first_slab: Rear slab, -1 before the first sample.
    """

    largest: NDArray[np.float64]
    smallest: NDArray[np.float64]
    starts: tuple[int, ...] = (0,)
    first_slab: int = -1
    _left: list[tuple[int, NDArray[np.float64]]] = field(default_factory=list)

    @classmethod
    def of(cls, trains: int, slots: int, points: int, starts: tuple[int, ...] = (0,)) -> SlotExtremes:
        """Extremes before the first sample."""
        shape = (trains, slots, points)
        return cls(np.full(shape, -np.inf), np.full(shape, np.inf), starts)

    def move(self, first_slab: int) -> None:
        """Put aside the slabs behind a new rear slab; their slots start again."""
        if first_slab == self.first_slab:
            return
        slots = self.largest.shape[1]
        for slab in range(self.first_slab, min(first_slab, self.first_slab + slots)) if self.first_slab >= 0 else ():
            largest, smallest = self.largest[:, slab % slots], self.smallest[:, slab % slots]
            reduced = np.maximum.reduceat(largest, self.starts, -1), np.minimum.reduceat(smallest, self.starts, -1)
            self._left.append((slab, np.stack(reduced)))
            largest[:], smallest[:] = -np.inf, np.inf
        self.first_slab = first_slab

    def add(self, largest: Reals, smallest: Reals, trains: slice = slice(None)) -> None:
        """Take in new values.

        Args:
            largest: Largest values of the slabs in all slots since the last call, shape (B, slots, points).
            smallest: Smallest values.
            trains: Those of these trains.
        """
        np.maximum(self.largest[trains], largest, out=self.largest[trains])
        np.minimum(self.smallest[trains], smallest, out=self.smallest[trains])

    def take(self) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Slabs put aside since the last call: their indices (n,), largest and smallest (B, n, quantities)."""
        left, self._left = self._left, []
        none = np.empty((2, len(self.largest), 0, len(self.starts)))
        largest, smallest = np.concatenate([none, *(extremes[:, :, None] for _, extremes in left)], axis=2)
        return np.array([slab for slab, _ in left], dtype=np.int64), largest, smallest

    def put_aside_all(self) -> None:
        """Put aside all slabs."""
        if self.first_slab >= 0:
            self.move(self.first_slab + self.largest.shape[1])

    def saved(self) -> dict[str, NDArray[np.float64]]:
        """Values that the coming slabs depend on, when nothing is put aside."""
        return {"largest": self.largest, "smallest": self.smallest, "first": np.array(float(self.first_slab))}

    def restore(self, saved: Mapping[str, NDArray[np.float64]]) -> None:
        """Continue from the values of :meth:`saved`."""
        self.largest[:], self.smallest[:] = saved["largest"], saved["smallest"]
        self.first_slab = int(saved["first"])


@dataclass(eq=False)
class SlabEnvelopes:
    """Extremes of every slab over the bodies' samples.

    Attributes:
        stepper: Is watched.
        void: Smallest factor of the voids under each slab that has one.
        moments: Bending moments by the motion.
        shape: Deflection at the nodes and under the seats, moments at the places of :mod:`tiengine.track.slab_moments`.
        pressure: Of the mortar.
    """

    stepper: Stepper
    void: Mapping[int, float]
    moments: SlabMoments
    shape: SlotExtremes
    pressure: SlotExtremes

    def __post_init__(self) -> None:
        """Operator on the slabs' coordinates."""
        self._places = _deflections(self.stepper.ingredients)

    @classmethod
    def of(cls, scenario: Scenario, stepper: Stepper) -> SlabEnvelopes:
        """Extremes before the first sample."""
        void: dict[int, float] = {}
        for each in scenario.track.mortar_voids:
            void[each.slab] = min(each.factor, void.get(each.slab, each.factor))
        moments, nodes = SlabMoments(stepper.ingredients), _deflections(stepper.ingredients).shape[1]
        trains, slots = stepper.state.trains, stepper.state.slots
        starts = (0, nodes, nodes + moments.points)
        shape = SlotExtremes.of(trains, slots, nodes + 2 * moments.points, starts)
        return cls(stepper, void, moments, shape, SlotExtremes.of(trains, slots, 1))

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """Take in the bodies' samples of the chunk; slabs that were left behind, train by train.

        Neither times nor positions matter.
        """
        chunk = self.stepper.chunk
        rear = chunk.rear_slab[: chunk.filled]
        for slab in np.unique(rear):
            rows = slice(*np.searchsorted(rear, (slab, slab + 1)).tolist())  # the window never goes back
            self._take_in(int(slab), chunk.slab[:, rows], chunk.mortar[:, rows])
        return self._taken()

    def _take_in(self, rear: int, moved: Reals, pressure: Reals) -> None:
        """Take in samples with one rear slab: motion (B, rows, 3, slots, dofs), pressures (B, rows, slots, 2)."""
        self.pressure.move(rear)
        self.pressure.add(pressure[..., :1].max(axis=1), pressure[..., 1:].min(axis=1))
        self.shape.move(rear)
        for b, motion in enumerate(moved):
            for first in range(0, len(motion), ROWS):
                part = motion[first : first + ROWS]
                values = np.concatenate([part[:, 0] @ self._places, self.moments.of(rear, part)], axis=2)
                self.shape.add(values.max(axis=0), values.min(axis=0), slice(b, b + 1))

    def remainder(self) -> list[Block]:
        """Slabs still in memory."""
        self.shape.put_aside_all()
        self.pressure.put_aside_all()
        return self._taken()

    def saved(self) -> dict[str, Reals]:
        """Values that the coming slabs depend on, when nothing is put aside."""
        rows = {"shape": self.shape.saved(), "pressure": self.pressure.saved()}
        return {f"{part}_{key}": value for part, saved in rows.items() for key, value in saved.items()}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Continue from the values of :meth:`saved`."""
        for part, extremes in (("shape_", self.shape), ("pressure_", self.pressure)):
            extremes.restore({key.removeprefix(part): saved[key] for key in saved if key.startswith(part)})

    def _taken(self) -> list[Block]:
        """Slabs that were put aside since the last call."""
        slab = self.stepper.ingredients.slab
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


def _deflections(ingredients: Ingredients) -> Reals:
    """Slab coordinates to the deflection at the nodes and under the fastenings, shape (dofs, points).

    Of a coarse mesh no node may be near the fastenings.
    """
    slab, seats = ingredients.slab, 2 * ingredients.slab.fastenings
    shapes = seat_shapes(ingredients.designs.matrices[0])
    nodes = np.eye(len(shapes))[:, : slab.plate_dofs : 3]
    return np.hstack([nodes, shapes[:, :seats]])
