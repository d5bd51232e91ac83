"""GB/T 5599-2019: stability, ride quality and the Sperling index W.

Wheel forces: low pass of 20 Hz, means over 2 m every 0.5 m, largest value of the run. The statistics over sections of
appendix D are not implemented, so that all values are indices, not assessments. With Q the lateral and P the vertical
force of a wheel, P0 the static load of a wheelset:

    derailment coefficient Q/P,  wheel unloading (P_static - P)/P_static,  lateral axle force |Q_left + Q_right|.

Sperling index W, for a sum of tones of amplitude A_i [m/s^2] and frequency f_i [Hz] between 0.5 and 40 Hz:

    W = (sum W_i^10)^(1/10),   W_i = 3.57 (A_i^3 F(f_i) / f_i)^(1/10)

The sum is evaluated as an integral over the amplitude spectrum A(f) of a block of 5 s,

    W = 3.57 (1/C integral A(f)^3 F(f)/f df)^(1/10),   C = integral |w(f)/w(0)|^3 df,

with a Hann window w, so that a tone has its index wherever it lies between the 0.2 Hz of the block; a plain sum over
the lines of a discrete transform is 6 % low half-way between two of them. Blocks overlap by half. Of tones within 0.2
Hz of either end of the band a part counts.

    F vertical  0.325 f^2 below 5.9 Hz,  400/f^2 to 20 Hz,  1 above
    F lateral   0.8 f^2   below 5.4 Hz,  650/f^2 to 26 Hz,  1 above
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import fft, signal

from tiengine.indices.filters import band_pass, band_pass_settling, sliding_mean
from tiengine.indices.index import Index, no_limit, worst, worst_of
from tiengine.indices.ride import Direction, FloorPoint, Forces, Ride
from tiengine.parameters.arrays import Reals
from tiengine.vehicle.connector import VehicleClass

__all__ = [
    "axle_force_limit",
    "body_indices",
    "sperling",
    "sperling_weight",
    "unloading",
    "unloading_limit",
    "wheel_indices",
    "wheelset_values",
]

STANDARD = "GB/T 5599-2019"
BLOCK = 5.0  # s
BAND = (0.5, 40.0)  # Hz, for the Sperling index
ACCELERATION_BAND = (0.5, 10.0)  # Hz
FINER = 4  # times the 0.2 Hz of a block: spacing of the spectrum that the integral is taken over
ACCELERATION_LIMITS: dict[VehicleClass | None, float] = {"coach": 2.5}  # m/s^2
DERAILMENT_LIMITS: dict[VehicleClass | None, float] = {"coach": 0.8, "locomotive": 0.8}
AXLE_FACTORS: dict[VehicleClass | None, float] = {"coach": 1.0, "locomotive": 1.0, "freight": 0.85}
SLOW = 160.0 / 3.6  # m/s
UNLOADING_LIMITS = (0.65, 0.80)  # up to 160 km/h, above
SPERLING_CLASSES: dict[VehicleClass | None, tuple[tuple[float, str], ...]] = {
    "coach": ((2.5, "excellent"), (2.75, "good"), (3.0, "passed")),
    "locomotive": ((2.75, "excellent"), (3.10, "good"), (3.45, "passed")),
    "freight": ((3.5, "excellent"), (4.0, "good"), (4.25, "passed")),
}
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
    if len(series) < size:
        return None
    window = signal.windows.hann(size, sym=False)
    length = fft.next_fast_len(FINER * size, real=True)
    f = fft.rfftfreq(length, interval)
    inside = (f >= BAND[0] - 1e-9) & (f <= BAND[1] + 1e-9)
    one_tone = float(np.sum(np.abs(fft.fft(window / window.sum(), length)) ** 3))  # C over the spacing of f
    largest = 0.0
    for begin in range(0, len(series) - size + 1, size // 2):
        block = series[begin : begin + size]
        A = 2.0 / window.sum() * np.abs(fft.rfft(window * (block - block.mean()), length))[inside]
        largest = max(largest, float(np.sum(A**3 * sperling_weight(f[inside], direction) / f[inside])))
    return float(3.57 * (largest / one_tone) ** 0.1)


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


def axle_force_limit(static: float, vehicle_class: VehicleClass | None) -> float | None:
    """Return the limit of the lateral axle force [kN]; None for a class without one.

    Args:
        static: Static load of the wheelset, both wheels [kN].
        vehicle_class: Class of the vehicle; None if it is not stated.
    """
    factor = AXLE_FACTORS.get(vehicle_class)
    return None if factor is None else factor * (15.0 + static / 3.0)


def wheel_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield derailment coefficient, wheel unloading and lateral axle force of the worst wheel or wheelset."""
    found: dict[str, list[Index]] = {}
    vehicle_class = ride.vehicle_classes[vehicle]
    for w in ride.wheelsets(vehicle):
        for name, side, value, unit, limit in wheelset_values(ride.forces(w), ride.speed, vehicle_class):
            index = _index(ride, vehicle, name, f"wheelset {w + 1}{side}", value, unit, limit, "cl. 9, 10, app. D")
            found.setdefault(name, []).append(index)
    yield from map(worst, found.values())


def wheelset_values(
    forces: Forces, speed: float, vehicle_class: VehicleClass | None
) -> Iterator[tuple[str, str, float, str, float | None]]:
    """Yield name, side, value, unit and limit of each index of a wheelset.

    Args:
        forces: Its forces.
        speed: Speed of the train [m/s].
        vehicle_class: Class of its vehicle.
    """
    for i, side in enumerate((" left", " right")):
        _, quotient = sliding_mean(forces.position, forces.quotient[:, i])
        limit = DERAILMENT_LIMITS.get(vehicle_class)
        yield "derailment coefficient", side, float(np.abs(quotient).max()), "-", limit
        _, P = sliding_mean(forces.position, forces.Q[:, i])
        yield "wheel unloading", side, unloading(P, float(forces.static.mean())), "-", unloading_limit(speed)
    _, H = sliding_mean(forces.position, forces.Y.sum(axis=1))
    limit = axle_force_limit(1e-3 * float(forces.static.sum()), vehicle_class)
    yield "lateral axle force", "", 1e-3 * float(np.abs(H).max()), "kN", limit


def body_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield Sperling indices and accelerations at the worst floor point over a running gear."""
    points = [point for point in ride.floor(vehicle) if point.over_bogie]
    directions: tuple[Direction, ...] = ("lateral", "vertical")
    for direction in directions:
        measured = [point for point in points if direction in point.acceleration]
        yield from worst_of(_sperling_at(ride, vehicle, point, direction) for point in measured)
        yield from worst_of(_acceleration_at(ride, vehicle, point, direction) for point in measured)


def _sperling_at(ride: Ride, vehicle: int, point: FloorPoint, direction: Direction) -> Index:
    times = ride.acceleration_times(vehicle)
    value = sperling(point.acceleration[direction][times.used()], times.interval, direction)
    classes = SPERLING_CLASSES.get(ride.vehicle_classes[vehicle], ())
    if value is None:
        note = "run shorter than a block of 5 s"
    else:
        note = next((name for bound, name in classes if value <= bound), "failed") if classes else ""
    limit = classes[-1][0] if classes else None
    name = f"Sperling index W, {direction}"
    return _index(ride, vehicle, name, point.name, value, "-", limit, "cl. 9, app. E", note)


def _acceleration_at(ride: Ride, vehicle: int, point: FloorPoint, direction: Direction) -> Index:
    times, settling = ride.acceleration_times(vehicle), band_pass_settling(*ACCELERATION_BAND)
    value, note = None, f"run shorter than a period of 0.5 Hz, 2 s, and {2.0 * settling:g} s of settling of the filter"
    if times.duration(settling) * ACCELERATION_BAND[0] >= 1.0:
        series = band_pass(point.acceleration[direction], times.interval, *ACCELERATION_BAND)
        value, note = float(np.abs(series[times.used(settling)]).max()), ""
    limit = ACCELERATION_LIMITS.get(ride.vehicle_classes[vehicle])
    name = f"{direction} acceleration"
    return _index(ride, vehicle, name, point.name, value, "m/s^2", limit, "cl. 9, app. D", note)


def _index(
    ride: Ride, vehicle: int, name: str, place: str, value: float | None, unit: str, limit: float | None,
    clause: str, note: str = "",
) -> Index:  # fmt: skip
    reason = f"largest value over {ride.distance(vehicle):.0f} m instead of the statistics over sections of app. D"
    if limit is None and not note:
        note = no_limit(ride.vehicle_classes[vehicle])
    return Index(
        standard=STANDARD, name=name, vehicle=vehicle + 1, place=place, value=value, unit=unit, limit=limit,
        clause=clause, shortfall=reason, note=note,
    )  # fmt: skip
