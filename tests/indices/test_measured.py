"""Measured signals from text files: the indices of a run of the same signals, and files that must be refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tiengine.cli.commands import main
from tiengine.indices.measured_ride import measured_ride
from tiengine.indices.metrics import train_metrics
from tiengine.parameters.errors import InputError

from .. import hand_made as by

RATE, SPEED = 500.0, 350.0 / 3.6
TIME = np.arange(round(12.0 * RATE)) / RATE


def written(path: Path, separator: str = ",", comma: bool = False, **columns: np.ndarray) -> Path:
    """A text file of these columns."""
    rows = [separator.join(f"{x:.9g}" for x in row) for row in zip(*columns.values(), strict=True)]
    text = "\n".join(["# measured on a Tuesday", separator.join(columns), *rows])
    path.write_text(text.replace(".", ",") if comma else text, encoding="utf-8")
    return path


def accelerations() -> dict[str, np.ndarray]:
    return {"ay": 0.3 * np.sin(2.0 * np.pi * 1.3 * TIME), "az": 0.5 * np.sin(2.0 * np.pi * 1.1 * TIME)}


def indices(ride) -> dict[tuple[str, str], object]:
    return {(index.standard.split()[0], index.name): index for index in train_metrics(ride).indices}


COLUMNS = {"lateral_acceleration": "ay", "vertical_acceleration": "az"}


def test_closed_forms_of_measured_tones(tmp_path):
    """0.5 m/s^2 at 1.1 Hz: W = 2.62; both amplitudes within 1 %; no index of wheel forces, which were not measured."""
    path = written(tmp_path / "a.csv", **accelerations())
    got = indices(measured_ride(path, COLUMNS, rate=RATE, speed=SPEED, vehicle_class="coach"))
    assert got["GB/T", "Sperling index W, vertical"].value == pytest.approx(2.6164, rel=5e-4)
    assert got["GB/T", "Sperling index W, vertical"].limit == 3.0
    assert got["EN", "vertical acceleration"].value == pytest.approx(0.5, rel=0.01)
    assert got["EN", "lateral acceleration"].value == pytest.approx(0.3, rel=0.01)
    assert ("EN", "wheel force Q") not in got
    assert ("EN", "mean comfort N_MV") in got


@pytest.mark.parametrize(("separator", "comma"), [(";", True), ("\t", False), (",", False)])
def test_forms_of_files(tmp_path, separator, comma):
    """Separators, decimal commas, units, a time column, and columns called after signals."""
    signals = accelerations()
    columns = {"time [ms]": 1e3 * TIME, "vertical_acceleration [g]": signals["az"] / 9.80665, "remark": 0.0 * TIME}
    path = written(tmp_path / "a.csv", separator, comma, **columns)
    got = indices(measured_ride(path, {}, speed=SPEED, vehicle_class="coach"))
    assert got["EN", "vertical acceleration"].value == pytest.approx(0.5, rel=0.01)
    assert ("EN", "lateral acceleration") not in got


def test_the_same_indices_as_a_run(tmp_path):
    """A car that moves as a whole and a wheelset's forces, once as a result, once as text: all values agree to 1e-5."""
    rng = np.random.default_rng(4)
    signals = accelerations()
    motion = np.zeros((len(TIME), 7, 5))
    motion[:, 0, 0], motion[:, 0, 1] = signals["ay"], signals["az"]
    of = by.scenario()
    static = by.static_loads(of)
    load = float(static[0].mean())
    Y, Q = np.zeros((len(TIME), 4, 2)), np.ones((len(TIME), 4, 2)) * load
    Y[:, 0], Q[:, 0] = 5e3 * rng.standard_normal((2, len(TIME), 2))
    Q[:, 0] += load
    groups = {"wheel": by.wheel(Q, Y, 1.0 / RATE), "body": by.body(motion, 1.0 / RATE)}
    with by.made(tmp_path / "a.h5", of, groups) as result:
        (run,) = result.metrics().trains
    columns = {"time": TIME, "position [km]": 1e-3 * (by.START + by.V * TIME), **signals}
    for i, side in enumerate(("left", "right")):
        columns |= {f"lateral_force_{side} [kN]": 1e-3 * Y[:, 0, i], f"vertical_force_{side} [kN]": 1e-3 * Q[:, 0, i]}
    path = written(tmp_path / "a.csv", **columns)
    names = (
        "time",
        "position",
        *(f"{force}_force_{side}" for force in ("lateral", "vertical") for side in ("left", "right")),
    )
    got = indices(measured_ride(path, {**COLUMNS, **{n: n for n in names}}, static_load=load, vehicle_class="coach"))
    assert {(index.standard.split()[0], index.name) for index in run.indices} == set(got)
    for index in run.indices:
        other = got[index.standard.split()[0], index.name]
        assert other.value == pytest.approx(index.value, rel=1e-5), index.name
        assert other.limit == pytest.approx(index.limit, rel=1e-9) if index.limit else other.limit is None


def test_places(tmp_path):
    """Two floor points: the worse one is named; one in the middle counts for comfort only."""
    signals = accelerations()
    path = written(tmp_path / "a.csv", a1=signals["az"], a2=2.0 * signals["az"], a3=5.0 * signals["az"])
    columns = {f"{place}:vertical_acceleration": f"a{i + 1}" for i, place in enumerate(("front", "rear", "middle"))}
    got = indices(measured_ride(path, columns, rate=RATE, speed=SPEED))
    assert got["EN", "vertical acceleration"].place == "rear"
    assert got["EN", "vertical acceleration"].value == pytest.approx(1.0, rel=0.01)


def test_command(tmp_path):
    """Table on screen, JSON in a file."""
    path, out = written(tmp_path / "a.csv", **accelerations()), tmp_path / "a.json"
    options = ["--rate", "500", "--speed", "350", "--class", "coach", "--json", str(out)]
    columns = [text for name, column in COLUMNS.items() for text in ("--column", f"{name}={column}")]
    done = CliRunner().invoke(main, ["metrics", str(path), *columns, *options])
    assert done.exit_code == 0, done.output
    assert "Sperling index W, vertical" in done.stdout
    first = json.loads(out.read_text(encoding="utf-8"))["trains"][0]["indices"]
    assert {index["standard"] for index in first} == {
        "EN 14363:2016", "GB/T 5599-2019", "EN 12299:2009", "ISO 2631-1:1997",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "no signal: name columns by --column"),
        (["--column", "vertical_acceleration=az"], "neither --rate nor a column time"),
        (["--column", "vertical_acceleration=az", "--rate", "500"], "neither --speed nor a column position"),
        (["--column", "vertical_acceleration=aq", "--rate", "500"], "no column 'aq'"),
        (["--column", "up=az"], "no signal 'up'"),
        (["--column", "az"], "must be SIGNAL=COLUMN"),
        (["--column", "vertical_acceleration=az", "--rate", "50", "--speed", "350"], "too coarse for the filters"),
        (["--column", "vertical_acceleration=az", "--rate", "nan"], "must be a finite number > 0"),
        (["--column", "lateral_force_left=az", "--rate", "500"], "no lateral_force_right"),
        (["--train", "1"], "holds the signals of one vehicle"),
    ],
)
def test_what_is_refused(tmp_path, options, message):
    """One line on the error stream, exit status 2."""
    path = written(tmp_path / "a.csv", **accelerations())
    done = CliRunner().invoke(
        main, ["metrics", str(path), *options, *(["--speed", "350"] if "aq" in str(options) else [])]
    )
    assert done.exit_code == 2, done.output
    assert re.fullmatch(r"error: [^\n]+\n", done.stderr)
    assert message in done.stderr


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must hold a line that names the columns"),
        ("1,2\n3,4\n", "must name the columns, not hold numbers"),
        ("az,az\n1,2\n", "two columns are called 'az'"),
        ("az\n1.0\nx\n", "line 3: az = 'x': must be a finite number"),
        ("az [furlong]\n1.0\n2.0\n", "its unit must be one of"),
    ],
)
def test_broken_files(tmp_path, text, message):
    """File, line and reason."""
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=re.escape(message)):
        measured_ride(path, {"vertical_acceleration": "az"}, rate=500.0, speed=90.0)


def test_options_of_text_files_do_not_apply_to_results(tmp_path):
    """Instead of being left unused without notice."""
    path = by.written(tmp_path / "a.h5", by.scenario(), {})
    done = CliRunner().invoke(main, ["metrics", str(path), "--rate", "500"])
    assert done.exit_code == 2
    assert "--rate: only for text files" in done.stderr
