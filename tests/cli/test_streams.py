"""Commands whose output goes nowhere: closed, or onto a full disk."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMAND = f"{sys.executable} -c 'from tiengine.cli.commands import main; main()' list profiles"


@pytest.mark.parametrize(
    ("where", "status", "message"),
    [
        (">&-", 0, ""),
        (">/dev/null 2>&-", 0, ""),
        pytest.param(
            ">/dev/full",
            1,
            "error: standard output: No space left on device\n",
            marks=pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full"),
        ),
    ],
    ids=["closed", "errors closed", "full"],
)
def test_no_traceback(where: str, status: int, message: str) -> None:
    """A closed stream is nothing to complain of; a full one is told in one line."""
    done = subprocess.run(["/bin/sh", "-c", f"{COMMAND} {where}"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == status
    assert done.stderr == message
