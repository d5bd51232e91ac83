"""Extremes of the seats or slabs of one train: where the train was, where defects are, which ones are sound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Reals

__all__ = ["Extremes", "read_extremes"]

FACTORS = {"seats": "factor", "slabs": "mortar_factor"}
REACH = {"seats": 10, "slabs": 2}
"""Neighbours on either side that a defect affects: several decay lengths of a rail on its fastenings."""


@dataclass(frozen=True, eq=False)
class Extremes:
    """Extremes of all seats or slabs.

    Attributes:
        index: Index of each seat or slab, counted from chainage 0, shape (n,).
        chainage: Chainages [m], shape (n,).
        values: Channels by name, shape (n,) or (n, 2).
        factor: Factor of a defect on stiffness, 1 where sound, shape (n, 1) or (n, 2).
        reached: Whether a wheel reached it, shape (n,).
        passed: Whether all wheels passed it, shape (n,).
        counted: Whether statistics include it: passed and after the run-in, or the nearest to that in a short run,
            shape (n,).
        pitch: Distance from one to the next [m].
        reach: Neighbours on either side that a defect affects.
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
        """Return a channel, shape (n,) or (n, 2)."""
        return self.values[name]

    @property
    def defects(self) -> list[NDArray[np.intp]]:
        """Groups of adjacent rows with a defect that the train reached."""
        rows = np.flatnonzero((self.factor != 1.0).any(axis=1) & self.reached)
        return np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if len(rows) else []

    @property
    def partly_passed(self) -> list[tuple[float, float]]:
        """Stretches that some wheels passed but not all, first and last chainage [m]."""
        rows = np.flatnonzero(self.reached & ~self.passed)
        groups = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if len(rows) else []
        return [self.span(group) for group in groups]

    def span(self, row: NDArray[np.intp]) -> tuple[float, float]:
        """Return the limits of adjacent rows [m], half a pitch beyond the first and the last."""
        return float(self.chainage[row[0]] - 0.5 * self.pitch), float(self.chainage[row[-1]] + 0.5 * self.pitch)

    def around(self, row: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the rows of a defect and of the neighbours that it affects."""
        first, last = max(row[0] - self.reach, 0), min(row[-1] + self.reach, len(self.index) - 1)
        return np.arange(first, last + 1)

    @property
    def sound(self) -> NDArray[np.bool_]:
        """Counted rows out of reach of any defect or, if there are none, counted rows without a defect, shape (n,)."""
        far = self.counted.copy()
        for row in self.defects:
            far[self.around(row)] = False
        if not far.any():
            far = self.counted & (self.factor == 1.0).all(axis=1)
        return far if far.any() else self.counted

    def sound_median(self, name: str) -> float:
        """Return the median of a channel over the sound rows."""
        return float(np.median(self.values[name][self.sound]))

    def sound_band(self, name: str) -> tuple[float, float]:
        """Return the percentiles 5 and 95 of a channel over the sound rows: the scatter due to irregularity alone."""
        low, high = np.percentile(self.values[name][self.sound], (5.0, 95.0))
        return float(low), float(high)


def read_extremes(train: Train, name: str, key: str) -> Extremes:
    """Read one group, which holds a few numbers per seat or slab of the run.

    Args:
        train: The train.
        name: ``"seats"`` or ``"slabs"``.
        key: Key of the scenario that has it written.

    Raises:
        AbsentError: The group is not in the file.
    """
    group = train.group(name, key)
    labels = {"chainage", "side", name.removesuffix("s"), FACTORS[name]}
    chainage: Reals = group["chainage"][:].astype(np.float64)
    if not len(chainage):
        raise AbsentError(f"{train.result.name}: {name} is empty: the run ended before its first samples were written")
    slab = train.scenario.parts.slab
    low, high, begin, end = _ranges(train)
    reached = (chainage >= low) & (chainage <= high)
    passed = (chainage >= begin) & (chainage <= end)
    counted = passed & (chainage >= begin + train.scenario.output.run_in)
    ahead = reached & (chainage >= begin)  # of the leading wheel's start: a long train may pass none with all wheels
    counted = next((rows for rows in (counted, passed, ahead) if rows.any()), reached)
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


def _ranges(train: Train) -> tuple[float, float, float, float]:
    """Chainages [m]: first and last that any wheel reached, first and last that all wheels passed."""
    scenario = train.scenario
    offset = scenario.parts.wheelset_positions
    start, end = scenario.rear + scenario.centre_in_window, train.last_chainage()
    rearmost, foremost = float(offset.min()), float(offset.max())
    return start + rearmost, end + foremost, start + foremost, end + rearmost
