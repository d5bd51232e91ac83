"""Measured tracks as recording cars write them: encodings, separators, decimal marks, mileages, gaps, columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.irregularity.irregularity import IrregularityParams, make_irregularity
from tiengine.irregularity.measured_files import read_series
from tiengine.irregularity.track_columns import FileColumns
from tiengine.irregularity.track_text import read_track_text
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario, to_toml

DATA = Path(__file__).parents[1] / "data" / "tracks"
CHINESE = FileColumns(
    km="公里标",
    m="米",
    vertical_left="左高低(mm)",
    vertical_right="右高低",
    alignment_left=7,
    alignment_right="右轨向(mm)",
    gauge="轨距",
)
GERMAN = FileColumns(km="km", vertical_left="Längshöhe links", vertical_right="längshöhe rechts [mm]")

FIRST = (120000.0, -0.832e-3, -0.235e-3)
"""Mileage and heights of the left and right rail in the first row of each file [m], as printed in it."""


def rails(values: np.ndarray) -> np.ndarray:
    """Heights of the left and right rail."""
    return values[:, 1, None] + np.array([-0.75, 0.75]) * values[:, 3, None]


@pytest.mark.parametrize(
    ("file", "keys", "offset", "words"),
    [
        ("tabs.txt", {}, 120e3, "read as UTF-8, separated by tabs; 3 of 3 columns used"),
        ("kmileage.csv", {}, 0.0, "read as UTF-8, separated by commas; 3 of 3 columns used"),
        ("inspection_gbk.csv", {"columns": CHINESE}, 0.0, "read as GBK, separated by commas; 7 of 12 columns used"),
        (
            "messwagen_latin1.csv",
            {"columns": GERMAN},
            0.0,
            "read as Latin-1, separated by semicolons, decimal commas; 3 of 4 columns used",
        ),
    ],
)
def test_files_of_recording_cars(file, keys, offset, words):
    """The same 15 m of track in four ways: mileage and heights as printed, and what was done is said."""
    series = read_series(DATA / file, **keys)
    values = series.values
    last = np.genfromtxt(DATA / "tabs.txt", skip_header=1)[-1]  # the plainest of them, by NumPy's reader
    assert series.description == words
    assert values[0, 0] + offset == pytest.approx(FIRST[0], abs=1e-9)
    assert values[-1, 0] + offset == pytest.approx(120000.0 + last[0], abs=1e-9)
    np.testing.assert_allclose(rails(values)[0], FIRST[1:], atol=1e-15)
    np.testing.assert_allclose(rails(values)[-1], 1e-3 * last[1:], atol=1e-15)


def test_alignment_and_gauge_of_the_chinese_file():
    """Its first row: 0.427 and -0.042 mm alignment, 0.507 mm gauge."""
    first = read_series(DATA / "inspection_gbk.csv", columns=CHINESE).values[0]
    assert first[[2, 4]] == pytest.approx([0.5e-3 * (0.427 - 0.042), 0.507e-3])


def test_columns_by_key_through_a_scenario(tmp_path):
    """Keys of a scenario reach the reader, and the recorded text loads back equal."""
    columns = {"km": "km", "vertical_left": 2, "vertical_right": 3}
    keys = {"irregularity.file": str(DATA / "messwagen_latin1.csv"), "irregularity.file_columns": columns}
    scenario = load_scenario("default", keys | {"irregularity.file_start": 119e3, "irregularity.taper": 1.0})
    assert load_scenario(scenario) == scenario
    assert "file_columns" in to_toml(scenario)
    track = make_irregularity(scenario.irregularity, -1e9)
    assert track.description.startswith("messwagen_latin1.csv: read as Latin-1")
    assert track.sample(np.array([1005.0]))[0, 0] != 0.0
    assert track.start == pytest.approx(1000.0, abs=1e-9)


@pytest.mark.parametrize(
    ("file", "keys", "reason"),
    [
        ("inspection_gbk.csv", {}, r"line 1: column '公里标': unknown; .*file_columns \(read as GBK, .* commas\)$"),
        ("messwagen_latin1.csv", {}, "line 1: column 'Längshöhe links .*': unknown; .*Latin-1, .* semicolons"),
        ("messwagen_latin1.csv", {"encoding": "utf-8"}, "line 1: not in the encoding utf-8 of file_encoding"),
        ("messwagen_latin1.csv", {"columns": FileColumns(km="km", vertical="Hoehe")}, "'Hoehe': no such head"),
        ("messwagen_latin1.csv", {"columns": FileColumns(km=9, vertical=2)}, "km = 9: there are 4 columns"),
        ("messwagen_latin1.csv", {"columns": FileColumns(km=1, gauge=4)}, "line 2: gauge = 1.43551 m: must be the dev"),
        ("kmileage.csv", {"columns": FileColumns(km=1, vertical=2)}, r"km = 'K120\+000.000': must be the column 'x'"),
        ("tabs.txt", {"columns": FileColumns(x=1, m=2, vertical=3)}, "must have either 'x' or 'km' and 'm'"),
        ("gaps.csv", {}, "line 32: vertical_left has no value up to line 34, a gap of 1 m; .*file_bridge = 1 "),
    ],
)  # fmt: skip
def test_what_is_not_stated_is_refused(file, keys, reason):
    """One line with file, line, reason, and how the file was read."""
    with pytest.raises(InputError, match=reason) as caught:
        read_series(DATA / file, **keys)
    assert file in str(caught.value)
    assert "\n" not in str(caught.value)


def test_gaps_are_bridged_where_allowed(tmp_path):
    """The values around are kept, those between lie between; a row that is missing is a gap as well."""
    series = read_series(DATA / "gaps.csv", bridge=1.0)
    assert series.description.endswith("; 3 points filled in gaps")
    right = np.genfromtxt(DATA / "gaps.csv", delimiter=",", skip_header=1)
    np.testing.assert_allclose(rails(series.values)[:, 1], 1e-3 * right[:, 2], atol=1e-15)
    left, gap = rails(series.values)[:, 0], np.isnan(right[:, 1])
    np.testing.assert_allclose(left[~gap], 1e-3 * right[~gap, 1], atol=1e-15)
    i = np.flatnonzero(gap)
    low, high = sorted((left[i[0] - 1], left[i[-1] + 1]))
    assert (low <= left[gap]).all()
    assert (left[gap] <= high).all()
    lines = (DATA / "gaps.csv").read_text().splitlines()
    path = tmp_path / "rows.csv"
    path.write_text("\n".join([*lines[: i[0] + 1], *lines[i[-1] + 2 :]]))
    with pytest.raises(
        InputError, match=r"line 32: x = 126: a gap of 1 m; the usual step is 0.25 m; .*file_bridge = 1"
    ):
        read_series(path)
    np.testing.assert_allclose(rails(read_series(path, bridge=1.0).values)[:, 0], left, atol=1e-15)


HEIGHTS = [0.0, 0.1, -0.2, 0.3, 0.1]


@pytest.mark.parametrize(
    "text",
    [
        "x [m];vertical [mm]\n" + "".join(f"{x};{z}\n" for x, z in enumerate(HEIGHTS)),
        "x [m];vertical [mm];\n" + "".join(f"{x};{z};\n" for x, z in enumerate(HEIGHTS)),
        "x [m]\tvertical [mm]\n" + "".join(f"{x},0\t{z}\n".replace(".", ",") for x, z in enumerate(HEIGHTS)),
        "x [m]   vertical [mm]\n" + "".join(f"  {x}  {z}\n" for x, z in enumerate(HEIGHTS)),
        "x  vertical [mm]\n" + "".join(f"{x} {z}\n".replace(".", ",") for x, z in enumerate(HEIGHTS)),
        "Car 7; run of 3 May\nDistance (m);Vertical (mm)\n" + "".join(f"{x};{z}\n" for x, z in enumerate(HEIGHTS)),
        "x [m],vertical [mm],\n" + "".join(f"{x},{z}\n" for x, z in enumerate(HEIGHTS)),
        "X [M],VERTICAL [MM]\n" + "".join(f"{x},{z}\n" for x, z in enumerate(HEIGHTS)),
        "sep=;\nx [m];vertical [mm]\n" + "".join(f"{x};{z}\n" for x, z in enumerate(HEIGHTS)),
        "x,vertical [mm]\n" + "".join(f"km 0 + {x:03d},{z}\n" for x, z in enumerate(HEIGHTS)),
        "x,vertical\n[m],[mm]\n" + "".join(f"{x},{z}\n" for x, z in enumerate(HEIGHTS)),
        "% by hand\nkm,m,vertical [mm]\n" + "".join(f"0,{x},{z}\n" for x, z in enumerate(HEIGHTS)),
        'x,"vertical [mm]"\n' + "".join(f'{x},"{z}"\n'.replace(".", ",") for x, z in enumerate(HEIGHTS)),
        "mileage,vertical [mm]\n" + "".join(f"DK0+{x:03d}.0,{z}\n" for x, z in enumerate(HEIGHTS)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_ways_to_write_a_table(tmp_path, text, encoding):
    """Separators, decimal commas, marks of the encoding, lines above the heads, units below them."""
    path = tmp_path / "track.txt"
    path.write_bytes(text.replace("x [m];vertical [mm];\n", "x [m];vertical [mm]\n").encode(encoding))
    values = read_series(path).values
    np.testing.assert_allclose(values[:, 0], np.arange(5.0), atol=1e-12)
    np.testing.assert_allclose(values[:, 1], 1e-3 * np.array(HEIGHTS), atol=1e-15)


def test_a_table_without_heads_by_numbers(tmp_path):
    path = tmp_path / "track.txt"
    path.write_text("".join(f"{x}\tgood\t{z}\n" for x, z in enumerate(HEIGHTS)))
    values = read_series(path, columns=FileColumns(x=1, vertical=3), unit="mm").values
    np.testing.assert_allclose(values[:, 1], 1e-3 * np.array(HEIGHTS), atol=1e-15)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "x;z_v\n0;1.5\n1;2,5\n2;0\n3;0\n",
            "line 3: z_v = '2,5': must be a finite number with the decimal mark of the",
        ),
        ("x;z_v\n0;1\n1;2.500,0\n2;0\n3;0\n", "line 3: z_v = '2.500,0': must be a finite number"),
        ("x,z_v\n0,0,0,5\n1,0,0,5\n2,0,0,5\n3,0,0,5\n", "line 2: 4 values; the header names 2 columns; decimal commas"),
        ("x;z_v\n0;-\n1;1\n2;1\n3;1\n4;1\n", "line 2: z_v has no value up to line 2: must not lack values at an end"),
        ("x;z_v\n0;0\n;1\n2;1\n3;1\n4;1\n", "line 3: the distance has no value"),
        ("x;z_v\n0;K1+200\n1;1\n2;1\n3;1\n", r"line 2: z_v = 'K1\+200': must be the column 'x'"),
    ],
)
def test_ambiguous_numbers_are_refused(tmp_path, text, reason):
    path = tmp_path / "track.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=reason):
        read_series(path)


@pytest.mark.parametrize(
    ("words", "encoding", "found"),
    [
        ("Längshöhe", "latin-1", "Latin-1"),
        ("écart é è", "latin-1", "Latin-1"),
        ("左高低", "gbk", "GBK"),
        ("左高低, 超高 mm", "gbk", "GBK"),
        ("左高低 ä", "utf-8", "UTF-8"),
        ("plain", "ascii", "UTF-8"),
    ],
)
def test_encodings_are_detected(tmp_path, words, encoding, found):
    path = tmp_path / "track.csv"
    path.write_bytes(f"x,z_v {words}\n0,1\n".encode(encoding))
    text = read_track_text(path)
    assert text.encoding == found
    assert words in text.lines[0][1]


def test_a_stated_encoding_is_taken(tmp_path):
    """A Latin-1 text whose umlauts come in pairs, which detection takes for GBK."""
    path = tmp_path / "track.csv"
    path.write_bytes("x,äö\n0,1\n".encode("latin-1"))
    assert read_track_text(path).encoding == "GBK"
    assert "äö" in read_track_text(path, "latin-1").lines[0][1]


def test_the_file_is_described_by_params():
    """The run reports and records how the file was read."""
    params = IrregularityParams(file=str(DATA / "gaps.csv"), file_bridge=1.0)
    assert make_irregularity(params, 0.0).description.startswith("gaps.csv: read as UTF-8, separated by commas")


@pytest.mark.parametrize("column", ["vertical", "alignment", "gauge"])
def test_millimetres_taken_for_metres_are_refused(tmp_path: Path, column: str) -> None:
    """Waves of 20 m and 0.3 mm would be 0.3 m high; a hill of 1 m in 40 m is a track."""
    x = np.arange(0.0, 80.0, 0.25)
    path = tmp_path / "track.csv"
    for height, length, unit in ((0.4, 20.0, "m"), (0.5, 80.0, "m"), (0.4, 20.0, "mm")):
        z = height * np.sin(2.0 * np.pi * x / length)
        path.write_text(f"x,{column} [{unit}]\n" + "".join(f"{a},{b:.5f}\n" for a, b in zip(x, z, strict=True)))
        if (length, unit) == (20.0, "m"):
            with pytest.raises(
                InputError, match=r"changes by 0.125 m within 1 m; at most 0.1 m .* are its units right"
            ):
                read_series(path)
        else:
            read_series(path)
