"""Profile files as users have them, thinned: each is read rightly or refused in one line that names the key to state.

Most wheels of ``tests/data/profiles`` are one made-up wheel, that of ``origin_ok.txt``, in different formats.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

from tiengine.contact.conicity import equivalent_conicity
from tiengine.contact.profile import Profile, load_profile
from tiengine.contact.table import ContactSettings, WheelRailPair
from tiengine.parameters.errors import InputError, InputNote
from tiengine.scenario.scenario import load_scenario

DATA = Path(__file__).parents[1] / "data" / "profiles"

SAME_WHEEL = {
    "count_first.txt": "line 1 is read as the number of points",
    "decimal_comma.txt": "commas are read as decimal points",
    "decimal_comma_tab.txt": "commas are read as decimal points",
    "duplicate_point.txt": r"line 37: 1 repeated point\(s\) left out",
    "excel_index.csv": "a first column that counts the points is left out",
    "exponent_D.txt": None,
    "gensys_comments.txt": None,
    "header_row.csv": "line 1 is read as a header row",
    "header_row_units.csv": "line 1 is read as a header row",
    "latin1.txt": None,
    "metres.txt": None,
    "mirrored_y.txt": None,
    "old_header_unquoted.whl": r"line 8: 1 row\(s\) of numbers read as part of the header",
    "origin_ok.txt": None,
    "percent_comment.txt": None,
    "reversed.txt": None,
    "semicolon.csv": None,
    "tabs_crlf.txt": None,
    "trailing_blank_bom.txt": None,
    "utf16.txt": None,
    "z_up.txt": None,
}
OTHER = {  # name: kind, note
    "commented_points.ban": ("rail", r"10 point\(s\) quoted out in the file are left out"),
    "row_comment.ban": ("rail", "line 200: words behind the numbers are left out"),
    "rail_field_corner_R4.txt": ("rail", "line 413: a kink of 14 deg .* wheel and rail do not touch there"),
    "rail_field_corner_R6.txt": ("rail", None),
    "wheel_flange_tip_R4.txt": ("wheel", "line 458: a kink of 14 deg .* wheel and rail do not touch there"),
    "wheel_flange_tip_R6.txt": ("wheel", None),
    "simpack_deg_mm.prw": ("wheel", None),
    "simpack_deg_neg.prw": ("wheel", None),
    "two_cones.txt": ("wheel", None),
}
REFUSED = {  # name: kind, message, keys that make it right
    "flange_back_origin.whl": ("wheel", "tip lies at y = 14.90 mm; .* state tape_circle", {"tape_circle": 0.07}),
    "origin_off_5mm.txt": ("wheel", "z = -0.132 mm at y = 0, .* state tape_circle", {"tape_circle": -0.005}),
    "rail_canted_inner_negative.txt": ("rail", "1:44 towards negative y: state has_cant = true", {"has_cant": True}),
    "rail_canted_inner_positive.txt": (
        "rail",
        "1:44 towards positive y: state has_cant = true and mirror = true",
        {"has_cant": True, "mirror": True},
    ),
    "inches.txt": ("wheel", "5.10236 mm wide; 50 to 400 mm expected: are its units right", None),
    "nan_row.txt": ("wheel", r"line 20: point 20 is \(nan, nan\); finite numbers expected", None),
}


def read(name: str, kind: str, note: str | None = None, **stated: object) -> Profile:
    """The profile, read with exactly the note that is expected."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        profile = load_profile(DATA / name, kind, **stated)
    assert [warning.category for warning in found] == [InputNote] * (note is not None)
    if note is not None:
        assert re.search(rf"{name}': {note}", str(found[0].message))
    return profile


def test_every_case_is_walked() -> None:
    """No file of the folder is left out."""
    assert {path.name for path in DATA.iterdir()} == set(SAME_WHEEL) | set(OTHER) | set(REFUSED)


@pytest.mark.parametrize("name", SAME_WHEEL)
def test_the_same_wheel_in_other_words(name: str) -> None:
    """From the flange's root outward, every third point: the sagitta of R13 between points 1.2 mm apart is 14 um."""
    y = np.linspace(-33.0, 55.0, 400) * 1e-3
    expected = read("origin_ok.txt", "wheel").height(y)
    np.testing.assert_allclose(read(name, "wheel", SAME_WHEEL[name]).height(y), expected, atol=14e-6)


@pytest.mark.parametrize("name", OTHER)
def test_others_are_read(name: str) -> None:
    """With the note on what was done."""
    kind, note = OTHER[name]
    assert read(name, kind, note).y.size > 90


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_the_key(name: str) -> None:
    """One line with file, reason and key; with the key stated the profile is read."""
    kind, message, stated = REFUSED[name]
    with pytest.raises(InputError, match=f"{kind} profile .*{name}.*{message}") as failure:
        load_profile(DATA / name, kind)
    assert "\n" not in str(failure.value)
    if stated is not None:
        read(name, kind, **stated)


def conicity(wheel: Profile, rail: Profile) -> float:
    """Equivalent conicity at 3 mm."""
    return float(equivalent_conicity(WheelRailPair(wheel, rail, ContactSettings()), [3e-3])[0])


def test_stated_placements_give_the_right_contact() -> None:
    """Both canted rails are one rail, 0.0175 (0.097 the wrong way round); the shifted wheel is the wheel.

    Lists have 1e-4 mm every 0.4 mm, a slope of 2.5e-4: 1 % of the conicity of 1:57.
    """
    wheel, rail = read("origin_ok.txt", "wheel"), load_profile("CHN60", "rail")
    canted = [
        read("rail_canted_inner_negative.txt", "rail", has_cant=True),
        read("rail_canted_inner_positive.txt", "rail", has_cant=True, mirror=True),
    ]
    assert conicity(wheel, canted[0]) == pytest.approx(0.0175, rel=0.01)
    assert conicity(wheel, canted[1]) == pytest.approx(conicity(wheel, canted[0]), rel=1e-6)
    expected = conicity(wheel, rail)
    for name, tape_circle in (("origin_off_5mm.txt", -0.005), ("flange_back_origin.whl", 0.07)):
        assert conicity(read(name, "wheel", tape_circle=tape_circle), rail) == pytest.approx(expected, rel=0.02)
    with pytest.raises(InputError, match="state mirror = true if that is at positive y"):
        load_profile(DATA / "rail_canted_inner_positive.txt", "rail", has_cant=True)


def test_corners_that_do_not_touch_do_not_matter() -> None:
    """A field corner of R4 or R6 and a flange tip of R4 or R6 leave the conicity within 1e-4: resampling."""
    wheel, rail = read("origin_ok.txt", "wheel"), load_profile("CHN60", "rail")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", InputNote)
        rails = [load_profile(DATA / f"rail_field_corner_R{radius}.txt", "rail") for radius in (4, 6)]
        wheels = [load_profile(DATA / f"wheel_flange_tip_R{radius}.txt", "wheel") for radius in (4, 6)]
    assert conicity(wheel, rails[0]) == pytest.approx(conicity(wheel, rails[1]), rel=1e-4)
    assert conicity(wheels[0], rail) == pytest.approx(conicity(wheels[1], rail), rel=1e-4)


@pytest.mark.parametrize(("gauge", "clearance"), [(1.400, -9.4), (1.520, 50.6), (1.676, 128.6)])
def test_a_gauge_that_does_not_fit(gauge: float, clearance: float) -> None:
    """Held against the flange 10 mm below the tape circle, 8.1 mm at 1435 mm; half the difference elsewhere."""
    wheel, rail = load_profile("LMA", "wheel"), load_profile("CHN60", "rail")
    message = f"gauge = {gauge:g} m does not fit .* {clearance} mm between flange and gauge face, .* state track.gauge"
    with pytest.raises(InputError, match=message):
        WheelRailPair(wheel, rail, ContactSettings(gauge=gauge))
    for fitting in (1.425, 1.480):  # narrow and widened, with 3 and 31 mm
        WheelRailPair(wheel, rail, ContactSettings(gauge=fitting))


def test_a_search_that_finds_nothing_is_a_message() -> None:
    """A cone 20 mm beside the rail: no contact at all, formerly an empty maximum."""
    y = np.linspace(-10e-3, 10e-3, 50)
    cone = Profile("cone", "wheel", y, -0.05 * y)
    with pytest.raises(InputError, match=r"'cone' on rail 'CHN60': no contact inside both profiles at u = 0\.00 mm"):
        WheelRailPair(cone, load_profile("CHN60", "rail"), ContactSettings(gauge=1.9)).contacts(0.0, 0.0)


def test_a_scenario_takes_and_refuses_the_same(tmp_path: Path) -> None:
    """Keys in the profile's table; lines of the file in messages; the resolved scenario needs no file."""
    train = {"vehicles": ["CRH380A_v2"], "speed_kmh": 200.0, "distance": 50.0}

    def scenario(**profile: object):
        return load_scenario({"train": {**train, "wheel_profile": profile}})

    off = str(DATA / "origin_off_5mm.txt")
    with pytest.raises(InputError, match=r"train.wheel_profile = '.*5mm.txt': z = -0.132 mm at y = 0, .* tape_circle"):
        scenario(like=off)
    found = scenario(like=off, tape_circle=-0.005)
    assert load_scenario(found).parts.wheel.y[0] == pytest.approx(-69.9e-3)
    wheel = load_profile("LMA", "wheel")
    bent = np.stack([wheel.y, wheel.z], axis=1) * 1e3
    row = int(np.argmin(np.abs(bent[:, 0] - 5.0)))
    bent[row, 1] += 0.2
    (tmp_path / "bent.txt").write_text("\n".join(f"{y:.4f} {z:.4f}" for y, z in bent))
    with pytest.raises(InputError, match=rf"line {row + 1}: a kink of .* or allow_kinks = true"):
        scenario(like=str(tmp_path / "bent.txt"))
    scenario(like=str(tmp_path / "bent.txt"), smoothing=5e-4)
    with pytest.warns(InputNote, match="kinks are allowed"):
        scenario(like=str(tmp_path / "bent.txt"), allow_kinks=True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("-10,5;1,5;2,5\n" * 12, "line 1 is '-10,5;1,5;2,5'; two numbers"),
        ("1,2,3,4\n" * 12, "line 1 is '1,2,3,4'; two numbers, .* if commas are decimal"),
        ("24\n" + "\n".join(f"{i} {i}" for i in range(20)), "line 1: announces 24 points; 20 follow"),
        ("-1o.5 3\n" + "\n".join(f"{i} {i}" for i in range(20)), "line 1 is '-1o.5 3'; two numbers"),
        ("z1 3\n" + "\n".join(f"{i} {i}" for i in range(20)), "line 1 is 'z1 3'; two numbers"),
    ],
)
def test_ambiguous_rows_are_refused(tmp_path: Path, text: str, message: str) -> None:
    """Neither guessed nor dropped."""
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(InputError, match=message):
        load_profile(tmp_path / "a.txt", "rail")


def test_header_rows_name_columns_and_units(tmp_path: Path) -> None:
    """Exchanged columns, inches; a semicolon and decimal commas with integers in between."""
    y, z = np.arange(-30.0, 31.0, 2.0), np.arange(-30.0, 31.0, 2.0) ** 2 / 200.0
    texts = {
        "swapped.csv": "z [mm]; y [mm]\n" + "\n".join(f"{b}; {a}" for a, b in zip(y, z, strict=True)),
        "inches.csv": "y (in), z (in)\n"
        + "\n".join(f"{a / 25.4:.7f}, {b / 25.4:.7f}" for a, b in zip(y, z, strict=True)),
        "german.csv": "\n".join(f"{a:g} {b:g}".replace(".", ",") for a, b in zip(y, z, strict=True)),
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
        with pytest.warns(InputNote, match="line 1 is read as a header row|columns are exchanged|decimal points"):
            rail = load_profile(tmp_path / name, "rail")
        np.testing.assert_allclose(rail.y, y * 1e-3, atol=3e-9)
        np.testing.assert_allclose(rail.z, z * 1e-3, atol=3e-9)  # seven decimals of an inch
