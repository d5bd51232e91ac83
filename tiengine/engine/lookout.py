"""Lookout of a launch of several steps: it stops where a guard must check the state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tiengine.parameters.arrays import Reals

__all__ = ["Lookout"]


@dataclass(eq=False)
class Lookout:
    """Where launches stop.

    Attributes:
        every: Steps between two looks at the state.
        limits: Limits of a sound state, see ``kernels.spline_layout``, shape (N_LIMITS,).
        check: Called with the row of the step at which a launch stopped.
        steps_before: Steps before the chunk's first, from which looks are counted.
        always: Stop at every look.
    """

    every: int
    limits: Reals
    check: Callable[[int], None]
    steps_before: int = 0
    always: bool = True
