"""Peak memory of this process."""

from __future__ import annotations

import sys
from pathlib import Path

__all__ = ["peak_memory"]


def peak_memory() -> float:
    """Peak memory of this process so far [MB].

    On Linux it is the kernel's high-water mark of this program; ``getrusage`` would there include the memory of the
    parent at the time it started this process.
    """
    if sys.platform == "win32":
        return float("nan")
    if sys.platform == "linux":
        line = next(row for row in Path("/proc/self/status").read_text().splitlines() if row.startswith("VmHWM"))
        return float(line.split()[1]) * 1024e-6
    import resource

    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss) * 1e-6  # macOS counts bytes
