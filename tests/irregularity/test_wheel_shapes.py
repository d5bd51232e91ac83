"""Wheels out of round: tables against their forms, wave content, files, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.irregularity.patch_filter import felt_wave
from tiengine.irregularity.wheel_files import read_polygon
from tiengine.irregularity.wheel_shapes import WheelShape, flat_depth, radius_deviation, wheel_tables
from tiengine.kernels.layout import ROUND_POINTS
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario

R0 = 0.43
ANGLE = 2.0 * np.pi / ROUND_POINTS * np.arange(ROUND_POINTS)
POLYGON = WheelShape(
    kind="harmonics", wheelsets=(2,), side="left", order=(20, 3), amplitude=(2e-5, 1e-4), phase=(0.3, 0.0)
)


def test_harmonics_are_filtered_waves_of_the_tread():
    """A wave of 2 pi r0/n gets the filter of a rail wave of that length; its derivative belongs to it."""
    tables = wheel_tables([POLYGON], [R0, R0])
    assert tables.number.tolist() == [[-1, -1], [0, -1]]
    wave = [A * felt_wave(2.0 * np.pi * R0 / n) for n, A in ((20, 2e-5), (3, 1e-4))]
    value = wave[0] * np.cos(20 * ANGLE + 0.3) + wave[1] * np.cos(3 * ANGLE)
    slope = -20 * wave[0] * np.sin(20 * ANGLE + 0.3) - 3 * wave[1] * np.sin(3 * ANGLE)
    np.testing.assert_allclose(tables.values[0, :, 0], value, atol=1e-16)
    np.testing.assert_allclose(tables.values[0, :, 1], slope, atol=1e-14)
    assert tables.waves == ((2.0 * np.pi * R0 / 20, 20),)
    assert 2.0 * np.pi * R0 / 20 == pytest.approx(0.135, abs=5e-4)  # 720 Hz at 350 km/h
    assert 350.0 / 3.6 / (2.0 * np.pi * R0 / 20) == pytest.approx(720.0, rel=1e-3)


def test_equal_wheels_share_a_table():
    """Two shapes on all wheels, one more on one of them."""
    all_round = WheelShape(kind="flat", length=0.03)
    tables = wheel_tables([all_round, POLYGON], [R0, R0])
    assert tables.number.tolist() == [[0, 0], [1, 0]]
    assert tables.name(1) == "wheelset 2 left"


def test_a_new_flat_turns_about_its_edges():
    """50 mm on R 430 are 0.727 mm deep; the centre falls as r0 (1 - cos of the angle from the edge)."""
    flat = WheelShape(kind="flat", length=0.05)
    assert flat_depth(0.05, R0) == pytest.approx(0.727e-3, abs=5e-7)
    s = np.linspace(-0.04, 0.04, 401)
    fall = -radius_deviation(flat, R0, s / R0)
    within = np.abs(s) < 0.025
    np.testing.assert_allclose(fall[within], (0.025 - np.abs(s[within])) ** 2 / (2.0 * R0), rtol=1e-3, atol=1e-12)
    assert not fall[~within].any()
    assert fall.max() == pytest.approx(0.727e-3, rel=1e-3)


def test_a_worn_flat_is_as_deep_and_smooth():
    """One wave 1 - cos, no corner."""
    worn = WheelShape(kind="flat", length=0.05, form="worn", angle=1.0)
    s = np.linspace(-0.03, 0.03, 601)
    fall = -radius_deviation(worn, R0, 1.0 + s / R0)
    assert fall.max() == pytest.approx(flat_depth(0.05, R0))
    new, old = (wheel_tables([WheelShape(kind="flat", length=0.05, form=form)], [R0]) for form in ("new", "worn"))
    assert new.waves[0][0] < old.waves[0][0]


def write(path: Path, rows: np.ndarray, heads: str = "angle [deg], deviation [um]") -> str:
    path.write_text(heads + "\n" + "\n".join(", ".join(f"{x:.9g}" for x in row) for row in rows))
    return str(path)


def test_a_measured_polygon_is_read(tmp_path: Path):
    """Every degree of order 15: the spline is 1e-4 of the amplitude off, the mean radius is taken off."""
    degrees = np.arange(0.0, 360.0)
    path = write(tmp_path / "wheel.csv", np.stack([degrees, 7.0 + 20.0 * np.cos(15 * np.radians(degrees))], axis=1))
    at = np.linspace(-7.0, 20.0, 999)
    np.testing.assert_allclose(read_polygon(path, "key")(at), 2e-5 * np.cos(15 * at), atol=2e-5 * 2e-4)
    shape = WheelShape(kind="file", file=path, angle=0.2, scale=2.0)
    np.testing.assert_allclose(radius_deviation(shape, R0, at), 4e-5 * np.cos(15 * (at - 0.2)), atol=1e-8)


@pytest.mark.parametrize(
    ("heads", "rows", "words"),
    [
        ("angle [deg], height [um]", 36, ("line 1", "height [um]")),
        ("angle [deg], deviation [in]", 36, ("line 1", "deviation [in]")),
        ("angle [deg], deviation [um]", 5, ("5 points", "at least 8")),
        ("angle [rad], deviation [um]", 36, ("one revolution",)),
        ("angle [deg], deviation [m]", 36, ("line 2", "at most 0.005 m")),
    ],
)
def test_files_that_are_refused(tmp_path: Path, heads, rows, words):
    """File, line and rule."""
    degrees = 10.0 * np.arange(rows)
    path = write(tmp_path / "wheel.csv", np.stack([degrees, 7.0 + degrees], axis=1), heads)
    with pytest.raises(InputError) as caught:
        read_polygon(path, "train.wheel_shapes[0].file")
    for word in ("wheel.csv", *words):
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"kind": "flat"}, ("train.wheel_shapes.length", "missing")),
        ({"kind": "flat", "length": 0.05, "order": [3]}, ("train.wheel_shapes.order", "left out")),
        ({"kind": "harmonics", "order": [3, 4], "amplitude": [1e-5]}, ("train.wheel_shapes.amplitude", "2 numbers")),
        ({"kind": "harmonics", "order": [300], "amplitude": [1e-5]}, ("order", "less than or equal to 256")),
        ({"kind": "flat", "length": 0.05, "wheelsets": [5]}, ("wheel_shapes[0].wheelsets = [5]", "from 1 to 4")),
    ],
)
def test_refused(table, words):
    """One line with key, value and rule."""
    with pytest.raises(InputError) as caught:
        load_scenario("smooth", {"train.wheel_shapes": [table]})
    for word in words:
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)
