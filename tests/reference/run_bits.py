"""A process of its own: advance the paper's case and print a digest of every bit and some sums.

Usage: run_bits.py THREADS OPTIMISED STEPS, run as a module of the tests' folder.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path

import numpy as np
import taichi as ti

from tiengine.engine import backend


def main(threads: int, optimised: bool, steps: int) -> None:
    """Advance and print one line of JSON."""
    if not optimised:
        init = ti.init
        ti.init = lambda **settings: init(**settings | {"advanced_optimization": False, "offline_cache": False})
    backend.start(threads)
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from reference.stepping import run_steps

    run = run_steps("paper", dt=1e-4, duration=steps * 1e-4, parallel=True)
    digest = hashlib.sha256(run.wheel.tobytes() + run.state.motion[:3].tobytes()).hexdigest()
    forces = np.stack([run.vertical[-1], run.lateral[-1]])
    print(json.dumps({"digest": digest, "forces": forces.tolist()}))


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2] == "1", int(sys.argv[3]))
