"""Profiles: smoothness against the arcs they were drawn with, cant, gauge, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.contact.profile import Profile, load_profile, profile_names
from tiengine.parameters.errors import InputError

ROUNDING = 0.5e-9  # of the library's lists, 1e-6 mm


def curvature(profile: Profile, y: np.ndarray) -> np.ndarray:
    """Curvature of the drawn curve [1/m], positive where the centre lies below."""
    return profile.height(y, 2) / (1.0 + profile.height(y, 1) ** 2) ** 1.5


@pytest.mark.parametrize(
    ("name", "kind", "first", "last", "radius"),
    [
        ("CHN60", "rail", -9.5, 9.5, 0.300),
        ("CHN60", "rail", -24.5, -10.5, 0.080),
        ("CHN60", "rail", -34.0, -26.0, 0.013),
        ("60E1", "rail", -9.5, 9.5, 0.300),
        ("60E1", "rail", 11.0, 25.0, 0.080),
        ("LMA", "wheel", -10.0, 3.5, 0.450),
        ("LMA", "wheel", -28.0, -11.5, 0.090),
        ("LMA", "wheel", -37.5, -29.0, 0.014),
        ("LMA", "wheel", -52.0, -41.0, -0.015),
        ("S1002", "wheel", -38.0, -35.5, 0.013),
    ],
)
def test_curvature_of_the_arcs(name: str, kind: str, first: float, last: float, radius: float) -> None:
    """Away from joints the curvature is the arc's, without the noise of a rounded list.

    An interpolating spline through CHN60's list is off by up to 0.8/m; the smoothing spline leaves the
    rounding (uniform, 0.29e-9 m) at l = 50 um: 4 sigma = 4 * 0.3 * 0.29e-9 * sqrt(0.05e-3)/(50e-6)^2.5 =
    0.14/m; sparser lists (0.1 mm) are interpolated, with 4 * 2.45 * 0.29e-9/(1e-4)^2 = 0.28/m.
    """
    y = np.linspace(first, last, 400) * 1e-3
    spacing = 1e-4 if kind == "wheel" else 5e-5
    noise = 0.28 if spacing == 1e-4 else 0.14
    np.testing.assert_allclose(curvature(load_profile(name, kind), y), 1.0 / radius, atol=noise)


@pytest.mark.parametrize(("name", "kind"), [("CHN60", "rail"), ("60E1", "rail"), ("S1002", "wheel")])
def test_smoothing_stays_within_rounding_and_joints(name: str, kind: str) -> None:
    """The smooth curve misses no point by more than 64/m * l^2 * 0.2 = 0.03 um, at the R80/R13 joint."""
    profile = load_profile(name, kind)
    assert np.abs(profile.height(profile.y) - profile.z).max() < 30e-9


def test_crown_and_gauge_of_the_canted_rail() -> None:
    """CHN60 at 1:40, gauge 1435 mm at 16 mm below the top: the crown is 752.548 mm from the centre."""
    rail = load_profile("CHN60", "rail").canted(0.025)
    y_r = 0.7175 - rail.inner_side(0.016)
    assert y_r == pytest.approx(0.752548, abs=0.5e-6)  # six printed digits
    assert float(rail.height(0.0)) == pytest.approx(0.0, abs=2 * ROUNDING)
    assert float(rail.height(0.0, 1)) == pytest.approx(-0.025, abs=2e-5)  # rounding over the spacing
    # the top of the canted R300 is R sin(atan c) outside the crown
    top = np.sin(np.arctan(0.025)) * 0.3
    assert float(rail.height(top, 1)) == pytest.approx(0.0, abs=2e-5)


def test_canting_a_rail_is_a_rotation() -> None:
    """Distances between points stay; a rail flagged as canted is only moved to its crown."""
    rail = load_profile("60E1", "rail")
    canted = rail.canted(0.025)
    assert np.hypot(np.diff(canted.y), np.diff(canted.z)).sum() == pytest.approx(
        np.hypot(np.diff(rail.y), np.diff(rail.z)).sum(), rel=1e-12
    )
    shifted = Profile("moved", "rail", canted.y + 7.5e-3, canted.z - 0.1e-3, has_cant=True).canted(0.025)
    # the slope at the crown is known to 2e-5 by rounding, on R300: 6 um along the head
    np.testing.assert_allclose(shifted.y, canted.y, atol=6e-6)
    np.testing.assert_allclose(shifted.z, canted.z, atol=6e-6 * 0.025)


def test_overhanging_side_is_cut() -> None:
    """At 1:10 the 1:20 inner side overhangs; the head is kept."""
    canted = load_profile("CHN60", "rail").canted(0.1)
    assert (np.diff(canted.y) > 0.0).all()
    assert canted.y[0] < -30e-3


def test_normal_offset_of_an_arc() -> None:
    """On R13 a point 4 mm along the tangent lies R - sqrt(R^2 - e^2) below it."""
    rail = load_profile("CHN60", "rail")
    expected = 0.013 - np.sqrt(0.013**2 - 0.004**2)
    y = np.array([-30.5e-3, -31e-3])
    # the joints R80/R13 (at 25.3 mm) and R13/side (35.4 mm) are more than 4 mm along the arc away
    turned = 1e-5 * 4e-3  # the tangent is known to the rounding over the spacing
    for eta in (4e-3, -4e-3):
        np.testing.assert_allclose(rail.normal_offset(y, eta), expected, atol=turned)


def test_library() -> None:
    """The four presets."""
    assert profile_names() == ["60E1", "CHN60", "LMA", "S1002"]


def test_reads_a_file_of_two_columns(tmp_path) -> None:
    """Commas, semicolons and blanks; comments; millimetres."""
    path = tmp_path / "rail.txt"
    path.write_text("# y z\n" + "\n".join(f"{y}; {0.01 * y * y} # point" for y in range(-20, 21)))
    profile = load_profile(path, "rail")
    assert profile.y[0] == pytest.approx(-0.020)
    assert profile.z[-1] == pytest.approx(0.004)


GOOD = [(float(y), 0.01 * y * y) for y in range(-10, 11)]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (GOOD[:9], "at least 10 pairs expected"),
        ([(y, z, 0.0) for y, z in GOOD], "line 1 is '-10.0,1.0,0.0'; two numbers, y and z in mm, expected"),
        ([(y,) for y, _z in GOOD], "line 1 is '-10.0'; two numbers"),
        ([*GOOD[:5], ("left", "up"), *GOOD[5:]], "line 6 is 'left,up'; two numbers"),
        ([*GOOD[:5], GOOD[3], *GOOD[5:]], "point 6; y must increase from point to point"),
        ([*GOOD[:5], (-5.5, float("nan")), *GOOD[5:]], "point 6 is .*; finite numbers expected"),
    ],
)
def test_bad_files_are_refused(tmp_path, rows, message: str) -> None:
    """One line that names the profile, the place and the rule."""
    path = tmp_path / "bad.csv"
    path.write_text("\n".join(",".join(str(field) for field in row) for row in rows))
    with pytest.raises(InputError, match=message) as failure:
        load_profile(path, "wheel")
    assert "\n" not in str(failure.value)
    assert "bad.csv" in str(failure.value)


def test_unknown_name_suggests_a_preset() -> None:
    """A slip of the pen is answered with the nearest name."""
    with pytest.raises(InputError, match="rail profile 'CHN6O': neither a file nor a preset; did you mean 'CHN60'"):
        load_profile("CHN6O", "rail")


def test_gauge_deeper_than_the_points_is_refused() -> None:
    """A head cut off 10 mm below its top has no gauge face at 14 mm."""
    rail = load_profile("60E1", "rail")
    keep = rail.z < 10e-3
    with pytest.raises(InputError, match="below its top on the inner side; gauge_depth = 14 mm"):
        Profile("cut", "rail", rail.y[keep], rail.z[keep]).inner_side(14e-3)
