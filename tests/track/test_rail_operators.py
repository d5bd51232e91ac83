"""Matrices of the rail: sines as ever, pinned frequencies, convection, moving loads on a bed, widths of the bands."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from tiengine.track.knots import Grading, graded_knots, uniform_knots
from tiengine.track.rail import RailWindow
from tiengine.track.rail_operators import RailOperators
from tiengine.track.seat_points import mean_cosine
from tiengine.track.sines import Sines
from tiengine.track.splines import Splines
from validation.closed_forms.timoshenko import Beam, pinned_frequencies

from ..reference.moving_load import Bed, deflection
from .rails import LENGTH, V350, WHEELS, chn60

V_RATE = -3.0  # m/s^2


def beams(rail):
    """Vertical and lateral beam."""
    return (
        Beam(rail.E * rail.Iy, rail.kappa_vertical * rail.G * rail.A, rail.mass_per_length, rail.rho * rail.Iy),
        Beam(rail.E * rail.Iz, rail.kappa_lateral * rail.G * rail.A, rail.mass_per_length, rail.rho * rail.Iz),
    )


@pytest.mark.parametrize("block", ["vertical", "lateral"])
def test_sines_are_todays(block):
    """Function by function instead of field by field, else the matrices of the sine window to the last bits."""
    old, fields = RailWindow(chn60(), 7.3, 13), 2 if block == "vertical" else 3
    order = np.arange(fields * 13).reshape(fields, 13).T.ravel()
    new = RailOperators(chn60(), Sines(7.3, 13))
    for a, b in zip(getattr(new, block)(V350, V_RATE), getattr(old, block)(V350, V_RATE), strict=True):
        expected = b.toarray()[np.ix_(order, order)]
        np.testing.assert_allclose(a.toarray(), expected, rtol=1e-14, atol=1e-15 * np.abs(expected).max())


def test_shapes_of_sines_are_todays():
    old, new, s = RailWindow(chn60(), 7.3, 13), Sines(7.3, 13), np.linspace(0.0, 7.3, 40)
    np.testing.assert_array_equal(new.shape(s), old.shape(s))
    np.testing.assert_array_equal(new.shape(s, 1), old.shape_slope(s))
    # a seat with a length feels a wave of k as the mean of cos k xi: sin(kL/2)/(kL/2) to the order of five points
    x = 0.5 * new.wave_numbers * 0.15
    np.testing.assert_allclose(new.shape(s, over=0.15), new.shape(s) * np.sin(x) / x, atol=1e-13)
    assert mean_cosine(np.array([0.0]), 0.15) == pytest.approx(1.0, abs=1e-15)


def test_pinned_frequencies():
    """Sixth order in both planes and in torsion, the lowest four of a rail of 6 m."""
    rail, errors = chn60(), []
    exact = [pinned_frequencies(beam, 6.0, 4)[0] for beam in beams(rail)]
    exact.append(np.arange(1, 5) * np.pi / 6.0 * np.sqrt(rail.GK / (rail.rho * rail.I_polar)))
    sizes = (0.5, 0.25, 0.125)
    for h in sizes:
        f = RailOperators(rail, Splines(uniform_knots(6.0, h)))
        (M, _, K), (ML, _, KL) = f.vertical(0.0), f.lateral(0.0)
        turn = np.arange(2, ML.shape[0], 3)
        plane = np.setdiff1d(np.arange(ML.shape[0]), turn)
        pairs = [(K, M), *((KL[kept][:, kept], ML[kept][:, kept]) for kept in (plane, turn))]
        found = [np.sqrt(la.eigh(a.toarray(), b.toarray(), eigvals_only=True)[:4]) for a, b in pairs]
        errors.append([np.max(x / y - 1.0) for x, y in zip(found, exact, strict=True)])
    errors = np.array(errors)
    assert np.all(errors > 0.0)  # Rayleigh and Ritz
    assert np.all(np.log2(errors[:-1] / errors[1:]) > 5.5)
    assert np.all(errors[-1] < 1e-6)


def test_widths_of_the_bands():
    """7 for (w, theta_y), 11 for (v, theta_z, theta_x) with the fastenings, whatever the spacing."""
    f = RailOperators(chn60(), Splines(graded_knots(LENGTH, WHEELS)))
    vertical, lateral = f.foundation(1.0, 1.0)
    for matrices, width in (((*f.vertical(V350, V_RATE), vertical), 7), ((*f.lateral(V350, V_RATE), lateral), 11)):
        for matrix in matrices:
            c = matrix.tocoo()
            assert np.abs(c.row - c.col).max() <= width


@pytest.mark.parametrize("block", ["vertical", "lateral"])
def test_convection_is_lagrange_plus_flux(block):
    """C is skew but for the slopes' values at the rear, where they leave; at the front the rail enters at rest."""
    f, fields = RailOperators(chn60(), Splines(graded_knots(LENGTH, WHEELS))), 2 if block == "vertical" else 3
    M, C, K = (matrix.toarray() for matrix in getattr(f, block)(V350))
    flux = np.zeros_like(C)
    rotary = chn60().densities[1 if block == "vertical" else 3]
    flux[1, 1] = 2.0 * V350 * rotary
    np.testing.assert_allclose(C + C.T, flux, atol=1e-12 * np.abs(C).max())
    np.testing.assert_allclose(M, M.T, atol=1e-15 * M.max())
    np.testing.assert_allclose(K, K.T, atol=1e-15 * np.abs(K).max())
    assert la.eigvalsh(M)[0] > 0.0
    slowing = getattr(f, block)(V350, V_RATE)[2].toarray() - K
    C[-fields + 1, -fields + 1] -= V350 * rotary  # entry is no part of the flow
    np.testing.assert_allclose(slowing, V_RATE / (2.0 * V350) * C, atol=1e-9 * np.abs(C).max())


def test_a_shape_fixed_to_the_ground_is_not_accelerated():
    """A shape fixed to the ground, u(s + V t), has no inertia force: V^2 u'' - 2 V V u'' + V^2 u'' = 0."""
    f = RailOperators(chn60(), Splines(uniform_knots(10.0, 0.05)))
    M, C, K = f.vertical(V350)
    still = f.vertical(0.0)[2]
    s = np.linspace(0.0, 10.0, 4001)
    u = np.sin(np.pi * s / 10.0) ** 4  # flat at the ends
    k = 2.0 * np.pi / 10.0
    u1 = k * (np.sin(k * s) / 2.0 - np.sin(2.0 * k * s) / 4.0)
    u2 = k**2 * (np.cos(k * s) - np.cos(2.0 * k * s)) / 2.0
    fit = [np.linalg.lstsq(f.functions.shape(s), field, rcond=None)[0] for field in (u, V350 * u1, V350**2 * u2)]
    q, v, a = (np.kron(x, [1.0, 0.0]) for x in fit)
    force = M @ a + C @ v + (K - still) @ q
    size = np.abs(M @ a).max()
    assert np.abs(force).max() < 1e-5 * size


BED = {"k": 4e7 / 0.63, "c": 5e4 / 0.63}
P = 70e3


def on_bed(f, middle, s):
    """Steady deflection at s from a load at ``middle``, [m]."""
    flow = sp.kron(f.functions.products.displacement.flow, np.array([[1.0, 0.0], [0.0, 0.0]]))
    K = f.vertical(V350)[2] + f.foundation(BED["k"], 0.0)[0] - V350 * BED["c"] * flow
    w, _, _ = f.under(middle + s)
    return w @ spsolve(sp.csc_array(K), P * w[[0]].toarray()[0])


def test_moving_load_on_a_bed():
    """350 km/h on a damped bed: the closed form of the endless beam, first order under the load, third beside it."""
    rail = chn60()
    vertical = beams(rail)[0]
    s = np.array([0.0, -3.0, -1.5, -0.6, 0.6, 1.5, 3.0])
    exact = deflection(Bed(vertical.EI, vertical.kGA, vertical.m, vertical.rho_I, **BED), V350, P, s)
    errors = []
    for h in (0.2, 0.1, 0.05, 0.025):
        f = RailOperators(rail, Splines(uniform_knots(36.0, h)))
        error = np.abs(on_bed(f, 18.0, s) - exact) / exact[0]
        errors.append([error[0], error[1:].max()])
    rate = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    assert np.all(np.abs(rate[1:, 0] - 1.0) < 0.1)  # the kink of the shear strain: half the spacing, half of what lacks
    assert rate[:, 1].mean() > 3.0  # beside it the kink is not seen
    assert errors[-1][1] < 2e-6


def test_graded_knots_follow_the_load():
    """The default's 43 knots in 24 m are within 0.6 % under the load and 0.03 % beside it."""
    rail = chn60()
    vertical = beams(rail)[0]
    s = np.array([0.0, -3.0, -1.5, -0.6, 0.6, 1.5, 3.0])
    exact = deflection(Bed(vertical.EI, vertical.kGA, vertical.m, vertical.rho_I, **BED), V350, P, s)
    f = RailOperators(rail, Splines(graded_knots(24.0, np.array([12.0]), Grading())))
    error = np.abs(on_bed(f, 12.0, s) - exact) / exact[0]
    assert error[0] < 6e-3
    assert error[1:].max() < 3e-4


def test_the_rate_of_the_speed_hardly_counts():
    """Braking by 1.5 m/s^2: -mu dV/dt u', which the step with splines leaves out, is some millionths.

    Rail on its fastenings smeared along it, under a wheel's vertical and lateral force at 350 km/h: change of the
    deflection under the wheel, and the largest anywhere, over the deflection under the wheel.
    """
    f = RailOperators(chn60(), Splines(graded_knots(24.0, np.array([12.0]), Grading())))
    beds = f.foundation(BED["k"], 1.5e7 / 0.63)
    s = np.linspace(0.0, 24.0, 481)
    for matrices, bed, row in ((f.vertical, beds[0], 0), (f.lateral, beds[1], 1)):
        load = f.under(np.array([12.0]))[row].toarray()[0]
        shape = f.under(s)[row]
        steady, braking = (shape @ spsolve(sp.csc_array(matrices(V350, rate)[2] + bed), load) for rate in (0.0, -1.5))
        under = steady[240]
        assert abs(braking[240] - steady[240]) < 1e-9 * under  # it is odd about the wheel
        assert 1e-8 * under < np.abs(braking - steady).max() < 4e-6 * under
