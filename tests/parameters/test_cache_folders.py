"""Cache folders that cannot be used: a warning, a temporary folder that is removed at exit, and exit status 0.

Taichi ends or crashes the whole process in these cases, so that every one is a process of its own, as root and as a
user without rights.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import pytest

from tiengine.parameters import cache_folders
from tiengine.parameters.cache_folders import KERNELS, SWITCH, TABLES, ensure_cache_folders
from tiengine.parameters.errors import InputError

ROOT = Path(__file__).parents[2]
NOBODY = 65534

SCRIPT = """
import os, sys
from tiengine.engine import backend
import taichi as ti
if sys.argv[1] != "self":
    os.setuid(int(sys.argv[1]))
backend.start()

@ti.kernel
def double(x: float) -> float:
    return 2.0 * x

assert double(1.5) == 3.0
from tiengine.parameters.cache_folders import table_folder
print(os.environ.get("TI_OFFLINE_CACHE_FILE_PATH", ""), table_folder(), sep="\\n")
"""


def start(folder: Path, changes: Mapping[str, str | None], user: str = "self") -> subprocess.CompletedProcess[str]:
    """Compile a small kernel in a process of its own, whose environment is changed; None removes a variable."""
    path = folder / "script.py"
    path.write_text(SCRIPT, encoding="utf-8")
    own = {KERNELS: None, TABLES: None, SWITCH: None, "XDG_CACHE_HOME": None, "PYTHONPATH": str(ROOT)}
    settings = own | {"TMPDIR": str(folder)} | dict(changes)
    environment = {**os.environ, **{name: value for name, value in settings.items() if value is not None}}
    for name, value in settings.items():
        if value is None:
            environment.pop(name, None)
    return subprocess.run(
        [sys.executable, str(path), user], env=environment, cwd=folder, capture_output=True, text=True, timeout=300,
        check=False,
    )  # fmt: skip


def assert_temporary(done: subprocess.CompletedProcess[str], folder: Path, kinds: int) -> None:
    """Exit status 0, one warning, and caches in a temporary folder that has been removed."""
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("no cache of kernels and contact tables") == 1, done.stderr
    assert "overridden" not in done.stderr
    used = [Path(line) for line in done.stdout.split("\n") if f"{folder}/tiengine-" in line]
    assert len(used) == kinds
    assert not list(folder.glob("tiengine-*"))


@pytest.mark.parametrize("home", [None, "", "/proc", "/dev/null"], ids=["unset", "empty", "proc", "device"])
def test_home_that_holds_no_cache(home: str | None, tmp_path: Path) -> None:
    """Neither Taichi's nor our own cache has a folder; ``import taichi`` alone would end the process."""
    done = start(tmp_path, {"HOME": home})
    assert_temporary(done, tmp_path, 2)
    assert ("there is no home directory (HOME)" in done.stderr) == (home in (None, "", "/dev/null"))


def test_cache_path_that_is_a_file(tmp_path: Path) -> None:
    """Whatever variable names it; the other cache stays where it is."""
    (tmp_path / "file").write_text("")
    assert_temporary(start(tmp_path, {"XDG_CACHE_HOME": str(tmp_path / "file")}), tmp_path, 2)
    done = start(tmp_path, {KERNELS: str(tmp_path / "file"), TABLES: str(tmp_path / "tables")})
    assert_temporary(done, tmp_path, 1)
    assert str(tmp_path / "tables") in done.stdout


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="changes to another user")
def test_read_only_folder() -> None:
    """Root may write anywhere but in /proc, so that a user without rights tries; pytest's own folders are root's."""
    with tempfile.TemporaryDirectory() as name:
        _run_as_nobody(Path(name))


def _run_as_nobody(folder: Path) -> None:
    folder.chmod(0o755)
    (temporary := folder / "temporary").mkdir()
    temporary.chmod(0o777)
    (kept := folder / "kept").mkdir()
    kept.chmod(0o555)
    done = start(folder, {KERNELS: str(kept), TABLES: str(kept), "TMPDIR": str(temporary)}, str(NOBODY))
    assert_temporary(done, temporary, 2)
    assert "Permission denied" in done.stderr
    assert not list(kept.iterdir())


def test_usable_folders_stay(tmp_path: Path) -> None:
    """No warning, and the kernel is kept from one process to the next."""
    done = start(tmp_path, {"HOME": str(tmp_path / "home")})
    assert (done.returncode, done.stderr) == (0, "")
    assert list((tmp_path / "home" / ".cache" / "taichi" / "ticache").glob("*.tic"))


def test_no_temporary_folder_either(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Refused before the run, in one line, since Taichi would crash after it."""
    (tmp_path / "file").write_text("")
    for name in (KERNELS, TABLES):
        monkeypatch.setenv(name, str(tmp_path / "file"))

    def refuse(**_: object) -> str:
        raise FileNotFoundError(2, "No usable temporary directory found")

    monkeypatch.setattr(cache_folders.tempfile, "mkdtemp", refuse)
    with pytest.raises(InputError) as refused:
        ensure_cache_folders()
    said = str(refused.value)
    assert f"'{tmp_path / 'file'}' cannot be written" in said
    assert f"nor is there a temporary folder (No usable temporary directory found); set HOME, or {KERNELS}" in said


def test_cache_that_is_switched_off(tmp_path: Path) -> None:
    """Taichi needs its folder even so."""
    assert_temporary(start(tmp_path, {SWITCH: "0", "HOME": "/proc"}), tmp_path, 2)
