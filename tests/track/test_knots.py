"""Graded knots: spacing as asked, symmetry, wheels on knots, no slivers, any number of wheels."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import build
from tiengine.track.knots import Grading, graded_knots, uniform_knots

from .rails import LENGTH, WHEELS


def train(cars):
    """Wheels of coaches 25 m apart, 8 m of rail beyond them."""
    one = np.array([0.0, 2.5, 17.5, 20.0])
    wheels = (8.0 + one + 25.0 * np.arange(cars)[:, None]).ravel()
    return wheels, wheels[-1] + 8.0


def asked(distance, g):
    return np.clip(g.finest + g.growth * (distance - g.near), g.finest, g.coarsest)


@pytest.mark.parametrize("cars", [1, 3, 8, 16])
@pytest.mark.parametrize("grading", [Grading(), Grading(finest=0.1, near=1.0, growth=0.1, coarsest=0.5)])
def test_spacing(cars, grading):
    """Nowhere coarser than asked; finer by no more than one span in a stretch between two wheels, or far from them."""
    wheels, length = train(cars)
    knots = graded_knots(length, wheels, grading)
    h, middle = np.diff(knots), (knots[1:] + knots[:-1]) / 2.0
    distance = np.abs(middle[:, None] - wheels).min(axis=1)
    size = asked(distance, grading)
    # a span takes the mean of one over the spacing; across the corners of the rule it differs from that at its middle
    assert np.all(h < 1.03 * size)
    far = (middle < wheels[0] - 5.0) | (
        middle > wheels[-1] + 5.0
    )  # three spans or more take what is missing to the end
    assert np.all(h[~far] > 0.85 * size[~far])
    assert np.all(h[far] > 2.0 / 3.0 * size[far])
    assert h.min() > 0.85 * grading.finest
    assert knots[0] == 0.0
    assert knots[-1] == length


def test_neighbours_are_alike():
    """No span is more than a third longer than the next: growth 0.2 over a span and a half."""
    for cars in (1, 8):
        wheels, length = train(cars)
        h = np.diff(graded_knots(length, wheels))
        assert np.all(np.abs(np.log(h[1:] / h[:-1])) < np.log(1.34))


def test_density():
    """About three functions a metre and field for eight cars."""
    wheels, length = train(8)
    assert 2.6 < len(graded_knots(length, wheels)) / length < 3.2


def test_symmetry_and_wheels():
    """Wheels stand on knots; what is symmetric stays so, and the order of wheels does not matter."""
    knots = graded_knots(LENGTH, WHEELS)
    np.testing.assert_allclose(knots, LENGTH - knots[::-1], atol=1e-13)
    assert np.all(np.abs(knots[:, None] - WHEELS).min(axis=0) == 0.0)
    np.testing.assert_array_equal(knots, graded_knots(LENGTH, WHEELS[[2, 0, 3, 1]]))


def test_shifting_the_wheels_far_from_the_ends_changes_nothing():
    """Knots travel with the wheels: a longer window has the same ones about them."""
    near, far = (graded_knots(LENGTH + 2 * x, WHEELS + x) - x for x in (0.0, 10.0))
    inside = (near >= WHEELS[0]) & (near <= WHEELS[-1])
    np.testing.assert_allclose(near[inside], far[(far >= WHEELS[0] - 1e-9) & (far <= WHEELS[-1] + 1e-9)], atol=1e-12)


def test_inverse():
    """Spans to distance and back."""
    g, x = Grading(), np.linspace(0.0, 40.0, 500)
    np.testing.assert_allclose(g.distance(g.spans(x)), x, atol=1e-12)
    h = np.diff(x)[0]
    np.testing.assert_allclose(np.diff(g.spans(x)) / h, 1.0 / asked(x[:-1] + h / 2, g), rtol=5e-2)


def test_wheels_close_together_share_a_knot():
    knots = graded_knots(20.0, np.array([10.0, 10.0, 10.02]))
    assert np.diff(knots).min() > 0.1


def test_equal_distances():
    """Finest as coarsest: one distance throughout, or a little shorter."""
    h = np.diff(graded_knots(10.0, np.array([4.0]), Grading(finest=0.3, coarsest=0.3)))
    assert np.all(h <= 0.3 + 1e-12)
    assert np.ptp(h) < 0.02
    np.testing.assert_allclose(np.diff(uniform_knots(10.0, 0.3)), 10.0 / 34.0)
    assert len(uniform_knots(1.0, 2.0)) == 4


@pytest.mark.parametrize("wheels", [[], [0.01], [9.99], [12.0]])
def test_wheels_outside(wheels):
    with pytest.raises(InputError, match="every wheel must stand"):
        graded_knots(10.0, np.array(wheels))


def test_grading_out_of_order():
    with pytest.raises(InputError, match="must not be below"):
        build(Grading, {"finest": 0.5, "coarsest": 0.2}, "grading")


def test_at_defects() -> None:
    """A track with defects has closer knots far from the wheels, never closer than the finest, never coarser."""
    assert Grading().at_defects().coarsest == 0.5
    assert Grading(coarsest=0.3).at_defects().coarsest == 0.3
    assert Grading(finest=0.6).at_defects().coarsest == 0.6
    assert Grading().at_defects().finest == Grading().finest


@pytest.mark.parametrize("length", [38.0, 44.0, 60.3])
def test_knots_near_the_wheels_do_not_depend_on_the_window(length):
    """Windows that reach beyond the graded zone, 5.3 m, have the same knots in it."""
    wheels = np.array([0.0, 2.5, 17.5, 20.0])
    near = [k[np.abs(k) < 15.2] for k in (graded_knots(x, wheels - 10.0 + 0.5 * x) - 0.5 * x for x in (36.0, length))]
    np.testing.assert_allclose(near[0], near[1], atol=1e-12)
