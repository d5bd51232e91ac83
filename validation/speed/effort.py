"""Repeats and sizes of the measurements."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Effort", "effort"]


@dataclass(frozen=True)
class Effort:
    """Repeats and sizes.

    Attributes:
        name: Name in the report.
        rounds: Number of repeats of each run.
        distance: Distance of each run [m].
        commands: Repeats of the whole command with a warm cache; the cold one is run once.
        lengths_km: Distances to compare, each in a process of its own [km].
        bench_rounds: Repeats of a block of steps in scaling curves.
        bench_steps: Steps in a block.
        profile_steps: Steps of a profile.
    """

    name: str
    rounds: int
    distance: float
    commands: int
    lengths_km: tuple[float, ...]
    bench_rounds: int
    bench_steps: int
    profile_steps: int


def effort(quick: bool, far: bool) -> Effort:
    """Choose an effort.

    Args:
        quick: Whether to measure in about four minutes.
        far: Whether to measure 100 km as well.
    """
    if quick:
        return Effort("quick", 2, 20.0, 1, (0.25, 0.5, 1.0), 3, 60, 1000)
    lengths = (5.0, 10.0, 20.0, 100.0) if far else (5.0, 10.0, 20.0)
    return Effort("long" if far else "whole", 5, 40.0, 3, lengths, 7, 150, 5000)
