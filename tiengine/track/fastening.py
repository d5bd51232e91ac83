"""Rail fastenings: parameters and constant tables of the sines at the seats (MODEL §3)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationInfo, field_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Name, Params, Q, Source
from tiengine.track.seat_points import mean_cosine
from tiengine.track.slab import Slab

__all__ = ["POINT", "Fastening", "check_baseplate", "seat_count", "seat_tables"]

POINT = (0.0, 0.0)
"""Rectangle of a seat that is a point."""


class Fastening(Params):
    """Spring and damper of one rail seat."""

    name: Name = "fastening"
    source: Source = ""
    vertical_stiffness: Annotated[float, Q("N/m", "k_v, both half springs together", gt=0)]
    lateral_stiffness: Annotated[float, Q("N/m", "k_l", gt=0)]
    vertical_damping: Annotated[float, Q("N s/m", "c_v", ge=0)]
    lateral_damping: Annotated[float, Q("N s/m", "c_l", ge=0)]
    length: Annotated[float, Q("m", "of rail on which the pad presses, evenly; 0 for a point", ge=0, le=0.4)] = 0.15
    baseplate_length: Annotated[
        float, Q("m", "along the track, of the slab on which the baseplate presses, evenly; 0 for a point", ge=0, le=1)
    ] = 0.36
    baseplate_width: Annotated[
        float,
        Q("m", "across the track, of the slab on which the baseplate presses", ge=0, le=1, validate_default=True),
    ] = 0.18

    @field_validator("baseplate_width")
    @classmethod
    def _is_a_rectangle_or_a_point(cls, value: float, info: ValidationInfo) -> float:
        length = info.data.get("baseplate_length", value)
        if (value == 0.0) != (length == 0.0):
            raise ValueError(f"must be 0 if baseplate_length is, and only then; baseplate_length is {length:g} m")
        return value

    @property
    def baseplate(self) -> tuple[float, float]:
        """Length along and width across the track of the rectangle on which the seat presses on the slab [m]."""
        return self.baseplate_length, self.baseplate_width


def seat_count(length: float, spacing: float) -> int:
    """Largest number of seats in a window: the first may lie anywhere in (0, d]."""
    return int(np.ceil(length / spacing - 1e-9)) + 1


def seat_tables(modes: int, length: float, spacing: float, seat_length: float = 0.0) -> NDArray[np.float64]:
    """Tabulate the constant factors of the sines at the seats.

    Args:
        modes: Modes N per field.
        length: Window l [m].
        spacing: Seat pitch d [m].
        seat_length: Length of rail on which a seat presses [m].

    Returns:
        cos(k_i j d) for i = 1..N, then sin(k_i j d), with k_i = i pi / l, times the factor by which the mean over a
        seat's length reduces them; shape (2 N, seats).
    """
    k = np.asarray(np.arange(1, modes + 1) * np.pi / length, np.float64)
    phase = np.outer(k, np.arange(seat_count(length, spacing)) * spacing)
    mean = np.tile(mean_cosine(k, seat_length), 2)[:, None]
    table: NDArray[np.float64] = np.vstack([np.cos(phase), np.sin(phase)]) * mean
    return table


def check_baseplate(slab: Slab, rectangle: tuple[float, float]) -> None:
    """Refuse a baseplate that reaches beyond the slab.

    Args:
        slab: The slab with its seats.
        rectangle: Length along and width across the track [m].

    Raises:
        InputError: Names the key, its value and the largest one.
    """
    room = (slab.fastening_pitch - slab.gap, slab.width - 2.0 * slab.seat_half_spacing)
    for key, value, most in zip(("length", "width"), rectangle, room, strict=True):
        if value > most + 1e-9:
            raise InputError(
                f"track.fastening.baseplate_{key} = {value:g}: must be at most {most:g} m, so that the outer seats'"
                " baseplates lie on the slab"
            )
