"""Estimates for parts of the step that share a launch with others and cannot be timed in it.

The suspension runs alone, by its stand-alone kernel, on the present state of one train copied many times: the
difference between many copies and one, over their number, is free of the cost of a public launch. Caches are warmer
than in the step. The time of contact is that of the launch with wheels less that without; contact starts from forces
that it has found before, at times with one iteration less than in the step.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from tiengine.engine.sine_stepper import SineStepper
from tiengine.kernels import layout as at
from tiengine.kernels.suspension import suspension_forces

__all__ = ["contact_us", "suspension_us"]

TRAIN_COPIES = 501  # below the 512 that Taichi gives one thread
REPEATS = 40


def contact_us(stepper: SineStepper) -> float:
    """Contact of one train in the last pass [us]; leaves the state as it was."""
    state, dims, clock = stepper.state, stepper.model.dims, time.perf_counter_ns
    launch = [stage for name, stage in stepper.stages if name == "forces and contact"][-1]
    live = (state.motion, state.contact, state.force, state.wheelset_force, state.rail_force)
    kept = [array.copy() for array in live]
    wheelsets, taken = int(dims[at.WHEELSETS]), np.empty((REPEATS, 2))
    for row in taken:
        for i, count in enumerate((0, wheelsets)):
            dims[at.WHEELSETS] = count
            start = clock()
            launch()
            row[i] = clock() - start
    for array, before in zip(live, kept, strict=True):
        array[:] = before
    without, with_wheels = np.median(taken, axis=0)
    return max(0.0, float(with_wheels - without)) * 1e-3 / int(dims[at.TRAINS])


def suspension_us(stepper: SineStepper) -> float:
    """One evaluation of one train's nonlinear elements [us]."""
    train = stepper.ingredients.train
    motion = np.stack([stepper.state.view(row, "vehicles")[0] for row in (at.U, at.V, at.F)])

    def evaluate(trains: int) -> Callable[[], object]:
        many = np.tile(motion, trains)
        return lambda: suspension_forces(
            train.n, train.element_index, train.element_row, train.element_kind, train.element_linear,
            train.element_table, np.zeros(len(train.element_kind)), many,
        )  # fmt: skip

    return _by_difference(evaluate, TRAIN_COPIES)


def _by_difference(evaluate: Callable[[int], Callable[[], object]], copies: int) -> float:
    """Time of one copy [us]: median of many copies' launches less that of one copy's, taken in turn."""
    clock = time.perf_counter_ns
    calls = evaluate(1), evaluate(copies)
    for call in calls:
        call()  # the first launch compiles
    taken = np.empty((REPEATS, 2))
    for row in taken:
        for i, call in enumerate(calls):
            start = clock()
            call()
            row[i] = clock() - start
    one, many = np.median(taken, axis=0)
    return max(0.0, float(many - one) / (copies - 1) * 1e-3)
