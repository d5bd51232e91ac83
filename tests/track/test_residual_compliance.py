"""Missing static compliance: against fine meshes, textbook limits, the sines' own sum."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.track.fastening import Fastening
from tiengine.track.knots import graded_knots, uniform_knots
from tiengine.track.rail import RailWindow
from tiengine.track.rail_operators import RailOperators
from tiengine.track.residual_compliance import Foundation, ResidualCompliance
from tiengine.track.seat_points import seat_points
from tiengine.track.sines import Sines
from tiengine.track.splines import Splines

from .rails import LENGTH, WHEELS, chn60

FASTENING = Fastening(vertical_stiffness=4e7, lateral_stiffness=1.5e7, vertical_damping=5e4, lateral_damping=5e4)
BED = Foundation.of(chn60(), FASTENING, 0.63)


def residual(functions, wheels=WHEELS, seat_length=0.15, bed=BED):
    return ResidualCompliance(RailOperators(chn60(), functions), bed, wheels, seat_length)


def discrete(functions, a, b, over=0.0):
    """Compliance of w, v, theta_x from b to the mean around a in the trial functions, by dense solves."""
    f = RailOperators(chn60(), functions)
    one = functions.products.displacement.values.toarray()
    K, KL = f.vertical(0.0)[2].toarray(), f.lateral(0.0)[2].toarray()
    n = functions.count
    plane, turn = np.arange(3 * n) % 3 < 2, np.arange(3 * n) % 3 == 2
    blocks = [K, KL[np.ix_(plane, plane)], KL[np.ix_(turn, turn)] + BED.torsion * one]
    for block, k in zip(blocks[:2], (BED.vertical, BED.lateral), strict=True):
        block[::2, ::2] += k * one
    out = []
    for block, stride in zip(blocks, (2, 2, 1), strict=True):
        load = np.zeros((len(block), len(b)))
        load[::stride] = functions.shape(b).T
        out.append(functions.shape(a, over=over) @ np.linalg.solve(block, load)[::stride])
    return np.array(out)  # (3, a, b)


def test_exact_is_where_fine_meshes_go() -> None:
    """Discretised plus residual is the same for any mesh, and what is missing halves with the spacing (shear kink)."""
    wheel, missing, total = np.array([3.1]), [], []
    for h in (0.2, 0.1, 0.05, 0.025):
        f = Splines(uniform_knots(6.2, h))  # a knot at the wheel
        missing.append(residual(f, wheel).wheels[0])
        total.append(discrete(f, wheel, wheel)[:, 0, 0] + missing[-1])
    rate = np.log2(np.array(missing)[:-1] / np.array(missing)[1:])
    assert np.all(np.abs(rate[-1] - 1.0) < 0.05)
    # extrapolated from the two finest meshes, apart from the closed form: first order gone, second left
    coarse, fine = (total[i] - missing[i] for i in (2, 3))
    np.testing.assert_allclose(2.0 * fine - coarse, total[3], rtol=2e-4)


def test_default_knots_lack_little() -> None:
    """0.3 % of the rail's own compliance vertically, 0.2 % laterally, 4 % in torsion; the same under each wheel."""
    f = Splines(graded_knots(LENGTH, WHEELS))
    found = residual(f).wheels
    share = found / np.array([discrete(f, WHEELS[[i]], WHEELS[[i]])[:, 0, 0] for i in range(4)])
    assert np.all(share > 0.0)
    assert np.all(share < [4e-3, 2e-3, 4e-2])
    assert np.all(np.ptp(found, axis=0) < 0.05 * found.mean(axis=0))


def test_closed_forms() -> None:
    """An endless beam's compliance under its own load, integrated in closed form; ends 20 m away are not felt.

    (1/2 pi) int (1 + EI q^2 / S) / (EI q^4 + EI k / S q^2 + k) dq = (r + EI / S) / (2 EI sqrt(k / S + 2 / r)),
    r = sqrt(EI / k); torsion 1 / (2 sqrt(k GK)).
    """
    rail, middle = chn60(), np.array([20.0])
    f = Splines(uniform_knots(40.0, 0.1))
    found = discrete(f, middle, middle)[:, 0, 0] + residual(f, middle).wheels[0]
    expected = []
    for EI, kappa, k in (
        (rail.E * rail.Iy, rail.kappa_vertical, BED.vertical),
        (rail.E * rail.Iz, rail.kappa_lateral, BED.lateral),
    ):
        S, r = kappa * rail.G * rail.A, np.sqrt(EI / k)
        expected.append((r + EI / S) / (2.0 * EI * np.sqrt(k / S + 2.0 / r)))
    expected.append(1.0 / (2.0 * np.sqrt(BED.torsion * rail.GK)))
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_near_an_end_too() -> None:
    """Images hold the ends: 0.4 m from one, as far as the rail's decay, fine and coarse knots still agree."""
    wheel = np.array([0.4])
    total = []
    for h in (0.1, 0.05):
        f = Splines(uniform_knots(6.0, h))
        total.append(discrete(f, wheel, wheel)[:, 0, 0] + residual(f, wheel).wheels[0])
    np.testing.assert_allclose(total[0], total[1], rtol=1e-6)
    assert residual(f, np.array([0.4])).wheels[0, 0] > 0.0


def test_sines_lack_their_sum() -> None:
    """The bed hardly reaches the modes left out: the mean over places is the sum over them."""
    modes = 60
    places = np.linspace(5.0, 31.0, 521)
    found = residual(Sines(36.0, modes), places).wheels
    np.testing.assert_allclose(found.mean(axis=0), RailWindow(chn60(), 36.0, modes).missing_compliance, rtol=0.03)


@pytest.mark.parametrize("seat_length", [0.0, 0.15])
def test_seats_and_wheels(seat_length: float) -> None:
    """Own compliance of a seat and that between seat and wheel: fine splines are the exact rail but for 1 in 30."""
    coarse, fine, seats = Sines(12.0, 24), Splines(uniform_knots(12.0, 0.01)), np.array([4.11, 5.2, 5.8, 7.3, 11.0])
    wheels = np.array([5.5])
    both = residual(coarse, wheels, seat_length)
    found = both.seats_by_wheels(seats)
    offset, weight = seat_points(seat_length)
    expected = np.zeros((3, len(seats)))
    for f, sign in ((fine, 1.0), (coarse, -1.0)):
        expected += sign * discrete(f, seats, wheels, seat_length)[:, :, 0]
    near = np.abs(seats - 5.5) < 1.0
    scale = both.wheels[0]
    assert np.all(np.abs(found[near, 0] - expected.T[near]) < 0.01 * scale)
    assert not found[~near].any()
    assert np.abs(found[near, 0]).max() > 0.05 * scale[0]
    own = both.seats(seats)
    at = (seats[:, None] + offset).ravel()
    full = discrete(fine, at, at) - discrete(coarse, at, at)
    full = full.reshape(3, len(seats), len(offset), len(seats), len(offset))
    expected = np.einsum("fkgkh,g,h->kf", full, weight, weight)
    assert np.all(np.abs(own - expected) < 0.04 * own.max(axis=0))
