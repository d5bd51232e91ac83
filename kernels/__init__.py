"""Taichi CPU kernels of moving and nonlinear parts. They import no host code."""

import os as _os

if _os.name == "posix" and not (_os.environ.get("HOME") or _os.environ.get("XDG_CACHE_HOME")):
    _os.environ["XDG_CACHE_HOME"] = _os.devnull  # with neither, importing Taichi ends the process
