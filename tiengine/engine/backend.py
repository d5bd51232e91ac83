"""Initialisation of Taichi, in this module only."""

from __future__ import annotations

import contextlib
import io
import time
from typing import Any

import taichi as ti
from taichi.lang.ast import ast_transformer_utils

from tiengine.parameters.cache_folders import ensure_cache_folders, kernel_cache

_started: dict[str, float] = {}


def start(threads: int = 1, debug: bool = False) -> float:
    """Initialise Taichi on the CPU in double precision, once per process.

    Args:
        threads: Threads of Taichi's parallel loops over trains. Results do not depend on it.
        debug: Bounds checks in every kernel (about 35 times slower).

    Returns:
        Wall time of the first initialisation in this process [s].
    """
    if not _started:
        clock = time.perf_counter()
        ensure_cache_folders()
        if not debug:
            _forget_source_positions()
        with contextlib.redirect_stdout(io.StringIO()):  # ti.init prints a line whatever the log level
            ti.init(
                arch=ti.cpu,
                default_fp=ti.f64,
                default_ip=ti.i32,
                fast_math=not debug,
                debug=debug,
                cpu_max_num_threads=threads,
                log_level=ti.WARN,
                **kernel_cache(),
            )
        _started["seconds"] = time.perf_counter() - clock
    return _started["seconds"]


def _forget_source_positions() -> None:
    """Let Taichi translate kernels without rendering the source position of each expression.

    The positions appear in its messages about wrong kernels only, and rendering them takes two thirds of the time of
    loading a kernel from the cache on disk. Private API of the pinned version; other versions keep rendering.
    """
    context: Any = getattr(ast_transformer_utils, "ASTTransformerContext", None)
    if hasattr(context, "get_pos_info"):
        context.get_pos_info = lambda self, node: ""
