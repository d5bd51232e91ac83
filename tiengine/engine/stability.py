"""Stability of a time step, found with the step itself before the run.

The track's free vibration from random velocities, wheels lifted off, is advanced by the kernels and inverses of the
run, with the window moving at its speed. A track only loses energy, so growing energy is due to the step: the explicit
iterates of the fastenings are too stiff for the smeared fastenings of the implicit blocks. Contact needs no such
estimate; it is solved implicitly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.chunk import Chunk
from tiengine.engine.sine_state import SineState
from tiengine.engine.sine_stepper import SineStepper
from tiengine.kernels import layout as at
from tiengine.model.model import Model

__all__ = ["energy_growth"]

STEPS = 240
TOLERATED_GROWTH = 1.05
"""Later over earlier peak of energy: undamped pinned-pinned vibration keeps its energy to a few per cent of beating."""

LIFTED = -1.0  # m: wheels do not fall back onto the rail within the trial


def energy_growth(model: Model, V: float) -> float:
    """Peak of the track's energy in the last third of a trial over that in the second.

    Args:
        model: Constant data, factorised at V.
        V: Speed [m/s].

    Returns:
        Below about one for a stable step; infinite if the trial overflows.
    """
    state = SineState.at_rest(model)
    chunk = Chunk.empty(model.ingredients, STEPS, 1, 1)
    stepper = SineStepper(model, state, chunk)
    X = np.arange(1.0, STEPS + 1.0) * (V * model.ingredients.newmark.dt)
    stepper.load(X, np.full(STEPS, V), np.zeros(STEPS), np.zeros_like(chunk.irregularity))
    random = np.random.Generator(np.random.Philox(key=0))
    state.enter(model, int(chunk.clock[0, at.FIRST_SEAT]), int(chunk.clock[0, at.FIRST_SLAB]))
    for block in ("vertical", "lateral", "slabs"):
        velocity = state.view(at.V, block)
        velocity[:] = 1e-3 * random.standard_normal(velocity.shape)
    train = model.ingredients.train
    state.view(at.U, "vehicles")[:, 1 : train.n_dof : 5] = LIFTED
    energies = np.empty(STEPS)
    with np.errstate(over="ignore", invalid="ignore"):
        for i in range(STEPS):
            stepper.step(i)
            energies[i] = _energy(model, state)
    third = STEPS // 3
    growth = energies[2 * third :].max() / energies[third : 2 * third].max()
    return float(growth) if np.isfinite(growth) else float("inf")


def _energy(model: Model, state: SineState) -> float:
    """Kinetic and elastic energy of rails and slabs [J], the rails' by their decoupled fields."""
    s, mass, n = model.stiffness, model.window.modal_masses, model.ingredients.modes
    vertical, lateral = (_split(state, name, n) for name in ("vertical", "lateral"))
    total = 0.0
    for (u, v), masses, k in (
        (vertical, mass[:2], (s[:, 0], s[:, 1], s[:, 2])),
        (lateral, mass[2:], (s[:, 3], s[:, 4], s[:, 5])),
    ):
        total += float(np.sum(masses[:, None] * v**2))
        total += float(
            np.sum(k[0] * u[..., 0, :] ** 2 + 2 * k[1] * u[..., 0, :] * u[..., 1, :] + k[2] * u[..., 1, :] ** 2)
        )
    total += float(np.sum(s[:, 6] * lateral[0][..., 2, :] ** 2))
    slab = model.ingredients.designs.matrices[0]
    u, v = state.view(at.U, "slabs"), state.view(at.V, "slabs")
    total += float(np.sum(v * (v @ slab.M)) + np.sum(u * (u @ (slab.K_plate + slab.K_bed))))
    return 0.5 * total


def _split(state: SineState, block: str, modes: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Displacements and velocities of a rail block by field, shape (B, 2, fields, N)."""
    u, v = state.view(at.U, block), state.view(at.V, block)
    shape = (*u.shape[:2], -1, modes)
    return u.reshape(shape), v.reshape(shape)
