"""Peak memory of this process."""

from __future__ import annotations

import sys
from pathlib import Path

__all__ = ["peak_memory"]


def peak_memory() -> float:
    """Most memory that this process has held so far [MB].

    On Linux the kernel's own mark of this program; ``getrusage`` there counts what the parent held before it started
    this one.
    """
    if sys.platform == "win32":
        return float("nan")
    if sys.platform == "linux":
        line = next(row for row in Path("/proc/self/status").read_text().splitlines() if row.startswith("VmHWM"))
        return float(line.split()[1]) * 1024e-6
    import resource

    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * 1e-6  # macOS counts bytes
