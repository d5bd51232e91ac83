"""Contact patch as a filter of given shapes: what is short against the patch does not move the wheel (MODEL §6)."""

from __future__ import annotations

import numpy as np

from tiengine.irregularity.spectrum import contact_filter
from tiengine.parameters.arrays import Reals

__all__ = ["PATCH_HALF_LENGTH", "felt_shape", "felt_share", "felt_wave"]

PATCH_HALF_LENGTH = 6e-3
"""Half length of the contact patch along the rail [m] in the filter of short waves (6 to 7 mm at 70 kN)."""


def felt_share(Omega: Reals) -> Reals:
    """Share of the amplitude of waves that a wheel feels.

    Args:
        Omega: Wave numbers [rad/m], any shape.
    """
    return np.asarray(np.sqrt(contact_filter(Omega, PATCH_HALF_LENGTH)), np.float64)


def felt_wave(wavelength: float) -> float:
    """Share of the amplitude of a wave of the given length [m] that a wheel feels."""
    return float(felt_share(np.array(2.0 * np.pi / wavelength)))


def felt_shape(z: Reals, step: float) -> Reals:
    """Filter one period of a periodic series, or a series that is zero at both ends.

    Args:
        z: Heights at equal steps [m], shape (n,).
        step: Step along the rail or the tread [m].

    Returns:
        Heights as a wheel feels them, shape (n,).
    """
    Omega: Reals = 2.0 * np.pi * np.fft.rfftfreq(len(z), step).astype(np.float64)
    return np.asarray(np.fft.irfft(np.fft.rfft(z) * felt_share(Omega), len(z)), np.float64)
