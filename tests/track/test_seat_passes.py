"""Passes over the seats: stand-in, contraction and growth, a seat's own compliance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tiengine.track.fastening import Fastening
from tiengine.track.knots import graded_knots, uniform_knots
from tiengine.track.rail_operators import RailOperators
from tiengine.track.seat_passes import CONTRACTION, SeatPasses, least_factor
from tiengine.track.splines import Splines

from ..reference.rail_march import RailMarch
from .rails import LENGTH, V350, WHEELS, chn60

GRADED = RailOperators(chn60(), Splines(graded_knots(LENGTH, WHEELS)))


def fastening(c=5e4, k=4e7, k_l=1.5e7):
    return Fastening(vertical_stiffness=k, lateral_stiffness=k_l, vertical_damping=c, lateral_damping=c)


def passes(c=5e4, dt=2e-4, length=0.15, factor=1.0, operators=GRADED, **stiffness):
    return SeatPasses(operators, fastening(c, **stiffness), 0.63, length, dt**2 / 4.0, dt / 2.0, V350, factor)


def march(given, lateral, count):
    f = given.fastening
    vertical = np.array([f.vertical_stiffness]), np.array([f.vertical_damping])
    foot = np.array([f.lateral_stiffness, f.vertical_stiffness]), np.array([f.lateral_damping, f.vertical_damping])
    k, c = foot if lateral else vertical
    return RailMarch(
        given.operators, lateral, k, c, V350, 2.0 * given.gamma_dt, given.spacing, given.seat_length, WHEELS, count,
        given.factor,
    )  # fmt: skip


@pytest.mark.parametrize("lateral", [False, True])
def test_stand_in_is_the_smeared_seats(lateral):
    """A_s against a quadrature of the seats' stretches."""
    given = passes(factor=2.0)
    by_quadrature = march(given, lateral, 2)
    found = given.smeared[lateral].toarray()
    np.testing.assert_allclose(found, by_quadrature.A_s, atol=1e-12 * np.abs(found).max())
    np.testing.assert_allclose(
        given.blocks[lateral].toarray(), by_quadrature.A + by_quadrature.A_s, rtol=1e-10, atol=1e-12
    )


@pytest.mark.parametrize("length", [0.0, 0.15])
def test_contraction_is_the_spectral_radius(length):
    """Power method against all eigenvalues of a pass, built from the march's own rows."""
    given, largest = passes(c=1e5, length=length), 0.0
    for lateral in (False, True):
        m = march(given, lateral, 2)
        m.first = 0.3
        B, Gu, Gv = m._pull()
        rest = m.A_s - B.T @ (m.b2 * Gu + m.g1 * Gv)
        largest = max(largest, np.abs(np.linalg.eigvals(m.inverse @ rest)).max())
    assert given.contraction(0.3) == pytest.approx(largest, rel=0.02)  # of the power method after 60 steps


@pytest.mark.parametrize("dt", [1e-4, 2e-4, 2.5e-4])
@pytest.mark.parametrize("c", [1e4, 5e4, 1e5])
def test_default_knots_need_no_more_than_the_smeared_seats(c, dt):
    assert least_factor(passes(c, dt)) == 1.0


def test_factors():
    """Strong dampers need a larger stand-in, point seats in a fine mesh the largest; at last none will do."""
    assert least_factor(passes(2e5)) == 2.0
    fine = RailOperators(chn60(), Splines(uniform_knots(20.0, 0.1)))
    assert least_factor(passes(2e5, length=0.0, operators=fine)) in (4.0, None)
    assert least_factor(passes(1e5, length=0.0, operators=fine)) in (2.0, 4.0)
    assert least_factor(passes(1e5, k=1e9, k_l=1e9)) is not None
    assert least_factor(passes(5e6, length=0.0, operators=fine)) is None


@pytest.mark.parametrize(("stiffest", "dt"), [(3.0, 2e-4), (10.0, 1e-4), (10.0, 2.5e-5)])
def test_stiffened_seats_need_a_larger_stand_in(stiffest, dt):
    """At least half of theirs, smeared; and its passes contract over sound seats, too."""
    factor = least_factor(replace(passes(dt=dt), stiffest=stiffest))
    assert factor >= 0.5 * stiffest
    assert passes(dt=dt, factor=factor).contraction(0.3) < CONTRACTION


def test_lag_is_what_a_pass_leaves_of_a_long_wave():
    """A half sine over the whole window, on seats as smeared, without stiffness of the rail: closed form."""
    assert passes(factor=1.0).lag == 0.0
    given = passes(factor=8.0)
    x = np.sin(np.pi * np.arange(GRADED.functions.count) / (GRADED.functions.count - 1.0))
    M, A_s = given.operators.vertical(0.0)[0], given.smeared[0]
    u = np.kron(x, [1.0, 0.0])
    M, A_s = u @ M @ u, u @ A_s @ u
    assert given.lag == pytest.approx((A_s - A_s / 8.0) / (M + A_s), rel=1e-6)


def growth(given, lateral, steps=450):
    """Energy of free motion: peak in the last third over that in the second."""
    m = march(given, lateral, 2)
    m.v = 1e-3 * np.random.default_rng(2).standard_normal(len(m.u))
    energy = np.empty(steps)
    with np.errstate(over="ignore", invalid="ignore"):
        for i in range(steps):
            m.step(lambda w, _: np.zeros(len(w)))
            energy[i] = m.energy()
            if not energy[i] < 1e6:
                return np.inf
    third = steps // 3
    return energy[2 * third :].max() / energy[third : 2 * third].max()


@pytest.mark.parametrize("lateral", [False, True])
def test_contraction_foretells_stability(lateral):
    """Two passes: free motion dies out where passes contract, and runs away where they do not."""
    for c, factor in ((1e5, 1.0), (2e5, 2.0)):
        given = passes(c, factor=factor)
        assert given.contraction(0.3) < CONTRACTION
        assert growth(given, lateral) < 1.05
    wild = passes(2e6)
    assert wild.contraction(0.3) > 2.0
    assert growth(wild, True) > 1e3


def test_own_compliance():
    """B A^-1 B^T by dense inverses, at places away from the ends and near a wheel."""
    given, s = passes(), np.array([3.3, 8.05, 17.2, 25.4])
    vertical, lateral = given.own_compliance(s)
    for block, found in ((False, vertical[:, None, None]), (True, lateral)):
        m = march(given, block, 2)
        B = np.stack(m.stretch(s, 0, 0.15), axis=1)
        np.testing.assert_allclose(found, B @ m.inverse @ B.transpose(0, 2, 1), rtol=1e-9)
    assert np.all(np.linalg.eigvalsh(lateral) > 0.0)
    softer = replace(given, factor=4.0).own_compliance(s)[0]
    assert np.all(softer < vertical)
