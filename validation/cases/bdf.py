"""The step against SciPy's BDF (the paper used the related ode15s of MATLAB) on the same equations.

The equations are assembled independently of the step (:mod:`validation.cases.semi_discrete`). The window extends 2 m
beyond the outer wheels, with three plate elements per slab and one sine per metre (431 degrees of freedom), or 3 m,
with splines on knots from 0.6 m near the wheels to 2 m, and seats of 0.15 m. A seat that enters acts from one instant
on, wherever this lies in a step: that is of first order, with splines and seats of 0.15 m 4e-5 at 2.5e-5 s where they
enter 2 m from a wheel, and not to be seen from 3 m. The German spectrum for high disturbance begins within 2 m, so that
all wheels move vertically and laterally. Errors are the largest over all wheels and times, relative to the
range of the forces.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import state_at_rest
from tiengine.irregularity.irregularity import make_irregularity
from tiengine.model.from_scenario import ingredients
from tiengine.model.model import build_model
from tiengine.scenario.scenario import load_scenario
from validation.cases.semi_discrete import SemiDiscrete
from validation.frame.case import Case
from validation.frame.runs import simulate

SHORT = (
    "numerics.window=24.0",
    "numerics.modes_per_metre=1",
    "irregularity.spectrum='german_high'",
    "irregularity.taper=2",
    'track.slab={like="CRTS_III", elements_x=3, elements_y=1}',
)
KINDS = {
    "sines": SHORT,
    "splines": (
        *SHORT,
        "numerics.window=26.0",
        'numerics.trial_functions="splines"',
        "numerics.knots={finest=0.6, growth=0.4, coarsest=2.0}",
        'track.fastening={like="ACE2021", length=0.15}',
    ),
}
RTOL = 1e-8
SIZES = 1e-4, 1e-2  # m or rad, and their rates: scales of the absolute tolerances
SAMPLE, DURATION = 2e-4, 0.05
STEPS = (1e-4, 5e-5, 2.5e-5)
ASYMPTOTIC = 5e-5, 2.5e-5
"""Steps from which the order of splines is taken."""
FINEST = 1.25e-5, 6.25e-6


@cache
def _reference(kind: str) -> NDArray[np.float64]:
    """Vertical and lateral wheel forces by BDF [N], shape (samples, wheelsets, 2, 2)."""
    scenario = load_scenario("paper", [*KINDS[kind], "numerics.time_step=1e-4"])
    V = scenario.train.speed.at(0.0)[0]
    model = build_model(ingredients(scenario, STEPS[0]), V)
    state = state_at_rest(model)
    equilibrium(model, state, 0.0, V)
    track = make_irregularity(scenario.irregularity, float(model.ingredients.wheel_s.max()))
    equations = SemiDiscrete(model, track, V, range(model.ingredients.slots))
    times = np.arange(1, round(DURATION / SAMPLE) + 1) * SAMPLE
    found = solve_ivp(
        equations.rhs,
        (0.0, times[-1]),
        equations.pack(state),
        method="BDF",
        jac=equations.jacobian,
        rtol=RTOL,
        atol=RTOL * np.repeat(SIZES, equations.n),
        t_eval=times,
    )
    if not found.success:
        raise RuntimeError(found.message)
    return np.array([equations.contact(t, y).rail[0, :, :, :2] for t, y in zip(times, found.y.T, strict=True)])


@cache
def _run(kind: str, dt: float) -> NDArray[np.float64]:
    """Vertical and lateral wheel forces of the step [N], shape (samples, wheelsets, 2, 2)."""
    settings = (f"numerics.time_step={dt}", f"output.wheel_interval={SAMPLE}", "train.distance=4.9")
    run = simulate("paper", *KINDS[kind], *settings)
    return np.stack([run.vertical, run.lateral], axis=-1)[: round(DURATION / SAMPLE)]


def _distance(ours: NDArray[np.float64], reference: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest difference over the range of the vertical and of the lateral forces."""
    result: NDArray[np.float64] = np.abs(ours - reference).max(axis=(0, 1, 2)) / np.ptp(reference, axis=(0, 1, 2))
    return result


def _error(kind: str, dt: float) -> NDArray[np.float64]:
    """Difference to BDF."""
    return _distance(_run(kind, dt), _reference(kind))


def _orders(kind: str) -> NDArray[np.float64]:
    """Order in dt of both errors, from each step to the next: sines against BDF, splines against their finest steps."""
    if kind == "sines":
        errors = np.array([_error(kind, dt) for dt in STEPS])
    else:
        coarse, fine = (_run(kind, dt) for dt in FINEST)
        errors = np.array([_distance(_run(kind, dt), (4.0 * fine - coarse) / 3.0) for dt in ASYMPTOTIC])
    return np.log2(errors[:-1] / errors[1:]).ravel()


CASES = tuple(
    case
    for kind, name, words, source, count, why in (
        (
            "sines",
            "bdf",
            "the difference to BDF, sines, 1e-4 to 2.5e-5 s",
            "BDF as above",
            4,
            "BDF's own error, 1e-6, is near the smallest difference",
        ),
        (
            "splines",
            "bdf-splines",
            "the error, splines, 5e-5 to 2.5e-5 s",
            "own runs at 1.25e-5 and 6.25e-6 s, extrapolated",
            2,
            "as with sines; BDF is off by nearly 1e-5 of the lateral range here, as much as the step of 2.5e-5 s",
        ),
    )
    for case in (
        *(
            Case(
                name=f"{name}-{dt:g}",
                kind="verification",
                quantity=f"first 0.05 s, {kind}: vertical and lateral wheel forces less BDF's, over their range,"
                f" dt = {dt:g} s",
                source="scipy.integrate BDF, rtol 1e-8, same right-hand side, assembled independently of the step",
                reference=[0.0, 0.0],
                atol=1e-3 * (dt / 1e-4) ** 2,
                why="1e-3 at 1e-4 s, second order below",
                compute=lambda kind=kind, dt=dt: _error(kind, dt),
                quick=False,
            )
            for dt in STEPS
        ),
        Case(
            name=f"{name}-order",
            kind="verification",
            quantity=f"order in dt of {words}, vertical and lateral",
            source=f"Newmark's average acceleration is of second order; {source}",
            reference=[1.7] * count,
            rule="at least",
            why=why,
            compute=lambda kind=kind: _orders(kind),
            quick=False,
        ),
    )
)
