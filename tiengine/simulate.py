"""Run a scenario: set-up, start, time loop in chunks, streamed output."""

from __future__ import annotations

import time

_clock = time.perf_counter()  # importing the engine's packages is part of what a user waits for

from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from threadpoolctl import threadpool_limits  # noqa: E402

from tiengine import backend  # noqa: E402
from tiengine.events import RunFailedError, check_chunk  # noqa: E402
from tiengine.irregularity import Irregularity, make_irregularity  # noqa: E402
from tiengine.kernels import layout as at  # noqa: E402
from tiengine.model import Model, build_model  # noqa: E402
from tiengine.quantity import InputError  # noqa: E402
from tiengine.recorder import Recorder  # noqa: E402
from tiengine.results import Result  # noqa: E402
from tiengine.scenario import Scenario, check_wavelength, load_scenario, to_toml  # noqa: E402
from tiengine.setup import ingredients  # noqa: E402
from tiengine.speed import SpeedProfile  # noqa: E402
from tiengine.stability import TOLERATED_GROWTH, energy_growth  # noqa: E402
from tiengine.start import equilibrium, release  # noqa: E402
from tiengine.state import State  # noqa: E402
from tiengine.stepper import Chunk, Stepper  # noqa: E402
from tiengine.writer import Writer, check_output  # noqa: E402

IMPORT_SECONDS = time.perf_counter() - _clock

__all__ = ["Progress", "prepare", "run"]

Progress = Callable[[float, float], None]

CHUNK_STEPS = 1000
AUTO_STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5)
"""Steps that "auto" tries, the longest first: 2e-4 s keeps wheel forces within 0.3 % of their peak (README)."""


def run(
    scenario: Scenario | str | Path | dict[str, Any],
    output: Path | str | None = None,
    *,
    force: bool = False,
    progress: Progress | None = None,
    public_launch: bool = False,
) -> Result:
    """Simulate a scenario.

    Args:
        scenario: What to run: a checked scenario, the name of a built-in one, a TOML file, or tables.
        output: HDF5 file to write; in memory if None.
        force: Replace an existing file.
        progress: Called with simulated time and end time [s] now and then.
        public_launch: Launch kernels by public Taichi calls only (slower; for comparison).

    Returns:
        The result, open for reading.

    Raises:
        InputError: The scenario breaks a rule, or the file cannot be written.
        RunFailedError: The train derailed or the numbers ran away; the file holds what was computed until then.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    path = None if output is None else Path(output)
    if path is not None:
        check_output(path, force)
    with threadpool_limits(1):  # BLAS on one thread: the same bits on any machine
        return _run(scenario, path, force, progress, public_launch)


def prepare(scenario: Scenario, public_launch: bool = False) -> tuple[Model, float]:
    """Build the model of a scenario with a stable time step.

    Args:
        scenario: Checked scenario.
        public_launch: Public Taichi calls only.

    Returns:
        The model, and the wall time of compiling the step's kernels [s].

    Raises:
        InputError: The step asked for is unstable or too long for the irregularity, or none is short enough.
    """
    backend.start(scenario.numerics.threads)
    asked = scenario.numerics.time_step
    V = scenario.train.speed.at(scenario.rear + scenario.centre_in_window)[0]
    fastest = scenario.train.speed.fastest
    jit = 0.0
    track = make_irregularity(scenario.irregularity, 0.0)  # a measured series has its own shortest wave
    for dt in AUTO_STEPS if asked == "auto" else (float(asked),):
        try:
            check_wavelength(scenario, dt)
            track.check_step(fastest, dt)
        except InputError:
            if asked == "auto" and dt != AUTO_STEPS[-1]:
                continue
            raise
        model = build_model(ingredients(scenario, dt), fastest)
        if jit == 0.0:
            jit = Stepper(model, State.at_rest(model), Chunk.empty(model, 1, 1, 1), public=public_launch).compile()
        growth = energy_growth(model, fastest)
        if growth <= TOLERATED_GROWTH:
            if V != fastest:
                model.refactor(V)
            return model, jit
    raise InputError(
        f"numerics.time_step = {asked}: unstable; free vibration of the track grows by a factor {growth:.3g} within"
        " 80 steps; choose a shorter step, more passes or fewer modes_per_metre"
    )


def _run(scenario: Scenario, path: Path | None, force: bool, progress: Progress | None, public: bool) -> Result:
    """Everything after the checks."""
    started = time.perf_counter()
    model, jit = prepare(scenario, public)
    dt = model.given.newmark.dt
    recorder = Recorder(scenario, dt)
    speed = scenario.train.speed
    state = State.at_rest(model)
    V, V_rate = speed.at(scenario.rear + model.centre_s)
    if scenario.numerics.start == "equilibrium":
        equilibrium(model, state, scenario.rear, V, V_rate)
    else:
        release(model, state, scenario.rear)
    rows = (CHUNK_STEPS // every + 1 for every in (recorder.wheel_every, recorder.body_every))
    chunk = Chunk.empty(model, CHUNK_STEPS, *rows)
    irregularity = make_irregularity(scenario.irregularity, scenario.rear + float(model.wheel_s.max()))
    stepper = Stepper(model, state, chunk, public=public)
    jit += stepper.compile()
    setup = time.perf_counter() - started - jit
    times = {"import": IMPORT_SECONDS, "jit": jit, "setup": setup}
    attributes = {**_facts(scenario, model), "status": "running"}
    labels = recorder.labels(model.given.train, model.given.slots)
    with Writer(
        path, to_toml(scenario), attributes, [labels], recorder.groups(), scenario.output.precision, force=force
    ) as writer:  # fmt: skip
        return _loop(scenario, model, stepper, irregularity, recorder, writer, progress, times)


def _loop(
    scenario: Scenario,
    model: Model,
    stepper: Stepper,
    irregularity: Irregularity,
    recorder: Recorder,
    writer: Writer,
    progress: Progress | None,
    times: dict[str, float],
) -> Result:
    """March chunk by chunk to the end of the way, then close the file."""
    dt, chunk = model.given.newmark.dt, stepper.chunk
    first = scenario.rear + model.centre_s
    end = first + scenario.train.distance
    speed = scenario.train.speed
    duration = _duration(speed, first, scenario.train.distance)
    position, done, writing = first, 0, 0.0
    started = time.perf_counter()
    failure = None
    while position < end - 1e-9 and failure is None:
        x, V, V_rate = speed.advance(position, dt, CHUNK_STEPS)
        count = min(int(np.searchsorted(x, end - 1e-9)), CHUNK_STEPS)
        x, V, V_rate = x[1 : count + 1], V[1 : count + 1], V_rate[1 : count + 1]
        wheels = x[:, None] + model.given.train.wheelset_x
        stepper.load(x - model.centre_s, V, V_rate, irregularity.sample(wheels)[None])
        for step in recorder.rows(done, count):
            stepper.step(*step)
        failure = check_chunk(model, chunk, recorder, done + 1, x)
        clock = time.perf_counter()
        recorder.write(writer, chunk, done + 1, x)
        writing += time.perf_counter() - clock
        done += count
        position = float(x[-1])
        if progress is not None:
            progress(done * dt, max(duration, done * dt))
    loop = time.perf_counter() - started
    times |= {"loop": loop, "writing": writing}
    attributes: dict[str, Any] = {f"wall_time_{name}": seconds for name, seconds in times.items()}
    attributes |= {
        "status": "complete" if failure is None else failure,
        "simulated_time": done * dt,
        "steps": done,
        "real_time_factor": loop / (done * dt),
        "contact_iterations": int(stepper.state.iterations.max()),
    }
    result = writer.close(attributes)
    if failure is not None:
        raise RunFailedError(failure)
    return result


def _duration(speed: SpeedProfile, start: float, distance: float) -> float:
    """Time that the way takes [s], for the progress bar."""
    x = np.linspace(start, start + distance, 200)
    slowness: NDArray[np.float64] = np.array([1.0 / speed.at(float(here))[0] for here in x])
    return float(np.trapezoid(slowness, x))


def _facts(scenario: Scenario, model: Model) -> dict[str, Any]:
    """Root attributes known at the beginning."""
    given = model.given
    return {
        **{f"dofs_{name}": count for name, count in model.dof_counts.items() if name != "total"},
        "dofs": model.dof_counts["total"],
        "time_step": given.newmark.dt,
        "passes": given.passes,
        "window_length": given.length,
        "modes": given.modes,
        "slabs": given.slots,
        "seats_in_window": int(model.dims[at.SEATS]),
        "seed": scenario.irregularity.seed,
    }
