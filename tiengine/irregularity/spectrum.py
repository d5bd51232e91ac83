"""Power spectral densities of track irregularity and of rail roughness (MODEL §6).

Every density S(Omega) is **one-sided** over the angular wave number Omega = 2 pi / lambda [rad/m]: the
variance of a band is the integral of S over it. Channels: vertical z_v and alignment y_a [m^2/(rad/m)], cross
level theta, an angle [rad^2/(rad/m)], gauge [m^2/(rad/m)]. Constants live in
``tiengine/library/irregularity/*.toml``. Formulas may be evaluated outside their band of validity
(``wavelengths``); the caller chooses the band.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from functools import cache
from typing import Annotated, Literal

import numpy as np
from pydantic import model_validator

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError, nearest
from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import find_preset
from tiengine.parameters.quantity import Params, Q, build

__all__ = [
    "CHANNELS",
    "FraSpectrum",
    "GermanSpectrum",
    "PowerLawSpectrum",
    "Roughness",
    "Spectrum",
    "band_variances",
    "contact_filter",
    "load_roughness",
    "load_spectrum",
    "sigma",
    "spectrum_names",
]

Density = Callable[[Reals], Reals]

CHANNELS = ("vertical", "alignment", "cross_level", "gauge")
"""Names of the channels in the order of the realisation: z_v, y_a, theta, g."""

_SPECTRA = ("german_low", "german_high", "china_ballastless", *(f"fra_{grade}" for grade in range(1, 7)))


class Spectrum(Params):
    """Base class of the spectra: title, source of the numbers, band of validity."""

    title: str
    source: str
    wavelengths: tuple[float, float]

    @abstractmethod
    def density(self, channel: str, Omega: Reals) -> Reals:
        """One-sided density of a channel.

        Args:
            channel: One of :data:`CHANNELS`.
            Omega: Angular wave numbers [rad/m], any shape, > 0.

        Returns:
            S(Omega) [m^2/(rad/m)], for the cross level [rad^2/(rad/m)]; same shape.
        """

    def mean_factor(self, percentile: float) -> float:
        """Factor on S for its percentile p; only the Chinese spectrum has percentiles."""
        raise InputError(
            f"irregularity.percentile = {percentile:g}: must not be set: the {self.title} has no percentiles"
        )


class GermanSpectrum(Spectrum):
    """German spectra of low and high disturbance.

    With L = 1/[(Omega^2 + Omega_r^2)(Omega^2 + Omega_c^2)]::

        S_v = A_v Omega_c^2 L                 S_c = (A_v/b^2) Omega_c^2 Omega^2 L/(Omega^2 + Omega_s^2)
        S_a = A_a Omega_c^2 L                 S_g =  A_g      Omega_c^2 Omega^2 L/(Omega^2 + Omega_s^2)
    """

    form: Literal["german"]
    Omega_c: Annotated[float, Q("rad/m", gt=0)]
    Omega_r: Annotated[float, Q("rad/m", gt=0)]
    Omega_s: Annotated[float, Q("rad/m", gt=0)]
    b: Annotated[float, Q("m", gt=0)]
    A_v: Annotated[float, Q("m^2 rad/m", gt=0)]
    A_a: Annotated[float, Q("m^2 rad/m", gt=0)]
    A_g: Annotated[float, Q("m^2 rad/m", gt=0)]

    def density(self, channel: str, Omega: Reals) -> Reals:
        """One-sided density of a channel; see :meth:`Spectrum.density`."""
        A = {
            "vertical": self.A_v,
            "alignment": self.A_a,
            "cross_level": self.A_v / self.b**2,
            "gauge": self.A_g,
        }[channel]
        W = Omega**2
        S: Reals = A * self.Omega_c**2 / ((W + self.Omega_r**2) * (W + self.Omega_c**2))
        return S if channel in ("vertical", "alignment") else S * W / (W + self.Omega_s**2)


class FraSpectrum(Spectrum):
    """FRA line classes; the cross level, a height in the formula, becomes an angle over ``base``.

    S_v = k A_v Omega_c^2/[Omega^2(Omega^2 + Omega_c^2)], S_a the same with A_a,
    S_c = S_g = 4 k A_v Omega_c^2/[(Omega^2 + Omega_c^2)(Omega^2 + Omega_s^2)].
    """

    form: Literal["fra"]
    k: Annotated[float, Q("-", gt=0)]
    Omega_c: Annotated[float, Q("rad/m", gt=0)]
    Omega_s: Annotated[float, Q("rad/m", gt=0)]
    A_v: Annotated[float, Q("m^2 rad/m", gt=0)]
    A_a: Annotated[float, Q("m^2 rad/m", gt=0)]
    base: Annotated[float, Q("m", gt=0)]

    def density(self, channel: str, Omega: Reals) -> Reals:
        """One-sided density of a channel; see :meth:`Spectrum.density`."""
        W = Omega**2
        common: Reals = self.k * self.Omega_c**2 / (W + self.Omega_c**2)
        if channel in ("vertical", "alignment"):
            return (self.A_v if channel == "vertical" else self.A_a) * common / W
        S: Reals = 4 * self.A_v * common / (W + self.Omega_s**2)
        return S / self.base**2 if channel == "cross_level" else S


class PowerLaw(Params):
    """S(f) = A/f^n in mm^2/(1/m), f in 1/m, with another (A, n) beyond each break."""

    breaks: tuple[Annotated[float, Q("1/m", gt=0)], ...]
    A: tuple[Annotated[float, Q("mm^2 (1/m)^(n-1)", gt=0)], ...]
    n: tuple[Annotated[float, Q("-")], ...]

    @model_validator(mode="after")
    def _one_more_piece_than_breaks(self) -> PowerLaw:
        if not len(self.A) == len(self.n) == len(self.breaks) + 1:
            raise ValueError("must have one A and one n more than breaks")
        if list(self.breaks) != sorted(set(self.breaks)):
            raise ValueError("breaks must increase")
        return self

    def density(self, Omega: Reals) -> Reals:
        """S(Omega) = S(f)/(2 pi) in m^2/(rad/m)."""
        f = Omega / (2 * np.pi)
        piece = np.searchsorted(np.array(self.breaks), f, side="right")
        S: Reals = np.array(self.A)[piece] * f ** -np.array(self.n)[piece]
        return S * (1e-6 / (2 * np.pi))


class PowerLawSpectrum(Spectrum):
    """Chinese ballastless spectrum: pieces of power laws; cross level as a height over ``base``.

    The curves are the mean of spectra that scatter with chi-square of two degrees of freedom, so the
    percentile p is the mean times -ln(1 - p); the mean itself is the 63.2nd percentile.
    """

    form: Literal["power_law"]
    base: Annotated[float, Q("m", gt=0)]
    vertical: PowerLaw
    alignment: PowerLaw
    cross_level: PowerLaw
    gauge: PowerLaw

    def density(self, channel: str, Omega: Reals) -> Reals:
        """One-sided density of a channel; see :meth:`Spectrum.density`."""
        law: PowerLaw = getattr(self, channel)
        S = law.density(Omega)
        return S / self.base**2 if channel == "cross_level" else S

    def mean_factor(self, percentile: float) -> float:
        """Factor on S of the percentile, -ln(1 - p)."""
        return float(-np.log1p(-percentile))


class Roughness(Params):
    """A one-third octave roughness spectrum of one railhead, as a density.

    Within a band Omega S is constant, such that every band has exactly the rms 10^(L/20) micrometres.
    Outside the bands S = 0.
    """

    form: Literal["one_third_octave"]
    title: str
    source: str
    first_band: int
    level: tuple[Annotated[float, Q("dB re 1e-6 m")], ...]

    @property
    def wavelengths(self) -> Reals:
        """Centre of every band [m], 10^(-n/10), longest first, shape (bands,)."""
        return 10.0 ** (-(self.first_band + np.arange(len(self.level))) / 10.0)

    @property
    def longest(self) -> float:
        """Upper edge of the longest band [m]."""
        return float(self.wavelengths[0] * 10.0**0.05)

    @property
    def shortest(self) -> float:
        """Lower edge of the shortest band [m]."""
        return float(self.wavelengths[-1] * 10.0**-0.05)

    def density(self, Omega: Reals) -> Reals:
        """One-sided density [m^2/(rad/m)] at Omega [rad/m]; any shape."""
        variance = (1e-6 * 10.0 ** (np.array([-np.inf, *self.level, -np.inf]) / 20.0)) ** 2
        band = np.floor(10.0 * np.log10(Omega * self.longest / (2 * np.pi))).astype(np.int64)
        clipped = np.clip(band + 1, 0, len(self.level) + 1)
        S: Reals = variance[clipped] / (Omega * np.log(10.0) / 10.0)
        return S


def spectrum_names() -> tuple[str, ...]:
    """Names of the library's spectra; ``"none"`` is not one of them."""
    return _SPECTRA


@cache
def load_spectrum(name: str) -> Spectrum:
    """Load a spectrum of the library.

    Args:
        name: One of :func:`spectrum_names`.

    Raises:
        InputError: Unknown name; the message suggests the nearest one.
    """
    if name not in _SPECTRA:
        raise InputError(f"irregularity.spectrum = {name!r}: unknown{nearest(name, (*_SPECTRA, 'none'))}")
    table = load_toml(find_preset("irregularity", name))
    forms: dict[str, type[Spectrum]] = {
        "german": GermanSpectrum,
        "fra": FraSpectrum,
        "power_law": PowerLawSpectrum,
    }
    return build(forms[table["form"]], table, f"{name}.toml")


@cache
def load_roughness(name: str = "iso3095") -> Roughness:
    """Load a roughness limit of the library; ISO 3095:2013 is the only one."""
    return build(Roughness, load_toml(find_preset("irregularity", name)), f"{name}.toml")


def band_variances(density: Density, edges: Reals) -> Reals:
    """Variance between consecutive wave numbers, by five-point Gauss-Legendre rule in each interval.

    Args:
        density: S(Omega), one-sided.
        edges: Increasing wave numbers [rad/m], shape (n+1,).

    Returns:
        Integral of S over every interval, shape (n,).
    """
    point, weight = np.polynomial.legendre.leggauss(5)
    half = 0.5 * np.diff(edges)
    middle = 0.5 * (edges[1:] + edges[:-1])
    total: Reals = half * (density(middle[:, None] + half[:, None] * point) @ weight)
    return total


def sigma(spectrum: Spectrum, channel: str, wavelength_min: float, wavelength_max: float) -> float:
    """Standard deviation of a channel over a band of wavelengths.

    Args:
        spectrum: The spectrum.
        channel: One of :data:`CHANNELS`.
        wavelength_min: Shortest wavelength [m].
        wavelength_max: Longest wavelength [m].

    Returns:
        sigma [m], for the cross level [rad].
    """
    edges = np.geomspace(2 * np.pi / wavelength_max, 2 * np.pi / wavelength_min, 2001)
    return float(np.sqrt(band_variances(lambda Omega: spectrum.density(channel, Omega), edges).sum()))


def contact_filter(Omega: Reals, half_length: float) -> Reals:
    """Share of the power of a roughness that a contact patch transmits, |H|^2 = 1/[1 + (pi/4)(Omega a)^3].

    Remington's filter for a circular patch (Remington, J. Acoust. Soc. Am. 81 (1987) 1805; Thompson, Railway
    Noise and Vibration (2009), ch. 5).

    Args:
        Omega: Wave numbers [rad/m], any shape.
        half_length: Half length a of the patch along the rail [m].
    """
    share: Reals = 1.0 / (1.0 + 0.25 * np.pi * (Omega * half_length) ** 3)
    return share
