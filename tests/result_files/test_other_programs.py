"""Result files in other programs: xarray's datasets, groups and trees, the netCDF library, names in MATLAB."""

from __future__ import annotations

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from scipy.io import loadmat, savemat

from tiengine import result as results
from tiengine.result_files.channels import BODY, DEFLECTION, IRREGULARITY, MORTAR, SEATS, SLABS, WHEEL
from tiengine.result_files.events import Event
from tiengine.result_files.export import MAT_KEYWORDS, export
from tiengine.result_files.layout import Block, GroupSpec, TrainLabels
from tiengine.result_files.writer import Writer

LABELS = TrainLabels(
    ["coach"], ["car", "frame 1"], np.zeros(4, np.int64), np.array([10.0, 7.5, -7.5, -10.0]), 3, np.arange(9.0)
)
GROUPS = {
    "wheel": GroupSpec.standard("wheel", tuple(WHEEL)),
    "irregularity": GroupSpec.standard("irregularity", tuple(IRREGULARITY), "wheel"),
    "body": GroupSpec.standard("body", tuple(BODY)),
    "mortar": GroupSpec.standard("mortar", tuple(MORTAR), "body"),
    "seats": GroupSpec.standard("seats", tuple(SEATS)),
    "slabs": GroupSpec.standard("slabs", tuple(SLABS)),
    "deflection": GroupSpec.standard("deflection", tuple(DEFLECTION)),
    "gauges/rail": GroupSpec.gauge("motion", {"on": "rail", "chainage": 3.0, "side": "left"}),
    "gauges/end": GroupSpec.gauge("force", {"on": "fastening", "chainage": 3.1, "side": "left"}),
    "gauges/1-b": GroupSpec.gauge("force", {"on": "fastening", "chainage": 4.1, "side": "left"}),
}
ROWS = {"wheel": 40, "irregularity": 40, "body": 20, "mortar": 20, "seats": 30, "slabs": 5, "deflection": 4}
LENGTHS = {"wheelset": 4, "side": 2, "body": 2, "dof": 5, "slot": 3, "point": 9, "direction": 2}


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two trains with every kind of group; their times differ from group to group and from train to train."""
    path = tmp_path_factory.mktemp("others") / "run.h5"
    rng = np.random.default_rng(7)
    with Writer(path, 'name = "made"\n', {}, [LABELS, LABELS], GROUPS) as writer:
        for train in range(2):
            for group, spec in GROUPS.items():
                count = ROWS.get(group, 11) - train
                shape = (count, *(LENGTHS[name] for name in spec.dimensions))
                along = np.arange(count) * (1 if group in ("seats", "slabs") else 0.08 / count)
                writer.write(
                    train, {group: Block(along, 80.0 * along, {name: rng.normal(size=shape) for name in spec.channels})}
                )
            writer.add_events(train, [Event("wheel_lift", 0.01, 0.8, 1, "left", "left the rail", False)])
            writer.describe(train, {"seed": train, "status": "complete"})
        writer.close({"status": "complete"}).close()
    return path


def groups_of(file: h5py.File) -> list[str]:
    """Paths of all groups of a file, the root included."""
    found = ["/"]
    file.visititems(lambda name, node: found.append(f"/{name}") if isinstance(node, h5py.Group) else None)
    return found


def assert_same(dataset: xarray.Dataset, group: h5py.Group) -> None:
    """Every dataset of a group has its values, names of dimensions and unit in xarray."""
    stored = {name: node for name, node in group.items() if isinstance(node, h5py.Dataset)}
    assert set(stored) == set(dataset.variables)
    for name, node in stored.items():
        is_text = h5py.check_string_dtype(node.dtype)
        expected = node.asstr()[:] if is_text else node[:]
        assert np.array_equal(dataset[name].values, expected), (group.name, name)
        assert dataset[name].dims == tuple(scale[0].name.rpartition("/")[2] for scale in node.dims if len(scale)) or (
            node.is_scale and dataset[name].dims == (name,)
        )
        assert dataset[name].attrs.get("units", "1") == node.attrs.get("units", "1")


@pytest.fixture(params=["h5netcdf", "netcdf4"])
def engine(request: pytest.FixtureRequest) -> str:
    """Both libraries by which xarray reads such files."""
    if request.param == "netcdf4":
        pytest.importorskip("netCDF4")
    return request.param


def test_open_dataset(path: Path, engine: str) -> None:
    with h5py.File(path) as file:
        for name in groups_of(file):
            with xarray.open_dataset(path, group=name, engine=engine) as dataset:
                assert_same(dataset, file[name])


def test_open_groups(path: Path, engine: str) -> None:
    with h5py.File(path) as file:
        found = xarray.open_groups(path, engine=engine)
        assert set(found) == set(groups_of(file))
        for name, dataset in found.items():
            assert_same(dataset, file[name])
            dataset.close()


def test_open_datatree(path: Path, engine: str) -> None:
    """No group inherits a coordinate that is not its own."""
    with h5py.File(path) as file, xarray.open_datatree(path, engine=engine) as tree:
        assert set(tree.groups) == set(groups_of(file))
        for name in tree.groups:
            assert_same(tree[name].to_dataset(), file[name])
        force = tree["trains/001/wheel/vertical_force"].sel(wheelset=3, side="right")
        np.testing.assert_array_equal(force.values, file["trains/001/wheel/vertical_force"][:, 2, 1])


def test_datatree_without_an_engine(path: Path) -> None:
    """As users write it."""
    with xarray.open_datatree(path) as tree:
        assert tree["trains/000/body"].sizes["time"] == ROWS["body"]


def test_netcdf_library(path: Path) -> None:
    """Dimensions by name, masked nothing, strings as strings."""
    netcdf = pytest.importorskip("netCDF4")
    with h5py.File(path) as file, netcdf.Dataset(path) as data:
        for name in groups_of(file)[1:]:
            for variable in data[name].variables.values():
                stored = file[name][variable.name]
                values = variable[:]
                assert not np.ma.is_masked(values)
                expected = stored.asstr()[:] if h5py.check_string_dtype(stored.dtype) else stored[:]
                assert np.array_equal(values, expected), (name, variable.name)
        assert data["trains/000/wheel/vertical_force"].dimensions == ("time", "wheelset", "side")
        assert data["trains/000/irregularity/vertical"].dimensions == ("time", "wheelset", "side")


def is_matlab_name(name: str) -> bool:
    """Rule of MATLAB: a letter, then letters, digits and underscores, at most 63 characters, no reserved word."""
    return re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", name) is not None and name not in MAT_KEYWORDS


def test_names_in_the_file_are_names_in_matlab(path: Path) -> None:
    """Groups, channels, labels and attributes; only trains have numbers, and gauges the names that users give them."""
    with h5py.File(path) as file:
        names = set(file.attrs) | set(file)
        train = file["trains/000"]
        names |= set(train) | set(train.attrs)
        for group in GROUPS:
            names |= set(train[group]) | set(train[group].attrs)
        assert [name for name in sorted(names) if not is_matlab_name(name)] == []


def test_exported_names_are_names_in_matlab(path: Path, tmp_path: Path) -> None:
    """Gauges named by a reserved word or with a digit first."""
    with results.open(path) as result:
        export(result, tmp_path / "a.mat", channels=list({group.partition("/")[0] for group in GROUPS}))
    content = loadmat(tmp_path / "a.mat", simplify_cells=True)
    assert set(content["gauges"]) == {"rail", "xend", "x1_b"}

    def check(node: object) -> None:
        for name, child in node.items() if isinstance(node, dict) else ():
            assert is_matlab_name(name) or name in ("__header__", "__version__", "__globals__")
            check(child)

    check(content)
    savemat(tmp_path / "again.mat", {key: value for key, value in content.items() if key[0] != "_"})
