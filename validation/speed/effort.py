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
        share: Part of each run's distance that is run.
        commands: Repeats of the whole command with a warm cache; the cold one is run once.
        lengths_km: Distances to compare, each in a process of its own [km].
        bench_rounds: Repeats of a block of steps in scaling curves.
        bench_steps: Steps in a block.
        bench_points: Points of each scaling curve; None for all.
        full_length: Further numerics of the full-length model, sines per metre and step [s], whose errors are measured.
    """

    name: str
    rounds: int
    share: float
    commands: int
    lengths_km: tuple[float, ...]
    bench_rounds: int
    bench_steps: int
    bench_points: int | None
    full_length: tuple[tuple[float, float], ...]


FULL_LENGTH = (
    (3.0, 2e-4), (5.0, 2e-4), (6.5, 2e-4), (8.0, 2e-4), (6.5, 1e-4), (8.0, 1e-4), (10.0, 1e-4), (8.0, 5e-5),
)  # fmt: skip


def effort(quick: bool, far: bool) -> Effort:
    """Choose an effort.

    Args:
        quick: Whether to measure in about five minutes.
        far: Whether to measure 100 km as well.
    """
    if quick:
        return Effort("quick", 2, 0.2, 1, (0.25, 0.5, 1.0), 3, 50, 4, ())
    lengths = (5.0, 10.0, 20.0, 100.0) if far else (5.0, 10.0, 20.0)
    return Effort("long" if far else "whole", 5, 1.0, 3, lengths, 7, 150, None, FULL_LENGTH)
