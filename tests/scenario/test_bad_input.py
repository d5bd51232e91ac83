"""The real command line, in a process of its own: one line on stderr, exit status 2, nothing left behind."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

COMMAND = (sys.executable, "-c", "from tiengine.cli.commands import main; main()")


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """``tiengine run`` in a folder."""
    return subprocess.run([*COMMAND, "run", *arguments], cwd=folder, capture_output=True, text=True, check=False)


def assert_refused(folder: Path, arguments: tuple[str, ...], *words: str) -> None:
    """Refused before anything is written."""
    before = sorted(folder.rglob("*"))
    done = run(folder, *arguments)
    assert done.returncode == 2, done.stderr
    lines = done.stderr.splitlines()
    assert len(lines) == 1, done.stderr
    assert re.match(r"error: \S", lines[0])
    for word in words:
        assert word in lines[0]
    assert "Traceback" not in done.stdout + done.stderr
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("train.distance=long", ("train.distance = 'long'", "must be a number")),
        ("train.sped_kmh=3", ("train.sped_kmh", "unknown key", "'speed_kmh'")),
        ("train.vehicles.0.car.mass=-1", ("car.mass = -1", "must be greater than 0 kg")),
        ("train.wheel_profile=LMX", ("train.wheel_profile = 'LMX'", "'LMA'")),
        ("train.speed_kmh=0", ("train.speed_kmh = 0", "must be greater than 0")),
        ("numerics.window=10", ("numerics.window = 10", "shorter than the train")),
        ("numerics.time_step=0.5", ("numerics.time_step = 0.5", "must be 'auto' or a number between")),
        ("irregularity.wavelength_min=0.015", ("wavelength_min = 0.015", "8 V dt")),
    ],
)
def test_a_wrong_value(tmp_path, setting, words):
    """Key, value and rule of each kind of mistake."""
    assert_refused(tmp_path, ("paper", "--set", setting), *words)


def test_an_unstable_step(tmp_path):
    """Only the trial of the step itself can tell."""
    settings = ("numerics.time_step=1e-3", "numerics.modes_per_metre=8")
    arguments = [word for setting in settings for word in ("--set", setting)]
    assert_refused(tmp_path, ("default", *arguments), "numerics.time_step = 0.001", "unstable", "choose")


def test_output_that_cannot_be_written(tmp_path):
    """No such folder; a folder; a file where a folder should be."""
    (tmp_path / "plain").write_text("text")
    for output in ("no/such/run.h5", ".", "plain/run.h5"):
        assert_refused(tmp_path, ("paper", "-o", output), f"output = '{output}'")


def test_a_file_that_is_no_scenario(tmp_path):
    """Broken TOML, and a profile that is missing, named by a scenario's own path."""
    (tmp_path / "broken.toml").write_text("[train\n")
    assert_refused(tmp_path, ("broken.toml",), "broken.toml")
    (tmp_path / "lost.toml").write_text(
        '[train]\nvehicles = ["CRH380A_v2"]\nspeed_kmh = 100.0\ndistance = 10.0\nwheel_profile = "worn/wheel.csv"\n'
    )
    assert_refused(tmp_path, ("lost.toml",), "train.wheel_profile", "worn/wheel.csv")
