"""Stability of a time step: growth of a disturbance, found with the step itself before the run.

The track's free vibration from small random velocities, wheels lifted off, is advanced over the seats. A track only
loses energy, so that growing energy is due to the step.

Then two trains are advanced together in steady rolling, the track of one disturbed. What they differ by is a
disturbance of the whole coupled step, contact with creep included. It may grow for physical reasons, such as hunting,
within thousands of steps; only what oscillates at the step's own frequency counts, by its second differences in time.
Fewer steps do, since what the track does without wheels is known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import DISPLACEMENT, VELOCITY, State
from tiengine.engine.vector_mode import lanes_for
from tiengine.model.constant_data import MassAndStiffness, Model, shared_arrays
from tiengine.model.ingredients import Ingredients, SlabDesigns
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["TOLERATED_GROWTH", "Growth", "of_trains", "step_growth", "with_stiffest_seats"]

TRACK = ("vertical", "lateral", "slabs")

VELOCITY_SIZE = 1e-4  # m/s: far above what the contact's tolerance leaves, and contact is still linear
LIFT = -100.0  # m: wheels fall by less within a trial

SHARE = 0.4
"""Steps of a trial over those of the run, within the limits below."""
SHORTEST, LONGEST = 480, 3000
"""At first the decay of all that is damped hides what grows; what has not come forth after LONGEST grows slowly."""
ROLLING = 480
"""Steps of the trial of two trains."""
EARLIER = 2.0 / 3.0
"""Place of the earlier energy in a trial; the later one is taken at its end."""
SAMPLED = 24
"""Steps over which the peak of an energy is taken."""

TOLERATED_GROWTH = 10.0
"""Growth of an oscillation over the run: rounding and contact leave a newton at most to grow from."""
BEATING = 1.05
"""Later over earlier energy without growth: undamped pinned-pinned vibration keeps its energy but for beating."""
OVERFLOW = 1e8
"""Squared disturbance over that at the start at which a trial ends."""
INFINITE = 1e300  # that of numbers that have run away
CHECKED = 20  # steps from one check for this to the next


@dataclass(frozen=True)
class Growth:
    """Growth of a disturbance.

    Attributes:
        rate: Logarithm of its amplitude's growth a step.
        resolution: Smallest rate that the trial tells from none.
    """

    rate: float
    resolution: float

    def over(self, steps: float) -> float:
        """Growth over a number of steps; infinite if it overflows."""
        exponent = self.rate * steps
        return float(np.exp(exponent)) if exponent < 700.0 else float("inf")

    def tolerable(self, steps: float) -> bool:
        """Whether a run of so many steps is left unharmed."""
        return self.rate <= self.resolution or self.over(steps) <= TOLERATED_GROWTH


def with_stiffest_seats(ingredients: Ingredients, factor: float) -> Ingredients:
    """The track of a run with all seats as its stiffest, which are the most damped as well.

    Args:
        ingredients: Of the run.
        factor: Largest factor of a fastening.
    """
    designs = ingredients.designs
    return replace(
        ingredients,
        seat_factors=lambda first, count: np.full((count, 2), factor),
        designs=SlabDesigns(designs.matrices[:1], np.full_like(designs.seat_scale[:1], factor), {}),
    )


def of_trains(model: Model, trains: int) -> Model:
    """The same model for another number of trains: only sizes differ, all else is shared."""
    ingredients = replace(model.ingredients, trains=trains)
    return replace(model, ingredients=ingredients, dims=shared_arrays(ingredients)["dims"])


def step_growth(model: Model, V: float, steps: float, lanes: int | None = None) -> Growth:
    """Growth of a disturbance by the step.

    Args:
        model: Constant data, made for V.
        V: Speed [m/s].
        steps: Of the run.
        lanes: See :func:`tiengine.engine.kinds.state_at_rest`; by default those of one train.
    """
    lanes = lanes or lanes_for(1)
    model = replace(model, ingredients=replace(model.ingredients, given=()))  # given loads do not depend on the motion
    count = int(np.clip(SHARE * steps, SHORTEST, LONGEST))
    slab = model.ingredients.designs.matrices[0]
    plates = sp.csr_array(slab.M), sp.csr_array(slab.K_plate + slab.K_bed)
    matrices = dict(zip(TRACK, (*model.rails_at_rest, plates), strict=True))
    alone = _growth(of_trains(model, 1), V, count, lanes, matrices)
    if not alone.tolerable(steps):
        return alone
    rolling = _growth(of_trains(model, 2), V, min(count, ROLLING), lanes, matrices)
    return alone if rolling.tolerable(steps) else rolling


def _growth(model: Model, V: float, count: int, lanes: int, matrices: dict[str, MassAndStiffness]) -> Growth:
    """Growth in a trial of one train lifted off, or of two that roll."""
    g = model.ingredients
    state, chunk = state_at_rest(model, lanes), Chunk.empty(g, count, 1)
    stepper = make_stepper(model, state, chunk)
    advance = max(V * g.newmark.dt, g.slab.fastening_pitch / count)  # a slow train also meets all places of the seats
    X = advance * np.arange(1.0, count + 1.0)
    stepper.load(X, np.full(count, V), np.zeros(count), np.zeros_like(chunk.irregularity))
    if not _begin(model, state, V):
        return Growth(0.0, 0.0)
    energy = _Energy(matrices, state)
    earlier, later, apart = int(EARLIER * count), count, count - int(EARLIER * count)
    first, peaks = energy.disturbance(), {earlier: 0.0, later: 0.0}
    with np.errstate(all="ignore"):
        for i in range(count):
            stepper.step(i)
            near = earlier if i < earlier else later
            if i >= near - SAMPLED:
                peaks[near] = max(peaks[near], energy())
            elif i % CHECKED == 0:
                energy.begin()
                grown = energy.disturbance() / first
                if not grown < OVERFLOW:
                    return Growth(0.5 * np.log(grown if np.isfinite(grown) else INFINITE) / (i + 1), 0.0)
        rate = 0.5 * np.log(peaks[later] / peaks[earlier]) / apart
    return Growth(float(rate) if np.isfinite(rate) else np.inf, 0.5 * np.log(BEATING) / apart)


def _begin(model: Model, state: State, V: float) -> bool:
    """Disturb the track of the last train, and lift off one that is alone; whether there is a steady rolling."""
    if state.trains == 1:
        state.enter(0, 0)
        train = model.ingredients.train
        above = np.zeros(train.n)
        above[1 : train.n_dof : 5] = LIFT
        state.put(DISPLACEMENT, "vehicles", above)
    else:
        try:
            equilibrium(model, state, 0.0, V)
        except InputError:  # the run will say so, or starts otherwise
            return False
    random = np.random.Generator(np.random.Philox(key=0))
    for name in TRACK:
        velocity = np.stack([state.part(b, name)[VELOCITY] for b in range(state.trains)])
        velocity[-1] += VELOCITY_SIZE * random.standard_normal(velocity.shape[1:])
        state.put(VELOCITY, name, velocity)
    return True


class _Energy:
    """Energy of the track's disturbance [J]; of its second differences in time for trains that roll."""

    def __init__(self, matrices: dict[str, MassAndStiffness], state: State) -> None:
        self.state, self._matrices = state, matrices
        self._before: list[dict[str, Reals]] = []

    def begin(self) -> None:
        """Forget the motion at earlier steps."""
        self._before.clear()

    def __call__(self) -> float:
        """Energy after a step; zero until there are differences."""
        motion = {name: self._part(name)[:2] for name in TRACK}
        if self.state.trains > 1:
            self._before = [*self._before[-2:], motion]
            if len(self._before) < 3:
                return 0.0
            first, second, third = self._before
            motion = {name: first[name] - 2.0 * second[name] + third[name] for name in TRACK}
        total = 0.0
        for name, (M, K) in self._matrices.items():
            u, v = motion[name]
            total += float(np.sum(v.T * (M @ v.T)) + np.sum(u.T * (K @ u.T)))
        return 0.5 * total

    def disturbance(self) -> float:
        """Sum of the squares of the rates."""
        return sum(float(np.sum(self._part(name)[VELOCITY] ** 2)) for name in TRACK)

    def _part(self, name: str) -> Reals:
        """Disturbance of a part, as :meth:`State.part`."""
        last = self.state.part(self.state.trains - 1, name)
        return last if self.state.trains == 1 else last - self.state.part(0, name)
