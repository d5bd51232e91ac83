"""Key figures of a run and their places: wheel forces, loss of contact, loads of fastenings, mortar and slabs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tiengine.indices.extremes import Extremes, read_extremes
from tiengine.indices.ground_under import ground_motion, ground_profile
from tiengine.indices.revolutions import revolutions, shaped_wheels
from tiengine.indices.train_record import AbsentError, Train
from tiengine.indices.wheel_extremes import ForceExtreme, WheelExtremes, wheel_extremes
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES
from tiengine.parameters.errors import InputError

__all__ = ["KeyFigure", "Summary", "key_figures", "summarise"]


@dataclass(frozen=True)
class KeyFigure:
    """One key figure.

    Attributes:
        name: Name of the quantity.
        value: Value in ``unit``.
        unit: Unit.
        where: Wheel, seat or slab, and chainage; empty if it has no place.
        smallest: Whether smaller values are worse.
    """

    name: str
    value: float
    unit: str
    where: str = ""
    smallest: bool = False


@dataclass(frozen=True)
class Summary:
    """One key figure over many trains.

    Attributes:
        worst: The worst of all trains.
        train: Number of the train that it belongs to.
        median: Median over the trains.
        band: Percentiles 5 and 95 over the trains.
    """

    worst: KeyFigure
    train: int
    median: float
    band: tuple[float, float]


def key_figures(train: Train) -> list[KeyFigure]:
    """Compute the key figures of one train; those whose data the file lacks are left out.

    Args:
        train: The train.
    """
    found: list[KeyFigure] = []
    for part in (_wheels, _revolutions, _seats, _slabs, _displaced_ground, _moving_ground):
        try:
            found += part(train)
        except (AbsentError, InputError):  # a file that the scenario names may be gone
            continue
    return found


def summarise(trains: Sequence[tuple[int, Sequence[KeyFigure]]]) -> list[Summary]:
    """Compute the worst, the median and the band of every key figure.

    Args:
        trains: Number and key figures of each train.
    """
    groups: dict[str, list[tuple[int, KeyFigure]]] = {}
    for train, figures in trains:
        for figure in figures:
            groups.setdefault(figure.name, []).append((train, figure))
    summaries = []
    for entries in groups.values():
        pick = min if entries[0][1].smallest else max
        train, worst = pick(entries, key=lambda entry: entry[1].value)
        low, median, high = np.percentile([figure.value for _, figure in entries], (5.0, 50.0, 95.0))
        summaries.append(Summary(worst, train, float(median), (float(low), float(high))))
    return summaries


def _revolutions(train: Train) -> Iterator[KeyFigure]:
    """Largest force of a revolution, the mean of all revolutions, of the worst wheel out of round."""
    tables, wheels = shaped_wheels(train)
    found = [revolutions(train, w, side, tables) for w, side in wheels]
    means = [float(each.of_revolution.mean()) if each.of_revolution.size else float("nan") for each in found]
    if not np.isfinite(means).any():
        raise AbsentError("no wheel out of round makes a whole revolution after the run-in")
    worst = int(np.nanargmax(means))
    yield KeyFigure("peak force of a revolution, mean", means[worst] / 1e3, "kN", found[worst].name)


def _wheels(train: Train) -> Iterator[KeyFigure]:
    found = wheel_extremes(train)
    yield _at_wheel(found, found.largest, "largest vertical wheel force Q", np.nanargmax)
    yield _at_wheel(found, found.smallest, "smallest vertical wheel force Q", np.nanargmin, smallest=True)
    yield _at_wheel(found, found.lateral, "largest lateral wheel force |Y|", np.nanargmax)
    w, side = divmod(int(np.argmax(found.time_off)), 2)
    where = found.place(w, side) if found.time_off.any() else ""
    yield KeyFigure("longest time of a wheel off the rail", 1e3 * float(found.time_off.max()), "ms", where)


def _at_wheel(
    found: WheelExtremes, extreme: ForceExtreme, name: str, worst: Callable[[Reals], Any], *, smallest: bool = False
) -> KeyFigure:
    """Worst of all wheels [kN] and its place."""
    w, side = divmod(int(worst(extreme.value)), 2)
    where = f"{found.place(w, side)}, chainage {extreme.chainage[w, side]:.1f} m"
    return KeyFigure(name, 1e-3 * float(extreme.value[w, side]), "kN", where, smallest)


def _seats(train: Train) -> Iterator[KeyFigure]:
    seats = read_extremes(train, "seats", "output.envelopes")
    value, where = _at_largest(seats, seats["largest_vertical_force"], "seat")
    median = seats.sound_median("largest_vertical_force")
    yield KeyFigure("largest vertical force on a fastening", 1e-3 * value, "kN", where)
    yield KeyFigure("largest force on a fastening over the sound median", value / median, "-", where)
    value, where = _at_largest(seats, -seats["smallest_vertical_force"], "seat")
    yield KeyFigure("largest uplift of a fastening", max(1e-3 * value, 0.0), "kN", where)
    lateral = np.maximum(seats["largest_lateral_force"], -seats["smallest_lateral_force"])
    value, where = _at_largest(seats, lateral, "seat")
    yield KeyFigure("largest lateral force on a fastening", 1e-3 * value, "kN", where)


def _slabs(train: Train) -> Iterator[KeyFigure]:
    slabs = read_extremes(train, "slabs", "output.envelopes")
    rows = (
        ("largest_pressure", "largest mortar pressure", 1e-3, "kPa"),
        ("largest_deflection", "largest deflection of a slab", 1e3, "mm"),
        ("largest_moment_x", "largest bending moment along the track", 1e-3, "kN m/m"),
        ("largest_moment_y", "largest bending moment across the track", 1e-3, "kN m/m"),
    )
    for channel, name, scale, unit in rows:
        value, where = _at_largest(slabs, slabs[channel], "slab")
        yield KeyFigure(name, scale * value, unit, where)
    if slabs.values.get("largest_opening", np.zeros(1)).any():
        yield from _openings(slabs)


def _openings(slabs: Extremes) -> Iterator[KeyFigure]:
    """Openings between slabs and a bed without tension."""
    value, where = _at_largest(slabs, slabs["opening_at_rest"], "slab")
    yield KeyFigure("largest opening under a slab at rest", 1e3 * value, "mm", where)
    value, where = _at_largest(slabs, slabs["largest_opening"], "slab")
    yield KeyFigure("largest opening under a slab", 1e3 * value, "mm", where)
    value, where = _at_largest(slabs, slabs["opening_at_rest"] - slabs["smallest_opening"], "slab")
    yield KeyFigure("largest way that an opening closes", 1e3 * value, "mm", where)
    value, where = _at_largest(slabs, slabs["closings"], "slab")
    yield KeyFigure("most closings of the gap under a slab", value, "-", where)


def _displaced_ground(train: Train) -> Iterator[KeyFigure]:
    """Largest displacement of the ground that the train passed over."""
    profile = ground_profile(train)
    for direction, words in enumerate(("vertical", "lateral")):
        size = np.abs(profile.displacement[:, direction])
        if size.any():
            where = f"chainage {profile.x[int(np.argmax(size))]:.1f} m"
            yield KeyFigure(f"largest {words} displacement of the ground", 1e3 * float(size.max()), "mm", where)


def _moving_ground(train: Train) -> Iterator[KeyFigure]:
    """Largest acceleration of the ground."""
    motion = ground_motion(train)
    for direction, words in enumerate(("vertical", "lateral")):
        if motion.acceleration[direction] > 0.0:
            yield KeyFigure(
                f"largest {words} acceleration of the ground", float(motion.acceleration[direction]), "m/s^2"
            )


def _at_largest(extremes: Extremes, values: Reals, kind: str) -> tuple[float, str]:
    """Largest value among the seats or slabs that the train reached, and its place."""
    among = np.where(extremes.reached.reshape(-1, *[1] * (values.ndim - 1)), values, -np.inf)
    place = np.unravel_index(int(np.argmax(among)), among.shape)
    side = f" {SIDES[place[1]]}" if values.ndim > 1 else ""
    return float(among[place]), f"{kind} {extremes.index[place[0]]}{side}, chainage {extremes.chainage[place[0]]:.1f} m"
