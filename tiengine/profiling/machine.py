"""Circumstances of a measurement: versions, processor, caches, memory.

Processor and caches are read from Linux's own files. The libraries for it start a child process, which hangs when it is
forked after Taichi has begun; on other systems the caches stay unknown.
"""

from __future__ import annotations

import platform
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import psutil
from threadpoolctl import threadpool_info

__all__ = ["Machine", "cache_bytes", "import_seconds", "this_machine", "versions"]

PACKAGES = ("tiengine", "numpy", "scipy", "taichi", "h5py")
CACHES = Path("/sys/devices/system/cpu/cpu0/cache")
UNITS = {"K": 2**10, "M": 2**20, "G": 2**30}


@dataclass(frozen=True)
class Machine:
    """The computer.

    Attributes:
        system: Operating system.
        cpu: Model of the processor.
        cores: Physical cores.
        l1_bytes: First-level data cache of a core, 0 where unknown; likewise ``l2_bytes`` and ``l3_bytes``.
        l2_bytes: Second level.
        l3_bytes: Third level, shared by the cores.
        memory_bytes: Main memory.
        blas: Library, version and processor that it was built for.
    """

    system: str
    cpu: str
    cores: int
    l1_bytes: int
    l2_bytes: int
    l3_bytes: int
    memory_bytes: int
    blas: str


def this_machine() -> Machine:
    """Describe the computer; NumPy must have been imported, so that its BLAS is known."""
    caches = cache_bytes(CACHES)
    return Machine(
        system=platform.platform(),
        cpu=_cpu(),
        cores=psutil.cpu_count(logical=False) or 1,
        l1_bytes=caches.get(1, 0),
        l2_bytes=caches.get(2, 0),
        l3_bytes=caches.get(3, 0),
        memory_bytes=int(psutil.virtual_memory().total),
        blas=_blas(),
    )


def versions() -> dict[str, str]:
    """Python and the packages that the speed depends on."""
    return {"python": platform.python_version(), **{name: metadata.version(name) for name in PACKAGES}}


def import_seconds() -> float:
    """Wall time of importing what a run needs, in a fresh interpreter [s]; call it before Taichi begins."""
    load = "import tiengine.simulation.simulate"
    script = f"import time; clock = time.perf_counter(); {load}; print(time.perf_counter() - clock)"
    output = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    return float(output.split()[-1])


def cache_bytes(folder: Path) -> dict[int, int]:
    """Sizes of data and unified caches by level; empty where the system does not describe them.

    Args:
        folder: Folder in which Linux describes the caches of a core.
    """
    found = {}
    for each in sorted(folder.glob("index*")):
        kind, level, size = ((each / name).read_text().strip() for name in ("type", "level", "size"))
        if kind != "Instruction":
            found[int(level)] = int(size[:-1]) * UNITS[size[-1]]
    return found


def _cpu() -> str:
    """Model name of the processor."""
    described = Path("/proc/cpuinfo")
    lines = described.read_text().splitlines() if described.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _blas() -> str:
    """Name and version of NumPy's BLAS, which does the products of the step."""
    libraries = [each for each in threadpool_info() if each["user_api"] == "blas"]
    own = [each for each in libraries if "numpy" in each["filepath"]] or libraries
    return f"{own[0]['internal_api']} {own[0]['version']} ({own[0].get('architecture', '?')})" if own else "unknown"
