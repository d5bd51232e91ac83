"""Tracks from a file: splines through known points and the errors of bad input."""

import numpy as np
import pytest

from tiengine.irregularity.irregularity import IrregularityParams, make_irregularity
from tiengine.parameters.errors import InputError

FAR = -1e9  # the irregularity has begun long before any chainage of these tests
MEASURED = "x,z_v,theta\n# by hand\n" + "".join(f"{x},{0.001 * (x % 3)},{1e-4 * x}\n" for x in range(0, 100, 2))


def test_measured_series(tmp_path):
    """Through the points away from the ends, zero with zero slope outside, faded over the taper."""
    path = tmp_path / "track.csv"
    path.write_text(MEASURED)
    track_ = make_irregularity(IrregularityParams(file=str(path), taper=10.0, scale=2.0), FAR)
    x = np.arange(10.0, 88.0, 2.0)
    sampled = track_.sample(x)
    assert sampled[:, 0] == pytest.approx(2 * 0.001 * (x % 3), abs=1e-15)
    assert sampled[:, 2] == pytest.approx(2e-4 * x, rel=1e-12)
    assert not sampled[:, [1, 3]].any()
    assert not track_.sample(np.array([-1e6, -0.1, 0.0, 98.0, 98.1, 1e6])).any()
    assert track_.shortest_wavelength == 4.0  # two points a wave
    eps = 1e-4
    inside = np.array([3.0, 50.3, 93.0])
    difference = (track_.sample(inside + eps) - track_.sample(inside - eps))[:, :4] / (2 * eps)
    assert track_.sample(inside)[:, 4:] == pytest.approx(difference, abs=1e-9)  # eps^2 z''' = 1e-8 x 0.01


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "line 1: must name the columns"),
        ("x,zv\n0,0\n", r"line 1: column 'zv': unknown; did you mean 'z_v'\?"),
        ("x,x,z_v\n", "line 1: a column is named twice"),
        ("z_v,theta\n0,0\n", "line 1: needs column 'x'"),
        (MEASURED + "98.5,low,0\n", "line 53: z_v = 'low': must be a finite number"),
        (MEASURED + "98.5,nan,0\n", "line 53: z_v has no value up to line 53: must not lack values at an end"),
        (MEASURED + "98.5,0\n", "line 53: 2 values; the header names 3 columns"),
        (MEASURED + "97,0,0\n", "line 53: x = 97: must be > the x before it"),
        ("x,z_v\n0,0\n1,0\n", "line 3: 2 points; must have at least 4 for a spline"),
    ],
)
def test_bad_file_is_refused(tmp_path, text, reason):
    """One line that names file, line and reason."""
    path = tmp_path / "track.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=f"track.csv, {reason}"):
        make_irregularity(IrregularityParams(file=str(path)), 0.0)


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"irregularity.file = .*none.csv': cannot be read \(No such file"):
        make_irregularity(IrregularityParams(file=str(tmp_path / "none.csv")), 0.0)
