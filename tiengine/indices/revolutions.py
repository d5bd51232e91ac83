"""Force of a wheel over its rotation angle, revolution by revolution."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tiengine.indices.train_record import AbsentError, Train
from tiengine.indices.wheel_extremes import first_samples
from tiengine.irregularity.wheel_shapes import WheelTables, wheel_tables
from tiengine.parameters.arrays import Reals

__all__ = ["Revolutions", "revolutions", "shaped_wheels"]

BINS = 180
"""Bins of a revolution, two degrees each."""


class Revolutions(NamedTuple):
    """Force of one wheel over its angle.

    Attributes:
        name: Wheel in words.
        angle: Middles of the bins [rad], shape (BINS,).
        mean: Mean normal force in each bin [N], NaN where there is no sample.
        smallest: Smallest.
        largest: Largest.
        deviation: Radius deviation there [m].
        of_revolution: Largest force of every whole revolution [N], shape (revolutions,).
    """

    name: str
    angle: Reals
    mean: Reals
    smallest: Reals
    largest: Reals
    deviation: Reals
    of_revolution: Reals


def shaped_wheels(train: Train) -> tuple[WheelTables, list[tuple[int, int]]]:
    """Tables of the wheels out of round, and wheelset and side of each of them.

    Args:
        train: The train.

    Raises:
        AbsentError: All wheels are round.
    """
    scenario = train.scenario
    if not scenario.train.wheel_shapes:
        raise AbsentError("all wheels are round; set train.wheel_shapes and run again")
    tables = wheel_tables(scenario.train.wheel_shapes, scenario.parts.wheel_radii)
    return tables, [(int(w), int(side)) for w, side in np.argwhere(tables.number >= 0)]


def revolutions(train: Train, wheelset: int, side: int, tables: WheelTables) -> Revolutions:
    """Sort the normal force of a wheel by the angle by which it has turned; the run-in is left out.

    The angle is the distance over r0 less the pitch of the wheelset, where the file holds it.

    Args:
        train: The train.
        wheelset: Its number, from 0.
        side: 0 left, 1 right.
        tables: Tables of the wheels out of round.

    Raises:
        AbsentError: The file lacks the wheel's force, or the run is shorter than the run-in.
    """
    samples = train.samples("wheel", "normal_force")
    begin = int(first_samples(train, samples)[wheelset])
    position, channels = samples.read(begin, len(samples), slice(wheelset, wheelset + 1))
    force = channels["normal_force"][:, 0, side]
    if not force.size:
        raise AbsentError("the run is shorter than output.run_in")
    angle = _turned(train, wheelset, position, np.asarray(samples.group["time"][begin:]))
    place = np.floor(np.mod(angle, 2.0 * np.pi) / (2.0 * np.pi) * BINS).astype(np.intp) % BINS
    count = np.bincount(place, minlength=BINS)
    mean = np.full(BINS, np.nan)
    mean[count > 0] = np.bincount(place, force, BINS)[count > 0] / count[count > 0]
    low, high = np.full(BINS, np.inf), np.full(BINS, -np.inf)
    np.minimum.at(low, place, force)
    np.maximum.at(high, place, force)
    low[count == 0] = high[count == 0] = np.nan
    middles = 2.0 * np.pi * (np.arange(BINS) + 0.5) / BINS
    values = tables.values[tables.number[wheelset, side], :, 0]
    deviation = values[np.floor(middles / (2.0 * np.pi) * len(values)).astype(np.intp)]
    turn = np.floor(angle / (2.0 * np.pi)).astype(np.intp)
    whole = [force[turn == k].max() for k in range(int(turn[0]) + 1, int(turn[-1]))]
    name = f"wheelset {wheelset + 1}, {('left', 'right')[side]} wheel"
    return Revolutions(name, middles, mean, low, high, deviation, np.array(whole))


def _turned(train: Train, wheelset: int, position: Reals, time: Reals) -> Reals:
    """Angle by which a wheel has turned since the start [rad]."""
    scenario = train.scenario
    start = scenario.rear + scenario.centre_in_window
    turned = (position - start) / scenario.parts.wheel_radii[wheelset]
    try:
        bodies = train.samples("body", "displacement")
    except AbsentError:
        return turned
    body, pitch = int(train.model.wheelset_dof[wheelset, 3]) // 5, 3
    values = np.asarray(bodies.group["displacement"][:, body, pitch], np.float64)
    return turned - np.interp(time, np.asarray(bodies.group["time"]), values)
