"""The whole step in one launch: dense algebra, the contact law, the same bits for any lanes and place in a batch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.engine.equilibrium import evaluate_contact
from tiengine.kernels import layout as at
from tiengine.kernels import spline_layout as sl
from tiengine.kernels.contact import ITERATE_TOLERANCE

from ..models import V350, paper_model
from .spline_bed import Bed, make_bed, with_trains
from .spline_reference import Motion, motion_of, reference_pass

DT = 2e-4
ROUNDING = 1e-11  # condition of the rails' blocks 1e3 at most, of the train's 1e4


def bed(trains: int = 1, **changes: Any) -> Bed:
    given = make_bed(with_trains(paper_model(dt=DT), trains), V350, **changes)
    given.start(1)
    return given


def differ(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Largest difference over the largest number."""
    return float(np.abs(a - b).max() / np.abs(b).max())


def assert_same(got: Motion, want: Motion) -> None:
    for field in range(5):
        assert differ(got.rails[..., field], want.rails[..., field]) < ROUNDING
    assert differ(got.slabs[..., :-2], want.slabs[..., :-2]) < ROUNDING
    assert differ(got.slabs[..., -2:], want.slabs[..., -2:]) < ROUNDING
    assert differ(got.train, want.train) < ROUNDING


@pytest.mark.parametrize(
    ("trains", "case"),
    [
        (1, {}),
        (3, {"soft": (2, 5), "factors": True}),
        (1, {"X": 100.3, "absorbing": 4.0, "pad": 0.0}),
        (1, {"X": 17.999, "soft": (0,), "fine": 0.15, "residual": 1e-10}),
    ],
)
def test_passes_are_those_of_dense_algebra(trains: int, case: dict[str, Any]) -> None:
    """First pass from a random state, then the second from the first, with the contact forces that came out."""
    # alone, the first pass has to stop its contact where it does as the first of two
    one, two = bed(trains, passes=1, tolerance=ITERATE_TOLERANCE, **case), bed(trains, passes=2, **case)
    before = [motion_of(one, b) for b in range(trains)]
    one.step(0)
    two.step(0)
    for b in range(trains):
        first = reference_pass(one, b, before[b], None, one.contact.rail_force[b], one.contact.wheelset_force[b])
        assert_same(motion_of(one, b), first)
        second = reference_pass(two, b, before[b], first, two.contact.rail_force[b], two.contact.wheelset_force[b])
        assert_same(motion_of(two, b), second)
        assert np.abs(two.contact.force[b]).max() > 1e5  # N: there was something to carry


@pytest.mark.parametrize("residual", [0.0, 2e-10])
def test_forces_are_the_law_at_the_end_of_the_step(residual: float) -> None:
    """At the coordinates the step leaves behind, the law gives the forces it used, once the passes have converged."""
    given = bed(2, residual=residual, passes=8)
    given.step(0)
    train = given.model.ingredients.train
    first, shape = given.spans.at(given.wheel_s)
    u, v = (given.state.rails(row)[..., [0, 2, 4]] for row in (sl.U, sl.V))
    near = first[:, None] + np.arange(4)
    rail = np.zeros((2, len(first), 2, 9))
    rail[..., :3] = np.einsum("brwqf,wq->bwrf", u[:, :, near], shape[..., 0])
    rail[..., 3:6] = np.einsum("brwqf,wq->bwrf", u[:, :, near], shape[..., 1])
    rail[..., 6:] = np.einsum("brwqf,wq->bwrf", v[:, :, near], shape[..., 0])
    rail[..., :3] += residual * given.contact.rail_force
    coordinates = [given.state.vehicles(row)[:, train.wheelset_dof] for row in (sl.U, sl.V)]
    law = evaluate_contact(given.model, V350, given.irregularity[:, 0], coordinates[0], coordinates[1], rail)
    tolerance = 20.0 * given.model.constants[at.CONTACT_TOLERANCE] * given.model.constants[at.STATIC_LOAD]
    assert np.abs(law.local[..., :3] - given.contact.force[..., :3]).max() < tolerance


def test_any_lanes_and_any_place_give_the_same_bits() -> None:
    """Seeds go by train, so that train b is the same alone and in a batch."""

    def bits(given: Bed, b: int) -> list[NDArray[np.float64]]:
        given.step.record[:] = np.arange(len(given.step.record))
        given.step(0)
        given.step(1, 3)
        state = motion_of(given, b)
        return [state.rails, state.slabs, state.train, given.contact.force[b], given.record[b], given.body_record[b]]

    batch = bed(6)
    together = [bits(batch, 0)] + [[a.copy() for a in bits_of(batch, b)] for b in (3, 5)]
    for lanes in (2, 4, 8):
        alone = bits(bed(1, lanes=lanes), 0)
        for a, b in zip(alone, together[0], strict=True):
            np.testing.assert_array_equal(a, b)
    pairs = bed(6, lanes=4)
    bits(pairs, 0)
    for place, b in enumerate((3, 5)):
        for x, y in zip(bits_of(pairs, b), together[1 + place], strict=True):
            np.testing.assert_array_equal(x, y)


def bits_of(given: Bed, b: int) -> list[NDArray[np.float64]]:
    state = motion_of(given, b)
    return [state.rails, state.slabs, state.train, given.contact.force[b], given.record[b], given.body_record[b]]


def test_steps_in_one_launch_are_single_steps() -> None:
    """Same bits, all trains of a chunk moved on before the next."""
    one, many = bed(6), bed(6)
    many.step(0, 4)
    for i in range(4):
        one.step(i)
    for b in range(6):
        for x, y in zip(bits_of(one, b), bits_of(many, b), strict=True):
            np.testing.assert_array_equal(x, y)


def test_without_vector_mode_the_same_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sums may be taken in another order, nothing else."""
    vectors = bed(1, soft=(1,))
    assert vectors.step.launch.vector_mode
    monkeypatch.setenv("TIENGINE_VECTOR", "0")
    plain = bed(1, soft=(1,))
    assert not plain.step.launch.vector_mode
    for given in (vectors, plain):
        given.step(0, 3)
    for x, y in zip(bits_of(vectors, 0)[:4], bits_of(plain, 0)[:4], strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-8, atol=1e-8 * np.abs(y).max())
