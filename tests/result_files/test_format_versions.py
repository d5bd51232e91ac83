"""Files of format version 1, made by tiengine 0.1.0, open, export and resume as those of the current version.

``tests/data/results/version_1.h5.gz`` is a run of two trains over 2 m with two gauges, envelopes and deflections.
"""

from __future__ import annotations

import gzip
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

from tiengine import result as results
from tiengine.cli.commands import main
from tiengine.result_files.layout import GroupSpec
from tiengine.result_files.reader import FORMAT_VERSION, RUNNING
from tiengine.result_files.writer import Writer

DATA = Path(__file__).parents[1] / "data" / "results" / "version_1.h5.gz"
SAMPLES = 24  # 48 ms, one sample of the wheels every 2 ms
GROUPS = {"wheel", "body", "irregularity", "mortar", "seats", "slabs", "deflection", "gauges", "events"}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The file of version 1."""
    path = tmp_path / "run.h5"
    path.write_bytes(gzip.decompress(DATA.read_bytes()))
    return path


def test_it_opens(path: Path) -> None:
    """All groups of both trains; on a smooth stretch the wheels carry the weight of the train."""
    with results.open(path) as result:
        assert result.attributes["format_version"] == 1
        assert result.trains == 2
        for train in range(2):
            assert GROUPS | {"time"} == set(result[f"trains/{train:03d}"])
            for group in GROUPS - {"gauges", "events"}:
                assert len(result.group(group, train)) > 2
            assert set(result.gauges(train)) == {"rail-1", "seat"}
            wheel = result.wheel(train)
            assert len(wheel["time"]) == SAMPLES
            # the track is irregular, but 48 ms are too short to shift more than a tenth of the weight of the train
            weight = 9.81 * sum(vehicle.mass for vehicle in result.scenario.parts.vehicles)
            np.testing.assert_allclose(wheel["vertical_force"].sum(axis=(1, 2)), weight, rtol=0.1)


def test_every_reader_takes_it(path: Path, tmp_path: Path) -> None:
    """Commands and xarray, as for a file of the current version."""
    for command in (["info"], ["export", "-o", str(tmp_path / "a.csv")], ["export", "-o", str(tmp_path / "a.mat")]):
        done = CliRunner().invoke(main, [command[0], str(path), *command[1:]])
        assert done.exit_code == 0, done.output
    with results.open(path) as result:
        assert result.to_xarray("wheel", None).sizes["train"] == 2


def test_a_resumed_run_is_of_the_current_version(path: Path) -> None:
    """An unfinished file is converted when a run writes to it again, and keeps its samples."""
    with h5py.File(path, "r+") as file:
        file.attrs["status"] = RUNNING
        before = file["trains/001/wheel/vertical_force"][:]
    groups = {"wheel": GroupSpec.standard("wheel", ("vertical_force", "lateral_force"))}
    with Writer.resume(path, groups) as writer:
        writer.close({}).close()
    with results.open(path) as result:
        assert result.attributes["format_version"] == FORMAT_VERSION
        assert set(result["trains/001"]) == GROUPS
        np.testing.assert_array_equal(result["trains/001/wheel/vertical_force"][:], before)
        np.testing.assert_array_equal(result["trains/001/wheel/time"][:], result["trains/001/irregularity/time"][:])
