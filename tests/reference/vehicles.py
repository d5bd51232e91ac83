"""Vehicles for tests: the library's with changes, a tiny one, and what tests read off them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import find_preset
from tiengine.vehicle.train import TrainModel
from tiengine.vehicle.vehicle import Vehicle, vehicle_from_table

NAMES = ("CRH2", "CRH380A_v2", "CRH380A_v6", "Manchester", "Zhai_coach")
"""Vehicles of the library."""


def changed(name: str, **changes: dict[str, Any]) -> Vehicle:
    """A preset with keys of its tables replaced."""
    table = load_toml(find_preset("vehicles", name))
    merged = {key: table.get(key, {}) | value for key, value in changes.items()}
    return vehicle_from_table(table | merged, name)


def free_of_wheelsets(train: TrainModel) -> NDArray[np.intp]:
    """Coordinates left when the wheelsets are held."""
    return np.setdiff1d(np.arange(train.n), train.wheelset_dof)


def rigid_motion(vehicle: Vehicle, **amounts: float) -> NDArray[np.float64]:
    """Coordinates of a vehicle that moves as one body about the rail level; wheelsets do not pitch."""
    y, z, roll, pitch, yaw = (amounts.get(key, 0.0) for key in ("y", "z", "roll", "pitch", "yaw"))
    motions = [
        [y + yaw * b.x + roll * b.height, z - pitch * b.x, roll, 0.0 if b.wheelset else pitch, yaw]
        for b in vehicle.body
    ]
    return np.ravel(motions)


def tiny_vehicle(**keys: Any) -> Vehicle:
    """A car of 1000 kg over one wheelset, joined as the keys say."""
    inertia = {"Jx": 50.0, "Jy": 60.0, "Jz": 70.0}
    car = {"name": "car", "mass": 1000.0, "height": 1.0, **inertia}
    axle = {"name": "axle", "mass": 200.0, "height": 0.4, "wheelset": True, **inertia}
    table = {"name": "tiny", "wheel_radius": 0.4, "half_span_contact": 0.75, "length_over_couplers": 5.0}
    ends = {"a": "car", "b": "axle", "point_a": [0.0, 0.0, 0.4], "point_b": [0.0, 0.0, 0.4]}
    joined = {key: [ends | item for item in value] for key, value in keys.items()}
    return vehicle_from_table(table | {"body": [car, axle]} | joined, "tiny")
