"""Extremes of every slab while it is in memory, in arrays of the window's size."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tiengine.engine.stepper import Stepper
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Reals
from tiengine.recording.slab_moments import SlabMoments
from tiengine.recording.slab_openings import SlabOpenings
from tiengine.recording.slot_extremes import SlotExtremes
from tiengine.result_files.layout import Block
from tiengine.scenario.scenario import Scenario
from tiengine.track.slab_matrices import seat_shapes

__all__ = ["SlabEnvelopes"]

ROWS = 25
"""Samples of a product: its result stays in the cache while it is searched."""


@dataclass(eq=False)
class SlabEnvelopes:
    """Extremes of every slab over the bodies' samples.

    Attributes:
        stepper: Is watched.
        void: Smallest factor of the voids under each slab that has one, 0 over a gap.
        moments: Bending moments by the motion.
        shape: Deflection at the nodes and under the seats, moments at the places of :mod:`tiengine.track.slab_moments`.
        pressure: Of the mortar.
        openings: Openings between slabs and bed; None if the bed has tension.
    """

    stepper: Stepper
    void: Mapping[int, float]
    moments: SlabMoments
    shape: SlotExtremes
    pressure: SlotExtremes
    openings: SlabOpenings | None = None

    def __post_init__(self) -> None:
        """Operator on the slabs' coordinates."""
        self._places = _deflections(self.stepper.ingredients)

    @classmethod
    def of(cls, scenario: Scenario, stepper: Stepper) -> SlabEnvelopes:
        """Extremes before the first sample."""
        void: dict[int, float] = {}
        for each in scenario.track.mortar_voids:
            factor = 0.0 if each.gap else each.factor
            void[each.slab] = min(factor, void.get(each.slab, factor))
        moments, nodes = SlabMoments(stepper.ingredients), _deflections(stepper.ingredients).shape[1]
        trains, slots = stepper.state.trains, stepper.state.slots
        starts = (0, nodes, nodes + moments.points)
        shape = SlotExtremes.of(trains, slots, nodes + 2 * moments.points, starts)
        dead = stepper.ingredients.dead
        openings = None if dead is None else SlabOpenings(stepper, dead)
        return cls(stepper, void, moments, shape, SlotExtremes.of(trains, slots, 1), openings)

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
        if self.openings is not None:
            self.openings.take_in(rear, moved)
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
        if self.openings is not None:
            self.openings.put_aside_all()
        return self._taken()

    def saved(self) -> dict[str, Reals]:
        """Values that the coming slabs depend on, when nothing is put aside."""
        rows = {name: part.saved() for name, part in self._parts.items()}
        return {f"{part}_{key}": value for part, saved in rows.items() for key, value in saved.items()}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Continue from the values of :meth:`saved`."""
        for name, part in self._parts.items():
            own = f"{name}_"
            part.restore({key.removeprefix(own): saved[key] for key in saved if key.startswith(own)})

    @property
    def _parts(self) -> dict[str, SlotExtremes | SlabOpenings]:
        """Memories by name."""
        parts: dict[str, SlotExtremes | SlabOpenings] = {"shape": self.shape, "pressure": self.pressure}
        return parts if self.openings is None else parts | {"openings": self.openings}

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
        if self.openings is not None:
            columns |= self.openings.take()
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
