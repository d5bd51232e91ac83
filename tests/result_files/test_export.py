"""Exported files: reading them back gives the values of the result; impossible exports are refused."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from pyarrow import parquet
from scipy.io import loadmat

from tiengine import result as results
from tiengine.cli.commands import main
from tiengine.parameters.errors import InputError
from tiengine.result_files import export as module
from tiengine.result_files.channels import BODY, GAUGE_MOTION, IRREGULARITY, SEATS, WHEEL, Channel
from tiengine.result_files.export import export
from tiengine.result_files.layout import Block, GroupSpec, TrainLabels
from tiengine.result_files.writer import Writer

LABELS = TrainLabels(["coach"], ["car", "frame 1"], np.zeros(4, np.int64), np.array([10.0, 7.5, -7.5, -10.0]))
SHAPES = {
    "wheel": (4, 2),
    "irregularity": (4, 2),
    "body": (2, 5),
    "seats": (2,),
    "gauges/a-b": (2,),
    "gauges/a_b": (2,),
}
GROUPS = {
    "wheel": GroupSpec.standard("wheel", tuple(WHEEL)),
    "irregularity": GroupSpec.standard("irregularity", tuple(IRREGULARITY), "wheel"),
    "body": GroupSpec.standard("body", tuple(BODY)),
    "seats": GroupSpec.standard("seats", tuple(SEATS)),
    "gauges/a-b": GroupSpec(("direction",), GAUGE_MOTION),
    "gauges/a_b": GroupSpec(("direction",), GAUGE_MOTION),
}
ROWS = {"body": 30, "seats": 50}  # others: one a step
STEPS = 300


def block(group: str, train: int) -> Block:
    """Values that differ between all channels and labels."""
    rows = ROWS.get(group, STEPS)
    rng = np.random.default_rng([sum(map(ord, group)), train])
    along = np.arange(rows) if group == "seats" else np.arange(1, rows + 1) * 2e-4 * STEPS / rows
    values = {
        name: rng.standard_normal((rows, *SHAPES[group])) * 10.0**i for i, name in enumerate(GROUPS[group].channels)
    }
    return Block(along, 80.0 * along, values)


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    """Two trains with every kind of group."""
    path = tmp_path_factory.mktemp("export") / "run.h5"
    with Writer(path, 'name = "fake"\n', {}, [LABELS, LABELS], GROUPS) as writer:
        for train in range(2):
            writer.write(train, {group: block(group, train) for group in GROUPS})
            writer.describe(train, {"seed": 5 + train, "status": "complete"})
        writer.close({"status": "complete"}).close()
    return path


@pytest.fixture
def result(path):
    """The result, open."""
    with results.open(path) as result:
        yield result


def read_csv(path: Path) -> dict[str, list[str]]:
    """Columns by heading."""
    with path.open(encoding="utf-8", newline="") as file:
        heads, *rows = csv.reader(file)
    return dict(zip(heads, zip(*rows, strict=True), strict=True))


def test_csv_reads_back_the_same_numbers(result, tmp_path):
    """Single precision channels and double precision times, bit for bit."""
    words = export(result, tmp_path / "out.csv", train=1)
    columns = read_csv(tmp_path / "out.csv")
    assert words == f"{STEPS} rows of {2 + 8 * len(WHEEL)} columns"
    assert list(columns)[:2] == ["time [s]", "position [m]"]
    assert len(columns) == 2 + 8 * len(WHEEL)
    group = result["trains/001/wheel"]
    assert np.array_equal(np.array(columns["time [s]"], np.float64), group["time"][:])
    for name in WHEEL:
        for wheelset in range(4):
            for side, word in enumerate(("left", "right")):
                unit = WHEEL[name].units
                head = f"wheel.{name}.{wheelset + 1}.{word}" + (f" [{unit}]" if unit != "1" else "")
                assert np.array_equal(np.array(columns[head], np.float32), group[name][:, wheelset, side])


def test_pieces_do_not_matter(result, tmp_path, monkeypatch):
    """A file written row by row is the same file."""
    export(result, tmp_path / "whole.csv", channels=["body"])
    monkeypatch.setattr(module, "CSV_VALUES", 1)
    export(result, tmp_path / "rows.csv", channels=["body"])
    assert (tmp_path / "rows.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()


@pytest.mark.parametrize("values", [1, 500, 10**9])
def test_a_piece_holds_no_more_than_asked_for(result, values):
    """So memory does not grow with the run; one row is the least."""
    table = module.channel_table(result)
    pieces = [[len(column) for column in piece] for piece in table.pieces(values)]
    assert all(len(set(rows)) == 1 and len(rows) == len(table.columns) for rows in pieces)
    assert sum(rows[0] for rows in pieces) == STEPS
    assert max(sum(rows) for rows in pieces) <= max(values, len(table.columns))


def test_parquet_has_the_same_columns_and_says_what_they_are(result, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PARQUET_VALUES", 100)  # several row groups
    export(result, tmp_path / "out.parquet", channels=["body/acceleration", "body/displacement"])
    file = parquet.ParquetFile(tmp_path / "out.parquet")
    assert file.num_row_groups > 1
    table = file.read()
    assert table.schema.metadata[b"scenario"] == b'name = "fake"\n'
    assert table.column_names[:3] == ["time [s]", "position [m]", "body.acceleration.car.y [m/s^2]"]
    assert "body.acceleration.frame_1.roll [rad/s^2]" in table.column_names
    field = table.schema.field("body.displacement.frame_1.z [m]")
    assert field.metadata == {b"unit": b"m", b"long_name": BODY["displacement"].long_name.encode()}
    values = table.column("body.displacement.frame_1.z [m]").to_numpy()
    assert values.dtype == np.float32
    assert np.array_equal(values, result["trains/000/body/displacement"][:, 1, 1])


def test_seats_and_wheels_with_irregularity(result, tmp_path):
    """Rows need not be times; groups that are sampled together share a table."""
    export(result, tmp_path / "seats.csv", channels=["seats"])
    assert list(read_csv(tmp_path / "seats.csv"))[:3] == ["seat", "chainage [m]", "seats.factor.left"]
    export(result, tmp_path / "both.csv", channels=["irregularity/vertical", "wheel/vertical_force"])
    heads = list(read_csv(tmp_path / "both.csv"))
    assert heads[2] == "irregularity.vertical.1.left [m]"
    assert heads[-1] == "wheel.vertical_force.4.right [N]"


def test_matlab_has_a_structure_for_each_group(result, tmp_path):
    """Names that MATLAB accepts: two gauges that would have one name keep two."""
    export(result, tmp_path / "out.mat", channels=["wheel", "body", "gauges", "seats"], train=1)
    content = loadmat(tmp_path / "out.mat", simplify_cells=True)
    assert np.array_equal(content["wheel"]["vertical_force"], result["trains/001/wheel/vertical_force"][:])
    assert content["wheel"]["units"]["vertical_force"] == "N"
    assert list(content["wheel"]["side"]) == ["left", "right"]
    assert list(content["body"]["body"]) == ["car", "frame 1"]
    assert content["facts"]["seed"] == 6
    assert content["facts"]["scenario"] == 'name = "fake"\n'
    assert set(content["gauges"]) == {"a_b", "a_b_2"}
    for name, group in (("a_b", "a-b"), ("a_b_2", "a_b")):
        assert np.array_equal(
            content["gauges"][name]["velocity"], result[f"trains/001/gauges/{group}/velocity"][:]
        )  # fmt: skip


def test_matlab_refuses_what_its_format_cannot_hold(result, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "MAT_BYTES", 1000)
    with pytest.raises(InputError, match="less than 2 GB; choose fewer channels"):
        export(result, tmp_path / "out.mat")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("output", "options", "said"),
    [
        ("out.txt", {}, "must end in .csv, .parquet, .mat"),
        ("no/out.csv", {}, "there is no folder"),
        ("out.csv", {"train": 2}, "trains/002"),
        ("out.csv", {"channels": ["wheel/vertcal_force"]}, "did you mean 'wheel/vertical_force'"),
        ("out.csv", {"channels": ["slabs"]}, "set output.envelopes = true"),
        ("out.csv", {"channels": ["wheel", "body"]}, "different rows (300 of time, 30 of time)"),
        ("out.csv", {"channels": ["gauges"]}, "different rows"),
    ],
)
def test_what_cannot_be_is_refused(result, tmp_path, output, options, said):
    with pytest.raises(InputError) as refused:
        export(result, tmp_path / output, **options)
    assert said in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_nothing_is_replaced_unasked(path, tmp_path):
    """With --force a file is replaced atomically."""
    output = tmp_path / "out.csv"
    output.write_text("mine", encoding="utf-8")
    arguments = ["export", str(path), "-o", str(output), "--channel", "wheel/vertical_force"]
    refused = CliRunner().invoke(main, arguments)
    assert (refused.exit_code, output.read_text(encoding="utf-8")) == (2, "mine")
    assert "exists already" in refused.stderr
    done = CliRunner().invoke(main, [*arguments, "--force"])
    assert (done.exit_code, done.stdout) == (0, f"{output}: {STEPS} rows of 10 columns\n")
    assert output.read_text(encoding="utf-8").startswith("time [s],position [m],wheel.vertical_force.1.left [N],")
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.csv"]


def test_a_failed_export_leaves_the_old_file(result, tmp_path, monkeypatch):
    output = tmp_path / "out.csv"
    output.write_text("mine", encoding="utf-8")

    def break_off(table, values):
        yield next(iter(original(table, values)))
        raise OSError(28, "No space left on device")

    original = module.ChannelTable.pieces
    monkeypatch.setattr(module.ChannelTable, "pieces", break_off)
    with pytest.raises(InputError, match="cannot be written"):
        export(result, output, force=True)
    assert output.read_text(encoding="utf-8") == "mine"
    assert [entry.name for entry in tmp_path.iterdir()] == ["out.csv"]


def test_parquet_without_its_package_says_what_to_install(result, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"pip install 'tiengine\[parquet\]'"):
        export(result, tmp_path / "out.parquet")


def test_units_stand_where_the_file_has_them():
    """A channel without a unit has none in its heading; one with a list of units has that of its last label."""
    with h5py.File("units", "w", driver="core", backing_store=False) as file:
        group = file.create_group("trains/000/x")
        time, part = group.create_dataset("time", data=np.arange(3.0)), group.create_dataset("part", data=[0, 1])
        time.make_scale("time")
        part.make_scale("part")
        for name, meaning in {"plain": Channel("1", "a"), "two": Channel("m, rad", "b")}.items():
            dataset = group.create_dataset(name, data=np.zeros((3, 2)))
            dataset.dims[0].attach_scale(time)
            dataset.dims[1].attach_scale(part)
            dataset.attrs.update(units=meaning.units, long_name=meaning.long_name, coordinates="")
        table = module.channel_table(results.Result(file, "units"), 0, ["x"])
    assert [column.heading for column in table.columns] == [
        "time", "x.plain.0", "x.plain.1", "x.two.0 [m]", "x.two.1 [rad]"
    ]  # fmt: skip
