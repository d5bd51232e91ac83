"""Result files made by hand with h5py, in the documented layout: what figures and reports are checked against."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tiengine import result as results
from tiengine.result import Result
from tiengine.result_files.layout import DIMENSIONS
from tiengine.result_files.reader import FORMAT, FORMAT_VERSION
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.vehicle.train import assemble, static_wheel_loads

V = 350.0 / 3.6  # m/s
BODIES = ("car", "frame 1", "frame 2", "wheelset 1", "wheelset 2", "wheelset 3", "wheelset 4")
OFFSET = np.array([10.0, 7.5, -7.5, -10.0])  # m, wheelsets of CRH380A_v2
START = 18.0  # m: where the default scenario's first vehicle stands at t = 0
SLAB, SEAT = 5.67, 0.63  # m, of CRTS_III

Groups = Mapping[str, Mapping[str, Any]]


def scenario(**overrides: Any) -> Scenario:
    """The default scenario without run-in; keys with two underscores for the point."""
    changes = {key.replace("__", "."): value for key, value in overrides.items()}
    return load_scenario("default", {"output.run_in": 0.0, **changes})


def static_loads(of: Scenario) -> np.ndarray:
    """Static load of each wheel [N], shape (4, 2)."""
    return static_wheel_loads(assemble(of.parts.vehicles, of.parts.centres))


def written(path: Path, of: Scenario, *trains: Groups, status: str = "complete", **attributes: Any) -> Path:
    """Write a file.

    Args:
        path: Where.
        of: Its scenario.
        trains: Groups of each train, by name, of datasets by name; attributes under ``"attributes"``.
        status: Of the last train.
        attributes: Of the root.
    """
    with h5py.File(path, "w") as file:
        header = {"format": FORMAT, "format_version": FORMAT_VERSION, "scenario": to_toml(of), "status": status}
        file.attrs.update({**header, "tiengine_version": "0", **attributes})
        for i, groups in enumerate(trains):
            train = file.create_group(f"trains/{i:03d}")
            train.attrs["status"] = status if i == len(trains) - 1 else "complete"
            for name, datasets in groups.items():
                group = train.create_group(name)
                for key, values in datasets.items():
                    if key == "attributes":
                        group.attrs.update(values)
                    else:
                        group[key] = list(values) if isinstance(values, tuple) else values
                _label(group, DIMENSIONS.get(name, ()))
    return path


def _label(group: h5py.Group, dimensions: tuple[str, ...]) -> None:
    """The labels of a group's dimensions that a test does not care for: numbers."""
    channels = [dataset for dataset in group.values() if len(dimensions) > 1 and dataset.ndim == len(dimensions)]
    for axis, name in enumerate(dimensions):
        if name not in group and channels:
            group[name] = np.arange(channels[0].shape[axis])


def made(path: Path, of: Scenario, *trains: Groups, **more: Any) -> Result:
    """The same, open for reading."""
    return results.open(written(path, of, *trains, **more))


def clock(samples: int, interval: float, speed: float = V, start: float = START) -> dict[str, np.ndarray]:
    """Times and positions."""
    time = interval * np.arange(samples)
    return {"time": time, "position": start + speed * time}


def wheel(Q: np.ndarray, Y: np.ndarray, interval: float = 1e-3, **more: Any) -> dict[str, Any]:
    """Wheel forces [N], shape (n, 4, 2), and further channels."""
    times = clock(len(Q), interval, **{key: more.pop(key) for key in ("speed", "start") if key in more})
    return {**times, "wheelset_offset": OFFSET, "vertical_force": Q, "lateral_force": Y, **more}


def body(acceleration: np.ndarray, interval: float = 1e-3) -> dict[str, Any]:
    """Accelerations, shape (n, 7, 5)."""
    return {**clock(len(acceleration), interval), "body": BODIES, "acceleration": acceleration}


def seats(count: int, failed: slice = slice(0), **channels: np.ndarray) -> dict[str, Any]:
    """Extremes of seats from chainage 0, 10 kN each; the left ones of a slice failed, their neighbours at 25 kN."""
    largest, factor = np.full((count, 2), 10e3), np.ones((count, 2))
    if failed.stop:
        factor[failed, 0] = largest[failed, 0] = 0.0
        largest[[failed.start - 1, failed.stop], 0] = 25e3
    index = np.arange(count)
    zero = np.zeros((count, 2))
    made = {"largest_vertical_force": largest, "smallest_vertical_force": zero - 1e3, "factor": factor}
    sideways = {"largest_lateral_force": zero + 2e3, "smallest_lateral_force": zero - 3e3}
    return {"seat": index, "chainage": (index + 0.5) * SEAT, **made, **sideways, **channels}


def slabs(count: int, void: int | None = None) -> dict[str, Any]:
    """Extremes of slabs from chainage 0: 50 kPa, under one with a void 80 kPa; moments 3 and 4 kN m/m."""
    index, ones = np.arange(count), np.ones(count)
    factor, pressure = ones.copy(), 50e3 * ones
    if void is not None:
        factor[void], pressure[void] = 0.0, 80e3
    values = {"largest_pressure": pressure, "smallest_pressure": 5e3 * ones, "mortar_factor": factor}
    values |= {"largest_deflection": 1e-4 * ones, "smallest_deflection": -1e-5 * ones}
    for i, direction in enumerate("xy"):
        values |= {f"largest_moment_{direction}": (3e3 + i * 1e3) * ones, f"smallest_moment_{direction}": -1e3 * ones}
    return {"slab": index, "chainage": (index + 0.5) * SLAB, **values}
