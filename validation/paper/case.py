"""The paper's case: 600 m at 350 km/h, window of 36 m, 60 modes, German low disturbance.

References: the source paper's degrees of freedom; statistics of an independent NumPy prototype of the
same equations with the same parts (another realisation of the same spectrum), with the digits noted there.
Statistics leave out the first 50 m.
"""

from __future__ import annotations

import numpy as np

from tiengine.parameters.arrays import Reals
from validation.frame.case import Case
from validation.frame.models import paper_model
from validation.frame.runs import Forces, simulate

PROTOTYPE = "independent prototype, another realisation"
RUN_IN = 50.0  # m


def _paper() -> Forces:
    return simulate("paper")


def _after_run_in(values: Reals) -> Reals:
    position = _paper().position
    return values[position > position[0] + RUN_IN]


def _at_rest() -> Reals:
    """Mean lateral creep force and net lateral force of a wheel on a smooth track [kN]."""
    run = simulate("paper", 'irregularity.spectrum="none"', "train.distance=110.0", "numerics.time_step=0.0002")
    return 1e-3 * np.array([np.abs(run.creep).mean(), np.abs(run.lateral).mean()])


def _kilonewton(values: Reals) -> Reals:
    return 1e-3 * _after_run_in(values)


CASES = (
    Case(
        name="paper-vertical",
        kind="validation",
        quantity="standard deviation of the vertical wheel forces [kN]",
        source=PROTOTYPE,
        reference=20.0,
        rtol=0.2,
        why="one realisation of 600 m against another, printed as 20",
        compute=lambda: _kilonewton(_paper().vertical).std(),
    ),
    Case(
        name="paper-mean",
        kind="validation",
        quantity="mean of the vertical wheel forces [kN]",
        source="static wheel load of CRH380A v2",
        reference=68.7,
        rtol=0.01,
        why="mean over 5.7 s, while the car bounces at 0.7 Hz",
        compute=lambda: _kilonewton(_paper().vertical).mean(),
    ),
    Case(
        name="paper-creep-at-rest",
        kind="validation",
        quantity="lateral creep force (spin) and net lateral force of a wheel in steady rolling [kN]",
        source=PROTOTYPE,
        reference=(1.35, 0.37),
        atol=0.03,
        why="printed digits; depends on the smoothing of the contact table",
        compute=_at_rest,
    ),
    Case(
        name="paper-lateral",
        kind="information",
        quantity="lateral wheel forces: standard deviation, largest [kN]; prototype: a few kN, peaks to 25",
        source=PROTOTYPE,
        reference=(np.nan, 25.0),
        why="peaks depend on the realisation",
        compute=lambda: [
            _kilonewton(_paper().lateral).std(),
            np.abs(_kilonewton(_paper().lateral)).max(),
        ],
    ),
    Case(
        name="paper-lift-off",
        kind="information",
        quantity="share of time in which a wheel is off the rail [%]; prototype: occasionally",
        source=PROTOTYPE,
        reference=np.nan,
        why="depends on the realisation",
        compute=lambda: 100.0 * np.mean(_after_run_in(_paper().normal) <= 0.0),
    ),
    *(
        Case(
            name=f"paper-dofs-{count}",
            kind="information",
            quantity=f"degrees of freedom, {words}",
            source="the source paper; its 44 DOFs per slab do not follow from 18 standard plate elements",
            reference=943,
            why="35 + 2 x 5 x 60 + slabs x (3 x 30 nodes + lateral and yaw)",
            compute=lambda count=count: paper_model(f'numerics.slab_count="{count}"').ingredients.dof_counts["total"],
        )
        for count, words in (("paper", "7 slabs as in the paper"), ("cover", "8 slabs, full cover"))
    ),
    Case(
        name="paper-real-time-factor",
        kind="information",
        quantity=("wall time of the loop over simulated time: pre-bound launches (600 m), public ones (50 m)"),
        source="-",
        reference=(np.nan, np.nan),
        why="on the machine that wrote this table; without compilation and set-up",
        compute=lambda: [
            _paper().facts["real_time_factor"],
            simulate("paper", "train.distance=50.0", public=True).facts["real_time_factor"],
        ],
    ),
)
