"""Irregularity: standard deviations of spectra and of a long realisation.

References: standard deviations by an independent quadrature of the spectra (digits as printed there):
the German ones as one-sided densities, the Chinese ballastless one (TB/T 3352-2014). A Gaussian sample
of length L scatters in its variance by sqrt(2 pi int S^2 dOmega / L).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.irregularity.irregularity import IrregularityParams, make_irregularity
from tiengine.irregularity.spectrum import CHANNELS, band_variances, load_spectrum, sigma
from tiengine.parameters.arrays import Reals
from validation.frame.case import Case

INDEPENDENT = "independent quadrature of the published spectrum"
LENGTH, SPACING = 20e3, 0.25
UNITS = np.array([1e3, 1e3, 1e3, 1e3])  # m to mm, rad to mrad
ORDER = ("vertical", "alignment", "gauge", "cross_level")
LOW = {
    (1.0, 120.0): (2.570, 1.863, 0.329, 1.209),
    (1.0, 80.0): (2.074, 1.504, 0.319, 1.173),
    (3.0, 150.0): (2.863, 2.076, 0.331, 1.216),
    (3.0, 25.0): (0.984, 0.714, 0.248, 0.912),
    (2.0, 200.0): (3.258, 2.362, 0.336, 1.232),
}
HIGH = (4.206, 3.167, 0.459, 1.978)
CHINA = (0.715, 0.534, 0.326)  # vertical, alignment, gauge over 2-120 m


def _sigmas(name: str, low: float, high: float, channels: tuple[str, ...] = ORDER) -> list[float]:
    """Standard deviations [mm, mrad]."""
    return [1e3 * sigma(load_spectrum(name), channel, low, high) for channel in channels]


@cache
def _sample() -> Reals:
    """Standard deviations over 20 km of the German low spectrum, seed 1, far beyond the taper [mm, mrad]."""
    x = np.arange(0.0, LENGTH, SPACING)
    values = make_irregularity(IrregularityParams(), -1e9).sample(x)[:, :4]
    found = dict(zip(CHANNELS, 1e3 * np.sqrt(np.mean(values**2, axis=0)), strict=True))
    return np.array([found[channel] for channel in ORDER])


def _scatter() -> Reals:
    """Four standard deviations of the sample's standard deviation [mm, mrad]."""
    spectrum = load_spectrum("german_low")
    edges = np.geomspace(2 * np.pi / 120.0, 2 * np.pi, 2001)
    square = [
        band_variances(lambda Omega, c=channel: spectrum.density(c, Omega) ** 2, edges).sum() for channel in ORDER
    ]
    of_variance = np.sqrt(2 * np.pi * np.array(square) / LENGTH)
    return 4.0 * 1e3 * of_variance / (2.0 * np.array(LOW[1.0, 120.0]) * 1e-3)


CASES = (
    Case(
        name="sigma-german-low",
        kind="validation",
        quantity=("German low: vertical, alignment, gauge [mm], cross level [mrad] in five bands of wavelength"),
        source=INDEPENDENT,
        reference=tuple(LOW.values()),
        atol=1e-3,
        why="a unit of the last printed digit, the error of the source's quadrature",
        compute=lambda: [_sigmas("german_low", *band) for band in LOW],
    ),
    Case(
        name="sigma-german-high",
        kind="validation",
        quantity="German high, the same quantities, 1-120 m",
        source=INDEPENDENT,
        reference=HIGH,
        atol=1e-3,
        why="a unit of the last printed digit, the error of the source's quadrature",
        compute=lambda: _sigmas("german_high", 1.0, 120.0),
    ),
    Case(
        name="sigma-china",
        kind="validation",
        quantity="Chinese ballastless, 2-120 m: vertical, alignment, gauge [mm]",
        source=INDEPENDENT,
        reference=CHINA,
        atol=1e-3,
        why="a unit of the last printed digit, the error of the source's quadrature",
        compute=lambda: _sigmas("china_ballastless", 2.0, 120.0, ORDER[:3]),
    ),
    Case(
        name="sigma-20-km",
        kind="validation",
        quantity="realisation of German low over 20 km, seed 1, the same four quantities",
        source=INDEPENDENT,
        reference=LOW[1.0, 120.0],
        atol=_scatter(),
        why="four standard deviations of the estimate",
        compute=_sample,
    ),
)
