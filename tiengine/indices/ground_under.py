"""Ground under a train: where it is displaced, how it moves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tiengine.indices.train_record import AbsentError, Train
from tiengine.irregularity.base_motion import GroundRecord
from tiengine.irregularity.ground import LATERAL, VERTICAL, ground_shape
from tiengine.irregularity.rail_shapes import RailShapes
from tiengine.parameters.arrays import Reals

__all__ = ["GroundMotion", "GroundProfile", "ground_motion", "ground_profile", "rail_profile"]

STEP = 0.1  # m between places at which shapes are taken


class GroundProfile(NamedTuple):
    """Displacement of the ground along the track.

    Attributes:
        x: Chainages [m], shape (n,).
        displacement: Down and to the right [m], shape (n, 2).
    """

    x: Reals
    displacement: Reals


class GroundMotion(NamedTuple):
    """Largest motion of the ground in time.

    Attributes:
        acceleration: Largest magnitude downwards or upwards, and to either side [m/s^2], shape (2,).
        displacement: The same of displacement [m], shape (2,).
        duration: Of the record [s].
    """

    acceleration: Reals
    displacement: Reals
    duration: float


def ground_profile(train: Train) -> GroundProfile:
    """Displacement of the ground that wheels of a train passed over.

    Args:
        train: The train.

    Raises:
        AbsentError: The ground is even.
        InputError: A file breaks a rule or is no longer there.
    """
    entries = train.scenario.track.ground
    if not entries:
        raise AbsentError("the ground is even; set track.ground and run again")
    x = _passed(train)
    both = [sum(ground_shape(each, x, d) for each in entries) for d in (VERTICAL, LATERAL)]
    return GroundProfile(x, np.stack([np.asarray(values, np.float64) for values in both], axis=1))


def rail_profile(train: Train) -> tuple[Reals, Reals]:
    """Chainages [m], shape (n,), and heights of the shapes of the left and right rail there [m], shape (n, 2).

    Args:
        train: The train.

    Raises:
        AbsentError: The rails have no shapes.
        InputError: A file breaks a rule or is no longer there.
    """
    shapes = train.scenario.track.rail_shapes
    if not shapes:
        raise AbsentError("the rails have no shapes; set track.rail_shapes and run again")
    x = _passed(train)
    return x, RailShapes(shapes).sample(x)[0]


def ground_motion(train: Train) -> GroundMotion:
    """Largest motion of ground that moves in time, over the whole record.

    Args:
        train: The train.

    Raises:
        AbsentError: The ground is at rest.
        InputError: The file breaks a rule or is no longer there.
    """
    moving = train.scenario.track.base_motion
    if moving.file is None:
        raise AbsentError("the ground is at rest; set track.base_motion and run again")
    record = GroundRecord(moving)
    time = moving.start + np.linspace(0.0, record.duration, 20_001)
    acceleration, displacement = (np.abs(record.at(time, derivative)).max(axis=0) for derivative in (2, 0))
    return GroundMotion(acceleration, displacement, record.duration)


def _passed(train: Train) -> Reals:
    """Chainages from the last wheel at the start to the first at the end [m]."""
    scenario = train.scenario
    start = scenario.rear + scenario.centre_in_window
    places = scenario.parts.wheelset_positions
    first, last = start + float(places.min()), train.last_chainage() + float(places.max())
    return np.linspace(first, last, max(int((last - first) / STEP), 1) + 1)
