"""Stability of a time step, found with the step itself before the run.

The track's free vibration from random velocities, wheels lifted off, is advanced by the kernels and inverses of the
run, with the window moving at its speed. A track only loses energy, so growing energy is due to the step: the explicit
iterates of the fastenings are too stiff for the smeared fastenings of the implicit blocks. Contact needs no such
estimate; it is solved implicitly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp

from tiengine.engine.chunk import Chunk
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import DISPLACEMENT, VELOCITY, State
from tiengine.kernels import layout as at
from tiengine.model.constant_data import Model

__all__ = ["energy_growth"]

STEPS = 240
TOLERATED_GROWTH = 1.05
"""Later over earlier peak of energy: undamped pinned-pinned vibration keeps its energy to a few per cent of beating."""

LIFTED = -1.0  # m: wheels do not fall back onto the rail within the trial


def energy_growth(model: Model, V: float, lanes: int | None = None) -> float:
    """Peak of the track's energy in the last third of a trial over that in the second.

    Args:
        model: Constant data of one train, factorised at V.
        V: Speed [m/s].
        lanes: See :func:`tiengine.engine.kinds.state_at_rest`.

    Returns:
        Below about one for a stable step; infinite if the trial overflows.
    """
    state = state_at_rest(model, lanes)
    chunk = Chunk.empty(model.ingredients, STEPS, 1, 1)
    stepper = make_stepper(model, state, chunk)
    X = np.arange(1.0, STEPS + 1.0) * (V * model.ingredients.newmark.dt)
    stepper.load(X, np.full(STEPS, V), np.zeros(STEPS), np.zeros_like(chunk.irregularity))
    random = np.random.Generator(np.random.Philox(key=0))
    state.enter(int(chunk.clock[0, at.FIRST_SEAT]), int(chunk.clock[0, at.FIRST_SLAB]))
    for name in ("vertical", "lateral", "slabs"):
        state.put(VELOCITY, name, 1e-3 * random.standard_normal((1, *state.part(0, name).shape[1:])))
    lifted = np.zeros(model.ingredients.train.n)
    lifted[1 : model.ingredients.train.n_dof : 5] = LIFTED
    state.put(DISPLACEMENT, "vehicles", lifted)
    energy = _energy(model, state)
    energies = np.empty(STEPS)
    with np.errstate(over="ignore", invalid="ignore"):
        for i in range(STEPS):
            stepper.step(i)
            energies[i] = energy()
    third = STEPS // 3
    growth = energies[2 * third :].max() / energies[third : 2 * third].max()
    return float(growth) if np.isfinite(growth) else float("inf")


def _energy(model: Model, state: State) -> Callable[[], float]:
    """Kinetic and elastic energy of rails and slabs of the first train [J]."""
    slab = model.ingredients.designs.matrices[0]
    plates = sp.csr_array(slab.M), sp.csr_array(slab.K_plate + slab.K_bed)
    parts = list(zip(("vertical", "lateral", "slabs"), (*model.rails_at_rest, plates), strict=True))

    def energy() -> float:
        total = 0.0
        for name, (M, K) in parts:
            u, v, _ = state.part(0, name)
            total += float(np.sum(v.T * (M @ v.T)) + np.sum(u.T * (K @ u.T)))
        return 0.5 * total

    return energy
