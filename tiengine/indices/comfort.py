"""Comfort by frequency-weighted acceleration of the floor.

EN 12299, mean comfort, from the 95th percentiles over blocks of 5 s of the weighted rms, Wd for x and y, Wb for z:

    N_MV = 6 sqrt(a_x^2 + a_y^2 + a_z^2)

ISO 2631-1, from the weighted rms of the whole run, Wd for y, Wk for z: a_v = sqrt(a_y^2 + a_z^2).

The model has no longitudinal vibration: a_x = 0. Neither standard sets a limit; both name classes.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator

import numpy as np

from tiengine.indices.filters import block_rms, weighted
from tiengine.indices.index import Index, worst
from tiengine.indices.ride import FloorPoint, Ride
from tiengine.parameters.arrays import Reals

__all__ = ["en12299_indices", "iso2631_indices", "mean_comfort", "total_rms"]

EN, ISO = "EN 12299:2009", "ISO 2631-1:1997"
BLOCK, BLOCKS = 5.0, 60  # s; least number: five minutes
ISO_DURATION = 108.0  # s: 3 dB of error at 90 % confidence in the third of an octave at 1 Hz
EN_BOUNDS = (1.5, 2.5, 3.5, 4.5)
EN_CLASSES = ("very comfortable", "comfortable", "medium", "uncomfortable", "very uncomfortable")
ISO_BOUNDS = (0.315, 0.63, 1.0, 1.6, 2.5)  # where the next class ends; the standard's own overlap
ISO_CLASSES = (
    "not uncomfortable", "a little uncomfortable", "fairly uncomfortable", "uncomfortable", "very uncomfortable",
    "extremely uncomfortable",
)  # fmt: skip


def mean_comfort(y: Reals, z: Reals) -> float:
    """N_MV from weighted rms values of blocks [m/s^2], shape (blocks,)."""
    return float(6.0 * np.hypot(np.percentile(y, 95), np.percentile(z, 95)))


def total_rms(y: Reals, z: Reals) -> float:
    """Vibration total value [m/s^2] of weighted series, shape (n,)."""
    return float(np.sqrt(np.mean(y**2) + np.mean(z**2)))


def en12299_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Mean comfort at the worst floor point."""
    yield worst(_mean_comfort_at(ride, vehicle, point) for point in ride.floor(vehicle))


def iso2631_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Weighted rms at the worst floor point."""
    yield worst(_rms_at(ride, vehicle, point) for point in ride.floor(vehicle))


def _mean_comfort_at(ride: Ride, vehicle: int, point: FloorPoint) -> Index:
    y, z = (block_rms(series, ride.body_interval, BLOCK) for series in _weighted(ride, point, "Wb"))
    value = mean_comfort(y, z) if len(y) else None
    return Index(
        standard=EN,
        name="mean comfort N_MV",
        vehicle=vehicle + 1,
        place=point.name,
        value=value,
        unit="-",
        limit=None,
        clause="mean comfort, floor",
        shortfall="" if len(y) >= BLOCKS else f"{len(y)} block(s) of 5 s, {BLOCKS} at least",
        note="run shorter than a block of 5 s" if value is None else EN_CLASSES[bisect_right(EN_BOUNDS, value)],
    )


def _rms_at(ride: Ride, vehicle: int, point: FloorPoint) -> Index:
    value = total_rms(*_weighted(ride, point, "Wk"))
    return Index(
        standard=ISO,
        name="weighted rms, total",
        vehicle=vehicle + 1,
        place=point.name,
        value=value,
        unit="m/s^2",
        limit=None,
        clause="6.1, 6.5; classes of annex C",
        shortfall=""
        if ride.duration >= ISO_DURATION
        else f"{ride.duration:.3g} s, {ISO_DURATION:g} s at least for 1 Hz",
        note=ISO_CLASSES[bisect_left(ISO_BOUNDS, value)],
    )


def _weighted(ride: Ride, point: FloorPoint, vertical: str) -> tuple[Reals, Reals]:
    """Lateral and vertical acceleration behind the run-in, weighted."""
    y = weighted(point.lateral, ride.body_interval, "Wd")
    z = weighted(point.vertical, ride.body_interval, vertical)
    return ride.behind_run_in(y), ride.behind_run_in(z)
