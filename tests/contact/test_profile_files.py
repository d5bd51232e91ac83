"""Profiles from SIMPACK, MiniProf and text files: what was written comes back; what is broken is named."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tiengine.contact.profile import Profile, load_profile
from tiengine.contact.table import ContactSettings, WheelRailPair
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario

DATA = Path(__file__).parents[1] / "data"
HEAD_Y = np.arange(-30.0, 31.0, 5.0) * 1e-3  # of tests/data/head.*
DIGITS = 6  # decimals of a millimetre that the tests write
ROUNDING = 0.5e-3 * 10.0**-DIGITS  # m


def simpack(points: np.ndarray, kind: str, *, per_metre: float = 1e3, keys: str = "") -> str:
    """Text of a .prw or .prr; points in mm."""
    decimals = DIGITS - round(np.log10(per_metre / 1e3))
    rows = "\n".join(f"{y:.{decimals}f}  {z:.{decimals}f}  1.0" for y, z in points * per_metre * 1e-3)
    header = f"header.begin\n  version = 1\n  type = {int(kind == 'wheel')}\nheader.end\n"
    spline = f"spline.begin\n  approx.smooth = 0.0\n  units.len.f = {per_metre}\n{keys}  point.begin\n"
    return f"! by a test\n{header}{spline}{rows}\n  point.end\nspline.end\n"


def miniprof(points: np.ndarray, kind: str) -> str:
    """Text of a .whl or .ban, z up; points in mm."""
    rows = "\n".join(f"{y:.{DIGITS}f}\t{-z:.{DIGITS}f}\t0.1" for y, z in points)
    return f'ProgramName=\n"Tilt="\nXYPoints={len(points)}\nColumnDef=X,Y,A\n\n{rows}\n'


def columns(points: np.ndarray, kind: str) -> str:
    """Two columns in metres."""
    return "\n".join(f"{y * 1e-3:.{DIGITS + 3}f}; {z * 1e-3:.{DIGITS + 3}f}" for y, z in points)


WRITERS = {
    "simpack-mm": (simpack, {"wheel": ".prw", "rail": ".prr"}),
    "simpack-m": (lambda p, kind: simpack(p, kind, per_metre=1.0), {"wheel": ".PRW", "rail": ".PRR"}),
    "simpack-mirrored": (
        lambda p, kind: simpack(p[::-1] * [-1, 1], kind, keys="mirror.y = 1\ninversion = 1\n"),
        {"wheel": ".prw", "rail": ".prr"},
    ),
    "simpack-shifted": (
        lambda p, kind: simpack(p * [1, -1] + [-5, 3], kind, keys="shift.y = 5\nshift.z = -3\nmirror.z = 1\n"),
        {"wheel": ".prw", "rail": ".prr"},
    ),
    "simpack-reversed": (lambda p, kind: simpack(p[::-1], kind), {"wheel": ".prw", "rail": ".prr"}),
    "miniprof": (miniprof, {"wheel": ".whl", "rail": ".ban"}),
    "miniprof-reversed": (lambda p, kind: miniprof(p[::-1], kind), {"wheel": ".WHL", "rail": ".BAN"}),
    "text-m": (columns, {"wheel": ".txt", "rail": ".dat"}),
    "text-reversed": (lambda p, kind: columns(p[::-1] * [1, -1], kind), {"wheel": ".txt", "rail": ".txt"}),
}


@pytest.fixture(scope="module")
def pair() -> WheelRailPair:
    return WheelRailPair(load_profile("LMA", "wheel"), load_profile("CHN60", "rail"), ContactSettings())


def in_millimetres(profile: Profile) -> np.ndarray:
    return np.stack([profile.y, profile.z], axis=1) * 1e3


@pytest.mark.parametrize("name", WRITERS)
def test_written_profiles_come_back(tmp_path, pair, name):
    """Points within the digits written, and the same contacts.

    The library's own lists have six digits, so nothing is rounded a second time: contacts differ by floating point
    alone, 1e-15 m over a slope's change of 2/m (R450 on R300) and a Newton end of 1e-10 m.
    """
    write, suffix = WRITERS[name]
    again = []
    for profile in (pair.wheel, pair.rail):
        path = tmp_path / f"profile{suffix[profile.kind]}"
        path.write_text(write(in_millimetres(profile), profile.kind))
        again.append(load_profile(path, profile.kind))
        np.testing.assert_allclose(again[-1].y, profile.y, atol=ROUNDING)
        np.testing.assert_allclose(again[-1].z, profile.z, atol=ROUNDING)
    u = np.linspace(-8e-3, 8e-3, 33)
    contacts, expected = WheelRailPair(*again, pair.settings).contacts(u, 0.0), pair.contacts(u, 0.0)
    np.testing.assert_allclose(contacts.gap, expected.gap, atol=1e-12)
    np.testing.assert_allclose(contacts.s_w, expected.s_w, atol=1e-8)
    np.testing.assert_allclose(contacts.tan_gamma, expected.tan_gamma, atol=1e-7)


@pytest.mark.parametrize("turned", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
def test_a_wheel_is_turned_by_its_flange(tmp_path, turned):
    """However its axes are drawn; the tape circle lies where the file says, the tread's height there is zero."""
    wheel = load_profile("S1002", "wheel")
    path = tmp_path / "wheel.txt"
    path.write_text(columns((in_millimetres(wheel) + np.array([70.0, 11.0])) * turned, "wheel"))
    again = load_profile(path, "wheel", tape_circle=0.07)
    np.testing.assert_allclose(again.y, wheel.y, atol=ROUNDING)
    np.testing.assert_allclose(again.z, wheel.z, atol=ROUNDING)


def test_hand_made_heads():
    """Shift, mirror, centimetres, a column of numbers before x, comments, z up."""
    for name in ("head.prr", "head.ban"):
        head = load_profile(DATA / name, "rail")
        np.testing.assert_allclose(head.y, HEAD_Y, atol=1e-15)
        np.testing.assert_allclose(head.z, 5.0 * HEAD_Y**2, atol=1e-15)  # y^2/200 mm


def test_hand_made_wheel():
    """The old style's free header; y from the flange's back."""
    wheel = load_profile(DATA / "wheel.whl", "wheel", tape_circle=0.07)
    assert (wheel.y[0], wheel.y[-1]) == pytest.approx((-0.070, 0.055))
    assert wheel.z.max() == pytest.approx(28.05e-3)  # 28 mm less the -0.05 mm at the tape circle
    with pytest.raises(InputError, match=r"flange's tip lies at y = 15.00 mm; .* state tape_circle"):
        load_profile(DATA / "wheel.whl", "wheel")
    with pytest.raises(InputError, match=r"flange's tip lies at y = -25.00 mm; -75 to -35 mm .* state tape_circle"):
        load_profile(DATA / "wheel.whl", "wheel", tape_circle=0.04)
    with pytest.raises(InputError, match="mirror = true: only for rails"):
        load_profile(DATA / "wheel.whl", "wheel", tape_circle=0.07, mirror=True)


def test_rotation_of_simpack(tmp_path):
    """A head turned by 0.1 rad in the file is turned back by its key, in degrees."""
    points = np.stack([HEAD_Y, 5.0 * HEAD_Y**2], axis=1) * 1e3
    c, s = np.cos(0.1), np.sin(0.1)
    keys = f"rotate = {np.degrees(0.1)}\nunits.ang.f = {180.0 / np.pi}\n"
    path = tmp_path / "turned.prr"
    path.write_text(simpack(points @ [[c, -s], [s, c]], "rail", keys=keys))
    np.testing.assert_allclose(load_profile(path, "rail").z, points[:, 1] * 1e-3, atol=3 * ROUNDING)


def test_simpack_bounds_and_least_distance(tmp_path):
    """Points outside and points too close are left out."""
    points = np.stack([HEAD_Y, 5.0 * HEAD_Y**2], axis=1) * 1e3
    doubled = np.repeat(points, 2, axis=0)
    keys = "point.dist.min = 0.1\nbound.y.min = -25\nbound.y.max = 25\nbound.z.min = 1\nbound.z.max = 0\n"
    path = tmp_path / "cut.prr"
    path.write_text(simpack(doubled, "rail", keys=keys))
    np.testing.assert_allclose(load_profile(path, "rail").y, HEAD_Y[1:-1], atol=1e-15)


def test_mirror_of_a_rail(tmp_path):
    """A head that reaches deeper on its outer side needs a word; y < 0 is inner then."""
    points = in_millimetres(load_profile("60E1", "rail"))
    deep = points[(points[:, 0] < 0.0) | (points[:, 1] < 10.0)]
    path = tmp_path / "rail.ban"
    path.write_text(miniprof(deep * [-1, 1], "rail"))
    with pytest.raises(InputError, match=r"9\.9 mm below its top at negative y, .* 26\.3 mm .* state mirror = true"):
        load_profile(path, "rail")
    mirrored = load_profile(path, "rail", mirror=True)
    np.testing.assert_allclose(in_millimetres(mirrored), deep, atol=1e3 * ROUNDING)
    assert load_profile(path, "rail", mirror=False).z[-1] == pytest.approx(deep[0, 1] * 1e-3)


def test_overhanging_sides_are_cut_and_noise_is_smoothed(tmp_path):
    """A measured head: 0.01 mm rounding, points on vertical and overhanging sides, a zigzag there.

    Resampling follows the points within their noise; where it counts, above 12 mm depth, within 0.02 mm.
    """
    rail = load_profile("CHN60", "rail")
    points = in_millimetres(rail)[::5]
    side = np.linspace(26.5, 40.0, 28)[:, None] * [0.0, 1.0]
    lean = np.linspace(0.0, 3.0, 28)[:, None] * [1.0, 0.0]
    left, right = (points[[0]] * [1, 0] + side + lean)[::-1], points[[-1]] * [1, 0] + side - lean
    noisy = np.concatenate([left, points, right])
    noisy = np.round(noisy + np.random.default_rng(3).normal(0.0, 4e-3, noisy.shape), 2)
    path = tmp_path / "measured.ban"
    path.write_text(miniprof(noisy, "rail"))
    head = load_profile(path, "rail", smoothing=3e-4)
    assert (np.diff(head.y) > 0.0).all()
    y = np.linspace(-34.0, 34.0, 200) * 1e-3
    np.testing.assert_allclose(head.height(y), rail.height(y), atol=0.02e-3)
    assert head.z[0] > 16e-3  # the gauge is still met there
    assert head.z[-1] > 16e-3


def test_measured_wheel_is_cut_beside_its_tread(tmp_path):
    """From the flange's back over a stray point at its tip to the rim's face: what the rail may meet is kept.

    Noise of 4 um, rounded to 0.01 mm, smoothed over 0.3 mm: within 0.02 mm where the wheel runs.
    """
    wheel = load_profile("LMA", "wheel")
    points = in_millimetres(wheel)[::3]
    tip = int(np.argmax(points[:, 1]))
    stray = points[[tip]] + [[-0.6, -0.2]]
    back = np.stack([np.full(100, -70.0), np.linspace(-22.0, 8.5, 100)], axis=1)
    rim = np.stack([np.full(40, 65.05), np.linspace(-8.0, -20.0, 40)], axis=1)
    noisy = np.concatenate([back, points[: tip + 1], stray, points[tip + 1 :], rim]) + np.array([70.0, 0.0])
    noisy = np.round(noisy + np.random.default_rng(5).normal(0.0, 4e-3, noisy.shape), 2)
    path = tmp_path / "measured.whl"
    path.write_text(miniprof(noisy, "wheel"))
    found = load_profile(path, "wheel", tape_circle=0.07, smoothing=3e-4)
    assert found.span[0] < -53e-3
    assert found.span[1] > 63e-3
    y = np.linspace(-50.0, 58.0, 300) * 1e-3
    np.testing.assert_allclose(found.height(y), wheel.height(y), atol=0.02e-3)


def test_kinks_are_refused_where_the_wheel_runs(tmp_path):
    """A point 0.2 mm off on a rail: 2 atan(0.18 mm, smoothed, over the 0.8 mm left of 1 mm of curve), 26 deg."""
    points = in_millimetres(load_profile("60E1", "rail"))
    top, side = int(np.argmin(points[:, 1])), 3
    for i, column, is_refused in ((top + 40, 1, True), (side, 0, False)):
        bent = points.copy()
        bent[i, column] -= 0.02 if column == 0 else 0.2
        path = tmp_path / "bent.csv"
        path.write_text("# a comment\n" + "\n".join(f"{y},{z}" for y, z in bent))
        if is_refused:
            message = f"line {i + 2}: a kink of 2[67] deg within 1 mm at y = {bent[i, 0]:.2f} mm"
            with pytest.raises(InputError, match=re.escape("bent.csv") + ".*" + message):
                load_profile(path, "rail")
        else:
            load_profile(path, "rail")


GOOD = (DATA / "head.prr").read_text()
BAN = (DATA / "head.ban").read_text()


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.prr", GOOD.replace("type    = 0", "type    = 1"), "line 4: header type = 1: must be 0 for a rail"),
        ("a.prr", GOOD.replace("point.end", ""), "line 28: ends without point.begin ... point.end"),
        ("a.prr", GOOD[: GOOD.index("2.5  ")], "ends without point.begin ... point.end; is the file cut off?"),
        ("a.prr", GOOD.replace("0.45        1.0", "deep"), "line 14 is '-2.0           deep'; y, z and a weight"),
        ("a.prr", GOOD.replace("0.3125      1.0", "nan"), r"line 15: point 2 is \(-1.5, nan\); finite"),
        ("a.prr", GOOD.replace("1.0e+02", "0"), "line 10: units.len.f = 0: must be > 0"),
        ("a.prr", GOOD.replace("1.0e+02", "wide"), "line 10: units.len.f = 'wide': must be a number"),
        ("a.prr", GOOD.replace("1.0e+02", "1.0"), "6000 mm wide; 20 to 400 mm expected: are its units right"),
        ("a.prr", GOOD.replace("0.3125      1.0", "1e300"), "line 15: z lies 1e[+]301 mm from the other points'"),
        ("a.prr", GOOD.replace("= -1.0  ", "= __import__('os')"), r"line 8: shift.y = \"__import__"),
        ("a.ban", BAN.replace("XYPoints=13", "XYPoints=14"), "line 19: 13 points; XYPoints = 14 are expected"),
        ("a.ban", BAN.replace("N,X,Y,A", "N,X"), "ColumnDef = 'N,X': must name X and Y"),
        ("a.ban", BAN.replace("0.0  0.0   0.0", "0.0"), "line 13 is '7   0.0'; 3 or more numbers"),
        ("a.ban", BAN.replace("0.0  0.0   0.0", "gauge corner"), "line 13 is .*; 3 or more numbers"),
        ("a.ban", BAN[: BAN.index("5 -10")].replace("13", "4"), "4 points; at least 10 pairs expected"),
        ("a.ban", "", "0 points; at least 10 pairs expected"),
        ("a.txt", "0 0\n1\0 0\n", "line 2: not a text file"),
        ("a.txt", "\n".join(f"{i}, {i}" for i in range(20)) + "\n19, 0", "line 21: y goes from 19 to 19 at point 21"),
        ("a.txt", "\n".join(f"{-i}, 0" for i in (0, 1, 2, 1.5, 4)), "line 4: .* point 4; y must decrease"),
        ("a.txt", "\n".join(f"{i}, 0" for i in range(0, 5000, 100)), "4900 mm wide; 20 to 400 mm expected"),
    ],
)
def test_broken_files_are_named(tmp_path, name, text, message):
    """File, line and reason, in one line."""
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=f"rail profile .*{name}.*{message}") as failure:
        load_profile(path, "rail")
    assert "\n" not in str(failure.value)


def test_huge_file_is_refused(tmp_path):
    """Its first 10 MB are all that is read."""
    path = tmp_path / "huge.ban"
    path.write_bytes(b"0 0\n" * 2_500_001)
    with pytest.raises(InputError, match="larger than 10 MB"):
        load_profile(path, "rail")


@pytest.mark.parametrize("points", ["0 0", "\n".join(f"{y} {z}" for y, z in [*enumerate(range(12)), (3, 1e300)])])
def test_bad_points_in_a_scenario(points):
    """A table's points pass the same door as a file's."""
    table = {"train": {"vehicles": ["CRH380A_v2"], "speed_kmh": 200.0, "distance": 50.0}}
    table["track"] = {"rail_profile": {"points": points}}
    with pytest.raises(InputError, match=r"track.rail_profile: 1?[13] points up to .* mm; at least 10 finite pairs"):
        load_scenario(table)


def test_scenario_takes_files(tmp_path):
    """Relative to the scenario, with the keys of a table; the resolved scenario needs the files no more."""
    wheel, rail = load_profile("S1002", "wheel"), load_profile("60E1", "rail")
    (tmp_path / "worn.whl").write_text(miniprof(in_millimetres(wheel) + np.array([70.0, 0.0]), "wheel"))
    (tmp_path / "worn.prr").write_text(simpack(in_millimetres(rail), "rail"))
    (tmp_path / "my.toml").write_text(
        '[train]\nvehicles = ["CRH380A_v2"]\nspeed_kmh = 200\ndistance = 50\n'
        'wheel_profile = {like = "worn.whl", tape_circle = 0.07, smoothing = 1e-4}\n'
        '[track]\nrail_profile = "worn.prr"\n'
    )
    scenario = load_scenario(tmp_path / "my.toml")
    (tmp_path / "worn.whl").unlink()
    parts = load_scenario(scenario).parts
    np.testing.assert_allclose(parts.wheel.y, wheel.y, atol=ROUNDING)
    np.testing.assert_allclose(parts.rail_profile.z, rail.z, atol=ROUNDING)
    assert parts.wheel.smoothing == 1e-4
    with pytest.raises(InputError, match=r"train.wheel_profile = 'worn.whl': no such file"):
        load_scenario(tmp_path / "my.toml")
