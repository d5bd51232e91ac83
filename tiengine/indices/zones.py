"""Test zones of EN 14363 on a line: straight track, and curves of large, small and very small radius.

A stretch of a zone has one curvature and one cant; transitions belong to no zone. Sections of a stretch have the length
that the standard prescribes for zone and speed; a stretch that is shorter is taken as one section.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.track.alignment import CANT_BASE, Alignment

__all__ = ["ZONES", "Stretch", "Zone", "stretches"]

STRAIGHT_RADIUS = 10e3
"""Radius from which a curve counts as straight [m]."""


@dataclass(frozen=True)
class Zone:
    """Test zone.

    Attributes:
        number: Number in the standard.
        name: Its curves in words.
        smallest: Smallest radius [m].
        lengths: Length of a section up to 140 km/h, up to 220 km/h and above [m].
    """

    number: int
    name: str
    smallest: float
    lengths: tuple[float, float, float]

    def section(self, speed: float) -> float:
        """Length of a section [m] at a speed [m/s]."""
        kmh = 3.6 * speed - 1e-6
        return self.lengths[0 if kmh <= 140.0 else 1 if kmh <= 220.0 else 2]


ZONES = (
    Zone(1, "straight track", STRAIGHT_RADIUS, (250.0, 250.0, 500.0)),
    Zone(2, "curves of large radius", 600.0, (100.0, 250.0, 500.0)),
    Zone(3, "curves of 400 to 600 m", 400.0, (100.0, 100.0, 100.0)),
    Zone(4, "curves of 250 to 400 m", 0.0, (70.0, 70.0, 70.0)),
)


@dataclass(frozen=True)
class Stretch:
    """Part of the line with one curvature and cant.

    Attributes:
        zone: Its zone.
        begin, end: Chainages, without the rounded ends [m].
        curvature: Positive to the right [1/m].
        cant: Positive where the left rail is raised [m].
    """

    zone: Zone
    begin: float
    end: float
    curvature: float
    cant: float

    @property
    def outer(self) -> int:
        """Number of the outer wheel, 0 left or 1 right."""
        return 0 if self.curvature > 0.0 else 1

    def sections(self, position: Reals, speed: float) -> list[slice]:
        """Samples of each section.

        Args:
            position: Chainages of a wheelset [m], increasing, shape (n,).
            speed: Speed [m/s].
        """
        begin, end = max(self.begin, float(position[0])), min(self.end, float(position[-1]))
        length = self.zone.section(speed)
        count = max(int((end - begin) / length + 1e-9), 1)
        edges = begin + length * np.arange(count + 1)
        edges[-1] = min(edges[-1], end)
        places = np.searchsorted(position, edges)
        return [slice(int(i), int(j)) for i, j in pairwise(places) if j > i]


def stretches(line: Alignment, begin: float, end: float) -> Iterator[Stretch]:
    """Yield the stretches of a line between two chainages [m], shorter ones than 10 m left out."""
    x = np.concatenate([[-np.inf], line.x, [np.inf]])
    kappa = np.concatenate([line.curvature[:1], line.curvature, line.curvature[-1:]])
    cant = CANT_BASE * np.sin(np.concatenate([line.roll[:1], line.roll, line.roll[-1:]]))
    same = (np.diff(kappa) == 0.0) & (np.diff(cant) == 0.0)
    half, i = 0.5 * line.rounding, 0
    while i < len(same):
        if not same[i]:
            i += 1
            continue
        j = i
        while j < len(same) and same[j]:
            j += 1
        first, last = max(float(x[i]) + half, begin), min(float(x[j]) - half, end)
        if last - first >= 10.0:
            radius = 1.0 / abs(kappa[j]) if kappa[j] else np.inf
            zone = next(zone for zone in ZONES if radius >= zone.smallest)
            yield Stretch(zone, first, last, float(kappa[j]), float(cant[j]))
        i = j
