"""Folders of the two caches on disk: compiled kernels, kept by Taichi, and contact tables.

Taichi ends the process on import if it can derive no folder from the environment, and crashes at exit, after a complete
result, if it cannot write to its folder. Both folders are therefore tried before a run; one that cannot be used is
replaced by a temporary folder, which is removed at exit. The choice is passed to worker processes by environment
variables.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path

from tiengine.parameters.errors import InputError

__all__ = ["ensure_cache_folders", "kernel_cache", "table_folder"]

KERNELS = "TI_OFFLINE_CACHE_FILE_PATH"
"""Environment variable of Taichi that overrides the folder of the kernels."""

SWITCH = "TI_OFFLINE_CACHE"
"""Environment variable of Taichi that switches its cache off by the value 0; it needs its folder nevertheless."""

TABLES = "TIENGINE_CACHE"
"""Environment variable that overrides the folder of the contact tables."""

NAMES = {KERNELS: "kernels", TABLES: "contact_tables"}
"""Names of the folders within the temporary folder."""

NOWHERE = Path(os.devnull)
"""Stands for the home directory where there is none."""


def kernel_cache() -> dict[str, Any]:
    """Arguments of ``ti.init`` for its cache; empty where the environment states them, of which Taichi would warn."""
    known = {SWITCH: ("offline_cache", True), KERNELS: ("offline_cache_file_path", str(_kernel_folder()))}
    return dict(argument for name, argument in known.items() if not os.environ.get(name))


def table_folder() -> Path:
    """Folder of the contact tables."""
    if os.environ.get(TABLES):
        return Path(os.environ[TABLES])
    return user_cache_path("tiengine") if _has_home() else NOWHERE / "tiengine"


def ensure_cache_folders(tell: Callable[[str], None] | None = None) -> None:
    """Replace cache folders that cannot be used by temporary ones, with a warning; call before Taichi is initialised.

    Args:
        tell: Called with the warning; None issues a Python warning.

    Raises:
        InputError: There is no temporary folder either: Taichi crashes at exit even with its cache switched off.
    """
    unusable = {name: why for name, folder in _folders().items() if (why := _fault(folder))}
    if not unusable:
        return
    reasons, remedy = ", ".join(dict.fromkeys(unusable.values())), f"set HOME, or {' and '.join(unusable)}"
    try:
        temporary = _temporary_folder()
    except OSError as error:
        raise InputError(
            f"cache: {reasons}, nor is there a temporary folder ({error.strerror or error}); {remedy}"
        ) from None
    for name in unusable:
        os.environ[name] = str(temporary / NAMES[name])
    words = (
        f"no cache of kernels and contact tables: {reasons}: a temporary folder is used, so that the next run compiles"
        f" again; {remedy}"
    )
    if tell is None:
        warnings.warn(words, stacklevel=3)
    else:
        tell(f"warning: {words}")


def _kernel_folder() -> Path:
    """Folder of the compiled kernels: the default of Taichi, stated explicitly."""
    if os.environ.get(KERNELS):
        return Path(os.environ[KERNELS])
    if os.name == "nt":
        return Path("C:/taichi_cache/ticache")
    home = Path(os.environ["HOME"]) if os.environ.get("HOME") else NOWHERE
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache") / "taichi" / "ticache"


def _has_home() -> bool:
    return os.name != "posix" or bool(os.environ.get("HOME") or os.environ.get("XDG_CACHE_HOME"))


def _folders() -> dict[str, Path]:
    """Folder of each cache by the environment variable that overrides it."""
    return {KERNELS: _kernel_folder(), TABLES: table_folder()}


def _fault(folder: Path) -> str:
    """Reason why no file can be created in a folder, empty if one can; the folder is created if it is missing."""
    if NOWHERE in folder.parents:
        return "there is no home directory (HOME)"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return ""
    except OSError as error:
        return f"'{folder}' cannot be written ({error.strerror or error})"


def _temporary_folder() -> Path:
    """Create a folder that is removed at exit."""
    folder = Path(tempfile.mkdtemp(prefix="tiengine-"))
    owner = os.getpid()

    def remove() -> None:
        if os.getpid() != owner:
            return
        if "taichi" in sys.modules:  # it writes its cache when it is reset, and would write it later otherwise
            sys.modules["taichi"].reset()
        shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return folder
