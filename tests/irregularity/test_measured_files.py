"""Measured irregularity from CSV files: ways to name channels, both directions, band-pass, broken files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.irregularity.irregularity import IrregularityParams, at_wheels, make_irregularity
from tiengine.irregularity.measured_files import LEVEL_BASE, read_series
from tiengine.irregularity.wave_content import band_passed
from tiengine.parameters.errors import InputError

DATA = Path(__file__).parents[1] / "data"
X = np.arange(0.0, 60.0, 0.5)
RAILS = {  # heights down and positions to the right of the left and right rail [m]
    "z": 1e-3 * np.stack([np.sin(0.4 * X), np.cos(0.3 * X)]),
    "y": 1e-3 * np.stack([np.sin(0.2 * X), 1.0 + np.sin(0.5 * X)]),
}
FAR = -1e9  # the irregularity has begun long before


def write(path: Path, header: str, *columns: np.ndarray) -> Path:
    rows = "\n".join(",".join(f"{v:.12g}" for v in row) for row in np.stack(columns, axis=1))
    path.write_text(f"# by a test\n{header}\n{rows}\n")
    return path


def derived() -> dict[str, np.ndarray]:
    z, y = RAILS["z"], RAILS["y"]
    return {"v": z.mean(axis=0), "level": z[1] - z[0], "a": y.mean(axis=0), "g": y[1] - y[0]}


WAYS = {
    "rails-mm": (
        "distance [km], vertical_left [mm], vertical_right [mm], alignment_left [mm], alignment_right [mm]",
        (X * 1e-3, *RAILS["z"] * 1e3, *RAILS["y"] * 1e3),
        {},
    ),
    "rails-key": (
        "x,vertical_left,vertical_right,alignment_left,alignment_right",
        (X, *RAILS["z"] * 1e3, *RAILS["y"] * 1e3),
        {"unit": "mm"},
    ),
    "level-gauge": (
        "gauge (mm), cross_level [mm], chainage, vertical, alignment[m]",
        (derived()["g"] * 1e3, derived()["level"] * 1e3, X, derived()["v"], derived()["a"]),
        {},
    ),
    "angle": (
        "mileage,z_v,theta [mrad],y_a,gauge",
        (X, derived()["v"], derived()["level"] / LEVEL_BASE * 1e3, derived()["a"], derived()["g"]),
        {},
    ),
    "up": (
        "x,vertical_left,vertical_right,alignment,gauge",
        (X, *-RAILS["z"], derived()["a"], derived()["g"]),
        {"vertical_up": True},
    ),
}


@pytest.mark.parametrize("name", WAYS)
def test_every_way_gives_the_same_rails(tmp_path, name):
    """Heights and positions of both railheads at the points of the file, to rounding (12 digits were written)."""
    header, columns, keys = WAYS[name]
    path = write(tmp_path / "track.csv", header, *columns)
    params = IrregularityParams(file=str(path), taper=1.0, **{f"file_{k}": v for k, v in keys.items()})
    inside = slice(3, -3)  # clear of the taper
    rails = at_wheels(make_irregularity(params, FAR).sample(X[inside]))
    for side in (0, 1):
        np.testing.assert_allclose(rails[:, side, 0], RAILS["z"][side, inside], atol=1e-14)
        np.testing.assert_allclose(rails[:, side, 1], RAILS["y"][side, inside], atol=1e-14)


@pytest.mark.parametrize("falls", [False, True])
@pytest.mark.parametrize("reverse", [False, True])
def test_both_directions(tmp_path, falls, reverse):
    """Running back, the train meets the last row first, and its left rail is the file's right one."""
    mileage = 5000.0 - X if falls else 5000.0 + X
    header = "mileage,vertical_left,vertical_right,alignment_left,alignment_right"
    path = write(tmp_path / "track.csv", header, mileage, *RAILS["z"], *RAILS["y"])
    first = mileage[-1] if reverse else mileage[0]
    series = read_series(path, start=first - 10.0 if falls == reverse else first + 10.0, reverse=reverse).values
    np.testing.assert_allclose(series[:, 0], X + 10.0, atol=1e-9)
    z, y = (RAILS["z"][::-1, ::-1], -RAILS["y"][::-1, ::-1]) if reverse else (RAILS["z"], RAILS["y"])
    np.testing.assert_allclose(series[:, 1], z.mean(axis=0), atol=1e-14)
    np.testing.assert_allclose(series[:, 2], y.mean(axis=0), atol=1e-14)
    np.testing.assert_allclose(series[:, 3] * LEVEL_BASE, z[1] - z[0], atol=1e-14)
    np.testing.assert_allclose(series[:, 4], y[1] - y[0], atol=1e-14)


def test_hand_made_file():
    """Falling mileage in km, heights up in mm by key, alignment in mm by header."""
    series = read_series(DATA / "track.csv", unit="mm", vertical_up=True).values
    assert series[:, 0] == pytest.approx([0.0, 1.0, 2.0, 3.0, 4.0])
    assert series[0] == pytest.approx([0.0, -1.5e-3, 0.5e-3, -1e-3 / 1.5, 1e-3])
    assert series[2] == pytest.approx([2.0, 0.0, 2e-3, 0.0, 2e-3])


def test_file_behind_the_train_is_refused(tmp_path):
    """A falling mileage with a start below the whole file, say."""
    path = write(tmp_path / "track.csv", "mileage,z_v", 900.0 - X, 1e-3 * X)
    with pytest.raises(InputError, match=r"ends at chainage -40\.5 m, .*; set file_start"):
        make_irregularity(IrregularityParams(file=str(path), file_start=800.0), 0.0)


def test_default_chainage_is_the_mileage(tmp_path):
    """A file that rises needs no start; it is where it says it is."""
    path = write(tmp_path / "track.csv", "x,z_v", X + 70.0, 1e-3 * X)
    assert read_series(path).values[0, 0] == 70.0


@pytest.mark.parametrize("uneven", [0.0, 0.1])
def test_band_pass(uneven):
    """Waves of 10 m pass, those of 200 m and 1.2 m do not, at 3 m half is left; nothing is shifted.

    Forwards and backwards the order-4 filter leaves 1/(1 + w^8), w = (f^2 - f_1 f_2)/(f (f_2 - f_1)): at 10 m all but
    5e-7, of 200 m 1.7e-4, of 1.2 m 5e-4. Uneven steps of 0.25 m bring the spline's error (k h)^4/384 of each wave.
    """
    rng = np.random.default_rng(0)
    x = np.arange(0.0, 2000.0, 0.25)
    x[1:-1] += uneven * 0.25 * rng.uniform(-1.0, 1.0, x.size - 2)
    waves = [np.sin(2.0 * np.pi * x / length) for length in (10.0, 200.0, 1.2, 3.0)]
    passed = band_passed(np.column_stack([x, *waves]), 3.0, 70.0)
    assert np.ptp(np.diff(passed[:, 0])) < 1e-9
    middle = (passed[:, 0] > 500.0) & (passed[:, 0] < 1500.0)
    along, found = passed[middle, 0], passed[middle, 1:]
    limits = {10.0: 1.0, 200.0: 0.0, 1.2: 0.0, 3.0: 0.5}
    for (length, factor), wave in zip(limits.items(), found.T, strict=True):
        spline = (2.0 * np.pi / length * 0.25) ** 4 / 384.0 if uneven else 0.0
        np.testing.assert_allclose(wave, factor * np.sin(2.0 * np.pi * along / length), atol=1e-3 + spline)


def test_band_pass_by_key(tmp_path):
    """The scenario's wavelengths; the shortest wave is the longer of wavelength_min and the content, 20 m here."""
    x = np.arange(0.0, 400.0, 0.25)
    path = write(tmp_path / "track.csv", "x,z_v", x, 0.1 * np.sin(2 * np.pi * x / 20.0) + 5.0)
    params = IrregularityParams(file=str(path), file_band_pass=True, wavelength_min=3.0, wavelength_max=70.0)
    made = make_irregularity(params, FAR)
    assert 10.0 <= made.shortest_wavelength < 20.0  # a stretch of 20 m: its main lobe reaches to 10 m
    middle = np.linspace(150.0, 250.0, 101)
    np.testing.assert_allclose(made.sample(middle)[:, 0], 0.1 * np.sin(2 * np.pi * middle / 20.0), atol=5e-4)
    for keys, message in (
        ({"wavelength_min": 0.5}, r"wavelength_min = 0.5: must be > 2 steps of the file = 0.5 m"),
        ({"wavelength_max": 1000.0}, r"wavelength_max = 1000: must be <= the file's length = 399.75 m"),
    ):
        with pytest.raises(InputError, match=message):
            make_irregularity(params.model_copy(update=keys), FAR)


ROWS = "".join(f"{x},0.001\n" for x in range(10))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("x,z_v [km]\n" + ROWS, r"line 1: column 'z_v \[km\]': its unit must be m or mm"),
        ("x,theta [mm]\n" + ROWS, "line 1: column .*: its unit must be rad or mrad"),
        ("x,vertical_lef\n" + ROWS, "line 1: column 'vertical_lef': unknown; did you mean 'vertical_left'"),
        ("x,distance\n" + ROWS, "line 1: a column is named twice"),
        ("x,vertical_left\n" + ROWS, "line 1: column 'vertical_left' needs that of the other rail"),
        ("x,alignment_right\n" + ROWS, "line 1: column 'alignment_right' needs that of the other rail"),
        ("x,z_v\n" + ROWS + "9,0\n", "line 12: x = 9: must be > the x before it"),
        ("x,z_v\n" + "".join(f"{-x},0\n" for x in range(10)) + "-8,0\n", "line 12: x = -8: must be < the x before"),
        ("x,z_v\n" + ROWS + "13,0\n", "line 12: x = 13: a gap of 4 m; the usual step is 1 m"),
        ("x,gauge [mm]\n" + "".join(f"{x},1435\n" for x in range(5)), "line 2: gauge = 1.435 m: must be the deviation"),
    ],
)
def test_broken_files_are_named(tmp_path, text, reason):
    path = tmp_path / "track.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=f"track.csv, {reason}"):
        read_series(path)
