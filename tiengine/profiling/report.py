"""Report of a profile: values with their units in their names, JSON, and the comparison of two reports."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import LARGEST_TOML, read_bytes
from tiengine.profiling.machine import Machine
from tiengine.profiling.roofline import Roofs

__all__ = ["Comparison", "Loop", "Memory", "ProfileReport", "Rate", "Stage", "Wall", "compare", "read_json"]

FORMAT = "tiengine-profile"
FORMAT_VERSION = 1


@dataclass(frozen=True)
class Wall:
    """Wall times apart from the loop.

    Attributes:
        import_s: Importing the engine and its packages.
        jit_s: Compiling the step's kernels, or loading them from Taichi's cache.
        code_generation_s: Code generation, a part of it; near zero when all kernels are in the cache.
        setup_s: Model and start, without compiling.
    """

    import_s: float
    jit_s: float
    code_generation_s: float
    setup_s: float


@dataclass(frozen=True)
class Stage:
    """One stage of the step; the stages add up to the loop.

    Attributes:
        name: Its name.
        calls_per_step: Calls per step; a fraction for work that is done once a chunk or only when recording.
        us_per_train_step: Mean wall time per step and train.
        share: Share of the loop.
        estimated: Not timed in the loop: a part of a fused launch, measured by running it alone, or the remainder.
    """

    name: str
    calls_per_step: float
    us_per_train_step: float
    share: float
    estimated: bool


@dataclass(frozen=True)
class Loop:
    """The time loop, writing included.

    Attributes:
        real_time_factor: Wall time over simulated time of all trains together, without timers in the step.
        real_time_factor_per_train: The same over the number of trains.
        steps_per_s: Steps of all trains together per second, without timers.
        us_per_train_step: Mean with timers, the sum of all stages.
        step_us_p50: Median of the steps that are taken at once (of splines a launch), all trains together, with timers.
        step_us_p90: Their 90th percentile.
        step_us_p99: Their 99th percentile.
        step_us_max: Their maximum.
        measuring_overhead: Step with timers over step without, less one: median over neighbouring blocks.
    """

    real_time_factor: float
    real_time_factor_per_train: float
    steps_per_s: float
    us_per_train_step: float
    step_us_p50: float
    step_us_p90: float
    step_us_p99: float
    step_us_max: float
    measuring_overhead: float


@dataclass(frozen=True)
class Memory:
    """Memory of the process, in 10^6 bytes.

    Attributes:
        peak_mb: Peak until the end of the loop.
        model_mb: Arrays of the model.
        state_mb: Arrays of the state.
        chunk_mb: Buffers of a chunk of steps.
    """

    peak_mb: float
    model_mb: float
    state_mb: float
    chunk_mb: float


@dataclass(frozen=True)
class Rate:
    """Matrix products of a stage against the roofs.

    Attributes:
        stage: Name of the stage.
        products_per_step: Number of products.
        flops_per_step: Counted operations of all trains.
        bytes_per_step: Counted traffic.
        gflops: Achieved rate of operations.
        gb_per_s: Achieved rate of traffic.
        of_roof: Least time that the roofs allow over the measured time.
    """

    stage: str
    products_per_step: int
    flops_per_step: int
    bytes_per_step: int
    gflops: float
    gb_per_s: float
    of_roof: float


@dataclass(frozen=True)
class ProfileReport:
    """Result of a profile.

    Attributes:
        scenario: Name of the scenario.
        trains: Trains advanced together.
        time_step_s: Time step.
        passes: Force passes per step.
        dofs: Degrees of freedom of a train.
        warm_up_steps: Steps before the measurement.
        steps: Measured steps, with and without timers.
        versions: Versions of Python and packages.
        machine: The computer.
        wall: Wall times apart from the loop.
        loop: The loop as a whole.
        stages: Its parts.
        memory: Memory.
        roofs: Roofline of the machine.
        rates: Rates that the step's matrix products achieve.
    """

    scenario: str
    trains: int
    time_step_s: float
    passes: int
    dofs: int
    warm_up_steps: int
    steps: int
    versions: dict[str, str]
    machine: Machine
    wall: Wall
    loop: Loop
    stages: tuple[Stage, ...]
    memory: Memory
    roofs: Roofs
    rates: tuple[Rate, ...]

    def to_json(self) -> str:
        """JSON text with a format version."""
        return json.dumps({"format": FORMAT, "format_version": FORMAT_VERSION, **asdict(self)}, indent=2)


def read_json(path: Path) -> ProfileReport:
    """Read a report.

    Args:
        path: File that ``tiengine profile --json`` wrote.

    Raises:
        InputError: No such file, not JSON, not a profile, or of another format version.
    """
    name = f"profile = '{path}'"
    try:
        tables = json.loads(read_bytes(path, name, LARGEST_TOML))
    except InputError:
        raise
    except (ValueError, RecursionError) as error:
        raise InputError(f"{name}: must be a JSON file ({error})") from None
    if not isinstance(tables, dict) or tables.pop("format", None) != FORMAT:
        raise InputError(f"{name}: must be a file that 'tiengine profile --json' wrote")
    version = tables.pop("format_version", None)
    if version != FORMAT_VERSION:
        raise InputError(f"{name}: format version {version}; must be {FORMAT_VERSION}; profile again with this version")
    try:
        return TypeAdapter(ProfileReport).validate_python(tables)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(f"{name}: {place}: {first['msg']}") from None


@dataclass(frozen=True)
class Comparison:
    """Two reports side by side.

    Attributes:
        rows: Quantity, its value in the first and in the second report; None where one lacks the stage.
        differences: Circumstances in which the two measurements differ, as sentences.
    """

    rows: tuple[tuple[str, float | None, float | None], ...]
    differences: tuple[str, ...]


def compare(first: ProfileReport, second: ProfileReport) -> Comparison:
    """Set two reports side by side, stage by stage in the order of the first."""
    a, b = ({stage.name: stage.us_per_train_step for stage in report.stages} for report in (first, second))
    rows: list[tuple[str, float | None, float | None]] = [
        (f"{name} [us/train-step]", a.get(name), b.get(name)) for name in dict.fromkeys([*a, *b])
    ]
    for words, key in (
        ("whole loop [us/train-step]", "us_per_train_step"),
        ("steps at once, median [us]", "step_us_p50"),
        ("steps at once, 99 % [us]", "step_us_p99"),
        ("RTF", "real_time_factor"),
        ("RTF per train", "real_time_factor_per_train"),
    ):
        rows.append((words, getattr(first.loop, key), getattr(second.loop, key)))
    rows += [
        ("JIT [s]", first.wall.jit_s, second.wall.jit_s),
        ("set-up [s]", first.wall.setup_s, second.wall.setup_s),
        ("peak memory [MB]", first.memory.peak_mb, second.memory.peak_mb),
    ]
    return Comparison(tuple(rows), tuple(_differences(first, second)))


def _differences(first: ProfileReport, second: ProfileReport) -> list[str]:
    """Circumstances in which two measurements differ."""
    pairs: list[tuple[str, Any, Any]] = [
        (words, getattr(first, key), getattr(second, key))
        for words, key in (
            ("scenario", "scenario"),
            ("trains", "trains"),
            ("time step [s]", "time_step_s"),
            ("passes", "passes"),
            ("DOFs", "dofs"),
        )
    ]
    pairs += [("processor", first.machine.cpu, second.machine.cpu), ("BLAS", first.machine.blas, second.machine.blas)]
    packages = dict.fromkeys([*first.versions, *second.versions])
    pairs += [(name, first.versions.get(name), second.versions.get(name)) for name in packages]
    return [f"{words}: {a} and {b}" for words, a, b in pairs if a != b]
