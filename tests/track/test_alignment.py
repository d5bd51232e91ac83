"""Lines with rounded corners, elements and rows of an alignment, and their rules."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.track.alignment import Line

ARC = {"kind": "arc", "length": 200.0, "radius": 1000.0, "cant_mm": 120.0}
STRAIGHT = {"kind": "straight", "length": 50.0}
RAMP = {"kind": "transition", "length": 100.0}


def scenario(*elements: dict[str, Any], **track: Any) -> Scenario:
    """The default train at 90 km/h on a line."""
    given = {"alignment": elements} if elements else {}
    return load_scenario({"train": {"vehicles": ["CRH2"], "speed_kmh": 90.0, "distance": 50.0}, "track": given | track})


def test_a_rounded_line_is_the_convolution_with_the_bell():
    """Against quadrature of the convolution; 4000 points of a smooth bell leave 1e-7 of the largest value."""
    x, f = np.array([0.0, 40.0, 100.0, 130.0]), np.array([1.0, 1.0, -2.0, 0.5])
    line, half = Line(x, f, 5.0), 5.0
    xi = (np.arange(4000) + 0.5) / 2000.0 - 1.0
    bell = 15.0 / 16.0 * (1.0 - xi**2) ** 2 / 2000.0
    where = np.linspace(-20.0, 150.0, 341)
    smooth = np.interp(where[:, None] + half * xi, x, f) @ bell
    assert line(where) == pytest.approx(smooth, abs=1e-6)


def test_a_line_has_continuous_second_derivatives_and_exact_integrals():
    x, f = np.array([0.0, 3.0, 100.0]), np.array([0.0, 1.0, -2.0])  # the first two corners are 3 m apart
    line = Line(x, f, 5.0)
    ends = line.value.x[1:-1]
    for derivative, size in ((0, 1.0), (1, 0.4), (2, 0.3)):
        jump = line(ends + 1e-9, derivative) - line(ends - 1e-9, derivative)
        assert np.abs(jump).max() < 1e-8 * size + 1e-9  # its slope times 2e-9
    y = np.linspace(-30.0, 120.0, 150_001)
    for function, integral in ((line.value, line.integral), (line.integral, line.twice)):
        trapezoid = np.sum(0.5 * np.diff(y) * (function(y[1:]) + function(y[:-1])))
        assert integral(y[-1]) - integral(y[0]) == pytest.approx(trapezoid, rel=1e-7)


def test_elements_give_curvature_cant_and_gradient():
    line = scenario(STRAIGHT, RAMP, ARC, RAMP, {**ARC, "radius": -500.0, "cant_mm": -80.0, "gradient_permille": 12.5})
    line = line.track.line
    assert line is not None
    kappa, _, grade = line.lines
    assert kappa(np.array([0.0, 100.0, 250.0, 400.0, 550.0])) == pytest.approx([0.0, 5e-4, 1e-3, -5e-4, -2e-3])
    assert line.cant(np.array([100.0, 250.0, 550.0])) == pytest.approx([0.06, 0.12, -0.08], rel=1e-3)  # roll is linear
    assert grade(np.array([400.0, 550.0, 700.0])) == pytest.approx([0.0, 6.25e-3, 12.5e-3])


def test_a_file_gives_the_same_line_and_is_stored_with_the_scenario(tmp_path: Path):
    file = tmp_path / "line.csv"
    file.write_text("# surveyed\nchainage; radius; cant_mm\n50; inf; 0\n150; 1000; 120\n350; 1000; 120\n")
    read = load_scenario(scenario(), {"track.alignment_file": str(file)})
    file.unlink()
    again = load_scenario(dict(_tables(to_toml(read))))
    for each in (read, again):
        assert each.track.alignment_file is None
        assert each.track.line.lines[0](np.array([100.0, 300.0])) == pytest.approx([5e-4, 1e-3])


def _tables(text: str) -> dict[str, Any]:
    from tiengine.parameters.input_files import parse_toml

    return parse_toml(text, "scenario")


@pytest.mark.parametrize(
    ("elements", "message"),
    [
        ([STRAIGHT, ARC], r"track.alignment\[1\] \(arc of radius 1000 m\): follows straight with another curvature"),
        ([RAMP, ARC], r"track.alignment\[0\] \(transition\): must lie between"),
        ([ARC, RAMP], r"track.alignment\[1\] \(transition\): must lie between"),
        ([ARC, RAMP, RAMP, STRAIGHT], r"track.alignment\[2\] \(transition\): follows a transition"),
        ([{**ARC, "radius": -249.0}], r"track.alignment\[0\].*radius 249 m; must be at least 250 m"),
        ([{**ARC, "cant_mm": 210.0}], r"track.alignment\[0\].*cant 210 mm; must be within -200 and 200"),
        ([STRAIGHT, {**RAMP, "length": 40.0}, ARC], r"track.alignment\[1\].*twist 3 mm/m; must be at most 2.5"),
        ([{**ARC, "gradient_permille": 51.0}], r"track.alignment\[0\].*gradient 51 permille"),
        (
            [STRAIGHT, {**STRAIGHT, "length": 10.0, "gradient_permille": 25.0}],
            r"track.alignment\[1\].*radius 400 m; must be at least 500 m",
        ),
        ([{"kind": "arc", "length": 100.0}], r"track.alignment\[0\].*an arc needs its radius"),
        ([{**STRAIGHT, "radius": 500.0}], r"track.alignment\[0\].*a straight has no radius"),
        ([{**RAMP, "cant_mm": 5.0}], r"track.alignment\[0\].*takes its cant from"),
        ([{**ARC, "length": 0.5}], r"track.alignment\[0\].length = 0.5"),
        ([{**ARC, "cant_mm": -200.0, "radius": 300.0}], "unbalanced acceleration of"),
    ],
)
def test_a_bad_alignment_is_refused_in_one_line(elements: list[dict[str, Any]], message: str):
    with pytest.raises(InputError, match=message) as error:
        scenario(*elements)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty; must have a head"),
        ("chainage,curvature\n", "no rows below the head"),
        ("chainage,cant_mm\n0,1\n", "must have one of the columns 'curvature' and 'radius'"),
        ("curvature\n0\n", "no column 'chainage'"),
        ("chainage,curvature,cant\n0,0,0\n", "line 1: unknown column 'cant'"),
        ("chainage,curvature\n0,0\n10,x\n", "line 3: must have 2 numbers"),
        ("chainage,curvature\n0,0\n0.5,0\n", r"alignment_rows\[1\]: chainage 0.5 m after 0 m; must grow by 1 m"),
        ("chainage,curvature\n0,0\n10,nan\n", r"alignment_rows\[1\]\[1\] = nan: must be a finite number"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path: Path, text: str, message: str):
    file = tmp_path / "line.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=message) as error:
        scenario(alignment_file=str(file))
    assert "\n" not in str(error.value)
