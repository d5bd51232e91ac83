"""The paper's train on a smooth track at 350 km/h: only the passing of seats and slabs excites it.

References: the train's weight; Newton's third law; symmetry. Statistics are over ten slabs (56.7 m,
2916 steps of 2e-4 s) after 50 m.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from threadpoolctl import threadpool_limits

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.kernels import layout as at
from tiengine.parameters.arrays import Reals
from tiengine.vehicle.train import static_wheel_loads
from validation.frame.case import Case
from validation.frame.models import paper_model
from validation.frame.runs import Forces, simulate

V, DT, SLABS, STEPS = 350.0 / 3.6, 2e-4, 10, 2916  # STEPS of DT at V are SLABS of 5.67 m


def _run() -> Forces:
    return simulate("paper", 'irregularity.spectrum="none"', "train.distance=110.0", f"numerics.time_step={DT}")


def _last(values: Reals) -> Reals:
    return values[-STEPS:]


def _static() -> Reals:
    """Static load of the eight wheels [N], shape (8,)."""
    return static_wheel_loads(paper_model().ingredients.train).ravel()


def _passing_share() -> float:
    """Smallest share, over the wheels, of the ripple's variance at the slab-passing harmonics."""
    force = _last(_run().vertical)
    power = np.abs(np.fft.rfft(force - force.mean(axis=0), axis=0)) ** 2
    return float((power[::SLABS].sum(axis=0) / power.sum(axis=0)).min())


def _ripple() -> Reals:
    """Standard deviation and largest deviation of the vertical force from its mean [N]."""
    force = _last(_run().vertical)
    force = force - force.mean(axis=0)
    return np.array([force.std(axis=0).max(), np.abs(force).max()])


@cache
def _supported() -> tuple[float, float]:
    """Mean of all fastening forces, and of all wheel forces on the rails, over two slabs [N]."""
    model = paper_model(dt=DT)
    state = state_at_rest(model)
    equilibrium(model, state, 0.0, V)
    count = 2 * STEPS // SLABS
    chunk = Chunk.empty(model.ingredients, 2 * count, 1)
    stepper = make_stepper(model, state, chunk)
    X = V * DT * np.arange(1.0, 2 * count + 1)
    stepper.load(X, np.full(2 * count, V), np.zeros(2 * count), np.zeros_like(chunk.irregularity))
    seats = []
    with threadpool_limits(1):
        for i in range(2 * count):
            stepper.step(i, i)
            seats.append(state.seat_forces[0, :, 0].sum())
    wheels = chunk.wheel[0, count:, ..., at.VERTICAL_FORCE].sum(axis=(1, 2))
    return float(np.mean(seats[count:])), float(wheels.mean())


CASES = (
    Case(
        name="smooth-mean",
        kind="verification",
        quantity="mean vertical force of the eight wheels at 350 km/h [N]",
        source="static wheel load",
        reference=_static,
        rtol=2e-3,
        why="creep forces of the inclined contacts and the passing of seats shift load between wheels",
        compute=lambda: _last(_run().vertical).mean(axis=0).ravel(),
    ),
    Case(
        name="smooth-weight",
        kind="verification",
        quantity="mean of all wheel forces together [N]",
        source="weight of the train",
        reference=lambda: _static().sum(),
        rtol=1e-4,
        why="slow bounce of the car after the start at one phase of the seats",
        compute=lambda: _last(_run().vertical).sum(axis=(1, 2)).mean(),
    ),
    Case(
        name="smooth-passing",
        kind="verification",
        quantity=("share of the ripple's variance at multiples of the slab-passing frequency (seats: every ninth)"),
        source="a periodic track causes a periodic response",
        reference=0.99,
        rule="at least",
        why="1 % for the remainder of the start's transient",
        compute=_passing_share,
    ),
    Case(
        name="smooth-ripple",
        kind="information",
        quantity="vertical ripple, standard deviation and peak [N]",
        source="-",
        reference=(np.nan, np.nan),
        why="grows with the number of modes: 60 in 36 m carry a tenth of the seats' contrast",
        compute=_ripple,
    ),
    Case(
        name="smooth-symmetry",
        kind="verification",
        quantity="largest difference of left and right: vertical, and sum of lateral forces [N]",
        source="mirror symmetry of train and track",
        reference=(0.0, 0.0),
        atol=1e-3,
        why="rounding, amplified by the wheelsets' lateral motion; the contact is solved to 0.07 N",
        compute=lambda: [
            np.abs(np.diff(_run().vertical, axis=2)).max(),
            np.abs(_run().lateral.sum(axis=2)).max(),
        ],
    ),
    Case(
        name="action-reaction",
        kind="verification",
        quantity="mean of all fastening forces over two slabs [N]",
        source="mean of all wheel forces: inertia of the rails has no mean",
        reference=lambda: _supported()[1],
        rtol=1e-3,
        why="the window's ends carry exp(-8 m / 0.8 m); two slabs are not exactly periodic yet",
        compute=lambda: _supported()[0],
    ),
)
