"""Ride comfort from frequency-weighted accelerations of the floor.

EN 12299, mean comfort, from the 95th percentiles of the weighted rms over blocks of 5 s, Wd for x and y, Wb for z:

    N_MV = 6 sqrt(a_x^2 + a_y^2 + a_z^2)

Only passengers' vehicles have a mean comfort; freight wagons have neither index.

ISO 2631-1, from the weighted rms over the whole run, Wd for y, Wk for z: a_v = sqrt(a_y^2 + a_z^2).

The model has no longitudinal vibration: a_x = 0. Neither standard sets a limit; both define classes.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator

import numpy as np

from tiengine.indices.filters import block_rms, weighted
from tiengine.indices.index import Index, worst_of
from tiengine.indices.ride import FloorPoint, Ride, Times
from tiengine.parameters.arrays import Reals

__all__ = ["en12299_indices", "iso2631_indices", "mean_comfort", "total_rms"]

EN, ISO = "EN 12299:2009", "ISO 2631-1:1997"
BLOCK = 5.0  # s
LEAST_BLOCKS = 60  # five minutes
ISO_DURATION = 108.0  # s: error below 3 dB at 90 % confidence in the third-octave band at 1 Hz
EN_BOUNDS = (1.5, 2.5, 3.5, 4.5)
EN_CLASSES = ("very comfortable", "comfortable", "medium", "uncomfortable", "very uncomfortable")
ISO_BOUNDS = (0.315, 0.63, 1.0, 1.6, 2.5)  # m/s^2, upper ends of the classes, which overlap in the standard
ISO_CLASSES = (
    "not uncomfortable", "a little uncomfortable", "fairly uncomfortable", "uncomfortable", "very uncomfortable",
    "extremely uncomfortable",
)  # fmt: skip


def mean_comfort(y: Reals, z: Reals) -> float:
    """Compute N_MV from the weighted rms values of blocks [m/s^2], shape (blocks,)."""
    return float(6.0 * np.hypot(np.percentile(y, 95), np.percentile(z, 95)))


def total_rms(y: Reals, z: Reals) -> float:
    """Compute the vibration total value [m/s^2] of weighted series [m/s^2], shape (n,)."""
    return float(np.sqrt(np.mean(y**2) + np.mean(z**2)))


def en12299_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield the mean comfort at the worst floor point; nothing for locomotives and freight wagons."""
    if ride.vehicle_classes[vehicle] in ("coach", None):
        yield from worst_of(_mean_comfort_at(ride, vehicle, point) for point in _floor(ride, vehicle))


def iso2631_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield the weighted rms at the worst floor point; nothing for freight wagons."""
    if ride.vehicle_classes[vehicle] != "freight":
        yield from worst_of(_rms_at(ride, vehicle, point) for point in _floor(ride, vehicle))


def _floor(ride: Ride, vehicle: int) -> list[FloorPoint]:
    """Floor points whose acceleration is known in both directions."""
    return [point for point in ride.floor(vehicle) if len(point.acceleration) == 2]


def _mean_comfort_at(ride: Ride, vehicle: int, point: FloorPoint) -> Index:
    times = ride.acceleration_times(vehicle)
    y, z = (block_rms(series, times.interval, BLOCK) for series in _weighted(times, point, "Wb"))
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
        shortfall="" if len(y) >= LEAST_BLOCKS else f"{len(y)} block(s) of 5 s, {LEAST_BLOCKS} at least",
        note="run shorter than a block of 5 s" if value is None else EN_CLASSES[bisect_right(EN_BOUNDS, value)],
    )


def _rms_at(ride: Ride, vehicle: int, point: FloorPoint) -> Index:
    times = ride.acceleration_times(vehicle)
    duration, value = times.duration(), total_rms(*_weighted(times, point, "Wk"))
    return Index(
        standard=ISO,
        name="weighted rms, total",
        vehicle=vehicle + 1,
        place=point.name,
        value=value,
        unit="m/s^2",
        limit=None,
        clause="6.1, 6.5; classes of annex C",
        shortfall="" if duration >= ISO_DURATION else f"{duration:.3g} s, {ISO_DURATION:g} s at least for 1 Hz",
        note=ISO_CLASSES[bisect_left(ISO_BOUNDS, value)],
    )


def _weighted(times: Times, point: FloorPoint, vertical: str) -> tuple[Reals, Reals]:
    """Weighted lateral and vertical acceleration after the run-in [m/s^2], shape (n,) each."""
    y = weighted(point.acceleration["lateral"], times.interval, "Wd")
    z = weighted(point.acceleration["vertical"], times.interval, vertical)
    return y[times.used()], z[times.used()]
