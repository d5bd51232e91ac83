"""Data sets: windows against the run, splits by seed, lazy loading in xarray, and the datasheet."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tiengine import result as results
from tiengine.parameters.errors import InputError
from tiengine.study.dataset import Windows, split_by_seed
from tiengine.study.study import Study, study

from .short import PLAN

CUT = {"length": 1.0, "step": 0.5, "samples": 50, "labels": ("largest_vertical_wheel_force_Q_kN",)}


@pytest.fixture(scope="module")
def trains(tmp_path_factory) -> Study:
    """Eight trains on four tracks."""
    plan = {**PLAN, "seeds": 4, "factors": PLAN["factors"][:1], "constraints": []}
    return study(plan, tmp_path_factory.mktemp("trains") / "s", workers=1)


def test_windows_are_those_of_the_run(trains, tmp_path):
    """Opened lazily in xarray; forces within a window are those of the run at the same chainages."""
    xarray, _ = pytest.importorskip("xarray"), pytest.importorskip("zarr")
    counts = trains.dataset(tmp_path / "d.zarr", **CUT)
    assert sum(counts.values()) == 8 * 4  # windows of 1 m every 0.5 m in 3 m, less the first chunk's start
    with xarray.open_zarr(tmp_path / "d.zarr", group="train", chunks=None) as data:
        assert dict(data.sizes) == {"window": counts["train"], "sample": 50, "wheelset": 4, "side": 2}
        assert not data["wheel_vertical_force"].variable._in_memory
        window = data.isel(window=3).load()
    number = int(window["train_number"])
    task = next(i for i, members in enumerate(trains.folder.design.tasks) if number in members)
    with results.open(trains.folder.part(task)) as part:
        wheel = part.wheel(trains.folder.design.tasks[task].index(number))
    for w, side in ((0, 0), (3, 1)):
        expected = np.interp(window["position"], wheel["position"], wheel["vertical_force"][:, w, side])
        np.testing.assert_allclose(window["wheel_vertical_force"][:, w, side], expected, rtol=1e-4)  # single precision
    assert float(window["speed"].mean()) == pytest.approx(float(window["factor_speed"]) / 3.6, rel=1e-3)


def test_no_seed_is_in_two_splits(trains, tmp_path):
    pytest.importorskip("pyarrow")
    trains.dataset(tmp_path / "d.parquet", **CUT)
    sheet = json.loads((tmp_path / "d.parquet" / "datasheet.json").read_text(encoding="utf-8"))
    seeds = [set(found) for found in sheet["seeds_per_split"].values()]
    assert sum(map(len, seeds)) == len(set.union(*seeds)) == 4
    assert sheet["windows_per_split"]["train"] > 0
    assert sheet["plan"]["scenario"] == "default"


def test_splits_of_many_seeds():
    """Shares of 1000 seeds; the same every time, others with another seed of the order."""
    found = split_by_seed(range(1000), Windows())
    assert [list(found.values()).count(name) for name in ("train", "validation", "test")] == [700, 150, 150]
    assert found == split_by_seed(range(1000), Windows())
    assert found != split_by_seed(range(1000), Windows(seed=2))


def test_parquet_has_a_row_a_window(trains, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    counts = trains.dataset(tmp_path / "d.parquet", **CUT)
    table = parquet.read_table(tmp_path / "d.parquet" / "train.parquet")
    assert table.num_rows == counts["train"]
    assert len(table["wheel_vertical_force_1_left"][0].as_py()) == 50


@pytest.mark.parametrize(
    ("cut", "words"),
    [
        ({"length": -1.0}, "length = -1: must be above 0"),
        ({"length": 100.0}, "no train is as long as a window of 100"),
        ({"channels": ("wheel/normal",)}, "channel 'wheel/normal': is not sampled over time"),
        ({"channels": ("seats/largest_vertical_force",)}, "is not sampled over time"),
        ({"labels": ("largest",)}, "no column 'largest'; did you mean"),
        ({"shares": (0.5, 0.1, 0.1)}, "must be three numbers"),
    ],
)
def test_bad_settings_are_refused(trains, tmp_path, cut, words):
    """In one line, and nothing is left behind."""
    cut = {"length": 1.0, **cut}
    pytest.importorskip("pyarrow")
    with pytest.raises(InputError, match=words):
        trains.dataset(tmp_path / "d.parquet", **cut)
    assert not list(tmp_path.iterdir())
