"""Running safety and track loading in curves: EN 14363, GB/T 5599, Nadal's limit, wear number.

EN 14363 by zone (:mod:`tiengine.indices.zones`), forces with a low pass of 20 Hz, of the outer wheel with the outward
direction positive. Of every section: the medians Y_qst and Q_qst, the percentiles 99.85 of Q and of the 2 m means of
Y/Q, the greater of the percentiles 0.15 and 99.85 of the 2 m means of the sum of Y. From 25 sections of a zone on the
value is mean + k standard deviations, k = 3.0 for running safety, 2.2 for the maxima of track loading, 0 for the
quasi-static values (their mean); with fewer sections the largest of them, an index.

Nadal's limit of Y/Q of a wheel that climbs, (tan d - mu)/(1 + mu tan d), with the flange angle d of the profile and the
friction of the scenario. Wear number: T gamma = |Fx xi_x| + |Fy xi_y| [N], summed over a wheel's patches, the energy
lost per metre without that of spin; British Rail's regimes are mild below 100 N, severe to 200 N, catastrophic above.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tiengine.indices import en14363, gb5599
from tiengine.indices.filters import sliding_mean
from tiengine.indices.index import Index, no_limit, worst
from tiengine.indices.ride import Forces, Ride
from tiengine.indices.zones import ZONES, Stretch, Zone, stretches
from tiengine.parameters.arrays import Flags, Reals
from tiengine.parameters.conventions import GRAVITY

__all__ = ["nadal_limit", "wear_regime", "wheel_indices"]

Y_LIMIT, Q_LIMIT = 60.0, 145.0  # kN, quasi-static
SIDES = ("left", "right")
WEAR = ((100.0, "mild"), (200.0, "severe"), (np.inf, "catastrophic"))  # N, British Rail
SHORTEST = 4.0  # m of a section that 2 m means are taken of


def nadal_limit(flange_angle: float, friction: float) -> float:
    """Return Nadal's limit of Y/Q.

    Args:
        flange_angle: Angle of the flange's flank [rad].
        friction: Coefficient of friction.
    """
    slope = np.tan(flange_angle)
    return float((slope - friction) / (1.0 + friction * slope))


def wear_regime(wear_number: float) -> str:
    """Return British Rail's regime of wear for T gamma [N]."""
    return next(name for bound, name in WEAR if wear_number <= bound)


def wheel_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield the indices of a vehicle in curves, zone by zone, then Nadal's limit and the wear number.

    Nothing on a line without curves.
    """
    line = ride.line
    if line is None or ride.wheel_times is None:
        return
    begin, end = float(ride.wheel_times.position[0]), float(ride.wheel_times.position[-1])
    found = list(stretches(line, begin - 1e3, end + 1e3))
    for zone in ZONES[1:]:
        own = [stretch for stretch in found if stretch.zone is zone]
        if own:
            yield from _zone_indices(ride, vehicle, zone, own)
    yield from _flange_indices(ride, vehicle)
    yield from _wear_indices(ride, vehicle)


def _zone_indices(ride: Ride, vehicle: int, zone: Zone, own: Sequence[Stretch]) -> Iterator[Index]:
    """Yield the worst wheelset's values of a zone."""
    values: dict[str, list[Index]] = {}
    for w in ride.wheelsets(vehicle):
        forces = ride.forces(w)
        forces = replace(forces, position=forces.position + ride.offset(w))
        parts = [
            (stretch, part)
            for stretch in own
            if len(forces.position) and stretch.begin < forces.position[-1] and stretch.end > forces.position[0]
            for part in stretch.sections(forces.position, ride.speed)
            if forces.position[part][-1] - forces.position[part][0] >= SHORTEST
        ]
        if not parts:
            continue
        for index in (
            *_en14363(ride, vehicle, w, zone, forces, parts),
            *_gb5599(ride, vehicle, w, zone, forces, parts),
        ):
            values.setdefault(index.standard + index.name, []).append(index)
    yield from map(worst, values.values())


def _en14363(
    ride: Ride, vehicle: int, wheelset: int, zone: Zone, forces: Forces, parts: Sequence[tuple[Stretch, slice]]
) -> Iterator[Index]:
    """Yield the values of a wheelset over the sections of a zone."""
    table: list[tuple[float, ...]] = []
    for stretch, part in parts:
        x, outer = forces.position[part], stretch.outer
        quotient = sliding_mean(x, forces.quotient[part, outer])[1]
        total = sliding_mean(x, forces.Y[part].sum(axis=1))[1]
        table.append((
            float(np.median((-1.0, 1.0)[outer] * forces.Y[part, outer])),
            float(np.median(forces.Q[part, outer])),
            float(np.percentile(forces.Q[part, outer], 99.85)),
            float(np.percentile(quotient, 99.85)),
            float(np.abs(np.percentile(total, (0.15, 99.85))).max()),
            1.0 - float(np.median(forces.Q[part, 1 - outer])) / float(forces.static[1 - outer]),
            1e3 * abs(_deficiency(ride, stretch)),
        ))  # fmt: skip
    vehicle_class = ride.vehicle_classes[vehicle]
    axle_limit = en14363.axle_force_limit(1e-3 * float(forces.static.sum()), vehicle_class)
    wheel_limit = en14363.wheel_force_limit(1e-3 * float(forces.static.max()), ride.speed)
    short = ""
    if len(table) < en14363.SECTIONS:
        length = zone.section(ride.speed)
        short = f"{len(table)} section(s) in this zone, {en14363.SECTIONS} of {length:g} m at least; largest of them"
    rows: tuple[tuple[str, float, float, str, float | None, str], ...] = (
        ("quasi-static Y of the outer wheel", 0.0, 1e-3, "kN", Y_LIMIT, "7.5.3 track loading"),
        ("quasi-static Q of the outer wheel", 0.0, 1e-3, "kN", Q_LIMIT, "7.5.3 track loading"),
        ("wheel force Q of the outer wheel", en14363.OTHER, 1e-3, "kN", wheel_limit, "7.5.3 track loading"),
        ("Y/Q of the outer wheel, 2 m mean", en14363.SAFETY, 1.0, "-", en14363.QUOTIENT_LIMIT, "7.5.2 running safety"),
        ("sum of Y, 2 m mean", en14363.SAFETY, 1e-3, "kN", axle_limit, "7.5.2 running safety"),
        ("quasi-static unloading of the inner wheel", 0.0, 1.0, "-", None, "information"),
        ("cant deficiency", 0.0, 1.0, "mm", None, "information"),
    )
    for (name, k, scale, unit, limit, clause), values in zip(rows, np.array(table).T, strict=True):
        value = float(values.max()) if short else float(values.mean() + k * values.std(ddof=1))
        none = clause == "information"
        yield Index(
            standard=f"{en14363.STANDARD}, zone {zone.number}: {zone.name}", name=name, vehicle=vehicle + 1,
            place=f"wheelset {wheelset + 1}", value=scale * value, unit=unit, limit=limit, clause=clause,
            shortfall=short, note="" if limit is not None or none else no_limit(vehicle_class),
        )  # fmt: skip


def _deficiency(ride: Ride, stretch: Stretch) -> float:
    """Cant deficiency [m] at the ride's speed, positive outward."""
    roll = np.arcsin(stretch.cant / 1.5)
    outward = ride.speed**2 * stretch.curvature * np.cos(roll) - GRAVITY * np.sin(roll)
    return float(1.5 / GRAVITY * outward)


def _gb5599(
    ride: Ride, vehicle: int, wheelset: int, zone: Zone, forces: Forces, parts: Sequence[tuple[Stretch, slice]]
) -> Iterator[Index]:
    """Yield the largest values of a wheelset over the sections of a zone."""
    vehicle_class = ride.vehicle_classes[vehicle]
    for _, part in parts:
        own = Forces(forces.position[part], forces.Y[part], forces.Q[part], forces.static)
        for name, side, value, unit, limit in gb5599.wheelset_values(own, ride.speed, vehicle_class):
            yield Index(
                standard=f"{gb5599.STANDARD}, {zone.name}", name=name, vehicle=vehicle + 1,
                place=f"wheelset {wheelset + 1}{side}", value=value, unit=unit, limit=limit, clause="cl. 9, 10, app. D",
                shortfall="largest value instead of the statistics over sections of app. D",
                note="" if limit is not None else no_limit(vehicle_class),
            )  # fmt: skip


def _flange_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield the largest Y/Q of the run against Nadal's limit, of the wheel that comes nearest to its own."""
    values = []
    for w in ride.wheelsets(vehicle):
        forces = ride.forces(w)
        for i, side in enumerate(SIDES):
            flange_angle = ride.flange_angle_of(w, i)
            quotient = sliding_mean(forces.position, forces.quotient[:, i])[1]
            if flange_angle is not None and len(quotient):
                limit, value = nadal_limit(flange_angle, ride.friction), float(quotient.max())
                values.append((value - limit, f"wheelset {w + 1} {side}", value, limit, np.degrees(flange_angle)))
    if not values:
        return
    _, place, value, limit, angle = max(values)
    yield Index(
        standard="Nadal", name="largest Y/Q, 2 m mean", vehicle=vehicle + 1, place=place, value=value, unit="-",
        limit=limit, clause="(tan d - mu)/(1 + mu tan d)", shortfall="largest value of the run",
        note=f"flange angle {angle:.1f} degrees, friction {ride.friction:g}",
    )  # fmt: skip


def _wear_indices(ride: Ride, vehicle: int) -> Iterator[Index]:
    """Yield the mean wear number in curves of the wheel that has most of it."""
    values: list[tuple[float, str]] = []
    for w in ride.wheelsets(vehicle):
        found = ride.wear_number(w)
        if found is None:
            return
        position, number = found
        kept = _in_curves(ride, position + ride.offset(w))
        if kept.any():
            values += [(float(number[kept, i].mean()), f"wheelset {w + 1} {side}") for i, side in enumerate(SIDES)]
    if values:
        value, place = max(values)
        yield Index(
            standard="wear", name="wear number T gamma, mean in curves", vehicle=vehicle + 1, place=place, value=value,
            unit="N", limit=None, clause="British Rail's regimes", shortfall="mean over the curves of the run",
            note=f"{wear_regime(value)} wear",
        )  # fmt: skip


def _in_curves(ride: Ride, position: Reals) -> Flags:
    """Samples at which a wheelset is in a curve of constant radius, shape (n,)."""
    kept = np.zeros(len(position), dtype=np.bool_)
    if ride.line is not None and len(position):
        for stretch in stretches(ride.line, float(position[0]), float(position[-1])):
            if stretch.zone is not ZONES[0]:
                kept |= (position >= stretch.begin) & (position <= stretch.end)
    return kept
