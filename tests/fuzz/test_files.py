"""Damaged profiles and measured tracks: changed texts of every format are read as they are or refused."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

from tiengine.contact.profile import Kind, Profile, load_profile
from tiengine.irregularity.base_motion import BaseMotion, GroundRecord
from tiengine.irregularity.irregularity import IrregularityParams, make_irregularity
from tiengine.irregularity.measured_files import LARGEST_CHAINAGE, LARGEST_HEIGHT, read_series

from ..contact.test_profile_files import columns, miniprof, simpack
from ..fuzzing import DAMAGES, EXAMPLES, Damage, mutated_texts, on_many, refused

pytestmark = pytest.mark.filterwarnings("ignore::tiengine.parameters.errors.InputNote")  # files may be read with notes

KINDS: dict[Kind, str] = {"wheel": "LMA", "rail": "CHN60"}
WRITERS = {".prw": simpack, ".prr": simpack, ".whl": miniprof, ".ban": miniprof, ".csv": columns}
FORMATS: list[tuple[str, Kind]] = [
    *((".prw", "wheel"), (".prr", "rail"), (".whl", "wheel")),
    *((".ban", "rail"), (".csv", "wheel"), (".csv", "rail")),
]
X = np.arange(0.0, 40.0, 0.5)
TRACK = "# measured\nmileage [km], vertical_left [mm], vertical_right [mm], alignment, gauge [mm]\n" + "\n".join(
    f"{1e-3 * x:.4f}, {np.sin(x):.3f}, {np.cos(x):.3f}, {1e-3 * np.sin(0.5 * x):.6f}, {np.sin(0.3 * x):.3f}" for x in X
)
PLAIN = "x,z_v\n" + "\n".join(f"{x:.1f},{1e-3 * np.sin(x):.6f}" for x in X)


SHAKEN = "time [s], vertical [m/s^2], lateral [gal]\n" + "\n".join(
    f"{0.01 * i:.2f}, {np.sin(0.3 * i):.4f}, {20.0 * np.cos(0.2 * i):.3f}" for i in range(60)
)


def text_of(suffix: str, kind: Kind) -> str:
    """Every twentieth point of a preset, as a file of some format."""
    profile = load_profile(KINDS[kind], kind)
    points = np.stack([profile.y, profile.z], axis=1)[::20] * 1e3
    return WRITERS[suffix](points, kind)


def assert_curve(profile: Profile) -> None:
    """An accepted profile is a smooth curve of the size of a wheel or rail."""
    assert np.isfinite(profile.y).all()
    assert np.isfinite(profile.z).all()
    assert (np.diff(profile.y) > 0.0).all()
    assert len(profile.y) >= 10
    assert np.ptp(profile.y) <= 0.4
    assert np.ptp(profile.z) <= 0.8
    assert np.isfinite(profile.height(np.linspace(*profile.span, 50))).all()


@EXAMPLES
@pytest.mark.parametrize(("suffix", "kind"), FORMATS)
def test_changed_profiles(examples: int, suffix: str, kind: Kind, tmp_path: Path) -> None:
    """A changed file is refused with file and reason, or gives a curve."""
    path = tmp_path / f"fuzzed{suffix}"

    def check(text: str) -> bool:
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        found: list[Profile] = []
        message = refused(lambda: found.append(load_profile(path, kind)))
        if message is None:
            assert_curve(found[0])
        else:
            assert path.name in message
        return message is not None

    on_many(examples // len(FORMATS) + 40 if examples < 1000 else examples, mutated_texts(text_of(suffix, kind)), check)


@EXAMPLES
def test_profiles_of_any_bytes(examples: int, tmp_path: Path) -> None:
    """Bytes changed anywhere, including Latin-1 and invalid UTF-8, are refused or give a curve."""
    contents = {each: text_of(*each).encode() for each in FORMATS}

    def check(given: tuple[tuple[str, Kind], Damage]) -> bool:
        (suffix, kind), damage = given
        path = tmp_path / f"fuzzed{suffix}"
        path.write_bytes(damage.of(contents[suffix, kind]))
        found: list[Profile] = []
        message = refused(lambda: found.append(load_profile(path, kind)))
        if message is None:
            assert_curve(found[0])
        return message is not None

    on_many(examples, st.tuples(st.sampled_from(FORMATS), DAMAGES), check)


def test_two_columns_are_what_they_say(tmp_path: Path) -> None:
    """A changed list that is accepted has the points that a simple reader finds in it."""
    path = tmp_path / "fuzzed.csv"
    text = text_of(".csv", "rail")

    def check(changed: str) -> bool:
        path.write_text(changed, encoding="utf-8", errors="surrogatepass", newline="")
        found: list[Profile] = []
        with warnings.catch_warnings(record=True) as notes:
            warnings.simplefilter("always")
            message = refused(lambda: found.append(load_profile(path, "rail")))
        if message is None and all("repeated" in str(note.message) for note in notes):
            lines = [re.split("#|%|!|//", line)[0] for line in changed.splitlines()]
            rows = [re.sub("[;,]", " ", re.sub(r"(?<=[\d.])[dD](?=[+-]?\d)", "e", line)) for line in lines]
            points = np.array([[float(y), float(z)] for y, z in (row.split() for row in rows if row.strip())])
            points = points[np.concatenate([[True], (np.diff(points, axis=0) != 0.0).any(axis=1)])]
            points *= 1.0 if np.ptp(points[:, 0]) <= 0.4 else 1e-3
            turned = points if points[-1, 0] > points[0, 0] else points[::-1]
            np.testing.assert_allclose(found[0].y, turned[:, 0], atol=1e-12)
            heights = turned[:, 1] * np.sign(np.median(turned[:, 1]) - turned[len(turned) // 2, 1])
            np.testing.assert_allclose(np.ptp(found[0].z), np.ptp(heights), atol=1e-12)
        return message is not None

    on_many(50, mutated_texts(text), check)


@EXAMPLES
@pytest.mark.parametrize("base", [TRACK, PLAIN], ids=["many-columns", "two-columns"])
def test_changed_tracks(examples: int, base: str, tmp_path: Path) -> None:
    """A changed track is refused with file and line, or gives finite numbers at rising chainages, as in the text."""
    path = tmp_path / "track.csv"

    def check(text: str) -> bool:
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        found: list[np.ndarray] = []
        message = refused(lambda: found.append(read_series(path).values))
        if message is not None:
            assert "track.csv" in message
            return True
        series = found[0]
        assert series.shape[1] == 5
        assert len(series) >= 4
        assert np.isfinite(series).all()
        assert (np.diff(series[:, 0]) > 0.0).all()
        assert np.abs(series[:, 1:]).max() <= LARGEST_HEIGHT
        assert np.ptp(series[:, 0]) <= 2.0 * LARGEST_CHAINAGE
        lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(("#", "%"))]
        if base is PLAIN and lines[0].strip() == "x,z_v":
            rows = np.array([[float(cell.strip().strip('"')) for cell in line.split(",")] for line in lines[1:]])
            np.testing.assert_array_equal(np.sort(np.abs(series[:, 1])), np.sort(np.abs(rows[:, 1])))
        return False

    on_many(examples, mutated_texts(base), check)


def test_changed_tracks_under_a_train(tmp_path: Path) -> None:
    """An accepted track gives finite irregularity everywhere, with a band-pass and without."""
    path = tmp_path / "track.csv"
    chainages = np.linspace(-10.0, 60.0, 71)

    def check(text: str) -> bool:
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        found: list[np.ndarray] = []

        def sample() -> None:
            for band_pass in (False, True):
                params = IrregularityParams(
                    file=str(path), file_band_pass=band_pass, wavelength_min=3.0, wavelength_max=20.0
                )
                found.append(make_irregularity(params, -20.0).sample(chainages))

        message = refused(sample)
        assert all(np.isfinite(each).all() for each in found)
        return message is not None

    on_many(50, mutated_texts(TRACK), check)


@EXAMPLES
def test_changed_acceleration_records(examples: int, tmp_path: Path) -> None:
    """A changed record of the ground's acceleration is refused with its name, or gives a finite motion."""
    path = tmp_path / "fuzzed.csv"

    def check(text: str) -> bool:
        path.write_text(text, encoding="utf-8", errors="surrogatepass", newline="")
        found: list[GroundRecord] = []
        message = refused(lambda: found.append(GroundRecord(BaseMotion(file=str(path), taper=0.05))))
        if message is None:
            times = np.linspace(-1.0, found[0].duration + 1.0, 50)
            assert all(np.isfinite(found[0].at(times, derivative)).all() for derivative in range(4))
        else:
            assert path.name in message
        return message is not None

    on_many(examples, mutated_texts(SHAKEN), check)
