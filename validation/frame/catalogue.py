"""All cases, in the order of the table."""

from __future__ import annotations

from validation.cases import (
    bdf,
    contact_geometry,
    contact_kinematics,
    critical_speed,
    curves,
    gaps,
    hertz_kalker,
    imperfect_line,
    irregularity,
    klingel,
    manchester,
    manchester_two_patches,
    moving_ground,
    moving_load,
    patch_load,
    periodic_support,
    plates,
    rail,
    receptance,
    robustness,
    settlement,
    smooth_track,
    statistics,
    supported_beam,
    thin_plates,
    time_stepping,
    unequal_wheels,
    uplift,
    vehicles,
    wheel_spectrum,
    window,
    winkler_load,
)
from validation.convergence import study as convergence
from validation.frame.case import Case
from validation.paper import case as paper_case
from validation.paper import comparison

__all__ = ["CASES", "HEADLINES"]

_FILES = (
    plates,
    thin_plates,
    rail,
    moving_load,
    winkler_load,
    supported_beam,
    periodic_support,
    receptance,
    vehicles,
    klingel,
    unequal_wheels,
    critical_speed,
    curves,
    hertz_kalker,
    contact_geometry,
    contact_kinematics,
    manchester,
    manchester_two_patches,
    irregularity,
    imperfect_line,
    smooth_track,
    statistics,
    wheel_spectrum,
    time_stepping,
    convergence,
    bdf,
    uplift,
    settlement,
    moving_ground,
    gaps,
    robustness,
    patch_load,
    paper_case,
    comparison,
    window,
)

CASES: tuple[Case, ...] = tuple(case for file in _FILES for case in file.CASES)
"""All cases of all files."""

HEADLINES = (
    "plate-aspect-1.5",
    "floquet-default-seat-350",
    "floquet-default-deflection-350",
    "pinned-pinned",
    "supported-beam-mass",
    "klingel-free-20",
    "vehicle-CRH380A_v2",
    "hertz-cone-R300",
    "manchester-station",
    "conicity-EN-15302",
    "spectrum-P2-long",
    "bdf-5e-05",
    "equal-density-36-vertical",
    "equal-density-36-lateral",
    "equal-density-60-lateral",
    "ripple",
    "defects-seats",
)
"""Cases shown in the README."""
