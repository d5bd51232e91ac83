"""Loads and wheels that move over periodic seats: Floquet's solution, order of the step, passes against exact steps."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.track.knots import Grading, graded_knots
from tiengine.track.rail_operators import RailOperators
from tiengine.track.residual_compliance import Foundation, ResidualCompliance
from tiengine.track.seat_points import seat_points
from tiengine.track.sines import Sines
from tiengine.track.splines import Splines
from validation.closed_forms.floquet import Seats, deflection_under_load
from validation.closed_forms.timoshenko import Beam

from ..reference.rail_march import RailMarch, TwoMasses, TwoMassWheels, constant_load
from .rails import V350, chn60, uic60

PITCH, K, C, P = 0.65, 5e7, 5e4, 70e3
WINDOW, WHEEL = 24.0, np.array([12.0])
PUBLISHED = np.array([0.62636, 0.66101])  # mm, over a seat and at mid-span, two independent programs


def uic_beam():
    r = uic60()
    return Beam(r.E * r.Iy, r.kappa_vertical * r.G * r.A, r.mass_per_length, r.rho * r.Iy)


def floquet(length):
    offset, share = seat_points(length)
    seats = Seats(PITCH, K, C, tuple(offset), tuple(share))
    return 1e3 * deflection_under_load(uic_beam(), seats, V350, P, np.array([0.0, PITCH / 2.0]))


def marched(functions, length):
    """Deflection over a seat and at mid-span [mm], what the functions lack under the wheel included."""
    operators = RailOperators(uic60(), functions)
    missing = ResidualCompliance(operators, Foundation(K / PITCH, 1.0, 1.0), WHEEL).wheels[0, 0]
    march = RailMarch(
        operators, False, np.array([K]), np.array([C]), V350, PITCH / V350 / 65, PITCH, length, WHEEL
    )  # fmt: skip
    X, w = constant_load(march, P, 5.0, 9.0, PITCH)
    place = np.mod(X + WHEEL[0], PITCH)
    order = np.argsort(place)
    found = np.interp([0.0, PITCH / 2.0], place[order], w[order, 0], period=PITCH)
    return 1e3 * (found + missing * P)


def test_floquet_of_points():
    np.testing.assert_allclose(floquet(0.0), PUBLISHED, atol=0.6e-5)  # half a digit


def test_floquet_of_long_seats_shrinks_to_points():
    """Quadratic in the length; a seat as long as five points in one place is a point."""
    point, errors = floquet(0.0), []
    for length in (0.04, 0.02):
        errors.append(np.abs(floquet(length) - point).max())
    assert errors[1] < 0.6 * errors[0]  # the jump at a point seat makes it first order
    assert errors[0] < 0.01 * point.max()


@pytest.mark.parametrize(
    ("length", "finest", "tolerance"), [(0.15, 0.15, 1e-3), (0.15, 0.05, 2.5e-4), (0.0, 0.05, 1.2e-3)]
)
def test_splines_converge_to_floquet(length, finest, tolerance):
    """Within 0.1 % with the default knots, 0.02 % with three times finer ones; point seats converge more slowly."""
    growth = 0.2 if finest == 0.15 else 0.1
    knots = graded_knots(WINDOW, WHEEL, Grading(finest=finest, growth=growth))
    found = marched(Splines(knots), length)
    assert np.abs(found / floquet(length) - 1.0).max() < tolerance


def test_published_numbers():
    """0.62636 and 0.66101 mm of point seats, within what halving the finest knots still changes."""
    knots = graded_knots(WINDOW, WHEEL, Grading(finest=0.03, growth=0.1, near=1.0))
    np.testing.assert_allclose(marched(Splines(knots), 0.0), PUBLISHED, rtol=6e-4)


def test_sines_too():
    """6.5 sines a metre, seats with a length."""
    np.testing.assert_allclose(marched(Sines(WINDOW, 156), 0.15), floquet(0.15), rtol=1.5e-3)


def wheel_forces(dt, passes, lateral):
    """Railhead under given lateral forces, or N of two wheels over a rough rail, at multiples of 4e-4 s.

    N is that above the static one: the contact is linear.
    """
    rail, wheels = chn60(), np.array([6.0, 8.5])
    operators = RailOperators(rail, Splines(graded_knots(14.5, wheels)))
    k, c = ((1.5e7, 4e7), (5e4, 5e4)) if lateral else ((4e7,), (5e4,))
    march = RailMarch(operators, lateral, np.array(k), np.array(c), V350, dt, 0.63, 0.15, wheels, passes)
    two, found = TwoMassWheels(TwoMasses(load=0.0), 2, dt), []
    for i in range(round(DURATION / dt)):
        t = (i + 1) * dt
        x = min(1.0, t / 0.04)
        ramp = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
        if lateral:
            force = 1e4 * ramp * (1.0 + 0.3 * np.sin(2.0 * np.pi * np.array([90.0, 210.0]) * t))
            w = march.step(lambda _, __, force=force: force)
        else:
            two.predict()
            rough = 2e-4 * ramp * np.sin(2.0 * np.pi * (V350 * t + wheels) / 1.3)
            w = march.step(two.load(rough, np.zeros(2)))
            two.finish()
        found.append(w if lateral else two.N.copy())
    return np.array(found)[round(4e-4 / dt) - 1 :: round(4e-4 / dt)]


DURATION = 0.08  # s: 12 seats


@pytest.mark.parametrize("lateral", [False, True])
def test_order_of_the_step(lateral):
    """The exact step is of second order; passes go to it, two of them staying within its own error at 2e-4 s."""
    exact = {dt: wheel_forces(dt, 0, lateral) for dt in (4e-4, 2e-4, 5e-5)}
    scale = np.abs(exact[5e-5]).max()
    coarse, fine = (np.abs(exact[dt] - exact[5e-5]).max() for dt in (4e-4, 2e-4))
    assert 1.8 < np.log2(coarse / fine) < 2.4  # 2.07 of a pure square against a reference at 5e-5 s
    assert fine < 4e-3 * scale
    two, four = (np.abs(wheel_forces(2e-4, passes, lateral) - exact[2e-4]).max() for passes in (2, 4))
    assert two < 2e-3 * scale
    assert four < 0.4 * two  # 0.5^2 by the spectral radius
