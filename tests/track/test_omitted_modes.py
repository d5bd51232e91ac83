"""Compliance of the sines left out: against the plain sum, means over seats, the tail."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.parameters.arrays import Reals
from tiengine.track.omitted_modes import REACH, WHOLE, OmittedModes
from tiengine.track.rail import RailWindow
from tiengine.track.seat_points import seat_points

from .rails import chn60

LENGTH, MODES, SEAT = 36.0, 60, 0.15
OMITTED = OmittedModes(chn60(), LENGTH, MODES, SEAT)


def summed(x: Reals, terms: int = 200_000) -> Reals:
    """h(x) between points term by term, shape (3, ...)."""
    r = chn60()
    k = np.arange(MODES + 1, terms) * np.pi / LENGTH
    waves = np.cos(np.multiply.outer(x, k)) / LENGTH
    shears, bendings = r.G * r.A * np.array([r.kappa_vertical, r.kappa_lateral]), r.E * np.array([r.Iy, r.Iz])
    across = [waves @ (1.0 / (S * k**2) + 1.0 / (EI * k**4)) for S, EI in zip(shears, bendings, strict=True)]
    return np.stack([*across, waves @ (1.0 / (r.GK * k**2))])


def test_closed_form_is_the_sum() -> None:
    """Beside the wheel, between seats, behind the next wheel; the sum's own tail is 1e-3 of its largest term."""
    x = np.array([0.0, 0.07, 0.63, -1.3, 2.5, 3.9])
    expected = summed(x)
    tail = 2.0 / 200_000 * MODES  # of h(0)
    np.testing.assert_allclose(
        OMITTED.compliance(x, 0), expected, rtol=0, atol=tail * expected[:, :1].max(axis=1).max()
    )
    for found, own in zip(OMITTED.compliance(x, 0), expected, strict=True):
        np.testing.assert_allclose(found, own, rtol=0, atol=tail * own[0])


def test_own_compliance_is_that_under_the_wheels() -> None:
    """h(0) is the constant that ``truncation = "local"`` adds in series with the contact."""
    missing = RailWindow(chn60(), LENGTH, MODES).missing_compliance
    np.testing.assert_allclose(OMITTED.compliance(np.zeros(1), 0)[:, 0], missing, rtol=1e-9)


@pytest.mark.parametrize("seats", [1, 2])
def test_a_seat_takes_the_mean_over_its_length(seats: int) -> None:
    """Five points of one seat, or of both."""
    offset, weight = seat_points(SEAT)
    apart = 0.3
    if seats == 1:
        expected = OMITTED.compliance(apart + offset, 0) @ weight
    else:
        expected = OMITTED.compliance(apart + np.add.outer(offset, offset), 0) @ weight @ weight
    np.testing.assert_allclose(OMITTED.compliance(np.array([apart]), seats)[:, 0], expected, rtol=1e-9)


@pytest.mark.parametrize("seats", [0, 1, 2])
def test_slope(seats: int) -> None:
    """By central differences, the faded part included; zero at the kink."""
    x, step = np.array([-2.0, 0.05, 0.3, 1.0, 4.7, 5.9]), 1e-5
    by_difference = (OMITTED.compliance(x + step, seats) - OMITTED.compliance(x - step, seats)) / (2.0 * step)
    found = OMITTED.slope(x, seats)
    for own, expected in zip(found, by_difference, strict=True):
        np.testing.assert_allclose(own, expected, rtol=0, atol=1e-4 * np.abs(own).max())
    assert not np.abs(OMITTED.slope(np.zeros(1), seats)).max() > 1e-9 * np.abs(found).max()


def test_the_tail_fades_out() -> None:
    """Untouched up to where it counts in full, nothing beyond its reach, no jump anywhere."""
    tail = OMITTED.compliance(np.array([REACH, REACH + 0.1, 17.0]), 1)
    assert not tail.any()
    x = np.linspace(WHOLE - 0.5, REACH + 0.5, 3001)
    h = OMITTED.compliance(x, 1)[0]
    assert np.abs(np.diff(h)).max() < 1e-3 * OMITTED.compliance(np.zeros(1), 1)[0, 0]  # k_N h(0) dx / (k_N x) = 4e-4
