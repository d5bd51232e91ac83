"""Simply supported beam under a moving force, mass, sprung mass: limits, and the textbook's series."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from validation.closed_forms.supported_beam import (
    Crossing,
    force_euler,
    force_timoshenko,
    moving_mass,
    sprung_mass,
)
from validation.closed_forms.timoshenko import Beam

BRIDGE = Crossing(EI=8.323e9, m=2303.0, length=25.0, V=100.0 / 3.6, mass=5750.0, stiffness=1.595e6)
MODES, MIDDLE = 8, 12.5
T = np.linspace(0.0, BRIDGE.duration, 41)[1:]


def test_series_of_the_textbook() -> None:
    """Fryba, ch. 1: w = w0 sum sin(i pi x/l) [sin i w t - (alpha/i) sin w_i t] / (i^2 (i^2 - alpha^2)), w0 static."""
    w0 = 2.0 * BRIDGE.weight * BRIDGE.length**3 / (np.pi**4 * BRIDGE.EI)
    alpha = np.pi * BRIDGE.V / BRIDGE.length / BRIDGE.frequencies(1)[0]
    expected = np.zeros_like(T)
    for i in range(1, 9):
        waves = np.sin(i * np.pi * BRIDGE.V * T / BRIDGE.length) - alpha / i * np.sin(BRIDGE.frequencies(i)[-1] * T)
        expected += w0 * np.sin(i * np.pi / 2.0) * waves / (i**2 * (i**2 - alpha**2))
    np.testing.assert_allclose(force_euler(BRIDGE, MIDDLE, T, 8), expected, rtol=1e-10, atol=1e-15)


def test_slow_force_is_a_static_one() -> None:
    """V to zero: P l^3 / (48 EI) with the force at mid-span."""
    slow = replace(BRIDGE, V=1e-4)
    found = force_euler(slow, MIDDLE, np.array([slow.duration / 2.0]), 400)[0]
    assert found == pytest.approx(BRIDGE.weight * 25.0**3 / (48.0 * BRIDGE.EI), rel=1e-5)


def test_timoshenko_without_shear_is_euler() -> None:
    beam = Beam(BRIDGE.EI, 1e9 * BRIDGE.EI, BRIDGE.m, 1e-6)
    expected = force_euler(BRIDGE, MIDDLE, T, MODES)
    np.testing.assert_allclose(force_timoshenko(beam, BRIDGE, MIDDLE, T, MODES), expected, atol=1e-6 * expected.max())


def test_timoshenko_at_rest_has_its_shear() -> None:
    """A slow force bends and shears: P l^3 / (48 EI) + P l / (4 kGA)."""
    beam, slow = Beam(BRIDGE.EI, 2e8, BRIDGE.m, 500.0), replace(BRIDGE, V=1e-4)
    expected = slow.weight * (25.0**3 / (48.0 * beam.EI) + 25.0 / (4.0 * beam.kGA))
    found = force_timoshenko(beam, slow, MIDDLE, np.array([slow.duration / 2.0]), 4000)[0]
    assert found == pytest.approx(expected, rel=2e-4)  # 1 / (pi^2 / 8 * 4000) of the shear


def test_small_mass_is_a_force() -> None:
    light = replace(BRIDGE, mass=1e-3)
    expected = force_euler(light, MIDDLE, T, MODES)
    np.testing.assert_allclose(moving_mass(light, MIDDLE, T, MODES), expected, rtol=0.0, atol=1e-5 * expected.max())


def test_soft_spring_is_a_force_and_hard_spring_a_mass() -> None:
    soft, hard = replace(BRIDGE, stiffness=1e-3), replace(BRIDGE, stiffness=1e9, damping=1e6)
    expected = force_euler(BRIDGE, MIDDLE, T, MODES)
    found, moved = sprung_mass(soft, MIDDLE, T, MODES)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-5 * expected.max())
    pulled = soft.stiffness / soft.mass * soft.duration**2 / 2.0  # by the spring alone
    assert 0.0 < np.abs(moved).max() < pulled * expected.max()
    mass = moving_mass(BRIDGE, MIDDLE, T, MODES)
    # the mass rings on its spring at 66 Hz, half damped, from the moment it arrives
    np.testing.assert_allclose(sprung_mass(hard, MIDDLE, T, MODES)[0], mass, rtol=0.0, atol=2e-2 * mass.max())
    assert np.abs(mass - expected).max() > 3e-2 * expected.max()  # the mass matters at all
