"""Size of a result file, estimated before the run."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

from tiengine.parameters.conventions import SIDES
from tiengine.parameters.errors import InputError
from tiengine.recording.deflection import window_points
from tiengine.recording.recorder import Recorder
from tiengine.recording.trackside import trackside_groups
from tiengine.result_files.channels import DIRECTIONS, DOFS
from tiengine.result_files.layout import CHUNK
from tiengine.scenario.scenario import Scenario, duration

__all__ = ["check_space", "estimated_bytes", "size_text"]

USUAL_STEP = 2e-4
"""Time step [s] assumed for "auto", which tries longer ones first."""

SLACK = 1.05
"""Factor for events, journal and checkpoints; without it, estimates for files of 2 to 14 MB are within 0.7 %."""

OF_DATASET = 2_100
"""Bytes of a dataset without its samples: header, attributes, scales; 1.5 to 2.0 kB measured."""

OF_CHUNK = 60
"""Bytes of a chunk without its samples: its entry in the index, half filled."""


def estimated_bytes(scenario: Scenario) -> int:
    """Size of the result file of a scenario in bytes, to about ten per cent.

    Args:
        scenario: Scenario with all its trains.
    """
    return round(SLACK * sum(_bytes_of(train) for train in scenario.members))


def check_space(scenario: Scenario, path: Path) -> None:
    """Refuse a run whose result will not fit on the disk.

    Args:
        scenario: Scenario with all its trains.
        path: Path of the result file.

    Raises:
        InputError: The free space is too small; the message states how much is missing.
    """
    needed, free = estimated_bytes(scenario), shutil.disk_usage(path.parent).free
    if needed > free:
        raise InputError(
            f"output = '{path}': needs about {size_text(needed)}, {size_text(free)} are free:"
            f" {size_text(needed - free)} are missing; record fewer channels, longer output intervals, or write to"
            " another disk"
        )


def _bytes_of(train: Scenario) -> float:
    """Bytes of the data of one train."""
    real = {"single": 4, "double": 8}[train.output.precision]
    found = 0.0
    for name, spec in (Recorder.groups_of(train) | trackside_groups(train)).items():
        rows, sample = _rows(train, name), math.prod(_length(train, name, each) for each in spec.dimensions)
        found += len(spec.channels) * _grown(rows, spec.chunk, sample * real)
        if spec.times_of is None:
            found += 2 * _grown(rows, CHUNK, 8)
        found += OF_DATASET * len(spec.dimensions)
    return found


def _grown(rows: float, chunk: int, sample: int) -> float:
    """Bytes of a dataset that grows to a number of rows; HDF5 stores whole chunks."""
    chunks = math.ceil(rows / chunk)
    return OF_DATASET + chunks * (chunk * sample + OF_CHUNK)


def _rows(train: Scenario, group: str) -> float:
    """Number of samples of a group."""
    out, slab = train.output, train.parts.slab
    step = train.numerics.time_step
    dt = USUAL_STEP if step == "auto" else float(step)
    distance, time = train.train.distance, duration(train)
    match group.partition("/")[0]:
        case "wheel" | "patch" | "irregularity":
            return time / _interval(out.wheel_interval, dt)
        case "body" | "mortar":
            return time / _interval(out.body_interval, dt)
        case "seats":
            return (distance + train.window_length) / slab.fastening_pitch
        case "slabs":
            return (distance + train.window_length) / slab.pitch + 1
        case "deflection":
            return time / float(out.deflection_interval)
        case _:  # a gauge is recorded while it is in the window
            return float(min(time, train.window_length / min(train.train.speed.speed)) / dt)


def _length(train: Scenario, group: str, dimension: str) -> int:
    """Length of a dimension of fixed length."""
    vehicles, slab = train.parts.vehicles, train.parts.slab
    return {
        "wheelset": sum(len(vehicle.axle_positions) for vehicle in vehicles),
        "body": sum(len(vehicle.body) for vehicle in vehicles),
        "dof": len(DOFS),
        "side": len(SIDES),
        "patch": 2,
        "direction": len(DIRECTIONS),
        "slot": slab.slots(train.window_length, train.numerics.slab_count == "cover"),
        "point": len(window_points(train.window_length)),
    }[dimension]


def _interval(stated: float | str, dt: float) -> float:
    """Interval of samples [s], a whole number of steps; "auto" or "every" is one step."""
    return dt if isinstance(stated, str) else max(round(stated / dt), 1) * dt


def size_text(count: int) -> str:
    """Size in MB or GB.

    Args:
        count: Bytes.
    """
    return f"{count / 1e9:.2f} GB" if count >= 1e9 else f"{count / 1e6:.1f} MB"
