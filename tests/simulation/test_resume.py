"""Stopping and going on: the same bits as without a break, whoever computes them."""

from __future__ import annotations

import io
import json
from itertools import count
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from tiengine import result as results
from tiengine.parameters.errors import InputError, RunStoppedError
from tiengine.result_files.checkpoint import Checkpoint, checkpoint_path, checkpoint_paths, sealed
from tiengine.scenario.scenario import Scenario, load_scenario
from tiengine.simulation import simulate

SHORT = {
    "train.distance": 45.0,  # three chunks of 1000 steps at 300 km/h
    "train.speed_kmh": [[0.0, 300.0], [60.0, 303.0]],  # matrices are made anew on the way
    "numerics.truncation": "none",
    "numerics.time_step": 2e-4,
    "output.precision": "double",
    "track.failed_fastenings": [{"seats": [50, 52]}],
    "gauges": [{"name": "mid", "on": "rail", "side": "left", "chainage": 40.0}],
}


def scenario(**changes: Any) -> Scenario:
    """One train over three chunks; two underscores stand for a dot."""
    return load_scenario("default", SHORT | {key.replace("__", "."): value for key, value in changes.items()})


def contents(path: Path) -> dict[str, np.ndarray]:
    """Every dataset of a file."""
    found: dict[str, np.ndarray] = {}

    def visit(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            found[name] = node[()]

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def assert_same(a: Path, b: Path) -> None:
    """The same datasets with the same bits."""
    mine, theirs = contents(a), contents(b)
    assert mine.keys() == theirs.keys()
    for name, values in mine.items():
        assert values.shape == theirs[name].shape, name
        if values.dtype == object:
            assert (values == theirs[name]).all(), name
        else:
            assert values.tobytes() == theirs[name].tobytes(), name


def stopped_after(chunks: int):
    """Asks to stop after so many questions, which come once a chunk."""
    calls = count(1)
    return lambda: next(calls) >= chunks


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run without a break."""
    path = tmp_path_factory.mktemp("whole") / "run.h5"
    simulate.run(scenario(), path).close()
    return path


@pytest.mark.parametrize("chunks", [1, 2])
def test_a_resumed_run_has_the_same_bits(whole: Path, tmp_path: Path, chunks: int):
    """Stopped after one chunk or two, while the speed changes: envelopes, gauges, snapshots, everything."""
    path = tmp_path / "run.h5"
    with pytest.raises(RunStoppedError, match=r"stopped after 0\.\d+ of 0\.\d+ s"):
        simulate.run(scenario(), path, stop=stopped_after(chunks))
    assert checkpoint_paths(path) == [checkpoint_path(path, 0)]
    with results.open(path) as result:
        assert not result.finished
        assert result.group("wheel")["time"].shape == (1000 * chunks,)
    with simulate.resume(path) as result:
        assert result.status() == "complete"
    assert_same(whole, path)
    assert list(tmp_path.iterdir()) == [path]


def test_a_run_without_checkpoint_begins_anew(whole: Path, tmp_path: Path):
    """Killed before the first one: what is in the file is written over by the same bits."""
    path = tmp_path / "run.h5"
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(), path, stop=stopped_after(1))
    checkpoint_path(path, 0).unlink()
    simulate.resume(path).close()
    assert_same(whole, path)


def test_checkpoints_are_written_as_often_as_asked(tmp_path: Path):
    """After every chunk here; the second one replaces the first."""
    seen = []

    def look(done: float, whole: float) -> None:
        seen.extend(Checkpoint.read(path).facts["done"] for path in checkpoint_paths(tmp_path / "run.h5"))

    simulate.run(scenario(), tmp_path / "run.h5", progress=look, checkpoint=1e-9).close()
    assert seen == [
        1000,
        2000,
        2000,
    ]  # called before each chunk is saved, and with the remainder of the envelopes at the end
    assert checkpoint_paths(tmp_path / "run.h5") == []


def test_an_ensemble_goes_on_with_other_workers(tmp_path: Path):
    """Two tasks, stopped in one process, resumed in two."""
    trains = {"ensemble__size": 2, "ensemble__vary": {"track.friction": [0.3, 0.2]}, "train__distance": 30.0}
    simulate.run(scenario(**trains), tmp_path / "whole.h5", workers=1).close()
    path = tmp_path / "run.h5"
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(**trains), path, workers=1, stop=stopped_after(1))
    with simulate.resume(path, workers=2) as result:
        assert not result.failures
        assert result.attributes["simulated_time"] == pytest.approx(2 * result.facts(0)["simulated_time"], rel=1e-12)
    assert_same(tmp_path / "whole.h5", path)


def test_only_an_unfinished_result_is_resumed(whole: Path, tmp_path: Path):
    with pytest.raises(InputError, match="the run is complete; there is nothing to resume"):
        simulate.resume(whole)
    with pytest.raises(InputError, match="no such file"):
        simulate.resume(tmp_path / "none.h5")


def test_an_unfinished_result_is_not_replaced_by_accident(tmp_path: Path):
    path = tmp_path / "run.h5"
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(), path, stop=stopped_after(1))
    with pytest.raises(InputError, match="it is an unfinished run: resume it with `tiengine resume"):
        simulate.run(scenario(), path)


def test_a_checkpoint_of_something_else_is_refused(tmp_path: Path):
    """Damaged, of another version, of another model: one sentence each, and the file stays."""
    path = tmp_path / "run.h5"
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(), path, stop=stopped_after(1))
    kept, good = contents(path), Checkpoint.read(checkpoint_path(path, 0))
    for damage, rule in (
        (lambda: checkpoint_path(path, 0).write_bytes(b"PK nonsense"), "not a checkpoint, or damaged"),
        (
            lambda: write_facts(path, {**good.facts, "version": 99}, good),
            "checkpoint version = 99: this program reads 1",
        ),
        (
            lambda: Checkpoint(0, good.facts, {**good.arrays, "state.force": np.zeros((9, 9))}).write(path),
            "does not fit the scenario",
        ),
    ):
        damage()
        with pytest.raises(InputError, match=rule):
            simulate.resume(path)
        assert contents(path).keys() == kept.keys()


def write_facts(result: Path, facts: dict[str, Any], good: Checkpoint) -> None:
    """A checkpoint with other facts."""
    text = np.frombuffer(json.dumps(facts).encode(), np.uint8)
    archived = io.BytesIO()
    np.savez(archived, facts=text, **good.arrays)
    checkpoint_path(result, 0).write_bytes(sealed(archived.getvalue()))


def test_a_checkpoint_keeps_every_bit(tmp_path: Path):
    """Not-a-numbers and infinities too; facts are plain values."""
    odd = np.array([0.1, -0.0, np.nan, np.inf, 5e-324])
    Checkpoint(3, {"position": 0.1 + 0.2, "alive": [0, 2]}, {"a": odd}).write(tmp_path / "run.h5")
    back = Checkpoint.read(checkpoint_path(tmp_path / "run.h5", 3))
    assert back.arrays["a"].tobytes() == odd.tobytes()
    assert (back.task, back.facts["position"], back.facts["alive"]) == (3, 0.1 + 0.2, [0, 2])
    assert back.foreign == []
