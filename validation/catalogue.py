"""All cases, in the order of the table."""

from __future__ import annotations

from validation import (
    bdf,
    contact_geometry,
    contact_kinematics,
    hertz_kalker,
    irregularity,
    manchester,
    moving_load,
    paper_case,
    plates,
    rail,
    robustness,
    smooth_track,
    time_stepping,
    vehicles,
)
from validation.case import Case

__all__ = ["CASES"]

_FILES = (
    plates,
    rail,
    moving_load,
    vehicles,
    hertz_kalker,
    contact_geometry,
    contact_kinematics,
    manchester,
    irregularity,
    smooth_track,
    time_stepping,
    bdf,
    robustness,
    paper_case,
)

CASES: tuple[Case, ...] = tuple(case for file in _FILES for case in file.CASES)
"""Every case of every file."""
