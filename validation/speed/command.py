"""Wall time of the whole command ``tiengine run default``, with warm and with empty caches."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tiengine import result as results
from tiengine.parameters.cache_folders import TABLES
from validation.speed.effort import Effort
from validation.speed.findings import Findings
from validation.speed.runs import Facts, median_of

__all__ = ["command"]

PARTS = ("import", "jit", "setup", "loop", "writing")
ENTRY = "from tiengine.cli.commands import main; main()"  # what the installed script does, wherever it is installed
CACHE = "TI_OFFLINE_CACHE_FILE_PATH"  # Taichi's own variable for the folder of its cache


def command(effort: Effort) -> Findings:
    """Run the command once with an empty cache, then several times with a warm one; 600 m each."""
    with TemporaryDirectory(prefix="tiengine-speed-") as folder:
        cache = Path(folder) / "cache"
        cold = [once(Path(folder), cache)]  # fills the cache
        warm = [once(Path(folder), cache) for _ in range(effort.commands)]
    values: dict[str, Any] = {"warm_s": median_of(warm, "wall"), "cold_s": median_of(cold, "wall")}
    for name, facts in (("warm", warm), ("cold", cold)):
        values |= {f"{name}_{part}_s": median_of(facts, f"wall_time_{part}") for part in PARTS}
        known = sum(values[f"{name}_{part}_s"] for part in PARTS if part != "writing")
        values[f"{name}_rest_s"] = values[f"{name}_s"] - known
    return Findings(values, {"warm_s": [each["wall"] for each in warm]})


def once(folder: Path, cache: Path, *settings: str) -> Facts:
    """Run the command once.

    Args:
        folder: Folder of the result.
        cache: Folder of both caches, Taichi's and that of contact tables.
        settings: Further ``KEY=VALUE``.

    Returns:
        Attributes of the result, and ``wall``, the wall time of the whole process [s].
    """
    path = folder / "default.h5"
    words = [sys.executable, "-c", ENTRY, "run", "default", "--quiet", "--force", "-o", str(path)]
    words += [word for each in settings for word in ("--set", each)]
    environment = os.environ | {CACHE: str(cache), TABLES: str(cache / "contact")}
    clock = time.perf_counter()
    subprocess.run(words, check=True, env=environment)
    wall = time.perf_counter() - clock
    with results.open(path) as result:
        return result.attributes | {"wall": wall}
