"""Run a scenario in the full-length model and write the engine's HDF5 layout."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from tiengine.engine import backend
from tiengine.irregularity.base_motion import GroundRecord
from tiengine.irregularity.irregularity import Irregularity, make_irregularity
from tiengine.model.from_scenario import ingredients
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.recording.recorder import Recorder, Samples
from tiengine.result import Result
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.simulation.simulate import Progress
from validation.msm.ground import ForcedBed
from validation.msm.model import FullTrack, build_track
from validation.msm.start import steady_rolling
from validation.msm.step import Buffers, FullState, FullStepper

__all__ = ["FullLength", "load", "prepare", "run_full_length"]

CHUNK_STEPS = 1000
END_MARGIN = 10.0
"""Least distance of a wheel from the rail's ends [m]."""


@dataclass(frozen=True)
class FullLength:
    """Numerics of the full-length model.

    Attributes:
        length: Length of the rail [m], rounded to whole seats.
        modes_per_metre: Trial functions per field and metre.
        slab_modes: Free-free plate modes per slab.
        time_step: dt [s].
    """

    length: float = 600.0
    modes_per_metre: float = 2.0
    slab_modes: int = 20
    time_step: float = 2e-4


def run_full_length(
    scenario: Scenario | str,
    numerics: FullLength | None = None,
    output: Path | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
) -> Result:
    """Simulate a scenario with whole rails and all slabs.

    Args:
        scenario: Train and track; its window and modes are not used.
        numerics: Length, modes and step.
        output: HDF5 file; in memory if None.
        force: Replace an existing file.
        progress: Called from time to time with simulated time and end time [s].

    Returns:
        The result, open for reading; the run ends before a wheel comes within 10 m of the rail's end.

    Raises:
        InputError: The scenario has a varying speed, a start from zero, an alignment or mortar without tension.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    numerics = numerics or FullLength()
    with threadpool_limits(1):
        return _run(scenario, numerics, output, force, progress)


def prepare(scenario: Scenario, numerics: FullLength, steps: int, body_rows: int) -> FullStepper:
    """Build the track, start from steady rolling, and bind the kernels to buffers of so many steps."""
    if not scenario.train.speed.is_constant:
        raise InputError("train.speed_kmh: must be one number in the full-length model")
    refused = (
        ("wind", scenario.wind.speed is not None),
        ("train.forces", scenario.train.forces),
        ("track.rail_shapes", scenario.track.rail_shapes),
        ("track.ground", scenario.track.ground),
        ("train.wheel_shapes", scenario.train.wheel_shapes),
    )
    for key, given_key in refused:
        if given_key:
            raise InputError(f"{key}: must be left out in the full-length model")
    if scenario.numerics.truncation == "static":
        raise InputError('numerics.truncation = "static": must be "local" or "none" in the full-length model')
    if scenario.numerics.start != "equilibrium":
        raise InputError('numerics.start = "zero": must be "equilibrium" in the full-length model')
    if scenario.track.line is not None:
        raise InputError(
            "track.alignment: must be left out in the full-length model, whose track is straight and level"
        )
    backend.start(1)
    V = scenario.train.speed.fastest
    given = ingredients(scenario, numerics.time_step)
    track = build_track(scenario, given, numerics.length, numerics.modes_per_metre, numerics.slab_modes)
    state = FullState.at_rest(track)
    steady_rolling(track, state, scenario, given, V)
    stepper = FullStepper(track, state, Buffers.empty(track, steps, body_rows), V)
    if scenario.track.base_motion.file is not None:
        stepper.bed = ForcedBed(track, GroundRecord(scenario.track.base_motion), given.slab.pitch)
    return stepper


def load(stepper: FullStepper, scenario: Scenario, irregularity: Irregularity, position: float, end: float) -> Reals:
    """Fill the stepper's buffers for the coming steps.

    Args:
        stepper: Owner of the buffers.
        scenario: Source of the speed.
        irregularity: The track.
        position: Chainage of the first vehicle's centre now [m].
        end: Chainage where the run ends [m].

    Returns:
        Chainage at the end of each step [m], shape (steps,).
    """
    track, buffers = stepper.track, stepper.buffers
    chainage, V, V_rate = scenario.train.speed.advance(position, track.newmark.dt, len(buffers.clock))
    count = min(int(np.searchsorted(chainage, end - 1e-9)), len(buffers.clock))
    chainage, V, V_rate = chainage[1 : count + 1], V[1 : count + 1], V_rate[1 : count + 1]
    buffers.clock[:count, :3] = np.stack([chainage, V, V_rate], axis=1)
    buffers.irregularity[0, :count] = irregularity.sample(chainage[:, None] + track.train.wheelset_x)
    return chainage


def _run(
    scenario: Scenario, numerics: FullLength, output: Path | None, force: bool, progress: Progress | None
) -> Result:
    clock = time.perf_counter()
    recorder = Recorder(scenario, numerics.time_step)
    stepper = prepare(scenario, numerics, CHUNK_STEPS, CHUNK_STEPS // recorder.body_every + 1)
    track = stepper.track
    attributes: dict[str, Any] = {
        **{f"dofs_{name}": count for name, count in track.dof_counts.items() if name != "total"},
        "dofs": track.dof_counts["total"],
        "method": "full length",
        "rail_length": track.rail_length,
        "modes": track.modes,
        "slabs": track.slabs,
        "time_step": numerics.time_step,
        "passes": track.passes,
        "seed": scenario.irregularity.seed,
        "status": "running",
        "wall_time_setup": time.perf_counter() - clock,
    }
    labels = recorder.labels(track.train, track.slabs)
    with Writer(
        output, to_toml(scenario), attributes, [labels], recorder.groups(), scenario.output.precision, force=force
    ) as writer:  # fmt: skip
        return _loop(scenario, stepper, recorder, writer, progress)


def _loop(
    scenario: Scenario, stepper: FullStepper, recorder: Recorder, writer: Writer, progress: Progress | None
) -> Result:
    """Advance to the end of the distance or of the rail."""
    track, buffers, dt = stepper.track, stepper.buffers, stepper.track.newmark.dt
    front = float(track.train.wheelset_x.max())
    position = start = scenario.rear + scenario.centre_in_window
    irregularity = make_irregularity(scenario.irregularity, start + front)
    end = min(start + scenario.train.distance, track.rear + track.rail_length - END_MARGIN - front)
    duration, done, writing = (end - start) / scenario.train.speed.fastest, 0, 0.0
    clock = time.perf_counter()
    while position < end - 1e-9:
        chainage = load(stepper, scenario, irregularity, position, end)
        count = len(chainage)
        buffers.time[:count] = dt * np.arange(done + 1, done + count + 1)
        plan = recorder.plan(done, count)
        for step, body in zip(plan.step.tolist(), plan.body.tolist(), strict=True):
            stepper.step(step, body)
        if not np.isfinite(stepper.state.force).all():
            raise RuntimeError(f"the full-length model ran away before {chainage[-1]:.1f} m; shorten the time step")
        before = time.perf_counter()
        steps = np.arange(done + 1, done + count + 1)
        writer.write(0, recorder.block(_samples(track, buffers), steps, chainage))
        writing += time.perf_counter() - before
        done, position = done + count, float(chainage[-1])
        if progress is not None:
            progress(done * dt, max(duration, done * dt))
    loop = time.perf_counter() - clock
    closed = writer.close(
        {
            "status": "complete",
            "simulated_time": done * dt,
            "steps": done,
            "wall_time_loop": loop,
            "wall_time_writing": writing,
            "real_time_factor": loop / (done * dt),
        }
    )
    return Result.of(closed)


def _samples(track: FullTrack, buffers: Buffers) -> Samples:
    """Chunk in the recorder's form; pressures include the slabs' dead weight."""
    u, v = buffers.slabs[:, 0, :, : track.slab_modes], buffers.slabs[:, 1, :, : track.slab_modes]
    pressure = np.empty((*u.shape[:2], 2))
    for group in track.groups:
        slab = group.slab
        here = (track.mortar.stiffness * u[:, group.index] + track.mortar.damping * v[:, group.index]) @ slab.bed
        here = slab.bed_factor * (track.dead_pressure + here)
        pressure[:, group.index, 0], pressure[:, group.index, 1] = here.max(axis=2), here.min(axis=2)
    index = np.broadcast_to(track.first_slab + np.arange(float(track.slabs)), u.shape[:2])
    return Samples(buffers.wheel[0], buffers.body[0], index, pressure)
