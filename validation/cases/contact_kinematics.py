"""Contact forces and creepages against their geometry.

References: virtual work: a frictionless contact has the generalised forces -N cos(gamma) dp/dq, p being
the vertical penetration; a wheel that follows the shape of its rail exactly rolls on it and has no
creepage from it. The derivatives are central differences of the penetration that the kernel returns,
including the angle that turns with the rail.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.engine.equilibrium import ContactForces, evaluate_contact
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.parameters.arrays import Reals
from validation.frame.case import Case
from validation.frame.models import paper_model

V = 350.0 / 3.6
TRIALS, NUDGE = 200, 1e-7
FRICTIONLESS = "track.friction=1e-12"
SLOPE = 1e-3


def _evaluate(wheelset: Reals, rails: Reals, channels: Reals, rates: Reals | None = None) -> ContactForces:
    """Contact of B states of one wheelset; the others are copies. Shapes (B, 5), (B, 2, 9), (B, channels)."""
    model = paper_model(FRICTIONLESS)
    W = len(model.wheel)
    rates = np.zeros_like(wheelset) if rates is None else rates
    return evaluate_contact(
        model,
        V,
        np.repeat(channels[:, None], W, axis=1),
        np.repeat(wheelset[:, None], W, axis=1),
        np.repeat(rates[:, None], W, axis=1),
        np.repeat(rails[:, None], W, axis=1),
    )


def _penetration(found: ContactForces, rails: Reals, channels: Reals) -> tuple[Reals, Reals]:
    """P [m] and gamma [rad] of both wheels, shape (B, 2) each."""
    state = found.contact[:, 0]
    turn = rails[:, :, 2] + channels[:, None, at.CROSS_LEVEL]
    gamma = np.arctan2(state[..., wr.SIN], state[..., wr.COS]) + np.array([-1.0, 1.0]) * turn
    return state[..., wr.DELTA] / np.cos(gamma), gamma


@cache
def _virtual_work() -> tuple[float, float]:
    """Largest error of a generalised normal force over N, and of a moment over N [m]; tread and flange."""
    random = np.random.default_rng(1)
    wheelset, rails = np.zeros((TRIALS, 5)), np.zeros((TRIALS, 2, 9))
    wheelset[:, 0] = random.uniform(-9e-3, 9e-3, TRIALS)
    wheelset[:, 1] = random.uniform(1e-3, 2e-3, TRIALS)
    wheelset[:, 2] = random.uniform(-1e-3, 1e-3, TRIALS)
    rails[:, :, :3] = random.uniform(-1.0, 1.0, (TRIALS, 2, 3)) * [1e-3, 1e-3, 2e-3]
    channels = np.zeros((TRIALS, at.N_IRREGULARITY))
    channels[:, at.CROSS_LEVEL] = random.uniform(-2e-3, 2e-3, TRIALS)
    found = _evaluate(wheelset, rails, channels)
    N = found.local[:, 0, :, 0]
    pull = N * np.cos(_penetration(found, rails, channels)[1])
    larger = N.max(axis=1)
    force, moment = 0.0, 0.0
    for q in range(3):  # y, z, roll of the wheelset
        nudge = NUDGE * np.eye(5)[q]
        p = [_penetration(_evaluate(wheelset + s * nudge, rails, channels), rails, channels)[0] for s in (1, -1)]
        exact = -(pull * (p[0] - p[1]) / (2.0 * NUDGE)).sum(axis=1)
        error = np.nanmax(np.abs(found.wheelset[:, 0, q] - exact) / larger)
        force, moment = (force, max(moment, error)) if q == 2 else (max(force, error), moment)
    for q in range(3):  # w, v, theta_x of either rail
        nudge = NUDGE * np.eye(9)[q]
        p = [
            _penetration(_evaluate(wheelset, rails + s * nudge, channels), rails + s * nudge, channels)[0]
            for s in (1, -1)
        ]
        exact = -pull * (p[0] - p[1]) / (2.0 * NUDGE)
        with np.errstate(invalid="ignore", divide="ignore"):
            error = np.nanmax(np.abs(found.rail[:, 0, :, q] - exact) / N)
        force, moment = (force, max(moment, error)) if q == 2 else (max(force, error), moment)
    return float(force), float(moment)


def _following() -> Reals:
    """Change of lateral creepage if the wheel follows a slope of 1 mm/m of track or rail, vertically and laterally."""
    wheelset, rates = np.zeros((5, 5)), np.zeros((5, 5))
    rails, channels = np.zeros((5, 2, 9)), np.zeros((5, at.N_IRREGULARITY))
    wheelset[:, 1] = 1e-4
    channels[1, at.Z_V_SLOPE], channels[2, at.Y_A_SLOPE] = SLOPE, SLOPE
    rails[3, :, 3], rails[3, :, 6] = SLOPE, V * SLOPE  # a shape fixed to the ground, seen at constant s
    rails[4, :, 4], rails[4, :, 7] = SLOPE, V * SLOPE
    rates[[1, 3], 1] = V * SLOPE
    rates[[2, 4], 0], wheelset[[2, 4], 4] = V * SLOPE, SLOPE
    xi = _evaluate(wheelset, rails, channels, rates).contact[:, 0, :, wr.XI_Y]
    return (xi[1:] - xi[0]).ravel()


CASES = (
    Case(
        name="virtual-work-force",
        kind="verification",
        quantity="generalised normal forces on wheelset and rails less -N cos(gamma) dp/dq, over N",
        source="virtual work; p differentiated numerically at 200 random states",
        reference=0.0,
        atol=3e-3,
        why="first order in the angles",
        compute=lambda: _virtual_work()[0],
    ),
    Case(
        name="virtual-work-moment",
        kind="verification",
        quantity="the same for roll of wheelset and torsion of rails, over N [m]",
        source="virtual work; p differentiated numerically at 200 random states",
        reference=0.0,
        atol=3e-3,
        why="first order in the angles: a lever of 3 mm",
        compute=lambda: _virtual_work()[1],
    ),
    Case(
        name="rolling-along-a-shape",
        kind="verification",
        quantity=(
            "lateral creepage of a wheelset that follows a slope of 1e-3 of track or rail, vertically and laterally"
        ),
        source="a wheel that rolls along a shape does not slip on it",
        reference=np.zeros(8),
        atol=1e-15,
        why="rounding of differences of 1e-3",
        compute=_following,
    ),
)
