"""Checks of the irregularity against a run: wavelengths against the time step, a file against the distance covered."""

from __future__ import annotations

import math
from collections.abc import Iterable

from tiengine.irregularity.irregularity import Irregularity, IrregularityParams, make_irregularity
from tiengine.irregularity.wave_content import NEGLIGIBLE_SHARE
from tiengine.parameters.errors import InputError

__all__ = ["STEPS_PER_WAVE", "check_reach", "check_step", "check_wave", "shortest_wavelength"]

STEPS_PER_WAVE = 8.0
"""Fewest time steps in which a wheel may pass the shortest wavelength (MODEL §6)."""


def shortest_wavelength(params: IrregularityParams) -> float:
    """Shortest wavelength that the time step must resolve [m]; infinite where unknown, as for a function.

    Args:
        params: Parameters; a file is read.

    Raises:
        InputError: The file breaks a rule.
    """
    return (
        params.shortest_wavelength if params.file is None else make_irregularity(params, -math.inf).shortest_wavelength
    )


def check_step(params: IrregularityParams, shortest: float, speed: float, dt: float) -> None:
    """Refuse wavelengths that the time step cannot resolve.

    Args:
        params: Parameters of the track.
        shortest: Its shortest wavelength [m], from :func:`shortest_wavelength`.
        speed: Highest speed V [m/s].
        dt: Time step [s].

    Raises:
        InputError: The shortest wavelength is below 8 V dt.
    """
    if params.file is None:
        check_wave("irregularity: shortest wavelength", shortest, speed, dt)
        return
    least = STEPS_PER_WAVE * speed * dt
    if shortest >= least:
        return
    longest_step = shortest / (STEPS_PER_WAVE * speed)
    raise InputError(
        f"irregularity.file: holds {100.0 * (1.0 - NEGLIGIBLE_SHARE):g} % of its slope variance in waves longer than"
        f" {shortest:.4g} m; must be >= 8 V dt = {least:.4g} m at a time step of {dt:g} s; take out shorter waves by"
        f" irregularity.file_band_pass = true with irregularity.wavelength_min >= {least:.4g}, or set"
        f" numerics.time_step <= {longest_step:.2g}"
    )


def check_wave(name: str, wavelength: float, speed: float, dt: float) -> None:
    """Refuse a wavelength that the time step cannot resolve.

    Args:
        name: Its name in the message.
        wavelength: The wavelength [m].
        speed: Highest speed V [m/s].
        dt: Time step [s].

    Raises:
        InputError: It is passed in fewer than eight steps (MODEL §6).
    """
    least = STEPS_PER_WAVE * speed * dt
    if wavelength < least:
        raise InputError(
            f"{name} = {wavelength:g} m: must be at least {STEPS_PER_WAVE:g} V dt = {least:.4g} m"
            f" at a time step of {dt:g} s; set numerics.time_step <= {wavelength / (STEPS_PER_WAVE * speed):.2g}, or"
            " choose a longer wave"
        )


def check_reach(tracks: Iterable[Irregularity], end: float) -> None:
    """Refuse a measured track that the train never reaches.

    Args:
        tracks: Irregularity of each train.
        end: Chainage of the leading wheel at the end of the run [m].

    Raises:
        InputError: A track begins beyond it.
    """
    for track in tracks:
        if track.start >= end:
            raise InputError(
                f"irregularity.file: begins at chainage {track.start:g} m: must be before the end of the run, {end:g}"
                " m; set file_start to the mileage of chainage zero"
            )
