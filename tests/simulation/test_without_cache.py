"""Whole runs without a cache folder, in processes of their own: one train, and an ensemble in two workers."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tiengine import result as results

ROOT = Path(__file__).parents[2]
COMMAND = (sys.executable, "-c", "from tiengine.cli.commands import main; main()", "run", "default", "--force")
SETTINGS = ("--set", "train.distance=2", "--set", "output.run_in=0")


@pytest.mark.parametrize(
    ("home", "more"),
    [
        pytest.param(None, (), id="no home"),
        pytest.param("/proc", ("--set", "ensemble.size=2", "--workers", "2"), id="unwritable home, workers"),
    ],
)
def test_a_run_is_complete_and_says_so(home: str | None, more: tuple[str, ...], tmp_path: Path) -> None:
    """One line of warning, exit status 0, a complete result, and nothing else left behind."""
    folders = ("HOME", "XDG_CACHE_HOME", "TI_OFFLINE_CACHE_FILE_PATH", "TIENGINE_CACHE")  # as CI sets them
    environment = {name: value for name, value in os.environ.items() if name not in folders}
    environment |= {"TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)} | ({} if home is None else {"HOME": home})
    done = subprocess.run(
        [*COMMAND, *SETTINGS, *more, "-o", str(tmp_path / "run.h5")],
        env=environment, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("warning: no cache of kernels and contact tables") == 1, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    with results.open(tmp_path / "run.h5") as result:
        assert result.finished
        assert not result.failures
