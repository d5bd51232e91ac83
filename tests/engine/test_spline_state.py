"""Plain numbers out of the arrays of vectors and back; trains and slabs taken out."""

from __future__ import annotations

import numpy as np

from tiengine.engine.spline_tables import RailTables
from tiengine.kernels import spline_layout as sl
from tiengine.kernels.spline_seats import LARGEST, ON_RAIL, SMALLEST

from ..models import V350, paper_model
from .spline_bed import make_bed, spline_rail, with_trains
from .spline_reference import motion_of

DT = 2e-4


def test_rows_come_back_as_they_were_put_in() -> None:
    state = make_bed(with_trains(paper_model(dt=DT), 6), V350).state
    rng = np.random.default_rng(0)
    rails, trains = rng.standard_normal((6, 2, state.functions, 5)), rng.standard_normal((6, 35))
    state.set_rails(sl.V, rails)
    state.set_vehicles(sl.A, trains)
    np.testing.assert_array_equal(state.rails(sl.V), rails)
    np.testing.assert_array_equal(state.vehicles(sl.A), trains)
    assert not state.rails(sl.U).any()


def test_a_cleared_train_leaves_the_others_alone() -> None:
    bed, whole = (make_bed(with_trains(paper_model(dt=DT), 6), V350) for _ in range(2))
    for given in (bed, whole):
        given.start(1)
    bed.state.set_rails(sl.U, np.where(np.arange(6)[:, None, None, None] == 2, np.nan, bed.state.rails(sl.U)))
    bed.state.clear(2)
    for given in (bed, whole):
        given.step(0, 2)
    for b in (0, 1, 3, 4, 5):
        np.testing.assert_array_equal(motion_of(bed, b).rails, motion_of(whole, b).rails)
        np.testing.assert_array_equal(motion_of(bed, b).train, motion_of(whole, b).train)


def test_a_fresh_slab_is_at_rest_and_has_its_design() -> None:
    bed = make_bed(with_trains(paper_model(dt=DT), 3), V350)
    bed.start(1)
    bed.state.enter_slab(4, 1)
    assert not bed.state.slabs(sl.U)[:, 0, 4].any()
    assert bed.state.slabs(sl.U)[:, 0, 3].any()
    np.testing.assert_array_equal(bed.state.slab_design[:, 4], 1.0)


def test_extremes_are_those_of_single_steps() -> None:
    """Forces at the end of each of four steps, against what one launch of four keeps."""
    one, four = (make_bed(with_trains(paper_model(dt=DT), 3), V350) for _ in range(2))
    for given in (one, four):
        given.start(1)
    four.step(0, 4)
    seen = []
    for i in range(4):
        one.step(i)
        seen.append(one.state.seats(ON_RAIL, 3))
    np.testing.assert_array_equal(four.state.seats(SMALLEST, 3), np.min(seen, axis=0))
    np.testing.assert_array_equal(four.state.seats(LARGEST, 3), np.max(seen, axis=0))


def test_tables_of_another_speed_fit_in() -> None:
    model = paper_model(dt=DT)
    bed = make_bed(model, V350)
    newmark = model.ingredients.newmark
    slower = spline_rail(model, bed.rail.knots, 20.0)
    new = RailTables.of(slower.vertical, slower.lateral, bed.spans, bed.wheel_s, newmark.beta_dt2, newmark.gamma_dt)
    bed.rails.refill(new)
    np.testing.assert_array_equal(bed.rails.coefficient, new.coefficient)
    count = int(new.wheel_place[:, sl.ROWS_COUNT].max())
    mine, theirs = (t.wheel_rows.reshape(4, -1, sl.N_WHEEL_FUNCTION) for t in (bed.rails, new))
    np.testing.assert_array_equal(mine[:, :count], theirs[:, :count])
