"""Unusual settings and tracks; reproducible bits; durations in closed form.

References: bounds, counts and closed forms, stated with each case.
"""

from __future__ import annotations

import subprocess
import sys

import numpy as np
from scipy.integrate import quad

from tiengine.engine.stability import TOLERATED_GROWTH, step_growth
from tiengine.scenario.scenario import load_scenario
from tiengine.vehicle.train import static_wheel_loads
from validation.frame.case import Case
from validation.frame.models import paper_model
from validation.frame.runs import simulate

SHORT = ("train.distance=20.0", "numerics.time_step=2e-4")


def _slow(kmh: float) -> float:
    """Largest deviation of a wheel's vertical force from its mean, over the mean, in 30 m at a low speed."""
    force = simulate("paper", f"train.speed_kmh={kmh}", "train.distance=30.0", "numerics.time_step=2e-4").vertical
    mean = force.mean(axis=0)
    return float((np.abs(force - mean) / mean).max())


def _travelled(scenario: str) -> float:
    """Share of the distance that a run has covered."""
    found = simulate(scenario)
    distance = load_scenario(scenario).train.distance
    step = found.position[1] - found.position[0]
    return float((found.position[-1] - found.position[0] + 2.0 * step) // distance)


def _braking_time() -> float:
    return float(simulate("braking").time[-1])


def _braking_time_exact() -> float:
    """Time from 350 to 330 km/h in 600 m, kinetic energy a cubic with level ends, from half the window: int dx/V."""
    scenario = load_scenario("braking")
    fast, slow = (speed / 3.6 for speed in (350.0, 330.0))

    def slowness(x: float) -> float:
        done = x / 600.0
        return float((fast**2 + (slow**2 - fast**2) * done**2 * (3.0 - 2.0 * done)) ** -0.5)

    start = scenario.window_length / 2.0
    return float(quad(slowness, start, 600.0)[0] + start / slow)  # beyond the last row the speed is constant


def _hash(threads: int) -> str:
    """Digest of all wheel forces of a short run in a process of its own."""
    code = (
        "import sys, hashlib; from tiengine import load_scenario, run\n"
        f"changes = {list(SHORT)!r} + ['numerics.threads={threads}', 'output.precision=\"double\"']\n"
        "s = load_scenario('paper', changes)\n"
        "print(hashlib.sha256(run(s).wheel()['vertical_force'].tobytes()).hexdigest())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip().splitlines()[-1])
    return done.stdout.split()[-1]


def _different_bits() -> int:
    """Number of differing comparisons of two: a second run; one against two threads."""
    first = _hash(1)
    return sum(first != other for other in (_hash(1), _hash(2)))


CASES = (
    Case(
        name="stable-144-modes",
        kind="verification",
        quantity="growth of a disturbance over 5000 steps, 144 modes in 36 m, dt = 2e-4 s",
        source="the track can only lose energy",
        reference=TOLERATED_GROWTH,
        rule="at most",
        why="beating of undamped pinned-pinned vibration; a newton grows to ten at most",
        compute=lambda: step_growth(paper_model("numerics.modes_per_metre=4.0"), 350.0 / 3.6, 5000).over(5000),
    ),
    Case(
        name="run-144-modes",
        kind="convergence",
        quantity="standard deviation of the vertical force over 100 m, 144 modes at dt = 2e-4 s [kN]",
        source="60 modes, the same track",
        reference=lambda: 1e-3 * simulate("paper", "train.distance=100.0", "numerics.time_step=2e-4").vertical.std(),
        rtol=0.05,
        why="60 modes are within 3 % of the peak from converged forces",
        compute=lambda: (
            1e-3
            * simulate(
                "paper", "train.distance=100.0", "numerics.time_step=2e-4", "numerics.modes_per_metre=4.0"
            ).vertical.std()
        ),
    ),
    *(
        Case(
            name=f"slow-{kmh:g}",
            kind="verification",
            quantity=f"largest dynamic part of a vertical wheel force over its mean at {kmh:g} km/h, 30 m",
            source="dynamic forces vanish with the speed; an unstable step oscillates by the whole load",
            reference=0.1,
            rule="at most",
            why="a bound: twist of the track changes the loads quasi-statically",
            compute=lambda kmh=kmh: _slow(kmh),
            quick=kmh > 10.0,
        )
        for kmh in (5.0, 20.0)
    ),
    *(
        Case(
            name=f"run-{name}",
            kind="verification",
            quantity=f"share of the distance covered by the scenario {name}: {words}",
            source="the run must reach its end",
            reference=1.0,
            why="a count",
            compute=lambda name=name: _travelled(name),
            quick=name == "defects",
        )
        for name, words in (
            ("defects", "three failed fastenings, mortar void of 0.65 m"),
            ("train3", "three vehicles in one window"),
            ("braking", "350 to 330 km/h over 600 m"),
        )
    ),
    Case(
        name="train3-loads",
        kind="verification",
        quantity="mean vertical force of 24 wheels in three vehicles [kN]",
        source="static wheel load",
        reference=lambda: np.full(24, 1e-3 * static_wheel_loads(paper_model().ingredients.train).mean()),
        rtol=0.02,
        why="means over 6 s of an irregular track",
        compute=lambda: 1e-3 * simulate("train3").vertical.mean(axis=0).ravel(),
        quick=False,
    ),
    Case(
        name="braking-time",
        kind="verification",
        quantity="time of the braking run [s]",
        source="int dx / V by quadrature, kinetic energy a cubic of chainage",
        reference=_braking_time_exact,
        atol=4e-4,
        why="two steps",
        compute=_braking_time,
        quick=False,
    ),
    Case(
        name="same-bits",
        kind="verification",
        quantity="runs that differ in any bit: a second run, a run with two threads",
        source="nothing in a run depends on the order of its threads",
        reference=0,
        why="a count",
        compute=_different_bits,
        quick=False,
    ),
)
