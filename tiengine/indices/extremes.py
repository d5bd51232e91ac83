"""Extremes of seats or slabs of one train: where the train has been, where defects are, what is sound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Reals

__all__ = ["Extremes", "read_extremes"]

FACTORS = {"seats": "factor", "slabs": "mortar_factor"}
REACH = {"seats": 10, "slabs": 2}
"""How far from a defect its neighbours feel it: several decay lengths of a rail on its fastenings."""


@dataclass(frozen=True, eq=False)
class Extremes:
    """One group of a file.

    Attributes:
        index: Of each seat or slab from chainage 0, shape (n,).
        chainage: [m], shape (n,).
        values: Channels, shape (n,) or (n, 2).
        factor: What defects make of it, 1 where sound, shape (n, 1) or (n, 2).
        reached: Whether a wheel came there, shape (n,).
        passed: Whether all wheels went over it, shape (n,).
        counted: Whether statistics count it: passed and behind the run-in, or as near to that as the run allows.
        pitch: From one to the next [m].
        reach: Neighbours that feel a defect.
    """

    index: NDArray[np.int64]
    chainage: Reals
    values: dict[str, Reals]
    factor: Reals
    reached: NDArray[np.bool_]
    passed: NDArray[np.bool_]
    counted: NDArray[np.bool_]
    pitch: float
    reach: int

    def __getitem__(self, name: str) -> Reals:
        """A channel."""
        return self.values[name]

    @property
    def defects(self) -> list[NDArray[np.intp]]:
        """Rows of neighbouring seats or slabs with a defect that the train came to."""
        rows = np.flatnonzero((self.factor != 1.0).any(axis=1) & self.reached)
        return np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if len(rows) else []

    @property
    def half_passed(self) -> list[tuple[float, float]]:
        """Stretches that some wheels came to but not all [m]."""
        rows = np.flatnonzero(self.reached & ~self.passed)
        parts = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if len(rows) else []
        return [self.span(part) for part in parts]

    def span(self, row: NDArray[np.intp]) -> tuple[float, float]:
        """From half a pitch before the first to half a pitch behind the last [m]."""
        return float(self.chainage[row[0]] - 0.5 * self.pitch), float(self.chainage[row[-1]] + 0.5 * self.pitch)

    def around(self, row: NDArray[np.intp]) -> NDArray[np.intp]:
        """Rows of a defect and of the neighbours that feel it."""
        first, last = max(row[0] - self.reach, 0), min(row[-1] + self.reach, len(self.index) - 1)
        return np.arange(first, last + 1)

    @property
    def sound(self) -> NDArray[np.bool_]:
        """What counts and is far from any defect, or at least has none, shape (n,)."""
        far = self.counted.copy()
        for row in self.defects:
            far[self.around(row)] = False
        if not far.any():
            far = self.counted & (self.factor == 1.0).all(axis=1)
        return far if far.any() else self.counted

    def sound_median(self, name: str) -> float:
        """Median of a channel over what is sound."""
        return float(np.median(self.values[name][self.sound]))

    def sound_band(self, name: str) -> tuple[float, float]:
        """5 and 95 % of a channel over what is sound: what irregularity alone makes of it."""
        low, high = np.percentile(self.values[name][self.sound], (5.0, 95.0))
        return float(low), float(high)


def read_extremes(source: Train, name: str, key: str) -> Extremes:
    """Read one group; it holds a few numbers for every seat or slab of the way.

    Args:
        source: The train.
        name: ``"seats"`` or ``"slabs"``.
        key: Key of the scenario without which it is not written.

    Raises:
        AbsentError: The group is not in the file.
    """
    group = source.group(name, key)
    labels = {"chainage", "side", name.removesuffix("s"), FACTORS[name]}
    chainage: Reals = group["chainage"][:].astype(np.float64)
    if not len(chainage):
        raise AbsentError(f"{source.result.name}: {name} is empty: the run ended before its first samples were written")
    slab = source.scenario.parts.slab
    low, high, begin, end = _ways(source)
    reached = (chainage >= low) & (chainage <= high)
    passed = (chainage >= begin) & (chainage <= end)
    counted = passed & (chainage >= begin + source.scenario.output.run_in)
    counted = counted if counted.any() else passed if passed.any() else reached
    return Extremes(
        index=group[name.removesuffix("s")][:].astype(np.int64),
        chainage=chainage,
        values={key: data[:].astype(np.float64) for key, data in group.items() if key not in labels},
        factor=group[FACTORS[name]][:].astype(np.float64).reshape(len(chainage), -1),
        reached=reached,
        passed=passed,
        counted=counted,
        pitch=slab.fastening_pitch if name == "seats" else slab.pitch,
        reach=REACH[name],
    )


def _ways(source: Train) -> tuple[float, float, float, float]:
    """Chainages [m]: first and last that a wheel came to, first and last that all wheels passed."""
    scenario = source.scenario
    offset = scenario.parts.wheelset_positions
    start, end = scenario.rear + scenario.centre_in_window, source.way_end()
    rearmost, foremost = float(offset.min()), float(offset.max())
    return start + rearmost, end + foremost, start + foremost, end + rearmost
