"""The moving window against the traditional full-length model, over the same 600 m of track.

Both run the scenario ``paper`` from chainage 30 m. Relative difference: the largest absolute difference of a force
over all wheels and times, over the largest force of the full-length model. The rms difference over the standard
deviation is given as well, since a single impact after a wheel lift determines the largest one.

The time step is 2.5e-5 s here: at 2e-4 s one would compare the step errors of both programs at such an impact, not the
window. With pinned ends the largest difference at 36 m is an echo of the impact: it reaches the leading wheel 4.7 and
7.9 ms after landing, and 16 m there and back at the shear wave speed sqrt(kappa G / rho) = 2030 m/s take 7.9 ms. The
36 m window is therefore judged with its absorbing zones, and its pinned ends are listed for information.

Splines are compared with the full-length model's sines at a density of its own, on the same seats of 0.15 m, both with
the static compliance that they lack under the wheels: equal density has no meaning between the two kinds, so that the
comparison is one of two nearly converged programs, and two densities of the full-length model tell its own error.

Slabs of the full-length model have all modes of the engine's mesh where the rails are to be compared, and 20 modes
where the traditional model is meant.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from validation.frame.case import Case
from validation.frame.runs import Forces, full_length, simulate
from validation.msm.simulate import FullLength

__all__ = ["ABSORBING", "ALL_MODES", "CASES", "Difference", "difference", "full", "window"]

STEP, COARSE_STEP = 2.5e-5, 2e-4
ALL_MODES, TRADITIONAL_MODES = 90, 20  # modes of a slab, whose mesh has 90
PER_METRE = 2.0
DENSITIES = (6.5, 10.0)  # of the full-length model beside splines
LENGTHS = (24, 36, 48, 60)
SAME_WAY = ("train.start=30", "train.distance=600")
ABSORBING = "numerics.absorbing_zone=6.0"
SOURCE = "traditional model, 661.5 m of rail, 2 modes per metre, slabs with all modes of the mesh"


class Difference(NamedTuple):
    """Differences of two runs in one direction: largest over the peak, rms over the standard deviation [%]."""

    largest: float
    rms: float


def window(
    length: float, per_metre: float = PER_METRE, truncation: str = "none", step: float = STEP, *overrides: str
) -> Forces:
    """The paper's case in a window of the given length [m] and modes per metre."""
    return simulate("paper", *_settings(step), *(_windowed(length, per_metre, truncation)), *overrides)


def full(
    slab_modes: int = ALL_MODES, truncation: str = "none", step: float = STEP, length: float = 660.0, *overrides: str
) -> Forces:
    """The paper's case in the full-length model."""
    numerics = FullLength(length, PER_METRE, slab_modes, step)
    return full_length("paper", numerics, *_settings(step), f'numerics.truncation="{truncation}"', *overrides)


def _settings(step: float) -> tuple[str, ...]:
    return (*SAME_WAY, f"numerics.time_step={step}", f"output.wheel_interval={max(step, 1e-4)}")


def _windowed(length: float, per_metre: float, truncation: str) -> tuple[str, ...]:
    return (
        f"numerics.window={float(length)}",
        f"numerics.modes_per_metre={per_metre!r}",
        f'numerics.truncation="{truncation}"',
    )


def difference(reference: Forces, other: Forces, direction: str, wheelset: int | None = None) -> Difference:
    """Compare two runs over their common distance.

    Args:
        reference: Run that defines peak and standard deviation.
        other: Sampled at the same times.
        direction: ``"vertical"`` or ``"lateral"``.
        wheelset: One wheelset only, 0 the leading one.
    """
    n = min(len(reference.time), len(other.time))
    if not np.allclose(reference.time[:n], other.time[:n], rtol=0.0, atol=1e-9):
        raise ValueError("runs are not sampled at the same times")
    pick = slice(None) if wheelset is None else wheelset
    a, b = (getattr(run, direction)[:n, pick] for run in (reference, other))
    largest = np.abs(a - b).max() / np.abs(a).max()
    rms = np.sqrt(np.mean((a - b) ** 2)) / np.sqrt(np.mean((a - a.mean(axis=0)) ** 2))
    return Difference(100.0 * float(largest), 100.0 * float(rms))


SHORT = ("train.start=30", "train.distance=15", "numerics.time_step=1e-4", "irregularity.taper=10")
SHORT_RAIL = 60.0  # m
PADS = 'track.fastening={like="ACE2021", length=0.15}'


def _short(direction: str, *overrides: str) -> float:
    """Largest difference over the peak [%] on 60 m of rail at 1e-4 s, sines of equal density."""
    reference = full_length("paper", FullLength(SHORT_RAIL, PER_METRE, ALL_MODES, 1e-4), *SHORT, *overrides)
    ours = simulate("paper", *SHORT, *_windowed(36, PER_METRE, "none"), *overrides)
    return difference(reference, ours, direction).largest


def _dense(per_metre: float) -> Forces:
    """The full-length model on the default's seats of 0.15 m, corrected under the wheels."""
    return full_length("default", FullLength(SHORT_RAIL, per_metre, ALL_MODES, 1e-4), *SHORT)


def _short_splines(direction: str, *overrides: str) -> list[float]:
    """Largest difference over the peak [%] of the default from the full-length model at both densities."""
    ours = simulate("default", *SHORT, *overrides)
    return [difference(_dense(per_metre), ours, direction).largest for per_metre in DENSITIES]


CASES = (
    *(
        Case(
            name=f"equal-density-short-{direction}",
            kind="full length",
            quantity=f"{direction} forces over 15 m, 36 m window minus 60 m of rail, largest difference over peak [%]",
            source="traditional model, 60 m of rail, 2 modes per metre, slabs with all modes of the mesh",
            reference=0.2,
            rule="at most",
            why="allowed effect of the window's ends; no wheel lifts off here",
            compute=lambda direction=direction: _short(direction),
        )
        for direction in ("vertical", "lateral")
    ),
    *(
        Case(
            name=f"equal-density-seats-{direction}",
            kind="full length",
            quantity=f"{direction} forces over 15 m as above, with seats of 0.15 m in both models [%]",
            source="traditional model, 60 m of rail, 2 modes per metre, slabs with all modes of the mesh",
            reference=0.2,
            rule="at most",
            why="allowed effect of the window's ends, as with point seats",
            compute=lambda direction=direction: _short(direction, PADS),
        )
        for direction in ("vertical", "lateral")
    ),
    *(
        Case(
            name=f"splines-short-{direction}",
            kind="full length",
            quantity=f"{direction} forces over 15 m, default splines in 36 m minus 60 m of rail with 6.5 and 10 sines a"
            " metre, seats of 0.15 m, largest difference over peak [%]",
            source="traditional model, slabs with all modes of the mesh",
            reference=(bound, bound),
            rule="at most",
            why=why,
            compute=lambda direction=direction: _short_splines(direction),
            quick=False,
        )
        for direction, bound, why in (
            ("vertical", 0.5, "required bound of the default's error"),
            ("lateral", 1.0, "required bound of the default's error"),
        )
    ),
    Case(
        name="splines-short-densities",
        kind="information",
        quantity="the full-length model at 6.5 sines a metre minus 10 a metre, largest difference over peak [%]:"
        " vertical, lateral",
        source="traditional model against itself",
        reference=(np.nan, np.nan),
        why="how far the reference of the rows above is converged",
        compute=lambda: [
            difference(_dense(DENSITIES[1]), _dense(DENSITIES[0]), direction).largest
            for direction in ("vertical", "lateral")
        ],
        quick=False,
    ),
    *(
        Case(
            name=f"equal-density-{length}-{direction}",
            kind="full length",
            quantity=f"{direction} forces over 600 m, {length} m window{', absorbing zones of 6 m' * bool(ends)},"
            " 2 modes per metre, largest difference over peak [%]",
            source=SOURCE,
            reference=bound,
            rule="at most",
            why="expected agreement of two independent programs",
            compute=lambda length=length, direction=direction, ends=ends: (
                difference(full(), window(length, PER_METRE, "none", STEP, *ends), direction).largest
            ),
            quick=False,
        )
        for length, direction, bound, ends in (
            (36, "vertical", 0.2, (ABSORBING,)),
            (36, "lateral", 0.2, (ABSORBING,)),
            (60, "lateral", 0.1, ()),
        )
    ),
    Case(
        name="pinned-ends-36",
        kind="information",
        quantity="the same with the pinned ends of the plain 36 m window, vertical and lateral [%]",
        source=SOURCE,
        reference=(np.nan, np.nan),
        why="effect removed by the absorbing zones: an echo of the impact of a landing wheel",
        compute=lambda: [difference(full(), window(36), direction).largest for direction in ("vertical", "lateral")],
        quick=False,
    ),
    *(
        Case(
            name=f"window-length-{direction}",
            kind="information",
            quantity=f"{direction} forces, windows of 24, 36, 48, 60 m, rms difference over standard deviation [%]",
            source=SOURCE,
            reference=(np.nan,) * len(LENGTHS),
            why="the effect of a longer window",
            compute=lambda direction=direction: [
                difference(full(), window(length), direction).rms for length in LENGTHS
            ],
            quick=False,
        )
        for direction in ("vertical", "lateral")
    ),
    *(
        Case(
            name=f"slabs-by-20-modes-{direction}",
            kind="information",
            quantity=f"{direction} forces, slabs by 20 modes instead of 90: largest over peak, rms over standard"
            " deviation [%]",
            source="traditional model against itself; 0.4 % by another program",
            reference=(np.nan, np.nan),
            why="the reason for comparing the rails on equal slabs",
            compute=lambda direction=direction: difference(full(), full(TRADITIONAL_MODES, length=600.0), direction),
            quick=False,
        )
        for direction in ("vertical", "lateral")
    ),
)
