"""Checks of the irregularity against a run: wavelengths against the time step, a file against the distance covered."""

from __future__ import annotations

import math
from collections.abc import Iterable

from tiengine.irregularity.irregularity import Irregularity, IrregularityParams, make_irregularity
from tiengine.irregularity.wave_content import NEGLIGIBLE_SHARE
from tiengine.parameters.errors import InputError

__all__ = ["STEPS_PER_WAVE", "check_reach", "check_step", "shortest_wavelength"]

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
    least = STEPS_PER_WAVE * speed * dt
    if shortest >= least:
        return
    rule = f"must be >= 8 V dt = {least:.4g} m at a time step of {dt:g} s"
    if params.file is None:
        raise InputError(f"irregularity: shortest wavelength = {shortest:.4g} m: {rule}")
    longest_step = shortest / (STEPS_PER_WAVE * speed)
    raise InputError(
        f"irregularity.file: holds {100.0 * (1.0 - NEGLIGIBLE_SHARE):g} % of its slope variance in waves longer than"
        f" {shortest:.4g} m; {rule}; take out shorter waves by irregularity.file_band_pass = true with"
        f" irregularity.wavelength_min >= {least:.4g}, or set numerics.time_step <= {longest_step:.2g}"
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
