"""``tiengine contact``: its numbers against the modules' and another program's, its figure, its errors."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from tiengine.cli.commands import main
from tiengine.contact.conicity import equivalent_conicity, rolling_radius_difference
from tiengine.contact.profile import load_profile
from tiengine.contact.table import ContactSettings, WheelRailPair
from tiengine.report.contact_report import contact_report, draw
from tiengine.scenario.profile_part import build_profile
from validation.cases.klingel import cone, round_head

PRINTED = 0.0350
"""LMA on CHN60 at 3 mm, another program's digits (tests/contact/test_conicity.py)."""


def call(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["contact", *map(str, arguments)])


@pytest.fixture(scope="module")
def report():
    return contact_report(load_profile("LMA", "wheel"), load_profile("CHN60", "rail"), ContactSettings())


def test_numbers_are_those_of_the_modules(report):
    """Conicity at 3 mm as printed elsewhere, to half a digit; all else the same bits as from the modules."""
    pair = WheelRailPair(report.pair.wheel, report.pair.rail, report.pair.settings)
    assert report.reference_conicity == pytest.approx(PRINTED, abs=0.5e-4)
    np.testing.assert_array_equal(report.conicity, equivalent_conicity(pair, report.amplitude))
    np.testing.assert_array_equal(report.radius_difference, rolling_radius_difference(pair, report.shift))
    np.testing.assert_allclose(report.radius_difference, -report.radius_difference[::-1], atol=1e-12)  # odd
    assert (report.shift[0], report.shift[-1]) == pytest.approx((-8e-3, 8e-3))


def test_command_prints_conicity_and_json(report):
    """A table for people, all numbers for scripts."""
    result = call("LMA", "CHN60")
    assert result.exit_code == 0, result.output
    assert re.search(r"conicity at 3 mm +0\.0350\n", result.stdout)
    found = json.loads(call("LMA", "CHN60", "--json").stdout)
    assert found["conicity_at_3mm"] == report.reference_conicity
    assert found["radius_difference"] == report.radius_difference.tolist()
    assert found["settings"]["gauge"] == 1.435


def test_options_place_wheel_and_rail(report):
    """A wider gauge lowers LMA's conicity; roll is found to 1e-12, whatever else is computed with it."""
    wide = json.loads(call("LMA", "CHN60", "--gauge", 1.440, "--json").stdout)
    pair = WheelRailPair(report.pair.wheel, report.pair.rail, ContactSettings(gauge=1.440))
    assert wide["conicity_at_3mm"] == pytest.approx(equivalent_conicity(pair, 3e-3)[0], rel=1e-7)
    assert wide["conicity_at_3mm"] < report.reference_conicity


def test_files_with_their_options(tmp_path, report):
    """A wheel measured from its flange's back on a rail mirrored in its file touch as the library's do."""
    wheel, rail = (np.stack([p.y, p.z], axis=1) * 1e3 for p in (report.pair.wheel, report.pair.rail))
    for name, points in (("w.txt", wheel + np.array([70.0, 0.0])), ("r.txt", rail[::-1] * [-1.0, 1.0])):
        (tmp_path / name).write_text("\n".join(f"{y:.6f} {z:.6f}" for y, z in points))
    options = ("--tape-circle", 0.07, "--mirror-rail", "--json")
    found = json.loads(call(tmp_path / "w.txt", tmp_path / "r.txt", *options).stdout)
    assert found["conicity_at_3mm"] == pytest.approx(report.reference_conicity, rel=1e-6)  # six digits both


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_figure_names_its_axes(tmp_path, report, suffix):
    """Written in the format of its suffix; quantities with their units."""
    path = tmp_path / f"contact.{suffix}"
    draw(report, path)
    content = path.read_bytes()
    assert content.startswith(b"\x89PNG" if suffix == "png" else b"<?xml")
    if suffix == "svg":
        for words in ("rolling-radius difference [mm]", "equivalent conicity [-]", "0.0350 at 3 mm"):
            assert f"<!-- {words} -->".encode() in content


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["LMX", "CHN60"], "wheel profile 'LMX': neither a file nor a preset; did you mean 'LMA'?"),
        (["LMA", "CHN60", "--gauge", "-1"], "contact.gauge = -1.0: must be greater than 0 m"),
        (["LMA", "CHN60", "--largest", "0.001"], "largest shift = 1 mm: must be 3 to 20 mm"),
        (["LMA", "CHN60", "--left-larger", "0.011"], "left wheel larger by 11 mm in radius: must be at most 10 mm"),
        (["LMA", "CHN60", "--left-larger", "nan"], "left wheel larger by nan mm in radius"),
        (["LMA", "CHN60", "--left-wheel", "LMX"], "wheel profile 'LMX': neither a file nor a preset"),
        (["LMA", "CHN60", "--left-larger", "1e-3", "--method", "en15302"], "method = 'en15302': must be 'harmonic'"),
        (["LMA", "CHN60", "-o", "figure.abc"], "output = 'figure.abc': its suffix must be one of"),
        (["LMA", "CHN60", "-o", "no/such/figure.png"], "output = 'no/such/figure.png': there is no folder 'no/such'"),
    ],
)
def test_bad_input_is_one_line(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    result = call(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert re.fullmatch(r"error: [^\n]+\n", result.stderr)
    assert message in result.stderr
    assert list(Path.cwd().iterdir()) == []


def test_sides_stated_alike_are_the_symmetric_wheelset(report):
    """About the mean shift, here 0; shifts in between are interpolated every 10 um, which moves conicity by 1e-4."""
    same = contact_report(report.pair.wheel, report.pair.rail, report.pair.settings, left_wheel=report.pair.wheel)
    assert same.rolling_shift == pytest.approx(0.0, abs=1e-8)
    inside = report.amplitude < 7e-3  # wider waves leave the shifts considered
    assert same.conicity[inside] == pytest.approx(report.conicity[inside], rel=1e-3)
    assert same.radius_difference == pytest.approx(report.radius_difference, abs=1e-15)


@pytest.mark.parametrize("larger", [4e-5, -4e-5, 1e-4])
def test_cones_of_unequal_radii_roll_beside_the_middle(larger):
    """They roll straight with a level axle, where the slope makes up for the difference: at larger/(2 slope).

    About there the conicity is that of equal radii, which includes the roll.
    """
    wheel, rail = (build_profile(table, "a", kind) for table, kind in ((cone(0.025), "wheel"), (round_head(), "rail")))
    equal = contact_report(wheel, rail, ContactSettings()).reference_conicity
    found = contact_report(wheel, rail, ContactSettings(), larger_left=larger)
    assert found.rolling_shift == pytest.approx(larger / (2.0 * 0.025), rel=1e-6)
    assert found.reference_conicity == pytest.approx(equal, rel=2e-3)
    mirrored = contact_report(wheel, rail, ContactSettings(), larger_left=-larger)
    assert mirrored.rolling_shift == pytest.approx(-found.rolling_shift, rel=1e-6)


def test_left_side_on_the_command_line(tmp_path):
    """Mirrored, S1002 on the left shifts the wheelset to the other side; the figure shows both sides."""
    left = json.loads(call("LMA", "CHN60", "--left-wheel", "S1002", "--left-rail", "60E1", "--json").stdout)
    right = json.loads(call("S1002", "60E1", "--left-wheel", "LMA", "--left-rail", "CHN60", "--json").stdout)
    assert (left["left_wheel"], left["left_rail"], left["wheel"]) == ("S1002", "60E1", "LMA")
    assert left["rolling_shift"] == pytest.approx(-right["rolling_shift"], abs=1e-7)
    assert left["conicity"][5] == pytest.approx(right["conicity"][5], rel=1e-6)
    path = tmp_path / "a.svg"
    result = call("LMA", "CHN60", "--left-larger", 2e-4, "-o", path)
    assert result.exit_code == 0, result.output
    assert re.search(r"equal rolling radii at +2\.\d+ mm", result.stdout)
    assert b"<!-- left wheel, drawn above its rail" in path.read_bytes()
