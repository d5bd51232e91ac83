"""Extremes of the unfiltered forces of every wheel of a train, found slice by slice.

A wheelset counts from where its run-in ends: at the chainage at which that of the leading vehicle's wheelset of the
same place ended. Those that the run ends too early for are left out; if all are, the whole run counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.indices.train_record import Samples, Train
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import SIDES

__all__ = ["ForceExtreme", "WheelExtremes", "first_samples", "wheel_extremes"]


@dataclass(frozen=True, eq=False)
class ForceExtreme:
    """Extreme of one force of every wheel.

    Attributes:
        value: Force [N], shape (n_ws, 2); NaN for wheelsets that do not count.
        chainage: Chainage of the wheelset at that instant [m], shape (n_ws, 2).
    """

    value: Reals
    chainage: Reals


@dataclass(frozen=True, eq=False)
class WheelExtremes:
    """Extremes of the wheels of a train.

    Attributes:
        vehicle: Vehicle of each wheelset, from 0, shape (n_ws,).
        largest: Largest Q.
        smallest: Smallest Q.
        lateral: Largest |Y|.
        time_off: Time that each wheel was off the rail [s], shape (n_ws, 2).
    """

    vehicle: NDArray[np.int32]
    largest: ForceExtreme
    smallest: ForceExtreme
    lateral: ForceExtreme
    time_off: Reals

    def place(self, wheelset: int, side: int) -> str:
        """Name a wheel, and in a train of several vehicles its vehicle."""
        vehicle = f", vehicle {self.vehicle[wheelset] + 1}" if self.vehicle.any() else ""
        return f"wheelset {wheelset + 1} {SIDES[side]}{vehicle}"


class _Running:
    """Largest value so far of every wheel, and the chainage where it was."""

    def __init__(self, offset: Reals) -> None:
        self._offset = offset
        self.value: Reals = np.full((len(offset), 2), -np.inf)
        self.chainage: Reals = np.full((len(offset), 2), np.nan)

    def update(self, values: Reals, position: Reals) -> None:
        """Add values, shape (n, n_ws, 2), -inf where they do not count, at positions of the train [m], shape (n,)."""
        i = values.argmax(axis=0)
        found = np.take_along_axis(values, i[None], axis=0)[0]
        more = found > self.value
        self.value[more] = found[more]
        self.chainage[more] = (position[i] + self._offset[:, None])[more]

    def extreme(self, sign: float = 1.0) -> ForceExtreme:
        return ForceExtreme(np.where(np.isfinite(self.value), sign * self.value, np.nan), self.chainage)


def first_samples(train: Train, samples: Samples) -> NDArray[np.intp]:
    """Find the first sample of every wheelset that counts, shape (n_ws,); the number of samples if none does.

    Args:
        train: The train.
        samples: Its group ``wheel``.
    """
    run_in, lag = train.scenario.output.run_in, train.wheelset_lag
    first = {float(each): samples.after(run_in + float(each)) for each in np.unique(lag)}
    begin = np.array([first[float(each)] for each in lag], np.intp)
    return begin if begin.min() < len(samples) else np.zeros_like(begin)


def wheel_extremes(train: Train) -> WheelExtremes:
    """Find the extremes.

    Args:
        train: The train.

    Raises:
        AbsentError: The file lacks the wheel forces.
    """
    samples = train.samples("wheel", "vertical_force", "lateral_force")
    offset: Reals = samples.group["wheelset_offset"][:]
    begin = first_samples(train, samples)
    largest, smallest, lateral = _Running(offset), _Running(offset), _Running(offset)
    off = np.zeros((len(offset), 2), np.int64)
    sample = int(begin.min())
    for position, channels in samples.slices(sample):
        Q, Y = channels["vertical_force"], channels["lateral_force"]
        early = (sample + np.arange(len(Q)))[:, None] < begin
        sample += len(Q)
        for running, values in ((largest, Q), (smallest, -Q), (lateral, np.abs(Y))):
            values[early] = -np.inf
            running.update(values, position)
        off += ((Q <= 0.0) & ~early[..., None]).sum(axis=0)
    return WheelExtremes(
        train.model.wheelset_vehicle, largest.extreme(), smallest.extreme(-1.0), lateral.extreme(),
        np.asarray(off * samples.interval, np.float64),
    )  # fmt: skip
