"""Points as spreadsheets and measuring programs write them: quoted cells, lines of words above, units in a line."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from tiengine.contact.profile import Profile, load_profile
from tiengine.contact.table import ContactSettings, WheelRailPair
from tiengine.parameters.errors import InputError, InputNote

Y = np.arange(-36.0, 37.0, 2.0)
Z = Y**2 / 100.0  # mm


def rows(form: str, *scale: float) -> str:
    """Points in a format, decimal commas where it has a %%."""
    a, b = scale or (1.0, 1.0)
    text = "".join(form.replace("%%", "%") % pair for pair in zip(Y * a, Z * b, strict=True))
    return text.replace(".", ",") if "%%" in form else text


def read(folder: Path, text: str, name: str = "rail.csv", **stated: object) -> tuple[Profile, list[str]]:
    """The rail and the notes on how it was read."""
    (folder / name).write_text(text)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always", InputNote)
        profile = load_profile(folder / name, "rail", **stated)
    return profile, [str(each.message) for each in found]


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ('"y (mm)","z (mm)"\r\n' + rows('"%.4f","%.4f"\r\n'), "line 1 is read as a header row"),
        ('"y";"z"\n' + rows('"%%.4f";"%%.4f"\n'), "commas are read as decimal points"),
        ('"y","z"\n' + rows('"%%.4f","%%.4f"\n'), "commas are read as decimal points"),
        ("y,z\nmm,mm\n" + rows("%.4f,%.4f\n"), "lines 1 to 2 are read as header rows"),
        ("y;z\nin;in\n" + rows("%.8f;%.8f\n", 1.0 / 25.4, 1.0 / 25.4), "lines 1 to 2 are read as header rows"),
        ("y [cm], z [cm]\n" + rows("%.5f,%.5f\n", 0.1, 0.1), "line 1 is read as a header row"),
        ("y [m]; z [mm]\n" + rows("%.6f;%.4f\n", 1e-3, 1.0), "line 1 is read as a header row"),
        ("y_mm z_mm\n" + rows("%.4f %.4f\n"), "line 1 is read as a header row"),
        ("Rail 3 left, of 2024-05-06\nN.N.\n\ny z\n" + rows("%.4f %.4f\n"), "lines 1 to 4 are read as header rows"),
    ],
    ids=["quotes", "german", "german cells", "units below", "inches below", "cm", "two units", "_mm", "title"],
)
def test_rows_of_spreadsheets(tmp_path: Path, text: str, note: str) -> None:
    """Read as the plain list, with a note on what the format left open."""
    rail, notes = read(tmp_path, text)
    np.testing.assert_allclose(rail.y, 1e-3 * Y, atol=1e-9)
    np.testing.assert_allclose(rail.z, 1e-3 * Z, atol=1e-9)
    assert any(note in each for each in notes)


def test_a_counted_list_names_z_first(tmp_path: Path) -> None:
    """The names of the last two of three columns."""
    text = "Nr;z;y\n" + "".join(f"{i};{b};{a}\n" for i, (a, b) in enumerate(zip(Y, Z, strict=True)))
    np.testing.assert_allclose(read(tmp_path, text)[0].y, 1e-3 * Y)


def test_units_that_contradict_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="states the units mm, in, m; one for y and one for z expected"):
        read(tmp_path, "all in [mm]\ny [in]; z [m]\n" + rows("%.4f;%.4f\n"))


def test_more_points_than_miniprof_announces_are_read_and_said(tmp_path: Path) -> None:
    rail, notes = read(tmp_path, "XYPoints=12\nColumnDef=X,Y\n\n" + rows("%.4f %.4f\n"), "rail.ban")
    assert len(rail.y) == len(Y)
    assert any("XYPoints = 12, and 37 points follow, which are all read" in note for note in notes)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rail_that_counts_from_its_gauge_face_needs_its_axis(tmp_path: Path, side: float) -> None:
    """Its torsion is about the axis; silence put it 36 mm off. The axis is that of the file, mirrored or not."""
    text = "".join(f"{a + 36.0 * side:.4f} {b:.4f}\n" for a, b in zip(Y, Z, strict=True))
    for mirror in (False, True):
        with pytest.raises(
            InputError, match=rf"middle of the head lies at y = {36.0 * side:.1f} mm; .* state rail_axis"
        ):
            read(tmp_path, text, mirror=mirror)
        rail, _ = read(tmp_path, text, mirror=mirror, rail_axis=36e-3 * side)
        np.testing.assert_allclose(rail.y, 1e-3 * Y, atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "key", "value"), [("rail", "tape_circle", 0.0), ("wheel", "rail_axis", 0.0), ("wheel", "has_cant", False)]
)
def test_keys_of_the_other_kind_are_refused(kind: str, key: str, value: object) -> None:
    preset = {"wheel": "S1002", "rail": "60E1"}[kind]
    with pytest.raises(InputError, match=f"{key} = .*: not for a {kind}"):
        load_profile(preset, kind, **{key: value})


def test_half_a_head_ends_where_the_wheel_touches(tmp_path: Path) -> None:
    """The end of the points was taken for the place of contact."""
    half = "".join(f"{a:.4f} {b:.4f}\n" for a, b in zip(Y, Z, strict=True) if a <= 0.0)
    rail, _ = read(tmp_path, half, mirror=False)
    pair = WheelRailPair(load_profile("S1002", "wheel"), rail, ContactSettings(gauge_depth=10e-3))
    with pytest.raises(InputError, match=r"no contact inside both profiles at u = 0\.00 mm"):
        pair.contacts(np.zeros(1), np.zeros(1))
