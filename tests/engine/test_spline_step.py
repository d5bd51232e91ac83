"""The whole step in one launch against dense algebra, and the same bits for any lanes and any place in a batch."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.kernels import layout as at
from tiengine.kernels import spline_layout as sl
from tiengine.start import evaluate_contact

from ..models import V350, paper_model
from .spline_bed import Bed, make_bed, motion_of, reference_pass, with_trains

DT = 2e-4


def bed(trains: int = 1, **changes: object) -> Bed:
    return make_bed(with_trains(paper_model(dt=DT), trains), V350, **changes)


def largest(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference over the largest number, field by field."""
    return float((np.abs(a - b).max(axis=tuple(range(a.ndim - 1))) / np.abs(b).max(axis=tuple(range(a.ndim - 1)))).max())


@pytest.mark.parametrize("trains", [1, 3])
def test_passes_are_those_of_dense_algebra(trains: int) -> None:
    """First pass from a random state, then the second from the first: 1e-9 is the solves' rounding (condition 1e3)."""
    one, two = bed(trains, passes=1), bed(trains, passes=2)
    for given in (one, two):
        given.start(1)
        before = [motion_of(given, b) for b in range(trains)]
        given.step(0)
    for b in range(trains):
        first = reference_pass(one, b, before[b], None, one.contact.rail_force[b], one.contact.wheelset_force[b])
        assert largest(motion_of(one, b).rails[2], first.rails[2]) < 1e-9
        assert largest(motion_of(one, b).slabs[2], first.slabs[2]) < 1e-9
        assert np.abs(motion_of(one, b).train[2] - first.train[2]).max() < 1e-9 * np.abs(first.train[2]).max()
