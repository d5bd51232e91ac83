"""Scene around one train, snapshot by snapshot: rails, slabs, bodies and wheel forces at the same instants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tiengine.indices.train_record import AbsentError, Train
from tiengine.parameters.arrays import Flags, Reals

__all__ = ["CAR", "FRAME", "WHEELSET", "Scene", "read_scene"]

CAR, FRAME, WHEELSET = "car", "frame", "wheelset"
MOST_FRAMES = 5000


@dataclass(frozen=True, eq=False)
class Scene:
    """Snapshots of a train; lengths along the track are relative to the first vehicle's centre, forward.

    Attributes:
        time: Instants [s], shape (frames,).
        position: Chainages of the first vehicle's centre [m], shape (frames,).
        offset: Points along the track [m], shape (points,).
        rail: Deflection of the rails, down positive [m], shape (frames, 2, points).
        slab: Deflection of the slabs under the rails, NaN over joints [m], shape (frames, 2, points).
        wheel_x: Wheelsets [m], shape (wheelsets,).
        wheel_radius: Radius of the wheels [m].
        half_spacing: Half distance of the tape circles [m].
        force: Vertical wheel forces [N], shape (frames, wheelsets, 2).
        lifted: Whether a wheel was off the rail since the last snapshot, shape (frames, wheelsets, 2).
        body_x: Bodies [m], shape (bodies,).
        body_kind: ``CAR``, ``FRAME`` or ``WHEELSET`` of each body.
        body_length: Lengths for drawing [m], shape (bodies,).
        body_z: Displacements, down positive [m], shape (frames, bodies).
    """

    time: Reals
    position: Reals
    offset: Reals
    rail: Reals
    slab: Reals
    wheel_x: Reals
    wheel_radius: float
    half_spacing: float
    force: Reals
    lifted: Flags
    body_x: Reals
    body_kind: tuple[str, ...]
    body_length: Reals
    body_z: Reals


def read_scene(train: Train) -> Scene:
    """Read the scene of a train at the snapshots of its deflection.

    Args:
        train: The train.

    Raises:
        AbsentError: The file has fewer than two snapshots, more than 5000, or lacks wheels or bodies.
    """
    bent = train.group("deflection", "output.deflection_interval")
    frames = len(bent["time"])
    if not 2 <= frames <= MOST_FRAMES:
        raise AbsentError(
            f"{train.result.name}: {frames} snapshots of the deflection; must be 2 to {MOST_FRAMES}: set"
            " output.deflection_interval = 0.002, for example, and run again"
        )
    time = np.asarray(bent["time"][:], np.float64)
    wheel, body = train.group("wheel", "output.wheel_channels"), train.group("body", "output.body_channels")
    for group, name, key in ((wheel, "vertical_force", "wheel"), (body, "displacement", "body")):
        if name not in group:
            raise AbsentError(f"{train.result.name}: no {name}; add it to output.{key}_channels and run again")
    normal = "normal_force" if "normal_force" in wheel else "vertical_force"
    instants = np.asarray(wheel["time"][:])
    at_wheels = np.clip(np.searchsorted(instants, time), 0, len(instants) - 1)
    kinds, x, length = _bodies(train)
    parts = train.scenario.parts
    return Scene(
        time=time,
        position=np.asarray(bent["position"][:], np.float64),
        offset=np.asarray(bent["offset"][:], np.float64),
        rail=np.asarray(bent["rail"][:], np.float64),
        slab=np.asarray(bent["slab"][:], np.float64),
        wheel_x=parts.wheelset_positions,
        wheel_radius=parts.vehicles[0].wheel_radius,
        half_spacing=parts.vehicles[0].half_spacing,
        force=wheel["vertical_force"][:][at_wheels].astype(np.float64),
        lifted=_lifted(wheel[normal][:], at_wheels),
        body_x=x,
        body_kind=kinds,
        body_length=length,
        body_z=_at(np.asarray(body["time"][:]), body["displacement"][:, :, 1].astype(np.float64), time),
    )


def _bodies(train: Train) -> tuple[tuple[str, ...], Reals, Reals]:
    """Kind, place and length of every body, in the order of the file."""
    kinds: list[str] = []
    rows: list[tuple[float, float]] = []
    parts = train.scenario.parts
    for centre, vehicle in zip(parts.centres, parts.vehicles, strict=True):
        heaviest = max(vehicle.body, key=lambda body: body.mass)
        for body in vehicle.body:
            kind = WHEELSET if body.wheelset else CAR if body is heaviest else FRAME
            kinds.append(kind)
            length = {CAR: 0.97 * vehicle.length, FRAME: 3.2, WHEELSET: 2.0 * vehicle.wheel_radius}[kind]
            rows.append((float(centre) + body.x, length))
    x, length_of = np.array(rows).T
    return tuple(kinds), x, length_of


def _lifted(force: Any, at: Any) -> Flags:
    """Whether each force was zero in the samples up to each snapshot since the one before."""
    edges = np.concatenate([[0], at[:-1] + 1])
    found = [(force[a : max(b, a) + 1] <= 0.0).any(axis=0) for a, b in zip(edges, at, strict=True)]
    return np.array(found)


def _at(time: Reals, values: Reals, when: Reals) -> Reals:
    """Linear interpolation of values (samples, columns); shape (instants, columns)."""
    return np.stack([np.interp(when, time, column) for column in values.T], axis=1)
