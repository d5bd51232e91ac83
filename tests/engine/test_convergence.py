"""Order of convergence in the time step, on the paper's case (issue: order >= 1.7, error <= 0.3 % of the peak)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.simulation.simulate import AUTO_STEPS

from ..reference.stepping import model_of, run_steps

STEPS = (2e-4, 1e-4, 5e-5, 2.5e-5)
KINDS = ("vertical", "lateral")


@pytest.fixture(scope="module")
def forces() -> dict[str, list[NDArray[np.float64]]]:
    """Wheel forces of the first second at the instants of the longest step, by kind and step."""
    runs = [run_steps("paper", dt=dt, duration=1.0) for dt in STEPS]
    return {
        kind: [
            getattr(run, kind)[round(2e-4 / dt) - 1 :: round(2e-4 / dt)] for dt, run in zip(STEPS, runs, strict=True)
        ]
        for kind in KINDS
    }


def extrapolated(forces: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Richardson's limit of a second-order method from the two shortest steps."""
    return forces[-1] + (forces[-1] - forces[-2]) / 3.0


@pytest.mark.parametrize("kind", KINDS)
def test_order_is_two(forces, kind):
    """Three-grid order of 2e-4, 1e-4, 5e-5 in the root mean square.

    Measured 1.94 vertically and 1.75 laterally; 1.96 and 1.94 from 1e-4 on.
    """
    found = forces[kind]
    rms = [(a - b).std() for a, b in pairwise(found)]
    assert np.log2(rms[0] / rms[1]) > 1.7
    assert np.log2(rms[1] / rms[2]) > 1.85


@pytest.mark.parametrize("kind", KINDS)
def test_largest_error_falls_with_order_two(forces, kind):
    """Largest error of any wheel at any instant, against the limit, from 1e-4 on (measured 1.84 and 1.89).

    From 2e-4 to 1e-4 it falls by 2^1.4 and 2^1.6 only: 2e-4 s is not yet in the asymptotic range of the start's
    first milliseconds, and the second of two passes has not converged.
    """
    found, limit = forces[kind], extrapolated(forces[kind])
    worst = [np.abs(f - limit).max() for f in found]
    assert np.log2(worst[1] / worst[2]) > 1.7


@pytest.mark.parametrize("kind", KINDS)
def test_error_of_the_default_step(forces, kind):
    """0.3 % of the peak force at the longest step that "auto" tries (measured 0.07 and 0.20 %), 0.1 % at half of it."""
    limit = extrapolated(forces[kind])
    peak = np.abs(limit).max()
    for dt, bound in ((AUTO_STEPS[0], 3e-3), (AUTO_STEPS[1], 1e-3)):
        assert np.abs(forces[kind][STEPS.index(dt)] - limit).max() < bound * peak


def test_mortar_implicit_or_explicit():
    """Both are the same equations: what differs is the error of the iteration, and it shrinks from pass to pass.

    At the default two passes the difference is within the error of the step (0.3 % of the peak).
    """
    difference = []
    for passes in (2, 3, 4):
        runs = [
            run_steps(
                "paper",
                dt=2e-4,
                duration=0.3,
                model=model_of("paper", f"numerics.mortar='{mortar}'", dt=2e-4, passes=passes),
            )
            for mortar in ("implicit", "explicit")
        ]
        peaks = [np.abs(getattr(runs[0], kind)).max() for kind in KINDS]
        gaps = [np.abs(getattr(runs[0], kind) - getattr(runs[1], kind)).max() for kind in KINDS]
        difference.append(np.divide(gaps, peaks))
    print("\nimplicit against explicit mortar, share of the peak, 2, 3, 4 passes:", *difference)
    assert np.all(difference[0] < 3e-3)
    assert np.all(difference[1] < 0.5 * difference[0])
    assert np.all(difference[2] < 0.5 * difference[1])


def test_more_passes_converge():
    """The iterates approach the fully implicit step; two passes are within the step's own error of it."""
    runs = [run_steps("paper", dt=2e-4, duration=0.3, model=model_of("paper", dt=2e-4, passes=n)) for n in (2, 3, 4, 8)]
    for kind in KINDS:
        limit = getattr(runs[-1], kind)
        gap = [np.abs(getattr(run, kind) - limit).max() / np.abs(limit).max() for run in runs[:-1]]
        assert gap[0] < 3e-3
        assert gap[1] < 0.7 * gap[0]
        assert gap[2] < 0.7 * gap[1]
