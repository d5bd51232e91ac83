"""Frame of a time step: what it offers to the time loop, to recorder and watchers, and to a profiler.

A kind of step derives from :class:`Stepper` and supplies its stages, its state and the matrices that depend on the
speed. Loading a chunk, running the stages in order, watchers after them and readings of a clock between them are the
same for all.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from tiengine.engine.chunk import Chunk
from tiengine.engine.load_rows import LoadRows
from tiengine.engine.lookout import Lookout
from tiengine.engine.state import State
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Flags, Ints, Reals
from tiengine.vehicle.given_loads import GivenLoads

__all__ = ["BETWEEN_STEPS", "Due", "Plan", "Rows", "Stage", "Stepper", "always"]

Call = Callable[[], object]
Stage = tuple[str, Call]
"""Name and call of a part of the step."""

BETWEEN_STEPS = "between stages"
"""Name of a clock reading before the first stage of a step."""


class Rows(NamedTuple):
    """Rows that a step fills.

    Attributes:
        step: Row of the chunk, also of the wheels' record: every step records the wheels.
        wheel: Number of the wheels' sample in the file's chunk, -1 if the step is none.
        body: Row of the bodies' record, -1 none.
    """

    step: int
    wheel: int = -1
    body: int = -1


class Plan(NamedTuple):
    """Rows of successive steps, each an array of shape (steps,); see :class:`Rows`."""

    step: Ints
    wheel: Ints
    body: Ints

    def part(self, first: int, end: int) -> Plan:
        """Steps from place ``first`` to before place ``end``."""
        return Plan(*(values[first:end] for values in self))


Due = Callable[[Plan], Flags]
"""Whether a watcher reads the state after each of the planned steps, shape (steps,)."""


def always(plan: Plan) -> Flags:
    """Each of the steps."""
    return np.ones(len(plan.step), dtype=np.bool_)


class Stepper(ABC):
    """Advances a group of trains.

    Attributes:
        ingredients: Track, train and numerics.
        state: Physical quantities at the end of the last step.
        chunk: Input and records of a number of steps.
        rows: Rows that the present step fills.
        moves: Whether seats, slabs or speed change at each loaded step, shape (steps,).
        stages: Own stages of one step, in their order.
        watchers: Stages after them, see :meth:`watch`.
        loads: Loads of the cars in the kernels' layout.
        factored_speed: Speed for which the matrices that depend on it were made [m/s].
    """

    factored_speed: float
    loads: LoadRows

    def __init__(self, ingredients: Ingredients, state: State, chunk: Chunk) -> None:
        """Keep the data of every kind of step; a derived class calls :meth:`bind` once its stages can be made."""
        self.ingredients, self.state, self.chunk = ingredients, state, chunk
        self.rows = Rows(-1)
        self.moves = np.zeros(0, dtype=np.bool_)
        self.stages: tuple[Stage, ...] = ()
        self.watchers: list[Stage] = []
        self.due: list[Due] = []
        self._mark: Callable[[str], object] | None = None

    def seat_extremes_due(self, plan: Plan) -> Flags:
        """Steps after which the extremes of the seats' forces must be taken from the state; by default all of them.

        Args:
            plan: Successive steps, at the first of which the stepper stands.
        """
        return always(plan)

    @abstractmethod
    def _stages(self) -> Iterator[Stage]:
        """Stages of one step in their order; the first lets seats and slabs in and out (:attr:`moves`)."""

    @abstractmethod
    def factor(self, V: float) -> None:
        """Make the matrices that depend on the speed V [m/s]."""

    @abstractmethod
    def finish(self, body_rows: int) -> None:
        """Complete the records of a chunk after its last step.

        Args:
            body_rows: Rows of the bodies' record that the chunk has filled.
        """

    @abstractmethod
    def compile(self) -> float:
        """Compile all kernels.

        Returns:
            Wall time [s]; small when Taichi finds them in its cache on disk.
        """

    def bind(self) -> None:
        """Make the stages."""
        self.stages = tuple(self._stages())

    def watch(self, name: str, call: Call, before: str | None = None, due: Due = always) -> None:
        """Call something at the end of steps.

        Args:
            name: Name of this stage.
            call: Reads :attr:`state`, :attr:`chunk` and :attr:`rows`.
            before: Name of the watcher that it precedes; None: it is the last.
            due: Steps of a plan after which ``call`` reads; :meth:`take` calls it after these only.
        """
        names = [each for each, _ in self.watchers]
        place = len(names) if before is None else names.index(before)
        self.watchers.insert(place, (name, call))
        self.due.insert(place, due)

    def look_out(self, lookout: Lookout) -> bool:
        """Check the state from time to time within the steps that are taken at once.

        Args:
            lookout: Says when, and what is to be called.

        Returns:
            Whether this kind of step can do it; if not, a guard must be a watcher.
        """
        return False

    def time_stages(self, mark: Callable[[str], object] | None) -> None:
        """Let a clock be read within the coming steps, or no longer.

        Args:
            mark: Called with ``BETWEEN_STEPS`` before the first stage, then with a stage's name after it, once for
                neighbours of the same name; None to end it. Such a reading costs about 0.1 us.
        """
        self._mark = mark

    def load(
        self, X: Reals, V: Reals, V_rate: Reals, irregularity: Reals, given: GivenLoads | None = None,
        time: Reals | None = None,
    ) -> None:  # fmt: skip
        """Fill the chunk for the coming steps.

        Args:
            X: Chainage of the window's rear end at the end of each step [m], shape (steps,).
            V: Speed [m/s].
            V_rate: Its rate [m/s^2].
            irregularity: Track channels, shape (B, steps, W, channels).
            given: Loads of the train beyond gravity; None where it has none.
            time: Ends of the steps since the start of the run [s], needed where the ground moves.
        """
        clock = window_clock(self.ingredients.slab, X, V, V_rate, self.ingredients.seat_reach)
        self.chunk.clock[: len(X), : at.N_CLOCK] = clock
        self.chunk.irregularity[:, : len(X)] = irregularity
        if given is not None:
            self.loads.fill(given, len(X))
        changes = np.diff(clock[:, [at.FIRST_SEAT, at.FIRST_SLAB, at.SPEED]], axis=0).any(axis=1)
        self.moves = np.concatenate([[True], changes])

    def step(self, i: int, wheel_row: int = -1, body_row: int = -1) -> None:
        """Advance to the end of step ``i`` of the chunk.

        Args:
            i: Row of the chunk.
            wheel_row: Row of the wheels' record to fill, -1 none.
            body_row: Row of the bodies' record to fill, -1 none.
        """
        self.rows = Rows(i, wheel_row, body_row)
        self.call((*self.stages, *self.watchers))

    def take(self, plan: Plan) -> None:
        """Take the planned steps one after another.

        A kind of step that can take several at once overrides this: between two of them nothing may read the state.
        """
        for rows in zip(*(values.tolist() for values in plan), strict=True):
            self.step(*rows)

    def call(self, stages: Sequence[Stage]) -> None:
        """Call stages in their order, with readings of the clock between those of other names if they are timed."""
        mark = self._mark
        if mark is None:
            for _, call in stages:
                call()
            return
        mark(BETWEEN_STEPS)
        for i, (name, call) in enumerate(stages):
            call()
            if i + 1 == len(stages) or stages[i + 1][0] != name:
                mark(name)
