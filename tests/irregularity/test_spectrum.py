"""Spectra against standard deviations computed by another program, and closed forms."""

import numpy as np
import pytest

from tiengine.irregularity.spectrum import (
    CHANNELS,
    band_variances,
    contact_filter,
    load_roughness,
    load_spectrum,
    sigma,
    spectrum_names,
)
from tiengine.parameters.errors import InputError

HALF_DIGIT = 0.0005  # references are printed with three decimals
MILLI = 1e-3

# Another quadrature: shortest and longest wave [m]; vertical, alignment, gauge [mm], cross level [mrad]
GERMAN_LOW = [
    (1.0, 120.0, (2.570, 1.863, 0.329, 1.209)),
    (1.0, 80.0, (2.074, 1.504, 0.319, 1.173)),
    (3.0, 150.0, (2.863, 2.076, 0.331, 1.216)),
    (3.0, 25.0, (0.984, 0.714, 0.248, 0.912)),
    (2.0, 200.0, (3.258, 2.362, 0.336, 1.232)),
]
PRINTED_ORDER = ("vertical", "alignment", "gauge", "cross_level")


@pytest.mark.parametrize(("shortest", "longest", "printed"), GERMAN_LOW)
def test_german_low_standard_deviations(shortest, longest, printed):
    """All bands of the table, to the digits printed."""
    spectrum = load_spectrum("german_low")
    computed = [sigma(spectrum, channel, shortest, longest) / MILLI for channel in PRINTED_ORDER]
    assert computed == pytest.approx(printed, abs=HALF_DIGIT)


def test_german_high_standard_deviations():
    """The 1-120 m band of the high disturbance."""
    spectrum = load_spectrum("german_high")
    computed = [sigma(spectrum, channel, 1.0, 120.0) / MILLI for channel in PRINTED_ORDER]
    assert computed == pytest.approx((4.206, 3.167, 0.459, 1.978), abs=HALF_DIGIT)


def test_chinese_standard_deviations():
    """Level, alignment, cross level and gauge over 2-120 m; the cross level is a height over 1.5 m there."""
    spectrum = load_spectrum("china_ballastless")
    computed = [sigma(spectrum, channel, 2.0, 120.0) / MILLI for channel in CHANNELS]
    computed[2] *= 1.5
    assert computed == pytest.approx((0.715, 0.534, 0.449, 0.326), abs=HALF_DIGIT)


def test_german_variance_of_all_waves():
    """Int_0^inf S_v = A_v Omega_c pi/[2 Omega_r (Omega_r + Omega_c)]."""
    exact = 4.032e-7 * 0.8246 * np.pi / (2 * 0.0206 * (0.0206 + 0.8246))
    computed = sigma(load_spectrum("german_low"), "vertical", 1e-2, 1e8) ** 2
    # what lies beyond 1e8 m: S(0) Omega_low = 5e-5 of Omega_r's share of exact, relative 2e-6
    assert computed == pytest.approx(exact, rel=1e-5)


def test_fra_spot_values():
    """Class 5 at Omega = 0.5 rad/m and class 1 at 2 rad/m, the formulas with their numbers written out."""
    S = load_spectrum("fra_5").density
    Omega = np.array([0.5])
    common = 0.25 * 0.8245**2 / (0.25 + 0.8245**2)
    expected = {
        "vertical": 0.2095e-4 * common / 0.25,
        "alignment": 0.0762e-4 * common / 0.25,
        "cross_level": 4 * 0.2095e-4 * common / (0.25 + 0.8209**2) / 1.5**2,
        "gauge": 4 * 0.2095e-4 * common / (0.25 + 0.8209**2),
    }
    for channel, value in expected.items():
        assert S(channel, Omega)[0] == pytest.approx(value, rel=1e-14)  # rounding
    first = load_spectrum("fra_1").density("vertical", np.array([2.0]))[0]
    assert first == pytest.approx(0.25 * 1.2107e-4 * 0.8245**2 / (4 * (4 + 0.8245**2)), rel=1e-14)


def test_fra_classes_improve():
    """Every class is smoother than the one before it, vertically and laterally."""
    Omega = np.geomspace(0.05, 6.0, 20)
    for channel in ("vertical", "alignment"):
        rows = [load_spectrum(f"fra_{grade}").density(channel, Omega) for grade in range(1, 7)]
        assert (np.diff(rows, axis=0) < 0.0).all()


@pytest.mark.parametrize("channel", CHANNELS)
def test_chinese_spectrum_is_continuous(channel):
    """At every break the two power laws agree within 0.5 %, the rounding of the coefficients."""
    spectrum = load_spectrum("china_ballastless")
    breaks = 2 * np.pi * np.array(getattr(spectrum, channel).breaks)
    below, above = (spectrum.density(channel, breaks * factor) for factor in (1 - 1e-9, 1 + 1e-9))
    assert above == pytest.approx(below, rel=5e-3)


def test_chinese_percentiles():
    """-ln(1 - p): one at 63.2 %, 2.303 at 90 %."""
    factor = load_spectrum("china_ballastless").mean_factor
    assert factor(1.0 - np.exp(-1.0)) == pytest.approx(1.0, rel=1e-14)
    assert factor(0.9) == pytest.approx(2.303, abs=HALF_DIGIT)


def test_iso_bands_have_their_level():
    """The density integrates to 10^(L/20) micrometres of the standard in every one-third octave."""
    roughness = load_roughness()
    edges = 2 * np.pi / (10.0 ** (-(np.arange(4, 27) - 0.5) / 10.0))
    rms = np.sqrt(band_variances(roughness.density, edges))
    levels = [17.1, 15, 13, 11, 9, 7, 4.9, 2.9, 0.9, -1.1, -3.2, -5, -5.6, -6.2, -6.8, -7.4, -8, -8.6, -9.2]
    levels += [-9.8, -10.4, -11.0]
    # five-point Gauss-Legendre on 1/Omega over a ratio of 1.26: (0.115)^10/10 = 4e-11
    assert 20 * np.log10(rms / 1e-6) == pytest.approx(levels, abs=1e-8)
    assert roughness.density(np.array([edges[0] * 0.999, edges[-1] * 1.001])) == pytest.approx([0.0, 0.0])
    nominal = [0.4, 0.315, 0.25, 0.2, 0.16, 0.125, 0.1, 0.08, 0.063, 0.05]
    assert roughness.wavelengths[:10] == pytest.approx(nominal, rel=0.01)  # standard rounding of the series


def test_contact_filter():
    """Half the power where (Omega a)^3 = 4/pi, none lost on long waves, Omega^-3 on short ones."""
    a = 6e-3
    half = (4 / np.pi) ** (1 / 3) / a
    assert contact_filter(np.array([half]), a)[0] == pytest.approx(0.5, rel=1e-14)
    assert contact_filter(np.array([2 * np.pi]), a)[0] == pytest.approx(1.0, abs=1e-4)  # (pi/4)(0.038)^3 = 4e-5
    short = contact_filter(np.array([100.0, 200.0]) / a, a)
    assert short[0] / short[1] == pytest.approx(8.0, rel=1e-5)


def test_every_spectrum_names_its_source():
    """Nine spectra, each with a title, a source and positive densities."""
    assert len(spectrum_names()) == 9
    for name in spectrum_names():
        spectrum = load_spectrum(name)
        assert spectrum.title
        assert len(spectrum.source) > 20
        for channel in CHANNELS:
            assert (spectrum.density(channel, np.geomspace(0.03, 100.0, 50)) > 0.0).all()


def test_unknown_spectrum_and_percentile_are_refused():
    """One line with the nearest name; percentiles only where there are any."""
    with pytest.raises(
        InputError, match=r"^irregularity.spectrum = 'german_lo': unknown; did you mean 'german_low'\?$"
    ):
        load_spectrum("german_lo")
    with pytest.raises(
        InputError, match=r"percentile = 0.9: must not be set: the FRA class 3 spectrum has no percentiles"
    ):
        load_spectrum("fra_3").mean_factor(0.9)
