"""Uplift of a fastening in windows of several lengths: recorded extremes converge as wheel forces do.

The rail lifts ahead of the leading wheel and behind the last one, 1.5 to 4 m from them, where the window's pinned
ends are nearer than to any wheel. References: the same run in a window 12 m beyond the outer wheels.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from validation.frame.case import Case

__all__ = ["CASES"]

START, DISTANCE, APART = 40.0, 110.0, 22.0  # m; seats that the whole train has passed
SPAN, LONGEST = 20.0, 44.0  # m between the outer wheels; window


@cache
def _seats(window: float) -> tuple[Reals, Reals, Reals]:
    """Chainage of the seats [m], their smallest and largest vertical forces, left and right [N]."""
    changes = (
        f"train.start={START}", f"train.distance={DISTANCE}", f"numerics.window={window}", "numerics.time_step=2e-4",
        'output.precision="double"',
    )  # fmt: skip
    with run(load_scenario("default", changes)) as result:
        seats = result.seats()
    x = seats["chainage"]
    passed = (x > START + APART) & (x < START + DISTANCE - APART)
    return x[passed], seats["smallest_vertical_force"][passed], seats["largest_vertical_force"][passed]


def _difference(window: float) -> list[float]:
    """Largest differences from the longest window [%]: uplift over the largest uplift, force over the largest force."""
    x, smallest, largest = _seats(window)
    reference = _seats(LONGEST)
    if not np.array_equal(x, reference[0]):
        raise ValueError("runs have not passed the same seats")
    lifted = np.abs(smallest - reference[1]).max() / -reference[1].min()
    pressed = np.abs(largest - reference[2]).max() / reference[2].max()
    return [float(100.0 * lifted), float(100.0 * pressed)]


CASES = (
    Case(
        name="uplift-window-36",
        kind="convergence",
        quantity="seats, window of 36 m (8 m beyond the outer wheels) less 44 m [%]: smallest vertical force over the"
        " largest uplift, largest over the largest",
        source="own run with 12 m beyond the outer wheels",
        reference=(0.5, 0.1),
        rule="at most",
        why="uplift is a tenth of the force: the bounds are the same 0.05 to 0.1 % of the largest force",
        compute=lambda: _difference(36.0),
    ),
    Case(
        name="uplift-window-28",
        kind="information",
        quantity="the same of a window of 28 m, 4 m beyond, the default until splines came",
        source="own run with 12 m beyond the outer wheels",
        reference=(np.nan, np.nan),
        why="the reason for 8 m",
        compute=lambda: _difference(28.0),
    ),
)
