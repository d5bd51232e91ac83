"""The full-length model's sums over seats with a length, against sums over points of the rail."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.track.seat_points import seat_points
from validation.msm.seats import SeatTransform

SEATS, MODES, PITCH = 20, 70, 0.63  # modes beyond the seats: folded once and twice


@pytest.mark.parametrize("length", [0.0, 0.15])
def test_modes_to_seats_and_back(length):
    """Mean of the rail over every seat, and the seats' forces spread over the rail: one matrix and its transpose."""
    transform = SeatTransform.of(SEATS, MODES, length / PITCH)
    offset, weight = seat_points(length)
    k = np.arange(1, MODES + 1) * np.pi / (SEATS * PITCH)
    middles = (np.arange(SEATS) + 0.5) * PITCH
    shape = np.einsum("jgi,g->ji", np.sin(k * (middles[:, None] + offset)[..., None]), weight)
    rng = np.random.default_rng(1)
    q, force = rng.standard_normal(MODES), rng.standard_normal((1, SEATS))
    folded = np.zeros((1, SEATS))
    np.add.at(folded[0], transform.target, transform.sign * q)
    np.testing.assert_allclose(transform.to_seats(folded)[0], shape @ q, atol=1e-12)
    back = transform.sign * transform.from_seats(force)[0][transform.target]
    np.testing.assert_allclose(back, shape.T @ force[0], atol=1e-12)


def test_points_have_whole_signs():
    assert set(SeatTransform.of(SEATS, MODES).sign) == {-1.0, 0.0, 1.0}
