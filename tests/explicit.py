"""Explicit part of a pass at a given state: forces of rails, slabs and seats, with the wheels lifted off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.chunk import Chunk
from tiengine.engine.sine_state import SineState
from tiengine.engine.sine_stepper import SineStepper
from tiengine.kernels import layout as at
from tiengine.model.model import Model

LIFTED = -1.0  # m


class Explicit:
    """Stages of a step up to its forces, launched one by one.

    Attributes:
        stepper: Bound to the state; ``stepper.scratch`` holds what the stages leave.
    """

    def __init__(
        self, model: Model, state: SineState, clock: NDArray[np.float64], constants: NDArray[np.float64] | None = None
    ) -> None:
        """Bind to a state and a window position, clock of shape (1, N_CLOCK)."""
        model = model if constants is None else replace(model, constants=constants)
        chunk = Chunk.empty(model.ingredients, 1, 1)
        chunk.clock[:] = clock
        self.state, self.stepper, self.model = state, SineStepper(model, state, chunk), model
        self.stepper.move(0)

    def first(self) -> None:
        """Forces of the first pass, from rows U_PREDICTED and V_PREDICTED."""
        train = self.model.ingredients.train
        self.state.view(at.U_PREDICTED, "vehicles")[:, 1 : train.n_dof : 5] = LIFTED
        self._run(("prepare", "rails", "slabs", "trains", "seats", "forces and contact"), 0)

    def second(self) -> None:
        """Forces of the second pass, from rows U, V, A; after the first."""
        train = self.model.ingredients.train
        self.state.view(at.U, "vehicles")[:, 1 : train.n_dof : 5] = LIFTED
        self._run(("factors", "seats", "forces and contact"), 1)

    def _run(self, wanted: tuple[str, ...], which: int) -> None:
        passed = 0
        for name, stage in self.stepper.stages:
            if passed == which and name in wanted:
                stage()
            passed += name == "forces and contact"

    def on_rails(self, train: int) -> NDArray[np.float64]:
        """Generalised forces of the seats on the rails, shape (2, 5, N): w, theta_y, v, theta_z, theta_x."""
        n = self.model.ingredients.modes
        v, l = (
            self.state.view(at.F, name)[train] - self.state.view(at.LINEAR, name)[train]
            for name in ("vertical", "lateral")
        )
        return np.concatenate([v.reshape(2, 2, n), l.reshape(2, 3, n)], axis=1)

    def on_slots(self, train: int) -> NDArray[np.float64]:
        """Generalised forces of the seats on the slabs, shape (slots, dofs)."""
        force = self.stepper.scratch.slab_force[train]
        generalised: NDArray[np.float64] = force.reshape(len(force), -1) @ self.model.slab_seats.T
        return generalised
