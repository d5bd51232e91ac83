"""Result files: the layout on which scripts of users rely, and the state after a failed run."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from tiengine import result as results
from tiengine.parameters.errors import InputError
from tiengine.result_files.channels import BODY, DOFS, IRREGULARITY, WHEEL
from tiengine.result_files.layout import GroupSpec, TrainLabels
from tiengine.result_files.output_file import check_output
from tiengine.result_files.writer import Writer
from tiengine.scenario.scenario import load_scenario, to_toml

STEP = 1e-4
SPEED = 97.0
WHEELSETS, BODIES = 4, 7
LABELS = TrainLabels(
    vehicles=["coach"],
    bodies=["car", "frame 1", "frame 2", *(f"wheelset {i}" for i in range(1, 5))],
    wheelset_vehicle=np.zeros(WHEELSETS, np.int64),
    wheelset_offset=np.array([10.0, 7.5, -7.5, -10.0]),
)
GROUPS = {
    "wheel": GroupSpec.standard("wheel", tuple(WHEEL)),
    "body": GroupSpec.standard("body", tuple(BODY)),
    "irregularity": GroupSpec.standard("irregularity", tuple(IRREGULARITY), "wheel"),
}
SHAPES = {"wheel": (WHEELSETS, 2), "body": (BODIES, 5), "irregularity": (WHEELSETS, 2)}


def samples(group: str, train: int, first: int, count: int) -> dict[str, np.ndarray]:
    """Values that differ between channels, trains, samples and labels."""
    rng = np.random.default_rng([len(group), train])
    size = int(np.prod(SHAPES[group]))
    return {
        name: rng.standard_normal((10_000, size))[first : first + count].reshape(count, *SHAPES[group])
        for name in GROUPS[group].channels
    }


def write(path: Path | None, *, trains: int = 1, chunks: tuple[int, ...] = (700, 1, 1300), **options) -> results.Result:
    """A run of some chunks; the bodies are sampled at every tenth step."""
    toml = options.pop("toml", 'name = "fake"\n')
    with Writer(path, toml, {"seed": 3}, [LABELS] * trains, GROUPS, **options) as writer:
        first = 0
        for count in chunks:
            time = (first + np.arange(count)) * STEP
            rare = np.flatnonzero((first + np.arange(count)) % 10 == 0)
            for train in range(trains):
                for group in ("wheel", "irregularity"):
                    writer.append(train, group, time, SPEED * time, samples(group, train, first, count))
                body = {k: v[rare] for k, v in samples("body", train, first, count).items()}
                writer.append(train, "body", time[rare], SPEED * time[rare], body)
            first += count
        return results.Result.of(writer.close({"dofs": 943, "time_step": STEP}))


def test_layout_is_the_interface(tmp_path: Path):
    """Every name of the interface is there, with units, meaning and shape."""
    path = tmp_path / "run.h5"
    write(path).close()
    with h5py.File(path) as file:
        train = file["trains/000"]
        assert list(train.attrs["vehicles"]) == ["coach"]
        for name in (
            *("normal_force", "vertical_force", "lateral_force", "longitudinal_creepage", "lateral_creepage"),
            *("spin_creepage", "penetration", "contact_position_wheel", "contact_position_rail"),
            *("rolling_radius", "rail_deflection"),
        ):
            assert train[f"wheel/{name}"].shape == (2001, WHEELSETS, 2)
        for name in ("displacement", "velocity", "acceleration"):
            assert train[f"body/{name}"].shape == (201, BODIES, 5)
        for name in ("vertical", "lateral"):
            assert train[f"irregularity/{name}"].shape == (2001, WHEELSETS, 2)

        def is_described(name: str, node: h5py.Group | h5py.Dataset) -> None:
            if isinstance(node, h5py.Dataset):
                assert node.attrs["units"], name
                assert node.attrs["long_name"], name
                assert node.chunks is None or node.chunks[0] == (64 if "/events/" in name else 1000), name

        file.visititems(is_described)


def test_times_are_linked_where_rates_agree(tmp_path: Path):
    """The train's and the irregularity's time are the wheel group's; the bodies have their own."""
    path = tmp_path / "run.h5"
    write(path).close()
    with h5py.File(path) as file:
        train = file["trains/000"]
        assert train["wheel/time"] == train["irregularity/time"]
        assert train["irregularity/position"] == train["wheel/position"]
        assert train["body/time"] != train["wheel/time"]
        np.testing.assert_array_equal(train["body/time"], np.arange(201) * 10 * STEP)


@pytest.mark.parametrize(("precision", "dtype"), [("single", np.float32), ("double", np.float64)])
def test_values_come_back(tmp_path: Path, precision, dtype):
    """Channels in the chosen precision, time and position always double, whatever the chunks."""
    result = write(tmp_path / "run.h5", trains=2, precision=precision)
    with result:
        assert result.trains == 2
        for train in range(2):
            for group, read in (("wheel", result.wheel), ("irregularity", result.irregularity)):
                got = read(train)
                for name, expected in samples(group, train, 0, 2001).items():
                    assert got[name].dtype == dtype
                    np.testing.assert_array_equal(got[name], expected.astype(dtype))
                assert got["time"].dtype == got["position"].dtype == np.float64
                np.testing.assert_array_equal(got["time"], np.arange(2001) * STEP)
                np.testing.assert_array_equal(got["position"], SPEED * (np.arange(2001) * STEP))
        body = result.body(1)
        expected = samples("body", 1, 0, 2001)["velocity"][::10].astype(dtype)
        np.testing.assert_array_equal(body["velocity"], expected)


@pytest.mark.parametrize("group", list(GROUPS))
def test_opens_with_xarray(tmp_path: Path, group):
    """Named coordinates, as the interface promises."""
    path = tmp_path / "run.h5"
    write(path).close()
    with xarray.open_dataset(path, group=f"trains/000/{group}", engine="h5netcdf") as data:
        if group == "body":
            expected = samples("body", 0, 0, 2001)["displacement"][::10].astype(np.float32)
            assert data["displacement"].dims == ("time", "body", "dof")
            assert list(data["dof"].values) == list(DOFS)
            got = data["displacement"].sel(body="frame 2", dof="roll").values
            np.testing.assert_array_equal(got, expected[:, 2, 2])
            return
        name = next(iter(GROUPS[group].channels))
        expected = samples(group, 0, 0, 2001)[name].astype(np.float32)
        assert data[name].dims == ("time", "wheelset", "side")
        assert set(data[name].coords) == {
            *("time", "position", "wheelset", "side", "wheelset_vehicle", "wheelset_offset")
        }
        got = data[name].sel(wheelset=3, side="right").values
        np.testing.assert_array_equal(got, expected[:, 2, 1])
        assert data[name].attrs["units"] == GROUPS[group].channels[name].units
        np.testing.assert_array_equal(data["wheelset_offset"], LABELS.wheelset_offset)


def test_attributes_say_what_was_run(tmp_path: Path):
    """Format, versions, what the run adds at both ends, and the scenario itself, which loads back."""
    scenario = load_scenario("paper")
    with write(tmp_path / "run.h5", toml=to_toml(scenario)) as result:
        a = result.attributes
        assert (a["format"], a["format_version"], a["seed"], a["dofs"], a["time_step"]) == (
            "tiengine",
            2,
            3,
            943,
            STEP,
        )
        assert a["tiengine_version"] == metadata.version("tiengine")
        assert a["taichi_version"] == metadata.version("taichi")
        assert result.scenario == scenario


def test_result_reads_lazily_and_names_what_is_missing(tmp_path: Path):
    """A path gives a dataset; a wrong one the nearest."""
    write(tmp_path / "run.h5").close()
    with results.open(tmp_path / "run.h5") as result:
        dataset = result["trains/000/wheel/normal_force"]
        assert isinstance(dataset, h5py.Dataset)
        assert dataset[5:7, 0, 1].shape == (2,)
        with pytest.raises(InputError, match="did you mean 'trains/000/wheel/normal_force'"):
            result["trains/000/wheel/normal_forces"]
        with pytest.raises(InputError, match="no 'trains/001/wheel'"):
            result.wheel(1)
        assert list(result.body()["body"][:2]) == ["car", "frame 1"]


def test_result_in_memory(tmp_path: Path):
    """Without a path nothing touches the disk."""
    with write(None) as result:
        assert result.wheel()["time"].shape == (2001,)
    assert list(tmp_path.iterdir()) == []


def test_failed_run_leaves_nothing(tmp_path: Path):
    """An exception removes the half file and leaves an older result as it was."""
    path = tmp_path / "run.h5"
    write(path, chunks=(10,)).close()
    before = path.read_bytes()

    def fail() -> None:
        with Writer(path, "", {}, [LABELS], GROUPS, force=True) as writer:
            time = np.arange(10) * STEP
            writer.append(0, "wheel", time, time, samples("wheel", 0, 0, 10))
            assert {".run.h5.lock", "run.h5"} < {each.name for each in tmp_path.iterdir()}
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == before


def test_run_that_is_not_closed_leaves_nothing(tmp_path: Path):
    """The file gets its name only when it is complete."""
    with Writer(tmp_path / "run.h5", "", {}, [LABELS], GROUPS):
        pass
    assert list(tmp_path.iterdir()) == []


def test_failure_at_the_last_moment_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The file cannot be moved to its place."""

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(InputError, match=r"run.h5': cannot be written \(.*Permission denied"):
        write(tmp_path / "run.h5", chunks=(10,))
    assert list(tmp_path.iterdir()) == []


def test_existing_file_needs_force(tmp_path: Path):
    """An existing result is not overwritten by accident."""
    path = tmp_path / "run.h5"
    write(path, chunks=(10,)).close()
    with pytest.raises(InputError, match=r"run.h5': exists already; choose another name or --force"):
        write(path, chunks=(20,))
    with write(path, chunks=(20,), force=True) as result:
        assert result.wheel()["time"].shape == (20,)


def test_unwritable_paths(tmp_path: Path):
    """A folder, a missing folder, a folder that takes no files."""
    (tmp_path / "file").write_text("")
    for path, rule in (
        (tmp_path, "must be a file, not a folder"),
        (tmp_path / "none" / "run.h5", "there is no folder"),
        (tmp_path / "file" / "run.h5", "there is no folder"),
        (Path("/proc/run.h5"), "cannot be written|there is no folder"),  # as root on Linux | elsewhere
    ):
        with pytest.raises(InputError, match=rule) as caught:
            write(path)
        assert str(caught.value).startswith(f"output = '{path}': ")
        assert "\n" not in str(caught.value)
    check_output(tmp_path / "run.h5")


def test_wrong_channels_are_refused():
    """Names and shapes of channels are checked, so that an error in the engine does not reach the file."""
    time = np.arange(10) * STEP
    good = samples("wheel", 0, 0, 10)
    with Writer(None, "", {}, [LABELS], GROUPS) as writer:
        with pytest.raises(ValueError, match="missing or unknown: normal_force"):
            writer.append(0, "wheel", time, time, {k: v for k, v in good.items() if k != "normal_force"})
        with pytest.raises(ValueError, match=r"wheel/penetration: shape \(10, 1, 2\), expected \(10, 4, 2\)"):
            writer.append(0, "wheel", time, time, {**good, "penetration": good["penetration"][:, :1]})


def test_not_a_result(tmp_path: Path):
    """No file, a text, another program's HDF5, another version of the format."""
    with pytest.raises(InputError, match="no such file"):
        results.open(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(InputError, match="not an HDF5 file, or damaged"):
        results.open(tmp_path / "text.h5")
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    with pytest.raises(InputError, match="its attribute format is not 'tiengine'"):
        results.open(tmp_path / "other.h5")
    with h5py.File(tmp_path / "other.h5", "r+") as file:
        file.attrs.update({"format": "tiengine", "format_version": 3})
    with pytest.raises(InputError, match="format_version = 3: this program reads 1 and 2"):
        results.open(tmp_path / "other.h5")


def test_file_size_is_that_of_the_numbers(tmp_path: Path):
    """Chunks are allocated whole; the structure of the file takes less than 0.2 MB."""
    sizes = {}
    for count in (1000, 5000):
        path = tmp_path / f"{count}.h5"
        write(path, chunks=(500,) * (count // 500)).close()
        sizes[count] = path.stat().st_size
    wheel = (len(WHEEL) + len(IRREGULARITY)) * WHEELSETS * 2 * 4 + 16
    body = len(BODY) * BODIES * 5 * 4 + 16
    assert sizes[1000] < 1000 * (wheel + body) + 2e5
    # in steps of whole chunks; bodies (one sample in ten) stay within their first chunk
    assert sizes[5000] - sizes[1000] == pytest.approx(4000 * wheel, rel=0.01)  # the index of the chunks
