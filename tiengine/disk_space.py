"""How large a result will be, before it is computed."""

from __future__ import annotations

import shutil
from pathlib import Path

from tiengine.quantity import InputError
from tiengine.scenario import Scenario

__all__ = ["check_space", "estimated_bytes"]

SHORTEST_STEP = 2e-4
"""Step [s] that "auto" means here: it tries longer ones first."""

SLACK = 1.1
"""Of HDF5: half-filled chunks, indices; 3 to 8 % measured on runs of 100 m to 5 km."""

PER_TRAIN = 300_000
"""Bytes of a train that do not grow with its way: labels, attributes, first chunks."""

POINTS_PER_METRE = 4
"""Of the deflected track."""


def estimated_bytes(scenario: Scenario) -> int:
    """Size of the result file of a scenario, within some ten per cent.

    Args:
        scenario: All trains.
    """
    return round(SLACK * sum(PER_TRAIN + _bytes_of(train) for train in scenario.members))


def check_space(scenario: Scenario, path: Path) -> None:
    """Refuse a run whose result will not fit on the disk.

    Args:
        scenario: All trains.
        path: Where the result shall be.

    Raises:
        InputError: Says how much is missing.
    """
    needed, free = estimated_bytes(scenario), shutil.disk_usage(path.parent).free
    if needed > free:
        raise InputError(
            f"output = '{path}': needs some {_size(needed)}, {_size(free)} are free: {_size(needed - free)} are"
            " missing; record fewer channels, longer output intervals, or write to another disk"
        )


def _bytes_of(scenario: Scenario) -> float:
    """Samples of one train."""
    out, vehicles = scenario.output, scenario.parts.vehicles
    real = {"single": 4, "double": 8}[out.precision]
    step = scenario.numerics.time_step
    dt = SHORTEST_STEP if step == "auto" else float(step)
    duration = scenario.train.distance / min(scenario.train.speed.speed)
    wheels = 2 * len(out.wheel_channels) + 2 * len(out.irregularity_channels)
    bodies = 5 * len(out.body_channels)
    slots = scenario.window_length / scenario.parts.slab.pitch + 2
    per_wheel_sample = 16 + real * wheels * 4 * len(vehicles)
    per_body_sample = 16 + real * (bodies * 7 * len(vehicles) + 3 * slots)
    found = duration / _interval(out.wheel_interval, dt) * per_wheel_sample
    found += duration / _interval(out.body_interval, dt) * per_body_sample
    if out.envelopes:
        slab = scenario.parts.slab
        found += scenario.train.distance * ((12 + 10 * real) / slab.fastening_pitch + (12 + 9 * real) / slab.pitch)
    if out.deflection_interval != "none":
        points = POINTS_PER_METRE * scenario.window_length
        found += duration / float(out.deflection_interval) * (16 + 4 * points * real)
    return float(found)


def _interval(given: float | str, dt: float) -> float:
    return dt if isinstance(given, str) else max(given, dt)


def _size(count: int) -> str:
    return f"{count / 1e9:.2f} GB" if count >= 1e9 else f"{count / 1e6:.1f} MB"
