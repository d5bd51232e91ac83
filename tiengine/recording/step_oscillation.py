"""Oscillation of the wheel forces at the step's own frequency, watched during a run.

A step that is unstable by a little lets the forces alternate from one step to the next, growing for thousands of steps
before anything runs away. Real motion does not look so: the irregularity must be resolved by eight steps a wave, and
the waves of an impact die out. So a few successive steps are looked at once in 20 ms: of an alternating force the sum
of squared second differences is four times that of first differences, of a sine with eight steps a period 0.6 times.

Nor is an oscillation that dies out an instability: after a blow, a step of the track of a millimetre, fine knots ring
on near the step's frequency for some tenths of a second, since average acceleration does not damp them, and beat
meanwhile. So the largest amplitudes of successive stretches of 0.1 s are compared: only what has grown since it was
least, or is large and has not abated, counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals

__all__ = ["StepOscillation"]

WINDOW = 8
"""Successive steps that are looked at."""

EVERY = 2e-2
"""Simulated time from one look to the next [s], at least a window."""

ALTERNATING = 3.0
"""Squared second differences over squared first ones: the mean of white noise, a sine of 3 steps a period."""

LEAST = 0.01
"""Amplitude over the static wheel load from which an oscillation counts: forces are wrong by as much."""

LASTING = 0.1
"""Time of windows with an oscillation, less that of windows without, that makes a stretch [s]: seats that pass modulate
an oscillation. As much time without it, and it has ended."""

GROWTH = 1.5
"""Growth of the largest amplitude from one stretch to a later one."""

LARGE = 0.2
"""Amplitude over the static wheel load that needs no further growth: friction bounds what is saturated."""

STEADY = 0.98
"""Largest amplitude of such a one over that of an earlier stretch: of what dies out it is less."""


@dataclass(eq=False)
class StepOscillation:
    """Looks at vertical and lateral wheel forces; B trains, W wheelsets. Its arrays are part of a checkpoint.

    Attributes:
        lasted: How long each wheel's force has alternated in this stretch, less how long not [s], shape (B, W, 2).
        largest: Largest amplitude in this stretch [N], same shape.
        least: Least of those of earlier stretches of the same oscillation [N], same shape; infinite before.
    """

    lasted: Reals
    largest: Reals
    least: Reals

    @classmethod
    def none(cls, trains: int, wheelsets: int) -> StepOscillation:
        """Nothing oscillates yet."""
        wheels = (trains, wheelsets, 2)
        return cls(np.zeros(wheels), np.zeros(wheels), np.full(wheels, np.inf))

    @staticmethod
    def interval(dt: float) -> int:
        """Steps of dt [s] from one look to the next."""
        return max(round(EVERY / dt), WINDOW)

    def look(self, samples: Reals, interval: float, static_load: float) -> tuple[NDArray[np.bool_], Reals]:
        """Judge the last steps.

        Args:
            samples: Vertical and lateral force of the wheels [N], shape (B, WINDOW, W, 2, 2).
            interval: Time since the last one [s].
            static_load: Of a wheel [N].

        Returns:
            Wheels whose force oscillates, shape (B, W, 2), and the amplitude [N] of each.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            first = np.diff(samples, axis=1)
            second = np.diff(first, axis=1)
            squares = np.mean(second * second, axis=1)
            alternates = squares > ALTERNATING * np.mean(first * first, axis=1)
            sizes = np.where(alternates, 0.25 * np.sqrt(squares), 0.0)  # +A, -A, +A differ by 4 A
        size = sizes.max(axis=-1)
        going = size > LEAST * static_load
        self.lasted += np.where(going, interval, -interval)
        np.maximum(self.largest, np.where(going, size, 0.0), out=self.largest)
        ended = (self.lasted <= -LASTING) | ((self.largest == 0.0) & np.isinf(self.least))
        complete = self.lasted > LASTING - 0.5 * interval
        large = (self.largest > LARGE * static_load) & (self.largest > STEADY * self.least)
        found = complete & np.isfinite(self.least) & ((self.largest > GROWTH * self.least) | large)
        size = np.where(found, self.largest, size)
        self.least[complete] = np.minimum(self.least, self.largest)[complete]
        self.least[ended] = np.inf
        self.lasted[complete | ended], self.largest[complete | ended] = 0.0, 0.0
        return found, size
