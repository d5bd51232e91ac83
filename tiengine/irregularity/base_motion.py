"""Motion of the ground in time, from a record of its acceleration: the same everywhere, or travelling (MODEL §14).

The record is scaled, grown in and faded over `taper`, freed of its drift, and interpolated by a cubic spline, which is
integrated twice in closed form. Drift is what velocity and displacement of the record come to at its end, though the
ground is at rest again. It is taken off by T(t) (a + b t) with the taper T of the record and the two numbers for which
both end at zero.

With a speed c the motion at a chainage x is that of `at`, later by (x - at)/c.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from scipy.interpolate import CubicSpline

from tiengine.irregularity.acceleration_file import read_acceleration
from tiengine.irregularity.measured_track import smooth_step
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["BaseMotion", "GroundRecord", "check_record"]

STEPS_PER_PERIOD = 8.0
NEGLIGIBLE_SHARE = 1e-3
"""Share of the variance of acceleration that the record may hold at frequencies which the time step does not follow."""
SHORTEST_WAVE = 20.0
"""Shortest wave [m] of the ground that counts: the track is taken to follow the ground, from which slabs, rigid
laterally, stand out by (2 pi L/wave)^2/12 of its displacement at their ends."""
SLOWEST_WAVE = 20.0  # m/s


class BaseMotion(Params):
    """Motion of the ground under the track in time, as in an earthquake; absent without its `file`.

    The file has the columns `time`, `vertical` (down positive) and `lateral` (to the right), with their units, one of
    the latter or both (docs/files.md). A `wave_speed` lets the motion travel along the track: at chainage x it is later
    by (x - at)/wave_speed than at `at`; negative, it runs against the train.
    """

    file: Annotated[
        str | None, Field(description="record of acceleration, relative to the scenario", max_length=4096)
    ] = None
    scale: Annotated[float, Q("-", "factor on all accelerations", ge=-1e3, le=1e3)] = 1.0
    vertical_up: Annotated[bool, Field(description="vertical accelerations of the file are positive upwards")] = False
    start: Annotated[float, Q("s", "time since the start of the run at which the record begins", ge=-1e4, le=1e6)] = 0.0
    taper: Annotated[float, Q("s", "time over which the record grows and fades", gt=0, le=100)] = 0.5
    baseline: Annotated[
        Literal["corrected", "none"],
        Field(description="whether the record's drift is taken off, so that the ground comes to rest where it was"),
    ] = "corrected"
    wave_speed: Annotated[
        float | None, Q("m/s", "speed of the motion along the track; without it all moves at once", ge=-1e6, le=1e6)
    ] = None
    at: Annotated[float, Q("m", "chainage where the record begins at `start`", ge=0, le=1e7)] = 0.0

    @model_validator(mode="after")
    def _check(self) -> BaseMotion:
        if self.file is None and self.model_fields_set - {"file"} and self != type(self)():
            raise InputError("track.base_motion.file: missing; a value is required")
        if self.wave_speed is not None and abs(self.wave_speed) < SLOWEST_WAVE:
            raise InputError(
                f"track.base_motion.wave_speed = {self.wave_speed:g}: must be at least {SLOWEST_WAVE:g} m/s in"
                " magnitude"
            )
        if self.wave_speed is None and self.at != 0.0:
            raise InputError(f"track.base_motion.at = {self.at:g}: must be left out without wave_speed")
        return self


class GroundRecord:
    """Displacement, velocity and acceleration of the ground, down and to the right.

    Attributes:
        motion: Entry of the scenario.
        duration: Of the record [s].
        highest: Frequency [Hz] above which it holds a negligible share of its variance.
    """

    def __init__(self, motion: BaseMotion) -> None:
        """Read, taper and integrate the record.

        Args:
            motion: Has a file.

        Raises:
            InputError: The file breaks a rule.
        """
        assert motion.file is not None
        self.motion = motion
        record = _read(motion.file, _changed(motion.file))
        t, a = record[:, 0], motion.scale * record[:, 1:]
        if motion.vertical_up:
            a[:, 0] = -a[:, 0]
        self.duration = float(t[-1])
        taper = min(motion.taper, 0.5 * self.duration)
        grown = smooth_step(t / taper)[0] * smooth_step((self.duration - t) / taper)[0]
        a *= grown[:, None]
        if motion.baseline == "corrected":
            a -= grown[:, None] * _drift(t, a, grown)
        self._derivatives = _integrated(t, a)
        self.highest = _highest_frequency(t, a)

    def at(self, time: Reals, derivative: int) -> Reals:
        """Motion where the record begins with the run's `start`, shape (..., 2) [m, m/s, m/s^2, m/s^3].

        Args:
            time: Since the start of the run, less the wave's delay [s], any shape.
            derivative: 0 displacement, 1 velocity, 2 acceleration, 3 its rate.
        """
        t = np.asarray(time, np.float64) - self.motion.start
        inside = np.clip(t, 0.0, self.duration)
        value: Reals = self._derivatives[derivative](inside)
        if derivative >= 2:
            value[(t < 0.0) | (t > self.duration)] = 0.0
        elif derivative == 0:
            value += (t - inside).clip(0.0)[..., None] * self._derivatives[1](self.duration)
        return value

    def delay(self, x: Reals) -> Reals:
        """Delay of the motion at chainages [m] behind that at its origin [s], shape as x."""
        if self.motion.wave_speed is None:
            return np.zeros_like(x)
        return np.asarray((x - self.motion.at) / self.motion.wave_speed, np.float64)


def check_record(record: GroundRecord, fastest: float, dt: float) -> None:
    """Refuse a record that the time step or the track cannot follow.

    Args:
        record: The record.
        fastest: Highest speed of the train [m/s].
        dt: Time step [s].

    Raises:
        InputError: Names the key, its value and the rule.
    """
    c, highest = record.motion.wave_speed, record.highest
    met = highest * (1.0 if c is None else 1.0 + fastest / abs(c))
    if met * STEPS_PER_PERIOD * dt > 1.0:
        raise InputError(
            f"track.base_motion.file: holds frequencies up to {met:.4g} Hz at the train; a period must take"
            f" {STEPS_PER_PERIOD:g} time steps of {dt:g} s; set numerics.time_step <="
            f" {1.0 / (STEPS_PER_PERIOD * met):.2g}, or take out higher frequencies"
        )
    if c is not None and abs(c) < SHORTEST_WAVE * highest:
        raise InputError(
            f"track.base_motion.wave_speed = {c:g}: makes waves of {abs(c) / highest:.3g} m at {highest:.4g} Hz, the"
            f" highest frequency of the file; must be {SHORTEST_WAVE:g} m or longer, which slabs and rails follow"
        )


def _integrated(t: Reals, a: Reals) -> tuple[CubicSpline, ...]:
    """Splines of displacement, velocity, acceleration and its rate; acceleration begins and ends level."""
    acceleration = CubicSpline(t, a, bc_type="clamped")
    velocity = acceleration.antiderivative()
    return velocity.antiderivative(), velocity, acceleration, acceleration.derivative()


def _drift(t: Reals, a: Reals, grown: Reals) -> Reals:
    """Acceleration (a + b t) whose tapered part ends with the velocity and the displacement of the record's."""
    share = t / t[-1]
    moved, fast, *_ = _integrated(t, np.column_stack([grown, grown * share, a]))
    ends = np.stack([fast(t[-1]), moved(t[-1])])
    factors = np.linalg.solve(ends[:, :2], ends[:, 2:])
    return np.asarray(np.column_stack([np.ones_like(t), share]) @ factors, np.float64)


def _highest_frequency(t: Reals, a: Reals) -> float:
    """Frequency [Hz] above which accelerations hold a negligible share of their variance."""
    step = float(np.diff(t).min())
    even = CubicSpline(t, a)(np.linspace(0.0, t[-1], min(round(t[-1] / step) + 1, 2**22)))
    power = (np.abs(np.fft.rfft(even, axis=0)) ** 2).sum(axis=1)
    above = np.cumsum(power[::-1])[::-1]
    kept = np.flatnonzero(above > NEGLIGIBLE_SHARE * above[0])
    return float(kept[-1] if kept.size else 0.0) / float(t[-1])


def _changed(path: str) -> int:
    """When a file was last changed [ns]; 0 if there is none."""
    try:
        return Path(path).stat().st_mtime_ns
    except (OSError, ValueError):
        return 0  # the reader says what is wrong


@lru_cache(maxsize=4)
def _read(path: str, changed: int) -> Reals:
    """Read a file as it was changed at a time."""
    return read_acceleration(path, "track.base_motion.file")
