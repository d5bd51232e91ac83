"""Closed forms of validation/closed_forms: cones on round heads, two masses, linearised wheelset."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from validation.closed_forms.klingel import cone_conicity, free_wheelset, rigid_bogie, track_conicity
from validation.closed_forms.linear_vehicle import EquivalentContact, _wheelset
from validation.closed_forms.two_mass import (
    WheelOnTrack,
    beam_receptance,
    force_per_roughness,
    peak,
    two_mass_frequencies,
)

DELTA, R0, B, HEAD = 0.05, 0.43, 0.75, 0.3
EULER = WheelOnTrack(unsprung=925.0, contact=1.2e9, EI=6.6e6, m=60.6, k=6.3e7, c=8e4)


def _cone_on_heads(y):
    """Half the difference of the rolling radii of two cones resting on two circles, by elementary geometry."""
    centre_y = B + HEAD * np.sin(np.arctan(DELTA))
    centre_z = HEAD * np.cos(np.arctan(DELTA))  # heads' centres below the contacts of the centred wheelset

    def placed(phi, z, side):
        """Distance of a head's centre from the cone's line less R, and the radius where they touch."""
        c, s = np.cos(phi), np.sin(phi)
        dy, dz = side * centre_y - y, centre_z + R0 - z
        across, down = side * (c * dy + s * dz), -s * dy + c * dz  # in the wheelset's axes
        normal = np.hypot(1.0, DELTA)
        surface = R0 - DELTA * (across - B)
        distance = (down - surface) / normal
        foot = across - distance * DELTA / normal
        return distance - HEAD, R0 - DELTA * (foot - B)

    def height(phi, side):
        return brentq(lambda z: placed(phi, z, side)[0], -0.05, 0.05, xtol=1e-15)

    phi = brentq(lambda p: height(p, 1.0) - height(p, -1.0), -0.01, 0.01, xtol=1e-15)
    z = height(phi, 1.0)
    return 0.5 * (placed(phi, z, 1.0)[1] - placed(phi, z, -1.0)[1]), phi


def test_cone_conicity_is_that_of_a_cone_on_two_circles():
    """Wickens drops the second order of the slope: delta^2 = 0.0025 of it."""
    y = 1e-4
    difference, phi = _cone_on_heads(y)
    assert difference / y == pytest.approx(cone_conicity(DELTA, R0, B, HEAD), rel=2.0 * DELTA**2)
    assert phi / y == pytest.approx(-DELTA / (B - R0 * DELTA), rel=2.0 * DELTA**2)


def test_roll_cancels_in_klingels_wavelength():
    """lambda of the axle over the slip's lever b/(b - r delta) is the conicity of the contacts."""
    lever = B / (B - R0 * DELTA)
    assert cone_conicity(DELTA, R0, B, HEAD) / lever == pytest.approx(track_conicity(DELTA, B, HEAD), rel=1e-14)


def test_klingel_limits():
    """A bogie without length is a wheelset; Klingel's 15.6 m of 1:20, r = 0.41, b = 0.75."""
    assert rigid_bogie(0.05, R0, B, 0.0) == free_wheelset(0.05, R0, B)
    assert free_wheelset(0.05, 0.41, 0.75) == pytest.approx(15.58, abs=0.005)


def test_slow_linear_wheelset_moves_along_klingels_wave():
    """At 0.1 m/s without spin and load the eigenvalue of the creep matrices is i 2 pi V/L."""
    V = 0.1
    lever = B / (B - R0 * DELTA)
    contact = EquivalentContact(
        cone_conicity(DELTA, R0, B, HEAD), (lever - 1.0) / R0, 0.0, 0.0, 0.0, B, 9e6, 8e6, 0.0, 0.0
    )
    C, K = _wheelset(contact, 0.0, V, R0)
    s = np.linalg.eigvals(-np.linalg.solve(C, K))
    exact = 2.0 * np.pi * V / free_wheelset(track_conicity(DELTA, B, HEAD), R0, B)
    np.testing.assert_allclose(np.sort(s.imag), [-exact, exact], rtol=1e-12)
    np.testing.assert_allclose(s.real, 0.0, atol=1e-12)


def test_p2_of_two_masses_in_its_limits():
    """A rigid contact joins the masses; without the rail's mass the springs are in series."""
    joined = np.sqrt(EULER.track_stiffness / (EULER.unsprung + EULER.track_mass)) / (2.0 * np.pi)
    rigid = WheelOnTrack(925.0, 1e15, 6.6e6, 60.6, 6.3e7, 8e4)
    assert two_mass_frequencies(rigid)[0] == pytest.approx(joined, rel=1e-6)
    light = WheelOnTrack(925.0, 1.2e9, 6.6e6, 1e-6, 6.3e7, 8e4)
    series = 1.0 / (1.0 / light.contact + 1.0 / light.track_stiffness)
    assert two_mass_frequencies(light)[0] == pytest.approx(np.sqrt(series / 925.0) / (2.0 * np.pi), rel=1e-6)


def test_track_mass_and_stiffness_are_those_of_the_static_shape():
    x = np.linspace(-20.0, 20.0, 400_001)
    shape = np.exp(-EULER.beta * abs(x)) * (np.cos(EULER.beta * x) + np.sin(EULER.beta * abs(x)))
    assert EULER.track_mass == pytest.approx(EULER.m * np.trapezoid(shape**2, x), rel=1e-6)
    assert EULER.track_stiffness == pytest.approx(EULER.k * np.trapezoid(shape, x), rel=1e-6)


def test_beam_receptance():
    """Euler: 1/(8 EI beta(omega)^3); Timoshenko: the integral by quadrature."""
    f = np.array([1e-3, 50.0, 120.0])
    omega = 2.0 * np.pi * f
    beta = ((EULER.k + 1j * omega * EULER.c - EULER.m * omega**2) / (4.0 * EULER.EI)) ** 0.25
    np.testing.assert_allclose(beam_receptance(EULER, f), 1.0 / (8.0 * EULER.EI * beta**3), rtol=1e-9)
    s = WheelOnTrack(925.0, 1.2e9, 6.6e6, 60.6, 6.3e7, 8e4, 3.2e8, 0.25, 1.5e9)
    xi = np.linspace(-4000.0, 4000.0, 8_000_001)
    w = omega[1]
    K = 1.0 / (1.0 / (s.k + 1j * w * s.c) + 1.0 / s.bed) - s.m * w**2
    slope = s.EI * xi**2 + s.kGA - s.rho_I * w**2
    integral = np.trapezoid(slope / ((s.kGA * xi**2 + K) * slope - (s.kGA * xi) ** 2), xi) / (2.0 * np.pi)
    tail = 1.0 / (np.pi * s.kGA * 4000.0)  # the integrand ends as 1/(kGA xi^2)
    assert beam_receptance(s, f[1:2])[0] == pytest.approx(integral + tail, rel=1e-6)
    values = slope / ((s.kGA * xi**2 + K) * slope - (s.kGA * xi) ** 2) * np.cos(2.5 * xi)
    away = np.trapezoid(values, xi) / (2.0 * np.pi)
    assert beam_receptance(s, f[1:2], 2.5)[0] == pytest.approx(away, abs=1e-4 * abs(integral))


def test_undamped_lumped_response_peaks_at_p2():
    s = WheelOnTrack(925.0, 1.2e9, 6.6e6, 60.6, 6.3e7, 10.0)
    f = np.linspace(40.0, 60.0, 20_001)
    low = two_mass_frequencies(s)[0]
    assert peak(f, np.abs(force_per_roughness(s, f, lumped=True))) == pytest.approx(low, rel=1e-4)
