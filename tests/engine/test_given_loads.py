"""Given loads of a train in both kinds of step: balance, and trains with loads of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import DISPLACEMENT
from tiengine.engine.stepper import Stepper
from tiengine.model.constant_data import Model, shared_arrays
from tiengine.parameters.arrays import Reals
from tiengine.vehicle.given_loads import GivenLoads
from tiengine.vehicle.train import TrainModel

from ..models import V350, default_model, paper_model

STEPS = 20


@dataclass(frozen=True, eq=False)
class Held:
    """Random loads that do not change, for some trains."""

    train: TrainModel
    factors: tuple[float, ...] = (1.0,)

    @property
    def sets(self) -> int:
        """Trains with loads of their own."""
        return len(self.factors)

    def __call__(self, time: Reals, x: Reals, V: Reals, V_rate: Reals) -> GivenLoads:
        """Forces on every body, elongations that reach stops, rates of a sharp curve."""
        random, t = np.random.default_rng(11), self.train
        force = np.zeros(t.n)
        force[: t.n_dof] = random.uniform(-500.0, 500.0, t.n_dof)
        force[t.wheelset_dof[:, 3]] = 0.0  # a torque would make wheels slide
        elongation = random.uniform(-0.05, 0.05, len(t.element_kind))
        rate = random.uniform(-0.02, 0.02, (len(t.wheelset_x), 2))
        scale, ones = np.array(self.factors), np.ones(len(x))
        return GivenLoads(
            np.einsum("b,s,n->bsn", scale, ones, force),
            np.einsum("b,s,n->bsn", scale, ones, elongation),
            np.einsum("b,s,wk->bswk", scale, ones, rate),
        )


def loaded(model: Model, *factors: float) -> Stepper:
    """A step of a train under loads, loaded with steps at which it stands still."""
    held = Held(model.ingredients.train, factors)
    g = replace(model.ingredients, given=(held,), trains=len(factors))
    model = replace(model, ingredients=g, dims=shared_arrays(g)["dims"])
    state = state_at_rest(model)
    equilibrium(model, state, 0.0, V350)
    stepper = make_stepper(model, state, Chunk.empty(g, STEPS, STEPS))
    zero, V = np.zeros(STEPS), np.full(STEPS, V350)
    stepper.load(zero, V, zero, np.zeros_like(stepper.chunk.irregularity), g.given_loads(zero, zero, V, zero))
    return stepper


@pytest.mark.parametrize("model", [default_model, paper_model])
def test_the_start_under_given_loads_is_in_balance(model):
    """Host and kernels agree on forces, elements' elongations and rates of the frames.

    Tolerances as in the test of the start on straight track: it is found to 1e-4 N, forces of 1e7 N cancel.
    """
    stepper = loaded(model(), 1.0)
    state = stepper.state
    force, before = state.normal_force.copy(), state.part(0, "vehicles")[DISPLACEMENT].copy()
    for i in range(STEPS):
        stepper.step(i)
    assert np.abs(state.normal_force - force).max() < 0.01
    moved = np.abs(state.part(0, "vehicles")[DISPLACEMENT] - before)
    moved[stepper.ingredients.train.wheelset_dof[:, 3]] = 0.0  # wheels roll on
    assert moved.max() < 1e-6 * np.abs(before).max()
    assert np.ptp(force) > 500.0  # the loads are felt


def test_every_train_has_its_own_loads():
    """The first of two trains moves as alone, the second, whose loads change sides, does not."""
    alone, two = loaded(default_model(), 1.0), loaded(default_model(), 1.0, -1.0)
    for i in range(STEPS):
        alone.step(i)
        two.step(i)
    assert two.state.normal_force[0] == pytest.approx(alone.state.normal_force[0], rel=1e-12)
    assert np.abs(two.state.normal_force[1] - two.state.normal_force[0]).max() > 100.0
