"""Layout of a result file: dimensions of its groups, coordinates, labels, channels.

Every group grows along its first dimension; the other dimensions have a fixed length per train.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES
from tiengine.result_files.channels import (
    DIRECTIONS,
    DOFS,
    GAUGE_FORCE,
    GAUGE_MOTION,
    GAUGE_OPENING,
    GROUPS,
    Channel,
)  # fmt: skip

__all__ = [
    "AUXILIARY", "AXES", "CHUNK", "DIMENSIONS", "DTYPES", "GAUGES", "GAUGE_DIMENSIONS", "SEAT", "SLAB", "TIME", "Axis",
    "Block", "GroupSpec", "TrainLabels",
]  # fmt: skip

CHUNK = 1000  # samples; for one coach a chunk of a wheel channel has 32 kB


@dataclass(frozen=True)
class Axis:
    """Dimension along which a group grows, with its dataset of chainages.

    Attributes:
        name: Name of the dimension and of its dimension scale.
        meaning: Unit and meaning of the scale.
        dtype: Data type of the scale in the file.
        chainage: Name of the dataset of chainages [m].
        chainage_meaning: Unit and meaning of the chainages.
    """

    name: str
    meaning: Channel
    dtype: str
    chainage: str
    chainage_meaning: Channel


TIME = Axis("time", Channel("s", "time"), "f8", "position", Channel("m", "chainage of the first vehicle's centre"))
SEAT = Axis("seat", Channel("1", "seat, counted from chainage 0"), "i4", "chainage", Channel("m", "chainage"))
SLAB = Axis("slab", Channel("1", "slab, counted from chainage 0"), "i4", "chainage", Channel("m", "of its centre"))

AXES = {axis.name: axis for axis in (TIME, SEAT, SLAB)}
"""Dimensions along which groups grow, by name."""

DIMENSIONS = {
    "wheel": ("time", "wheelset", "side"),
    "patch": ("time", "wheelset", "side", "patch"),
    "irregularity": ("time", "wheelset", "side"),
    "body": ("time", "body", "dof"),
    "mortar": ("time", "slot"),
    "seats": ("seat", "side"),
    "slabs": ("slab",),
    "deflection": ("time", "side", "point"),
}
"""Dimensions of the channels of each standard group, the growing one first."""

GAUGES = "gauges"
"""Group that holds one group per gauge."""

GAUGE_DIMENSIONS = {"motion": ("time", "direction"), "force": ("time",), "opening": ("time",)}
"""Dimensions of a gauge's channels: of one on a rail or slab, of one on a fastening, of one in a gap."""

AUXILIARY = {"wheelset_vehicle": "wheelset", "wheelset_offset": "wheelset", "offset": "point"}
"""Auxiliary coordinates and the dimension along which each runs."""


@dataclass(frozen=True)
class TrainLabels:
    """Labels and auxiliary coordinates of one train.

    Attributes:
        vehicles: Names of the vehicles.
        bodies: Names of the bodies, unique in the train.
        wheelset_vehicle: Index of the vehicle of each wheelset, shape (wheelsets,).
        wheelset_offset: Position of each wheelset relative to the first vehicle's centre [m], shape (wheelsets,).
        slots: Number of slots for the slabs in the window.
        point_offset: Points of the group ``deflection`` relative to the first vehicle's centre [m], shape (points,).
    """

    vehicles: Sequence[str]
    bodies: Sequence[str]
    wheelset_vehicle: NDArray[np.integer[Any]]
    wheelset_offset: Reals
    slots: int = 0
    point_offset: Reals = field(default_factory=lambda: np.zeros(0))

    def scales(self, dimensions: Sequence[str]) -> dict[str, tuple[Any, Channel]]:
        """Labels and their meaning, by dimension."""
        known: dict[str, tuple[Any, Channel]] = {
            "wheelset": (
                np.arange(1, len(self.wheelset_offset) + 1, dtype=np.int32),
                Channel("1", "wheelset, 1 leads"),
            ),
            "side": (list(SIDES), Channel("1", "side of the track, looking forward")),
            "patch": (np.arange(1, 3, dtype=np.int32), Channel("1", "patch of a wheel, 1 nearer the field side")),
            "body": (list(self.bodies), Channel("1", "body of the train")),
            "dof": (list(DOFS), Channel("1", "degree of freedom of a body")),
            "slot": (np.arange(self.slots, dtype=np.int32), Channel("1", "slot of a slab in the window")),
            "point": (np.arange(len(self.point_offset), dtype=np.int32), Channel("1", "point of the track")),
            "direction": (list(DIRECTIONS), Channel("1", "direction: y right, z down")),
        }
        return {name: known[name] for name in dimensions}

    def auxiliary(self, dimension: str) -> dict[str, tuple[NDArray[Any], Channel]]:
        """Auxiliary coordinates along a dimension and their meaning, by name."""
        known: dict[str, tuple[NDArray[Any], Channel]] = {
            "wheelset_vehicle": (
                np.asarray(self.wheelset_vehicle, np.int32),
                Channel("1", "vehicle of the wheelset, 0 leads"),
            ),
            "wheelset_offset": (
                np.asarray(self.wheelset_offset, np.float64),
                Channel("m", "wheelset forward of the first vehicle's centre"),
            ),
            "offset": (self.point_offset, Channel("m", "point forward of the first vehicle's centre")),
        }
        return {name: known[name] for name, along in AUXILIARY.items() if along == dimension}


@dataclass(frozen=True)
class GroupSpec:
    """Specification of a group of channels.

    Attributes:
        dimensions: Dimensions after the growing one, such as ``("wheelset", "side")``.
        channels: Units and meaning of the channels by name.
        times_of: Group sampled at the same times, whose time and position this group shares; None for its own.
        axis: Growing dimension.
        chunk: Samples per chunk of the file.
        attributes: Attributes of the group.
    """

    dimensions: tuple[str, ...]
    channels: Mapping[str, Channel]
    times_of: str | None = None
    axis: Axis = TIME
    chunk: int = CHUNK
    attributes: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def standard(cls, group: str, names: Sequence[str], times_of: str | None = None) -> GroupSpec:
        """Specification of a standard group with some of its channels.

        Args:
            group: Name of a group of :mod:`tiengine.result_files.channels`.
            names: Channels to record.
            times_of: Group sampled at the same times; None for none.
        """
        along, *dimensions = DIMENSIONS[group]
        chunk = 20 if group == "deflection" else CHUNK  # a sample has hundreds of points and the interval is long
        channels = {name: GROUPS[group][name] for name in names}
        return cls(tuple(dimensions), channels, times_of, AXES[along], chunk)

    @classmethod
    def gauge(cls, kind: Literal["motion", "force", "opening"], attributes: Mapping[str, Any]) -> GroupSpec:
        """Specification of the group of a gauge.

        Args:
            kind: ``"motion"`` of a rail or slab, ``"force"`` of a fastening, ``"opening"`` of a gap.
            attributes: Attributes of the group.
        """
        channels = {"motion": GAUGE_MOTION, "force": GAUGE_FORCE, "opening": GAUGE_OPENING}[kind]
        return cls(GAUGE_DIMENSIONS[kind][1:], channels, attributes=attributes)


@dataclass(frozen=True, eq=False)
class Block:
    """Samples of one group of one train.

    Attributes:
        along: Times [s], or indices of seats or slabs, shape (n,); ignored if the group shares those of another.
        chainage: Chainages [m], shape (n,); ignored likewise.
        channels: All channels of the group, each of shape (n, *dimensions).
    """

    along: NDArray[Any]
    chainage: Reals
    channels: Mapping[str, NDArray[Any]]


DTYPES = {"single": np.float32, "double": np.float64}
"""Data types of the channels, by the key ``output.precision``."""
