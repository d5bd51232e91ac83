"""The only place that initialises Taichi."""

from __future__ import annotations

import contextlib
import io
import time

import taichi as ti

_started: dict[str, float] = {}


def start(threads: int = 1, debug: bool = False) -> float:
    """Initialise Taichi on the CPU in double precision, once per process.

    Args:
        threads: Threads of Taichi's parallel loops over trains. Results do not depend on it.
        debug: Bounds checks in every kernel (some 35 times slower).

    Returns:
        Wall time of the first initialisation in this process [s].
    """
    if not _started:
        clock = time.perf_counter()
        with contextlib.redirect_stdout(io.StringIO()):  # ti.init prints a line whatever the log level
            ti.init(
                arch=ti.cpu,
                default_fp=ti.f64,
                default_ip=ti.i32,
                fast_math=not debug,
                debug=debug,
                cpu_max_num_threads=threads,
                offline_cache=True,
                log_level=ti.WARN,
            )
        _started["seconds"] = time.perf_counter() - clock
    return _started["seconds"]
