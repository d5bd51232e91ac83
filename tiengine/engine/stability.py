"""Stability of a time step: growth of a disturbance, found with the step itself before the run.

The track's free vibration, wheels lifted off, is advanced over the seats. A track only loses energy, so that growth is
due to the step. Then two trains are advanced together in steady rolling, the track of one disturbed. What they differ
by is a disturbance of the whole coupled step, contact with creep included. Fewer steps do, since what the track does
without wheels is known.

What grows may be hidden for long by all that decays more slowly than it grows, if it begins with little. So every
coordinate begins with the same energy, the slopes of the rails and the nodes of the slabs as well, and the energy that
counts is that of second differences in time: what oscillates quickly stands out, and growth for physical reasons, such
as hunting, which takes thousands of steps, does not count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import DISPLACEMENT, VELOCITY, State
from tiengine.engine.stepper import Plan, Stepper
from tiengine.engine.vector_mode import lanes_for
from tiengine.model.constant_data import MassAndStiffness, Model, shared_arrays
from tiengine.model.ingredients import Ingredients, SlabDesigns
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError

__all__ = ["TOLERATED_GROWTH", "Growth", "of_trains", "step_growth", "with_gaps_closed", "with_stiffest_seats"]

TRACK = ("vertical", "lateral", "slabs")

ENERGY_SIZE = 3e-7  # J a coordinate, 1e-4 m/s of a metre of rail: above the contact's tolerance, which is still linear
CLOSED = 1e-15  # m: the play of a hanging seat whose gap is closed
LIFT = -100.0  # m: wheels fall by less within a trial

SHARE = 0.4
"""Steps of a trial over those of the run, within the limits below."""
SHORTEST, LONGEST = 480, 5000
"""Three times as many where growth is coming forth."""
ROLLING = 480
"""Steps of the trial of two trains."""
SAMPLED = 24
"""Steps over which the peak of an energy is taken."""

TOLERATED_GROWTH = 10.0
"""Growth of an oscillation over the run: rounding and contact leave a newton at most to grow from."""
BEATING = 1.05
"""Later over earlier energy without growth: undamped pinned-pinned vibration keeps its energy but for beating."""
OVERFLOW = 1e8
"""Squared disturbance over that at the start at which a trial ends."""
INFINITE = 1e300  # that of numbers that have run away
CHECKED = 20  # steps from one check for this to the next, in one launch


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
        seat_plays=None,
        dead=None,
    )


def with_gaps_closed(ingredients: Ingredients) -> Ingredients:
    """The track of a run with all gaps closed: the bed in contact, hanging seats with as good as no play.

    Args:
        ingredients: Of the run.
    """
    plays = ingredients.seat_plays
    closed = None if plays is None else lambda first, count: np.where(plays(first, count) > 0.0, CLOSED, 0.0)
    return replace(ingredients, seat_plays=closed, dead=None)


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
    """Growth in a trial of one train lifted off, or of two that roll.

    It is judged over the last third. If it has risen so much that it may soon be there, the trial is made three times
    as long.
    """
    trial = _Trial.of(model, V, count // 3, lanes, matrices)
    if trial is None:
        return Growth(0.0, 0.0)
    peaks = [trial.peak() for _ in range(3)]
    before, growth = (trial.growth(*pair) for pair in pairwise(peaks))
    if growth.rate + (growth.rate - before.rate) > growth.resolution and not trial.overflow:
        peaks += [trial.peak() for _ in range(6)]
        growth = trial.growth(peaks[5], peaks[8], parts=3)
    return trial.overflow or growth


@dataclass(eq=False)
class _Trial:
    """A disturbance that is advanced part by part, all of the same number of steps.

    Attributes:
        stepper: With two trains, what they differ by is the disturbance.
        energy: Of the disturbance.
        V: Speed [m/s].
        advance: Distance that the window moves in a step [m].
        steps: Of a part.
        done: Steps so far.
        overflow: Growth, once numbers have run away.
    """

    stepper: Stepper
    energy: _Energy
    V: float
    advance: float
    steps: int
    done: int = 0
    overflow: Growth | None = None

    @classmethod
    def of(cls, model: Model, V: float, steps: int, lanes: int, matrices: dict[str, MassAndStiffness]) -> _Trial | None:
        """Begin; none if there is no steady rolling to disturb."""
        g = model.ingredients
        state = state_at_rest(model, lanes)
        stepper = make_stepper(model, state, Chunk.empty(g, steps, 1))
        # a slow train also meets all places of the seats
        trial = cls(
            stepper, _Energy(matrices, state), V, max(V * g.newmark.dt, g.slab.fastening_pitch / (3 * steps)), steps
        )
        trial._load()
        if not _begin(model, state, V, matrices):
            return None
        trial.energy.begin()
        return trial

    def peak(self) -> float:
        """Largest energy in the last steps of the next part."""
        if self.overflow:
            return INFINITE
        if self.done:
            self._load()
        sampled = self.steps - SAMPLED
        with np.errstate(all="ignore"):
            for first in range(0, sampled, CHECKED):
                self._take(first, min(first + CHECKED, sampled))
                grown = self.energy.grown()
                if not grown < OVERFLOW:
                    rate = 0.5 * np.log(grown if np.isfinite(grown) else INFINITE) / (self.done + first + CHECKED)
                    self.overflow = Growth(float(rate), 0.0)
                    return INFINITE
            peak = 0.0
            for i in range(sampled, self.steps):
                self._take(i, i + 1)
                peak = max(peak, self.energy())
        self.done += self.steps
        return peak

    def growth(self, earlier: float, later: float, parts: int = 1) -> Growth:
        """Growth between energies a number of parts apart."""
        apart = parts * self.steps
        with np.errstate(all="ignore"):
            rate = 0.5 * np.log(later / earlier) / apart
        return Growth(float(rate) if np.isfinite(rate) else np.inf, 0.5 * float(np.log(BEATING)) / apart)

    def _take(self, first: int, end: int) -> None:
        steps = np.arange(first, end)
        nothing = np.full(len(steps), -1)
        self.stepper.take(Plan(steps, nothing, nothing))

    def _load(self) -> None:
        chunk, count = self.stepper.chunk, self.steps
        X = self.advance * (self.done + np.arange(1.0, count + 1.0))
        self.stepper.load(X, np.full(count, self.V), np.zeros(count), np.zeros_like(chunk.irregularity))


def _begin(model: Model, state: State, V: float, matrices: dict[str, MassAndStiffness]) -> bool:
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
        size = np.sqrt(2.0 * ENERGY_SIZE / matrices[name][0].diagonal())
        velocity[-1] += size * random.standard_normal(velocity.shape[1:])
        state.put(VELOCITY, name, velocity)
    return True


class _Energy:
    """Energy of the second differences in time of the track's disturbance [J]."""

    def __init__(self, matrices: dict[str, MassAndStiffness], state: State) -> None:
        self.state, self._matrices = state, matrices
        self._before: list[dict[str, Reals]] = []
        self._first = 0.0

    def begin(self) -> None:
        """Take the disturbance as the one at the start."""
        self._first = self._disturbance()

    def __call__(self) -> float:
        """Energy after one of several successive steps; zero until there are differences."""
        self._before = [*self._before[-2:], {name: self._part(name)[:2] for name in TRACK}]
        if len(self._before) < 3:
            return 0.0
        first, second, third = self._before
        total = 0.0
        for name, (M, K) in self._matrices.items():
            u, v = first[name] - 2.0 * second[name] + third[name]
            total += float(np.sum(v.T * (M @ v.T)) + np.sum(u.T * (K @ u.T)))
        return 0.5 * total

    def grown(self) -> float:
        """Sum of the squares of the rates over that at the start; the next energy is that after a first step."""
        self._before.clear()
        return self._disturbance() / self._first

    def _disturbance(self) -> float:
        return sum(float(np.sum(self._part(name)[VELOCITY] ** 2)) for name in TRACK)

    def _part(self, name: str) -> Reals:
        """Disturbance of a part, as :meth:`State.part`."""
        last = self.state.part(self.state.trains - 1, name)
        return last if self.state.trains == 1 else last - self.state.part(0, name)
