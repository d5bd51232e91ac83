"""Equivalent conicity of EN 15302: its own reference values, closed forms, two cones past a jump."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.contact.conicity import (
    en15302_conicity,
    equivalent_conicity,
    integrated_conicity,
    rolling_radius_difference,
    unrolled_position,
)
from tiengine.contact.profile import Profile, load_profile
from tiengine.contact.table import ContactSettings, WheelRailPair

DATA = Path(__file__).parents[1] / "data" / "profiles"

# Rolling-radius differences [mm] of EN 15302:2008+A1:2010, annex E, every 0.1 mm from 0: reference wheels A and B on
# reference rail A, gauge 1435.16 mm, radius 460 mm; B is a cone of 1:40 up to 2.9 mm.
WHEEL_A = """0 .032 .051 .071 .092 .116 .142 .167 .197 .227 .257 .292 .328 .361 .402 .443 .481 .527 .574 .616 .667 .719
.766 .822 .879 .931 .992 1.055 1.111 1.177 1.236 1.299 1.346 1.407 1.471 1.539 1.598 1.673 1.752 1.834 1.906 1.995 2.088
2.185 2.286 2.373 2.481 2.593 2.709 2.808 2.931 3.058 3.189 3.324 3.44 3.582 3.729 3.879 4.008 4.166 4.328 4.494 4.636
5.064 5.692 6.521 7.597 9.01 10.954"""
WHEEL_B = """1.95 2.003 2.057 2.112 2.167 2.224 2.281 2.339 2.397 2.457 2.517 2.578 2.64 2.702 2.766 2.83 2.895 2.961
3.027 3.095 3.163 3.232 3.302 3.372 3.444 3.516 3.589 3.663 3.737 3.813 3.889 3.966 4.044 4.123 5.392 6.111 7.05 8.27
9.895"""
DIFFERENCES = {
    "A": [float(value) for value in WHEEL_A.split()],
    "B": [0.05 * 0.1 * i for i in range(30)] + [float(value) for value in WHEEL_B.split()],
}
REFERENCE = {
    "A": {1.0: 0.125, 2.0: 0.155, 3.0: 0.188, 4.0: 0.216, 5.0: 0.254, 6.0: 0.303, 6.5: 0.348},
    "B": {1.0: 0.025, 2.9: 0.025, 3.0: 0.058, 3.1: 0.097, 3.5: 0.189, 4.0: 0.241, 5.0: 0.283, 6.0: 0.302, 6.5: 0.336},
}


@pytest.mark.parametrize("wheel", REFERENCE)
def test_reference_values_of_the_standard(wheel: str) -> None:
    """Every digit printed; the standard itself tolerates 0.05 or half the value."""
    difference = np.array(DIFFERENCES[wheel]) * 1e-3
    y = np.arange(difference.size) * 1e-4
    amplitude = np.array(list(REFERENCE[wheel])) * 1e-3
    found = integrated_conicity(y, difference, amplitude)
    np.testing.assert_allclose(found, list(REFERENCE[wheel].values()), atol=0.00051)


def test_a_cubic_difference() -> None:
    """Delta r = c y^3: a quarter wavelength is int_0^A dy/sqrt(c (A^4 - y^4)/2) = 1.3110288 sqrt(2/c)/A.

    1.3110288 is half the lemniscate constant. Linear interpolation over 1 um leaves (1 um/A)^2.
    """
    c, y = 4e3, np.linspace(0.0, 8e-3, 8001)
    amplitude = np.array([1e-3, 3e-3, 8e-3])
    quarter = np.sqrt(2.0 / c) / amplitude * 1.3110287771461
    expected = (np.pi / quarter) ** 2 / 8.0
    np.testing.assert_allclose(integrated_conicity(y, c * y**3, amplitude), expected, rtol=2e-6)


def test_a_motion_that_does_not_return() -> None:
    """Zero or negative conicity at the centre: 0 until the amplitude reaches beyond the hump of the integral."""
    y = np.linspace(0.0, 4e-3, 401)
    difference = np.where(y < 2e-3, -1e-4, 1e-3)
    found = integrated_conicity(y, difference, np.array([1e-3, 2.1e-3, 3e-3]))
    np.testing.assert_array_equal(found[:2], 0.0)
    assert found[2] > 0.0


def test_a_cone_without_roll_has_its_tangent() -> None:
    """The standard neglects roll: a cone of 1:20 is 0.05 at any amplitude, on round rails too."""
    y = np.linspace(-70e-3, 60e-3, 261)
    cone = Profile("cone", "wheel", y, -0.05 * y)
    pair = WheelRailPair(cone, load_profile("CHN60", "rail"), ContactSettings())
    np.testing.assert_allclose(en15302_conicity(pair, [1e-3, 4e-3, 7e-3]), 0.05, rtol=1e-6)
    np.testing.assert_array_equal(unrolled_position(pair, [3e-3]).roll, 0.0)


def test_two_cones_past_a_jump() -> None:
    """60E1 at 1:20, 3.5 mm, 0.4 mm past the jump: harmonic linearisation 0.308.

    The integral over the same difference, with roll and sampled every 0.05 mm, is 0.263, a sixth less. Without roll the
    jump lies 0.06 mm further out, at 3.10 mm; that is within the standard's tolerance of 0.05.
    """
    settings = ContactSettings(gauge_depth=0.014, half_spacing=0.75, cant=0.05, wheel_radius=0.46)
    pair = WheelRailPair(load_profile(DATA / "two_cones.txt", "wheel"), load_profile("60E1", "rail"), settings)
    assert equivalent_conicity(pair, [3.5e-3])[0] == pytest.approx(0.308, abs=1e-3)
    y = np.arange(0.0, 4e-3, 0.05e-3)
    rolled = integrated_conicity(y, rolling_radius_difference(pair, y), [3.5e-3])[0]
    assert rolled == pytest.approx(0.263, abs=1e-3)
    found = en15302_conicity(pair, [2e-3, 3.5e-3])
    assert found[0] == pytest.approx(0.025, rel=1e-4)  # the list's digits, 1e-4 mm over 2 mm
    assert found[1] == pytest.approx(0.263, abs=0.05)
