"""GB/T 5599-2019: stability, ride quality and the Sperling index W.

Wheel forces: low pass of 20 Hz, means over 2 m every 0.5 m, largest value of the run. The statistics over sections of
appendix D are not implemented, so that all values are indices, not assessments. With Q the lateral and P the vertical
force of a wheel:

    derailment coefficient Q/P,  wheel unloading (P_static - P)/P_static,  lateral axle force |Q_left + Q_right|.

Sperling index, from the amplitudes A [m/s^2] of the spectrum of a 5 s block between 0.5 and 40 Hz, f [Hz]:

    W = (sum W_i^10)^(1/10),   W_i = 3.57 (A_i^3 F(f_i) / f_i)^(1/10)

    F vertical  0.325 f^2 below 5.9 Hz,  400/f^2 to 20 Hz,  1 above
    F lateral   0.8 f^2   below 5.4 Hz,  650/f^2 to 26 Hz,  1 above
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np
from scipy import fft

from tiengine.indices.filters import band_pass, sliding_mean
from tiengine.indices.index import Index, worst
from tiengine.indices.ride import FloorPoint, Forces, Ride
from tiengine.parameters.arrays import Reals

__all__ = [
    "axle_force_limit",
    "body_indices",
    "sperling",
    "sperling_weight",
    "unloading",
    "unloading_limit",
    "wheel_indices",
]

Direction = Literal["vertical", "lateral"]

STANDARD = "GB/T 5599-2019"
BLOCK = 5.0  # s
BAND = (0.5, 40.0)  # Hz, for the Sperling index
ACCELERATION_BAND = (0.5, 10.0)  # Hz
ACCELERATION_LIMIT = 2.5  # m/s^2
DERAILMENT_LIMIT = 0.8
SLOW = 160.0 / 3.6  # m/s
UNLOADING_LIMITS = (0.65, 0.80)  # up to 160 km/h, above
SPERLING_CLASSES = ((2.5, "excellent"), (2.75, "good"), (3.0, "passed"))
CURVES = {"vertical": (0.325, 5.9, 400.0, 20.0), "lateral": (0.8, 5.4, 650.0, 26.0)}


def sperling_weight(frequency: Reals, direction: Direction) -> Reals:
    """Evaluate the weight F at frequencies [Hz], shape (n,)."""
    rise, first, fall, second = CURVES[direction]
    f = np.asarray(frequency, np.float64)
    return np.where(f < first, rise * f**2, np.where(f < second, fall / np.maximum(f, first) ** 2, 1.0))


def sperling(series: Reals, interval: float, direction: Direction) -> float | None:
    """Compute the Sperling index of the worst 5 s block.

    Args:
        series: Acceleration [m/s^2], shape (n,).
        interval: Time between samples [s].
        direction: Direction of the acceleration, which selects the weight.

    Returns:
        W, or None if the series is shorter than a block.
    """
    size = round(BLOCK / interval)
    blocks = series[: len(series) // size * size].reshape(-1, size)
    if not len(blocks):
        return None
    f = fft.rfftfreq(size, interval)
    inside = (f >= BAND[0] - 1e-9) & (f <= BAND[1] + 1e-9)
    A = 2.0 / size * np.abs(fft.rfft(blocks))[:, inside]
    f = f[inside]
    tenth_powers = np.sum(A**3 * sperling_weight(f, direction) / f, axis=1)
    return float(3.57 * tenth_powers.max() ** 0.1)


def unloading(P: Reals, static: float) -> float:
    """Compute the largest relative unloading of a wheel.

    Args:
        P: Vertical force, shape (n,).
        static: Static load, in the same unit.
    """
    return float((static - P.min()) / static)


def unloading_limit(speed: float) -> float:
    """Return the limit of wheel unloading at a speed [m/s]."""
    return UNLOADING_LIMITS[speed > SLOW + 1e-9]


def axle_force_limit(static: float) -> float:
    """Return the limit of the lateral axle force [kN].

    Args:
        static: Static load of the wheelset, both wheels [kN].
    """
    return 15.0 + static / 3.0


def wheel_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield derailment coefficient, wheel unloading and lateral axle force of the worst wheel or wheelset."""
    found: dict[str, list[Index]] = {}
    for w in ride.wheelsets(vehicle):
        for name, side, value, unit, limit in _wheelset_values(ride.forces(w), ride.speed):
            index = _index(ride, vehicle, name, f"wheelset {w + 1}{side}", value, unit, limit, "cl. 9, 10, app. D")
            found.setdefault(name, []).append(index)
    yield from map(worst, found.values())


def _wheelset_values(forces: Forces, speed: float) -> Iterator[tuple[str, str, float, str, float]]:
    """Yield name, side, value, unit and limit of each index."""
    for i, side in enumerate((" left", " right")):
        _, quotient = sliding_mean(forces.position, forces.quotient[:, i])
        yield "derailment coefficient", side, float(np.abs(quotient).max()), "-", DERAILMENT_LIMIT
        _, P = sliding_mean(forces.position, forces.Q[:, i])
        yield "wheel unloading", side, unloading(P, float(forces.static.mean())), "-", unloading_limit(speed)
    _, H = sliding_mean(forces.position, forces.Y.sum(axis=1))
    limit = axle_force_limit(1e-3 * float(forces.static.sum()))
    yield "lateral axle force", "", 1e-3 * float(np.abs(H).max()), "kN", limit


def body_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield Sperling indices and accelerations at the worst floor point over a bogie."""
    points = [point for point in ride.floor(vehicle) if point.over_bogie]
    directions: tuple[Direction, ...] = ("lateral", "vertical")
    for direction in directions:
        yield worst(_sperling_at(ride, vehicle, point, direction) for point in points)
        yield worst(_acceleration_at(ride, vehicle, point, direction) for point in points)


def _sperling_at(ride: Ride, vehicle: int, point: FloorPoint, direction: Direction) -> Index:
    series = ride.after_run_in(getattr(point, direction))
    value = sperling(series, ride.body_interval, direction)
    if value is None:
        note = "run shorter than a block of 5 s"
    else:
        note = next((words for bound, words in SPERLING_CLASSES if value <= bound), "failed")
    limit = SPERLING_CLASSES[-1][0]
    return _index(
        ride, vehicle, f"Sperling index W, {direction}", point.name, value, "-", limit, "cl. 9, app. E", note
    )  # fmt: skip


def _acceleration_at(ride: Ride, vehicle: int, point: FloorPoint, direction: Direction) -> Index:
    value, note = None, "run shorter than a period of 0.5 Hz, 2 s"
    if ride.duration * ACCELERATION_BAND[0] >= 1.0:
        series = band_pass(getattr(point, direction), ride.body_interval, *ACCELERATION_BAND)
        value, note = float(np.abs(ride.after_run_in(series)).max()), ""
    return _index(
        ride, vehicle, f"{direction} acceleration", point.name, value, "m/s^2", ACCELERATION_LIMIT,
        "cl. 9, app. D", note,
    )  # fmt: skip


def _index(
    ride: Ride, vehicle: int, name: str, place: str, value: float | None, unit: str, limit: float, clause: str,
    note: str = "",
) -> Index:  # fmt: skip
    reason = f"largest value over {ride.distance:.0f} m instead of the statistics over sections of app. D"
    return Index(
        standard=STANDARD, name=name, vehicle=vehicle + 1, place=place, value=value, unit=unit, limit=limit,
        clause=clause, shortfall=reason, note=note,
    )  # fmt: skip
