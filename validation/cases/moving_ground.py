"""Ground that moves in time: inertia forces in coordinates from the ground against a displaced bed in absolute ones.

The engine measures rails, slabs and train from the ground, where each feels -m a. The full-length model has absolute
coordinates: its beds press with k_m (w - z_g) + c_m (dw/dt - dz_g/dt), and all else follows. Both see one record.
"""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np

from tiengine.irregularity.base_motion import GroundRecord
from tiengine.model.base_motion_loads import BaseMotionLoads
from tiengine.parameters.arrays import Reals
from tiengine.result import Result
from tiengine.scenario.scenario import Scenario, load_scenario
from tiengine.simulation.simulate import run
from validation.frame.case import Case
from validation.msm.simulate import FullLength, run_full_length

__all__ = ["CASES"]

PERIOD, SLOW = 0.2, 20.0  # s: of a motion that shakes the train, of one that everything follows
MOTIONS = {
    "uniform": (PERIOD, 1.0, "start=0.1"),
    "travelling": (PERIOD, 1.0, "start=0.1, wave_speed=500.0, at=45.0"),
    "fast": (PERIOD, 1.0, "start=0.1, wave_speed=1e6, at=45.0"),
    "slow": (SLOW, 0.01, f"start={-1.5 * SLOW}"),
}
"""Period [s], largest acceleration [m/s^2] and keys of each motion."""
FULL = FullLength(length=140.0, modes_per_metre=4.0, slab_modes=20, time_step=2e-4)
CHANGES = (
    "train.distance=50", "train.start=45", "irregularity.spectrum='none'", "output.run_in=0",
    "output.precision='double'", "numerics.time_step=2e-4", "numerics.truncation='none'",
)  # fmt: skip
FORCES = ("vertical_force", "lateral_force")


def _record(folder: str, period: float, largest: float) -> str:
    """File of a burst of a vertical and a lateral wave of a period [s], with a largest acceleration [m/s^2]."""
    t = np.linspace(0.0, 5.0 * period, 251)
    bell = np.exp(-(((t - 1.5 * period) / (0.8 * period)) ** 2))
    waves = (np.sin(2.0 * np.pi * t / period), np.cos(3.0 * np.pi * t / period))
    path = Path(folder) / f"{period:g}.csv"
    np.savetxt(
        path, np.column_stack([t, *(largest * wave * bell for wave in waves)]), delimiter=",", comments="",
        header="time [s], vertical [m/s^2], lateral [m/s^2]",
    )  # fmt: skip
    return str(path)


def _scenario(folder: str, motion: str) -> Scenario:
    """The default train on smooth rails, on ground that moves or rests."""
    if motion == "rest":
        return load_scenario("default", CHANGES)
    period, largest, words = MOTIONS[motion]
    file = _record(folder, period, largest)
    return load_scenario("default", [*CHANGES, f"track.base_motion={{file='{file}', taper=0.05, {words}}}"])


def _forces(result: Result) -> Reals:
    """Vertical and lateral forces of all wheels over time, shape (2, steps, W, 2)."""
    wheel = result.wheel()
    return np.stack([np.asarray(wheel[name], np.float64) for name in FORCES])


@cache
def _engine(motion: str) -> tuple[Reals, Reals, Reals]:
    """Forces of the wheels; y and z of the bodies over time, shape (steps, bodies, 2), and of the ground then."""
    with TemporaryDirectory() as folder:
        scenario = _scenario(folder, motion)
        with run(scenario) as result:
            body, forces = result.body(), _forces(result)
            moved = np.asarray(body["displacement"], np.float64)[..., :2]
            ground = np.zeros((len(moved), 1, 2))
            if motion != "rest":
                record = GroundRecord(scenario.track.base_motion)
                ground = record.at(np.asarray(body["time"], np.float64), 0)[:, None, ::-1]
    return forces, moved, ground


@cache
def _full(motion: str) -> Reals:
    with TemporaryDirectory() as folder, run_full_length(_scenario(folder, motion), FULL) as result:
        return _forces(result)


def _from_the_ground_at_rest(
    self: BaseMotionLoads, time: Reals, x: Reals, V: Reals, reference: float | None = None
) -> tuple[Reals, Reals]:
    """Frames against the ground at rest instead of their vehicle's: slopes then load longitudinal springs."""
    motion = self.motion(time, x, V, np.zeros_like(V))
    return motion[:, 0], motion[:, 1]


def _absolute_pitch_apart() -> float:
    """As :func:`_apart` of the travelling motion, vertically, both models with absolute pitch."""
    with patch.object(BaseMotionLoads, "offsets", _from_the_ground_at_rest):
        ours = _engine.__wrapped__("travelling")[0][0] - _engine("rest")[0][0]
    return _over_largest(ours, _full("travelling")[0] - _full("rest")[0])


def _apart(motion: str, direction: int) -> float:
    """Largest difference between what the motion changes in either model, over the largest change."""
    ours = _engine(motion)[0][direction] - _engine("rest")[0][direction]
    return _over_largest(ours, _full(motion)[direction] - _full("rest")[direction])


def _over_largest(ours: Reals, full: Reals) -> float:
    """Largest difference over the largest value; one model takes a step more."""
    count = min(len(ours), len(full))
    return float(np.abs(ours[:count] - full[:count]).max() / np.abs(full).max())


def _of_fast_waves() -> float:
    """Largest difference between a wave that passes in a moment and a motion of all at once, over the largest force."""
    fast, uniform, rest = (_engine(motion)[0] for motion in ("fast", "uniform", "rest"))
    return float(np.abs(fast - uniform).max() / np.abs(uniform - rest).max())


def _left_behind() -> float:
    """Distance of the bodies from ground that moves slowly, beyond that on ground at rest, over its displacement."""
    moved, ground = _engine("slow")[1:]
    return float(np.abs(moved - _engine("rest")[1] - ground).max() / np.abs(ground).max())


def _shaken() -> float:
    """Largest change of a wheel's force by ground that moves slowly [N]."""
    return float(np.abs(_engine("slow")[0] - _engine("rest")[0]).max())


_EVENLY = "a uniform acceleration of the ground (here -m a on everything)"

CASES = (
    *(
        Case(
            name=f"base-motion-{motion}-{name}",
            kind="full length",
            quantity=f"what {words} changes in {name} wheel forces, largest difference over largest change",
            source="full-length model in absolute coordinates, its beds displaced",
            reference=0.0,
            rule="at most",
            atol=tolerance,
            why=why,
            compute=partial(_apart, motion, direction),
            quick=False,
        )
        for motion, words, name, direction, tolerance, why in (
            (
                "uniform",
                _EVENLY,
                "vertical",
                0,
                0.02,
                "splines here, modes of the whole rail there; seats pass at other moments of the motion",
            ),
            ("uniform", _EVENLY, "lateral", 1, 0.03, "as above; lateral resonance of rails on their seats"),
            (
                "travelling",
                "a motion of the ground that travels at 500 m/s",
                "lateral",
                1,
                0.05,
                "as above; rigid slabs lie along chords of the ground, by (2 pi 5.6/67)^2/12 = 2 % of it at their ends",
            ),
        )
    ),
    Case(
        name="base-motion-travelling-vertical",
        kind="full length",
        quantity="what a motion of the ground that travels at 500 m/s changes in vertical wheel forces, as above",
        source="full-length model in absolute coordinates, its beds displaced",
        reference=0.0,
        rule="at most",
        atol=0.03,
        why="as above; in both, pitch is taken from the horizontal, so that slopes load the longitudinal springs;"
        " the engine takes it from the ground, since bodies have no longitudinal coordinate: that changes 17 %",
        compute=_absolute_pitch_apart,
        quick=False,
    ),
    Case(
        name="base-motion-fast-wave",
        kind="verification",
        quantity="wheel forces by a motion that travels at 1e6 m/s against a uniform one, over the largest change",
        source="limit of a large speed: a delay of 0.1 ms over 100 m",
        reference=0.0,
        rule="at most",
        atol=3e-3,
        why="a wave of 0.2 s changes by 2 pi 1e-4/0.2 in the delay",
        compute=_of_fast_waves,
    ),
    Case(
        name="base-motion-slow",
        kind="verification",
        quantity="bodies' displacement by ground that moves with a period of 20 s, less the ground's, over the latter",
        source="quasi-static limit: all moves along; (omega/omega_0)^2 remains, 0.01 at 0.5 Hz, 0.0025 at 1 Hz",
        reference=0.0,
        rule="at most",
        atol=0.01,
        why="lowest natural frequency of the car body, 0.5 to 1 Hz",
        compute=_left_behind,
    ),
    Case(
        name="base-motion-slow-forces",
        kind="verification",
        quantity="largest change of a wheel's force by ground that moves with 0.01 m/s^2 [N]",
        source="quasi-static limit: all but m a of an eighth of the vehicle, 60 N, and of the overturning moment",
        reference=0.0,
        rule="at most",
        atol=100.0,
        why="with the lever of the car body the moment moves as much load again",
        compute=_shaken,
    ),
)
