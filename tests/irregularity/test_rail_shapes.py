"""Shapes of single rails: their heights and slopes, their wave content, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.irregularity.patch_filter import felt_shape, felt_wave
from tiengine.irregularity.rail_shapes import RailShape, RailShapes
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario

CORRUGATION = {"kind": "corrugation", "reach": (40.0, 60.0), "wavelength": 0.12, "depth": 8e-5, "taper": 2.0}
WELD = {"kind": "weld", "at": 50.0, "length": 1.0, "depth": 3e-4}
JOINT = {"kind": "joint", "rail": "right", "at": 50.0, "length": 2.0, "depth": 5e-3}


def shapes(*tables: dict) -> RailShapes:
    return RailShapes([RailShape(**table) for table in tables])


@pytest.mark.parametrize("table", [CORRUGATION, WELD, JOINT], ids=lambda t: t["kind"])
def test_slopes_are_those_of_the_heights(table):
    """Central differences over 2 um; their error is 1e-12 m over the step."""
    x = np.linspace(38.0, 62.0, 20_001)
    made = shapes(table)
    height, slope = made.sample(x)
    rise = (made.sample(x + 1e-6)[0] - made.sample(x - 1e-6)[0]) / 2e-6
    assert np.abs(rise - slope).max() < 2e-4 * np.abs(slope).max()
    assert np.abs(height).max() > 0.0


def test_a_corrugation_is_the_filtered_sine():
    """Full in the middle, on both rails, nothing outside; crest to trough is the depth times the filter."""
    x = np.linspace(45.0, 55.0, 4000)
    height, _ = shapes(CORRUGATION).sample(x)
    wave = 4e-5 * felt_wave(0.12) * np.sin(2.0 * np.pi * (x - 40.0) / 0.12)
    np.testing.assert_allclose(height, np.stack([wave, wave], axis=1), atol=1e-15)
    assert not shapes(CORRUGATION).sample(np.array([39.9, 60.1]))[0].any()
    assert 0.97 < felt_wave(0.12) < 1.0


def test_a_joint_lies_on_its_rail():
    """Two ramps of 5 mm/m on the right rail: the filter rounds their tip by less than 2 %."""
    height, slope = shapes(JOINT).sample(np.array([49.5, 50.0, 50.5]))
    assert not height[:, 0].any()
    np.testing.assert_allclose(height[[0, 2], 1], 2.5e-3, rtol=1e-3)
    np.testing.assert_allclose(slope[[0, 2], 1], [5e-3, -5e-3], rtol=1e-2)
    assert 0.98 * 5e-3 < height[1, 1] < 5e-3


def test_shapes_add():
    """A weld on the corrugation."""
    x = np.linspace(40.0, 60.0, 501)
    both, one, other = (shapes(*t).sample(x) for t in ((CORRUGATION, WELD), (CORRUGATION,), (WELD,)))
    for k in range(2):
        np.testing.assert_allclose(both[k], one[k] + other[k], atol=1e-18)


def test_the_filter_keeps_waves_apart():
    """Each wave of a period by its own share: 200 and 20 mm."""
    x = 1e-3 * np.arange(2000)
    z = np.cos(2 * np.pi * x / 0.2) + np.cos(2 * np.pi * x / 0.02)
    wanted = felt_wave(0.2) * np.cos(2 * np.pi * x / 0.2) + felt_wave(0.02) * np.cos(2 * np.pi * x / 0.02)
    np.testing.assert_allclose(felt_shape(z, 1e-3), wanted, atol=1e-12)


def test_content_and_not_rows_sets_the_step(tmp_path: Path):
    """A settlement of 15 mm over 20 m in rows of 10 mm runs at the longest step; rows would ask for 2.5e-5 s."""
    x = np.arange(0.0, 120.0, 0.01)
    z = np.where(np.abs(x - 60.0) < 10.0, 7.5 * (1.0 + np.cos(np.pi * (x - 60.0) / 10.0)), 0.0)
    path = tmp_path / "settled.csv"
    path.write_text("x [m],vertical [mm]\n" + "\n".join(f"{a:.2f},{b:.6f}" for a, b in zip(x, z, strict=True)))
    made = shapes({"kind": "file", "file": str(path)})
    assert made.waves[0] > 1.0  # eight steps of 2e-4 s at 350 km/h are 0.16 m
    height, _ = made.sample(np.array([60.0, 55.0]))
    np.testing.assert_allclose(height, [[15e-3] * 2, [7.5e-3] * 2], atol=1e-6)
    assert shapes(CORRUGATION).waves == (0.12,)
    assert 0.2 < shapes(WELD).waves[0] < 1.0
    assert shapes(JOINT).waves[0] < 0.1  # the tip


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"wavelength": None}, ("track.rail_shapes.wavelength", "missing", "corrugation")),
        ({"at": 3.0}, ("track.rail_shapes.at = 3.0", "left out")),
        ({"reach": (60.0, 40.0)}, ("track.rail_shapes.reach = [60.0, 40.0]", "from < to")),
        ({"depth": 0.2}, ("track.rail_shapes[0].depth = 0.2", "less than or equal to 0.05 m")),
        ({"reach": (400.0, 500.0)}, ("track.rail_shapes[0].reach = [400.0, 500.0]", "leading wheel")),
        ({"kind": "bump"}, ("track.rail_shapes[0].kind = 'bump'", "'weld'")),
    ],
)
def test_refused(change, words):
    """One line with key, value and rule."""
    table = {key: value for key, value in {**CORRUGATION, **change}.items() if value is not None}
    with pytest.raises(InputError) as caught:
        load_scenario("smooth", {"track.rail_shapes": [table]})
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message


def test_sines_refuse_shapes():
    """Their step does not know them."""
    with pytest.raises(InputError, match=r"track\.rail_shapes: must be left out .*sines"):
        load_scenario("paper", {"track.rail_shapes": [CORRUGATION]})


def test_a_missing_file_is_named(tmp_path: Path):
    """By its key and its path."""
    with pytest.raises(InputError, match=r"track\.rail_shapes\[0\]\.file = .*none\.csv"):
        RailShapes([RailShape(kind="file", file=str(tmp_path / "none.csv"))])
