"""Data set for learning from the parts of a study: windows of equal length, channels, inputs and labels, split by seed.

A window is a stretch of a train's run, of distance or of time; every window has the same number of samples. Windows of
one seed, whose track is the same, are all in one split, so that no track that a model is tested with was trained with.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.result_files.reader import COMPLETE, Reader, open_reader
from tiengine.study.dataset_files import ParquetSink, Sink, ZarrSink
from tiengine.study.folder import Folder
from tiengine.study.table import Table, read_table

__all__ = ["SPLITS", "Windows", "make_dataset"]

SPLITS = ("train", "validation", "test")
DEFAULT_INPUTS = ("irregularity/vertical", "irregularity/lateral")
DEFAULT_CHANNELS = ("wheel/vertical_force", "wheel/lateral_force")
SUFFIXES = (".zarr", ".parquet")


@dataclass(frozen=True)
class Windows:
    """How runs are cut.

    Attributes:
        length: Length of a window [m], or its duration [s] if ``by_time``.
        step: From the start of one window to that of the next, likewise.
        samples: Samples of a window.
        channels: Channels to learn, as ``group/channel``.
        inputs: Channels that they follow from; the speed is always one.
        labels: Columns of the table that each window carries along, besides all factors.
        by_time: Whether windows are cut by time.
        shares: Shares of the seeds in training, validation and test.
        seed: Selects which seeds go where.
    """

    length: float = 10.0
    step: float = 5.0
    samples: int = 256
    channels: tuple[str, ...] = DEFAULT_CHANNELS
    inputs: tuple[str, ...] = DEFAULT_INPUTS
    labels: tuple[str, ...] = ()
    by_time: bool = False
    shares: tuple[float, float, float] = (0.7, 0.15, 0.15)
    seed: int = 1

    def check(self) -> None:
        """Refuse settings that give no windows.

        Raises:
            InputError: The first value that breaks a rule.
        """
        for name, value in (("length", self.length), ("step", self.step)):
            if not 0.0 < value < 1e6:
                raise InputError(f"{name} = {value:g}: must be above 0 and below 1e6")
        if not 2 <= self.samples <= 1_000_000:
            raise InputError(f"samples = {self.samples}: must be from 2 to 1000000")
        if min(self.shares) < 0.0 or abs(sum(self.shares) - 1.0) > 1e-9:
            raise InputError(f"shares = {self.shares}: must be three numbers >= 0 whose sum is 1")
        for channel in (*self.channels, *self.inputs):
            if channel.count("/") != 1:
                raise InputError(f"channel = {channel!r}: must be GROUP/CHANNEL, such as wheel/vertical_force")


def make_dataset(folder: Folder, path: Path, windows: Windows) -> dict[str, int]:
    """Cut the complete trains of a study into windows and write them with a datasheet.

    Args:
        folder: Folder of the study.
        path: Folder to create, ending in ``.zarr`` or ``.parquet``.
        windows: How runs are cut.

    Returns:
        Number of windows in each split.

    Raises:
        InputError: A setting breaks a rule, a channel is missing, runs are shorter than a window, a package is missing,
            or the path exists.
    """
    windows.check()
    if path.suffix not in SUFFIXES:
        raise InputError(f"output = '{path}': must end in {', '.join(SUFFIXES)}")
    if path.exists():
        raise InputError(f"output = '{path}': exists already; choose another name")
    table = read_table(folder)
    if missing := [name for name in windows.labels if name not in table.columns]:
        table[missing[0]]  # raises with the nearest name
    splits = split_by_seed(_seeds(folder, table), windows)
    counts = dict.fromkeys(SPLITS, 0)
    temporary = path.with_name(f".{path.name}.part")
    shutil.rmtree(temporary, ignore_errors=True)  # of a process that was killed
    try:
        sink: Sink = ZarrSink(temporary) if path.suffix == ".zarr" else ParquetSink(temporary)
        for member, arrays in _cut_all(folder, windows):
            split = splits[_seed_of(folder, member)]
            sink.add(split, arrays, _labels(table, member, windows))
            counts[split] += len(arrays["position"])
        if not sum(counts.values()):
            raise InputError(f"{folder.path}: no train is as long as a window of {windows.length:g}")
        sink.close()
        sheet = _datasheet(folder, windows, splits, counts)
        (temporary / "datasheet.json").write_text(json.dumps(sheet, indent=1), encoding="utf-8")
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"output = '{path}': cannot be written ({error.strerror or error})") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return counts


def split_by_seed(seeds: Sequence[int], windows: Windows) -> dict[int, str]:
    """Split of every seed: shares of the seeds in a random order that repeats.

    Args:
        seeds: Different seeds.
        windows: Shares, and the seed of the order.
    """
    mixed = np.random.default_rng(windows.seed).permutation(sorted(seeds))
    ends = np.rint(np.cumsum(windows.shares) * len(mixed)).astype(int)
    names = [SPLITS[int(np.searchsorted(ends, i, side="right"))] for i in range(len(mixed))]
    return {int(seed): name for seed, name in zip(mixed, names, strict=True)}


def _seed_of(folder: Folder, number: int) -> int:
    """Seed of the track of a member."""
    design = folder.design
    member = design.members[number]
    changed = design.points[member.point].changes.get("irregularity.seed")
    base = design.base.irregularity.seed if design.base is not None else 0
    return member.seed if member.seed is not None else int(base if changed is None else changed)


def _seeds(folder: Folder, table: Table) -> list[int]:
    return sorted({_seed_of(folder, int(row)) for row in table["train"]})


def _cut_all(folder: Folder, windows: Windows) -> Iterator[tuple[int, dict[str, NDArray[np.float32]]]]:
    """Number and windows of every complete train, part after part."""
    for task in sorted(folder.complete()):
        if not folder.part(task).exists():
            continue
        with open_reader(folder.part(task)) as part:
            for place, member in enumerate(folder.design.tasks[task]):
                if part.status(place) == COMPLETE and (found := _cut(part, place, windows)):
                    yield member, found


def _cut(part: Reader, train: int, windows: Windows) -> dict[str, NDArray[np.float32]]:
    """Windows of one train: channels (windows, samples, wheelset, side), position and speed (windows, samples).

    Channels are interpolated linearly between their samples. Empty if the run is shorter than a window.
    """
    base = part[f"trains/{train:03d}/wheel"]
    time, position = base["time"][:], base["position"][:]
    along = time if windows.by_time else position
    starts = np.arange(along[0], along[-1] - windows.length + 1e-9, windows.step)
    if not len(starts):
        return {}
    at = starts[:, None] + np.linspace(0.0, windows.length, windows.samples, endpoint=False)
    when = at if windows.by_time else np.interp(at, position, time)
    found = {"position": np.interp(when, time, position), "speed": np.interp(when, time, np.gradient(position, time))}
    for channel in (*windows.inputs, *windows.channels):
        group, _, name = channel.partition("/")
        source = part[f"trains/{train:03d}/{group}"]
        if "time" not in source or name not in source:
            raise InputError(f"{part.name}: channel {channel!r}: is not sampled over time in the parts of the study")
        found[channel.replace("/", "_")] = _at(source["time"][:], source[name][:], when)
    return {name: values.astype(np.float32) for name, values in found.items()}


def _at(time: Reals, values: Reals, when: Reals) -> Reals:
    """Linear interpolation of values (samples, ...) at instants (windows, points); shape (windows, points, ...)."""
    right = np.clip(np.searchsorted(time, when), 1, len(time) - 1)
    weight = np.clip((when - time[right - 1]) / (time[right] - time[right - 1]), 0.0, 1.0)
    weight = weight.reshape(*weight.shape, *[1] * (values.ndim - 1))
    mixed: Reals = (1.0 - weight) * values[right - 1] + weight * values[right]
    return mixed


def _labels(table: Table, member: int, windows: Windows) -> dict[str, Any]:
    """Factors and chosen columns of a train."""
    row = int(np.flatnonzero(table["train"] == member)[0])
    factors = {f"factor_{name}": table[name][row] for name in table.factors}
    return {"train_number": member, **factors, **{name: table[name][row] for name in windows.labels}}


def _datasheet(
    folder: Folder, windows: Windows, splits: Mapping[int, str], counts: Mapping[str, int]
) -> dict[str, Any]:
    """Origin, contents and limits of the data set."""
    plan = folder.design.plan
    return {
        "name": plan.name,
        "made_by": f"tiengine {metadata.version('tiengine')}",
        "origin": "simulated by tiengine from the plan below; no measured forces",
        "source_of_the_plan": plan.source,
        "plan": plan.model_dump(mode="json", exclude_none=True),
        "study": folder.design.digest,
        "windows": {
            "length": windows.length,
            "unit": "s" if windows.by_time else "m",
            "step": windows.step,
            "samples": windows.samples,
            "interpolation": "linear between the samples of the run",
        },
        "inputs": ["speed", *windows.inputs],
        "channels": list(windows.channels),
        "labels": [*folder.design.factors, *windows.labels],
        "units": "SI: m, s, N, m/s",
        "windows_per_split": dict(counts),
        "seeds_per_split": {name: sorted(seed for seed, of in splits.items() if of == name) for name in SPLITS},
        "splits": "by the seed of the track: no seed is in two splits",
        "limits": "the model's validity limits apply, see the documentation of tiengine, 'what is not modelled'",
    }
