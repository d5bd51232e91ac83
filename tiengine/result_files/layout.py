"""What the groups of a result file hold: the dimension along which they grow, other dimensions, labels, channels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES
from tiengine.result_files.channels import DIRECTIONS, DOFS, GROUPS, Channel

__all__ = ["CHUNK", "DTYPES", "SEAT", "SLAB", "TIME", "Axis", "Block", "GroupSpec", "TrainLabels"]

CHUNK = 1000  # samples: a chunk of a coach's channel is 32 kB


@dataclass(frozen=True)
class Axis:
    """The dimension along which a group grows, and the chainage that goes with it.

    Attributes:
        name: Of the dimension and of the dataset that is its scale.
        meaning: Of its values.
        dtype: Of its values in the file.
        place: Name of the dataset of chainages [m].
        place_meaning: Of the chainages.
    """

    name: str
    meaning: Channel
    dtype: str
    place: str
    place_meaning: Channel


TIME = Axis("time", Channel("s", "time"), "f8", "position", Channel("m", "chainage of the first vehicle's centre"))
SEAT = Axis("seat", Channel("1", "seat, counted from chainage 0"), "i4", "chainage", Channel("m", "chainage"))
SLAB = Axis("slab", Channel("1", "slab, counted from chainage 0"), "i4", "chainage", Channel("m", "of its centre"))

DIMENSIONS = {
    "wheel": ("wheelset", "side"),
    "irregularity": ("wheelset", "side"),
    "body": ("body", "dof"),
    "mortar": ("slot",),
    "seats": ("side",),
    "slabs": (),
    "deflection": ("side", "point"),
}
"""Dimensions of the standard groups besides the one along which they grow."""


@dataclass(frozen=True)
class TrainLabels:
    """Labels of one train.

    Attributes:
        vehicles: Names of the vehicles.
        bodies: Names of the bodies, unique in the train.
        wheelset_vehicle: Vehicle of each wheelset, from 0, shape (wheelsets,).
        wheelset_offset: Wheelset relative to the first vehicle's centre [m], shape (wheelsets,).
        slots: Slabs in the window.
        point_offset: Points of the deflected track relative to the first vehicle's centre [m], shape (points,).
    """

    vehicles: Sequence[str]
    bodies: Sequence[str]
    wheelset_vehicle: NDArray[np.integer[Any]]
    wheelset_offset: Reals
    slots: int = 0
    point_offset: Reals = field(default_factory=lambda: np.zeros(0))

    def scales(self, dimensions: Sequence[str]) -> dict[str, tuple[Any, Channel]]:
        """Values and meaning of the labels along some dimensions."""
        known: dict[str, tuple[Any, Channel]] = {
            "wheelset": (
                np.arange(1, len(self.wheelset_offset) + 1, dtype=np.int32),
                Channel("1", "wheelset, 1 leads"),
            ),
            "side": (list(SIDES), Channel("1", "side of the track, looking forward")),
            "body": (list(self.bodies), Channel("1", "body of the train")),
            "dof": (list(DOFS), Channel("1", "degree of freedom of a body")),
            "slot": (np.arange(self.slots, dtype=np.int32), Channel("1", "place of a slab in memory")),
            "point": (np.arange(len(self.point_offset), dtype=np.int32), Channel("1", "point of the track")),
            "direction": (list(DIRECTIONS), Channel("1", "direction: y right, z down")),
        }
        return {name: known[name] for name in dimensions}

    def details(self, dimension: str) -> dict[str, tuple[NDArray[Any], Channel]]:
        """Values and meaning of what else is known along a dimension, by name."""
        if dimension == "wheelset":
            return {
                "wheelset_vehicle": (
                    np.asarray(self.wheelset_vehicle, np.int32),
                    Channel("1", "vehicle of the wheelset, 0 leads"),
                ),
                "wheelset_offset": (
                    np.asarray(self.wheelset_offset, np.float64),
                    Channel("m", "wheelset forward of the first vehicle's centre"),
                ),
            }
        if dimension == "point":
            return {"offset": (self.point_offset, Channel("m", "point forward of the first vehicle's centre"))}
        return {}


@dataclass(frozen=True)
class GroupSpec:
    """What a group of channels holds.

    Attributes:
        dimensions: Dimensions after the one along which it grows, such as ``("wheelset", "side")``.
        channels: Units and meaning by name.
        times_of: Group that is sampled at the same times and whose coordinates are linked; None for its own.
        axis: Along which it grows.
        chunk: Samples that the file keeps together.
        attributes: Of the group.
    """

    dimensions: tuple[str, ...]
    channels: Mapping[str, Channel]
    times_of: str | None = None
    axis: Axis = TIME
    chunk: int = CHUNK
    attributes: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def standard(cls, group: str, names: Sequence[str], times_of: str | None = None) -> GroupSpec:
        """Some channels of one of the groups of :mod:`tiengine.result_files.channels`."""
        axis = {"seats": SEAT, "slabs": SLAB}.get(group, TIME)
        chunk = 20 if group == "deflection" else CHUNK  # a sample has hundreds of points, and is rare
        return cls(DIMENSIONS[group], {name: GROUPS[group][name] for name in names}, times_of, axis, chunk)


@dataclass(frozen=True, eq=False)
class Block:
    """Samples of one group of one train.

    Attributes:
        along: Times [s], or indices of seats or slabs, shape (n,); ignored where the group shares another one's.
        place: Chainages that belong to them [m], shape (n,); likewise.
        channels: Every channel of the group, shape (n, *dimensions).
    """

    along: NDArray[Any]
    place: Reals
    channels: Mapping[str, NDArray[Any]]


DTYPES = {"single": np.float32, "double": np.float64}
