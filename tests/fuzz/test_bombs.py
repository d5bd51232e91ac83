"""Inputs that are too large, never end, or lead elsewhere are refused at once, by limits that the message states."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import tiengine
from tiengine.cli.commands import main
from tiengine.contact.profile import load_profile
from tiengine.contact.profile_files import MOST_POINTS
from tiengine.irregularity.measured_files import read_series
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import parse_toml
from tiengine.result_files.checkpoint import Checkpoint
from tiengine.result_files.output_file import check_output
from tiengine.scenario.scenario import load_scenario

from ..fuzzing import deadline, refused

TRAIN = {"vehicles": ["CRH380A_v2"], "speed_kmh": 300.0, "distance": 20.0}
READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "scenario": (".toml", load_scenario),
    "part": (".toml", lambda path: load_scenario({"train": {**TRAIN, "vehicles": [str(path)]}})),
    "profile": (".prw", lambda path: load_profile(path, "wheel")),
    "profile of a scenario": (".csv", lambda path: load_scenario({"train": {**TRAIN, "wheel_profile": str(path)}})),
    "track": (".csv", read_series),
    "result": (".h5", tiengine.open),
    "checkpoint": (".checkpoint", Checkpoint.read),
}


def sparse(path: Path, size: int, content: bytes = b"") -> None:
    """Sparse file of many bytes that takes no space on the disk."""
    with path.open("wb") as file:
        file.write(content)
        file.truncate(size)


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("what", ["pipe", "device", "link to a device", "folder", "nothing", "link to itself"])
def test_what_is_no_regular_file(name: str, what: str, tmp_path: Path) -> None:
    """Devices and pipes are neither waited for nor read: /dev/zero never ends, a pipe never begins."""
    suffix, read = READERS[name]
    path = tmp_path / f"odd{suffix}"
    match what:
        case "pipe":
            os.mkfifo(path)
        case "device":
            path = Path("/dev/zero")
        case "link to a device":
            path.symlink_to("/dev/zero")
        case "folder":
            path.mkdir()
        case "link to itself":
            path.symlink_to(path)
    message = refused(lambda: read(path))
    assert message is not None
    words = ("regular file", "no such", "No such", "cannot be read", "neither a file nor")
    assert any(word in message for word in words)


@pytest.mark.parametrize(
    ("name", "size"),
    [("scenario", 100_000_000), ("part", 10**9), ("profile", 10**9), ("track", 10**9), ("checkpoint", 2**40)],
)
def test_large_files(name: str, size: int, tmp_path: Path) -> None:
    """Large files are refused by their size, before a byte is read; the message gives both numbers."""
    suffix, read = READERS[name]
    path = tmp_path / f"large{suffix}"
    sparse(path, size)
    message = refused(lambda: read(path))
    assert message is not None
    assert f"{size / 1e6:g} MB, larger than " in message


@pytest.mark.parametrize("name", ["profile", "track"])
def test_long_lines(name: str, tmp_path: Path) -> None:
    """One line of 9 MB."""
    suffix, read = READERS[name]
    path = tmp_path / f"long{suffix}"
    path.write_text("x,z_v\n" + "1," * 4_500_000)
    message = refused(lambda: read(path))
    assert message is not None
    assert "line 2: 9000000 characters; at most 10000 expected" in message


def test_many_points(tmp_path: Path) -> None:
    """A smooth profile with more points than any instrument gives is refused."""
    y = np.linspace(-30.0, 30.0, MOST_POINTS + 1)
    path = tmp_path / "fine.csv"
    path.write_text("\n".join(f"{a:.9f} {a * a / 600.0:.9f}" for a in y))
    message = refused(lambda: load_profile(path, "rail"))
    assert message is not None
    assert f"{MOST_POINTS + 1} points; at most {MOST_POINTS} expected" in message


@pytest.mark.parametrize(
    "text",
    [
        *("a = " + "[" * n + "]" * n for n in (22, 500, 200_000)),
        "a = " + "{a = " * 100_000,
        "a" + ".a" * 500_000 + " = 1",
        "[" + "a." * 500_000 + "a]",
        "a = 1" + "0" * 5000,
        "a = 0x" + "f" * 100_000,
        "a = '''" + "x" * 1_000_000,
    ],
    ids=lambda text: f"{text[:12]} {len(text)}",
)
def test_nested_toml(text: str) -> None:
    """tomllib alone would raise a RecursionError or a ValueError, or take time in the square of a key's length."""
    message = refused(lambda: parse_toml(text, "bomb.toml"))
    assert message is not None
    assert message.startswith("bomb.toml: ")


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"ensemble": {"size": 10**9}}, "ensemble.size = 1000000000: must be less than or equal to 100000"),
        (
            {"ensemble": {"size": 99_991, "vary": {"train.speed_kmh": tuple(300.0 + i * 1e-3 for i in range(99_991))}}},
            "99991 different trains: must be at most 5000",
        ),
        (
            {"ensemble": {"size": 90_090, "vary": {f"numerics.{k}": (1,) * n for k, n in (("a", 990), ("b", 91))}}},
            "90090 different trains: must be at most 5000",
        ),
        ({"train": {**TRAIN, "vehicles": ("CRH380A_v2",) * 1000}}, "must have at most 64 items"),
        (
            {
                "train": {**TRAIN, "vehicles": ("CRH380A_v2",) * 64},
                "numerics": {"trial_functions": "sines", "modes_per_metre": 20.0},
            },
            "3000 functions",
        ),
        ({"train": {**TRAIN, "speed_kmh": 1e-12}}, "would take up to 7.2e+13 s; must be at most 1e+06 s"),
        (
            {"gauges": tuple({"name": f"g{i}", "on": "rail", "chainage": 1.0, "side": "left"} for i in range(1001))},
            "gauges",
        ),
        (
            {
                "track": {
                    "mortar_voids": tuple(
                        {"slab": 0, "x": (1e-4 * i, 1e-4 * (i + 1)), "y": (0.1, 0.2)} for i in range(9999)
                    )
                }
            },
            "slab 0 has more than 100 voids",
        ),
        ({"track": {"slab": {"like": "CRTS_III", "elements_x": 200, "elements_y": 100}}}, "must be at most 5000"),
        ({"track": {"slab": {"like": "CRTS_III", "fastening_pitch": 1e-9, "fastenings": 10**9}}}, "fastening_pitch"),
        ({"irregularity": {"wavelength_min": 1e-9}}, "wavelength"),
    ],
    ids=lambda value: value[:40] if isinstance(value, str) else "",
)
def test_large_scenarios(changes: dict[str, Any], rule: str) -> None:
    """Short inputs that would need hours or more memory than available are refused."""
    message = refused(lambda: load_scenario({"train": TRAIN, **changes}))
    assert message is not None
    assert rule in message


@pytest.mark.parametrize("name", ["../up", "/tmp/up", "a/b", "..\\up", "a\nb", "", "n" * 201])
def test_a_name_leads_nowhere(name: str) -> None:
    """A result named after the scenario stays in the working directory."""
    message = refused(lambda: load_scenario({"name": name, "train": TRAIN}))
    assert message is not None
    assert message.startswith("name = ")


@pytest.mark.parametrize("name", ["../../profiles/LMA", "..", "~root/x.toml", "a\0b", "x" * 5000, "~nobody/x.toml"])
def test_names_of_presets_are_no_paths(name: str) -> None:
    """A slash makes a path, relative to the scenario; a name is looked up in the library only."""
    for key in ("wheel_profile", "vehicles"):
        value = [name] if key == "vehicles" else name
        message = refused(lambda value=value, key=key: load_scenario({"train": {**TRAIN, key: value}}))
        assert message is not None


def test_paths_are_those_of_the_scenario(tmp_path: Path) -> None:
    """Paths relative to the scenario's folder, above it, absolute and by a link are read, as documented."""
    (tmp_path / "shared").mkdir()
    (tmp_path / "runs").mkdir()
    head = tmp_path / "shared" / "head.csv"
    head.write_text("\n".join(f"{y} {y * y / 600.0}" for y in range(-30, 31)))
    (tmp_path / "runs" / "link.csv").symlink_to(head)
    for name in ("../shared/head.csv", str(head), "link.csv"):
        (tmp_path / "runs" / "my.toml").write_text(
            '[train]\nvehicles = ["CRH380A_v2"]\nspeed_kmh = 300\ndistance = 20\n'
            f'[track]\ngauge_depth = 0.001\nrail_profile = "{name}"\n'
        )
        assert load_scenario(tmp_path / "runs" / "my.toml").parts.rail_profile.y.size == 61


@pytest.mark.parametrize("path", ["/dev/null", "/dev/zero", "x" * 300 + ".h5"])
def test_output_is_a_regular_file(path: str) -> None:
    """A result never replaces a device such as /dev/null."""
    with deadline(), pytest.raises(InputError, match=r"regular file|cannot be written"):
        check_output(Path(path), force=True)


def test_command_line_answers_in_one_line(tmp_path: Path) -> None:
    """Quotations of an input are cut and contain no control characters."""
    path = tmp_path / "wide.toml"
    train = f"[train]\nvehicles = ['a']\nspeed_kmh = '{chr(0x2028) * 5000}'\ndistance = 1\n"
    path.write_text("x" * 900 + " = 1\n" + train)
    done = CliRunner().invoke(main, ["run", str(path), "-o", str(tmp_path / "run.h5")])
    assert done.exit_code == 2
    assert len(done.stderr) < 2000
    assert done.stderr.count("\n") == 1
