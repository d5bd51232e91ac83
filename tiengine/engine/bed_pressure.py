"""Extreme pressures of the mortar under recorded slabs, where the bed is wholly implicit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from tiengine.engine.chunk import Chunk
from tiengine.engine.window import slabs_in_slots
from tiengine.model.model import Model
from tiengine.parameters.arrays import Ints

__all__ = ["designs_in_slots", "fill_pressures"]

BLOCK = 256
"""Slabs of a product: its result stays in the cache while it is scaled and searched."""


def fill_pressures(model: Model, chunk: Chunk) -> None:
    """Compute the largest and smallest pressure of every slab in every filled row.

    The pressure of the slab's weight, and k_m u + c_m v at the quadrature points of the bed.

    Args:
        model: Gives the bed's points, stiffness and damping, factors and pressures at rest by design.
        chunk: ``slab`` and ``rear_slab`` are read, ``mortar`` is filled.
    """
    (k, c), rows = model.bed_numbers[:2], chunk.filled
    kinds = designs_in_slots(model.ingredients.designs.of_slab, chunk.rear_slab[:rows], chunk.mortar.shape[2])
    factor, at_rest = (values.reshape(len(values), -1) for values in (model.bed_factor, model.bed_rest))
    even = all((values == values[0, 0]).all() for values in (factor, at_rest)) and factor[0, 0] == 1.0
    together = max(BLOCK // chunk.mortar.shape[2], 1)
    for motion, out in zip(chunk.slab, chunk.mortar, strict=True):
        for first in range(0, rows, together):
            here = slice(first, min(first + together, rows))
            moved = k * motion[here, 0] + c * motion[here, 1]
            pressure = moved.reshape(-1, moved.shape[-1]) @ model.bed_points
            if even:
                pressure += at_rest[0, 0]
            else:
                kind = kinds[here].ravel()
                pressure *= factor[kind]
                pressure += at_rest[kind]
            extremes = out[here].reshape(-1, 2)
            pressure.max(axis=1, out=extremes[:, 0])
            pressure.min(axis=1, out=extremes[:, 1])


def designs_in_slots(of_slab: Mapping[int, int], rear_slab: Ints, slots: int) -> Ints:
    """Design of the slab in each slot, shape (rows, slots).

    Args:
        of_slab: Design of the slabs (by index along the track) that are not sound.
        rear_slab: Rear slab in memory, shape (rows,).
        slots: Slabs in memory.
    """
    slab = slabs_in_slots(rear_slab, slots)
    designs = np.zeros_like(slab)
    for number, design in of_slab.items():
        designs[slab == number] = design
    return designs
