"""The trial before a run: steps that would let an oscillation grow within the run are refused, others are not."""

from __future__ import annotations

import re

import numpy as np
import pytest
import scipy.sparse as sp

from tiengine.engine.stability import Growth, of_trains, step_growth, with_stiffest_seats
from tiengine.engine.time_step import prepare
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.track.knots import Grading
from tiengine.track.splines import Splines

from ..models import V350, default_model

STIFF = "track.failed_fastenings=[{{seats = [{}, {}], factor = {}}}]"
SINES = (
    "numerics.trial_functions='sines'",
    "numerics.window=36",
    "track.fastening={like = 'ACE2021', length = 0.0}",
)
"""Rails and point seats of the source paper, for which the failures below were measured."""


def step_of(*overrides: str, scenario: str = "default", distance: float = 150.0) -> float:
    """Time step that a scenario is run with [s]."""
    changes = (f"train.distance={distance}", *overrides)
    return float(prepare(load_scenario(scenario, changes))[0].ingredients.newmark.dt)


def test_growth_counts_over_the_run():
    """A rate that a short run bears is too much for a long one; rates that are not told from none are borne."""
    growth = Growth(rate=1e-3, resolution=1e-5)
    assert growth.over(1000) == pytest.approx(np.e)
    assert growth.tolerable(1000)
    assert not growth.tolerable(3000)
    assert Growth(rate=1e-5, resolution=1e-5).tolerable(10**7)
    assert Growth(rate=1.0, resolution=0.0).over(10**6) == np.inf


def test_nothing_grows_by_the_default_step():
    """Disturbances of the track alone and of rolling trains decay: seats damp."""
    growth = step_growth(default_model(), V350, 7700)
    assert growth.rate < 0.0


def test_stiffened_seats_grow_with_the_stand_in_of_sound_ones(monkeypatch):
    """As it was: a stand-in for sound seats only."""
    monkeypatch.setattr("tiengine.track.seat_passes.FACTORS", (1.0,))
    monkeypatch.setattr("tiengine.track.seat_passes.CONTRACTION", np.inf)
    model = default_model()
    stiff = default_model(**vars_of(with_stiffest_seats(model.ingredients, 3.0)))
    assert step_growth(stiff, V350, 1200).rate > 1e-3


def test_growth_that_begins_hidden_is_found(monkeypatch):
    """Rail that enters in the motion of the window's end feeds a mode there by 1e-3 a step, where nothing else moves.

    A run with these settings ran away after 28 000 steps. In the energy of a track whose coefficients all begin with
    the same velocity the mode came forth after 5000; and rail that enters at rest lets nothing grow.
    """
    grading = Grading(finest=0.05, coarsest=1.0 / 3.0)
    settings = {"grading": grading, "dt": 5e-5, "length": 44.0, "passes": 3}
    sound = step_growth(default_model(**settings), V350, 30000)
    assert sound.tolerable(30000)
    monkeypatch.setattr(Splines, "_entry", lambda self: sp.csr_array((self.count, self.count)))
    growth = step_growth(default_model(**settings), V350, 30000)
    assert not growth.tolerable(30000)
    assert growth.rate > 1e-4


def vars_of(ingredients) -> dict[str, object]:
    return {"seat_factors": ingredients.seat_factors, "designs": ingredients.designs}


def test_a_model_of_other_trains_differs_in_its_sizes_only():
    one = default_model()
    three, built = of_trains(one, 3), default_model(trains=3)
    np.testing.assert_array_equal(three.dims, built.dims)
    np.testing.assert_array_equal(three.constants, built.constants)
    assert three.ingredients.trains == 3


@pytest.mark.parametrize(
    ("seats", "step"), [((100, 100, 3.0), 1e-4), ((100, 100, 10.0), 2.5e-5), ((0, 250, 2.0), 2e-4)]
)
def test_stiffened_seats_shorten_the_automatic_step(seats, step):
    """Longest steps that are stable and whose wheel forces are within 0.3 % of those at 6.25e-6 s."""
    assert step_of(STIFF.format(*seats)) == step


def test_seats_too_stiff_for_any_step_are_refused():
    """Entries that overlap multiply: 1000 times the sound stiffness."""
    row = "{seats = [40, 41], factor = 10.0}"
    with pytest.raises(InputError, match=r"time_step = auto: unstable; .* choose smaller factors"):
        step_of(f"track.failed_fastenings=[{row}, {row}, {row}]")


@pytest.mark.parametrize(("factor", "dt"), [(3.0, 1e-4), (10.0, 2.5e-5), (10.0, 1e-4)])
def test_stiffened_seats_do_not_grow(factor, dt):
    """The stand-in of the seats is that of the stiffest; sound seats beside them are as stable."""
    model = default_model(dt=dt)
    ingredients = with_stiffest_seats(model.ingredients, factor)
    stiff = default_model(dt=dt, **vars_of(ingredients))
    assert step_growth(stiff, V350, 1200).rate < 0.0
    sound_too = default_model(dt=dt, designs=ingredients.designs)
    assert sound_too.seats.factor == stiff.seats.factor > 1.0
    assert step_growth(sound_too, V350, 1200).rate < 0.0


def test_softened_seats_do_not():
    assert step_of(STIFF.format(60, 62, 0.0), distance=60.0) == 2e-4


@pytest.mark.parametrize("overrides", [(STIFF.format(100, 100, 10.0),), ("numerics.passes=1",)], ids=["seat", "pass"])
def test_advice_has_been_tried(overrides):
    """Whatever change a refusal names is then accepted, and no longer step of the automatic ones."""
    wanted = ("numerics.time_step=2e-4", *overrides)
    with pytest.raises(InputError, match=r"unstable; .* is stable$") as refused:
        step_of(*wanted)
    changes = re.findall(r"numerics\.(\w+) = ([\d.e-]+)(?= or| is)", str(refused.value))
    assert changes
    for key, value in changes:
        assert step_of(*wanted, f"numerics.{key}={value}") <= 2e-4


def test_one_pass_needs_a_shorter_step():
    assert step_of("numerics.passes=1") == 1e-4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("modes", "kmh", "distance"),
    [(8.0, 350.0, 150.0), (12.0, 350.0, 250.0), (13.0, 350.0, 200.0), (10.0, 400.0, 150.0)],
)
def test_slow_growth_with_many_sines_is_found(modes, kmh, distance, monkeypatch):
    """Oscillations of the lateral force that grew from 2 N to 4 to 28 kN in a run that ended with "complete".

    No advice is sought: a trial with so many sines takes a minute.
    """
    monkeypatch.setattr("tiengine.engine.time_step._advice", lambda *_: "")
    overrides = (*SINES, f"numerics.modes_per_metre={modes}", f"train.speed_kmh={kmh}")
    with pytest.raises(InputError, match=r"unstable; an oscillation"):
        step_of(*overrides, "numerics.time_step=2e-4", distance=distance)


@pytest.mark.slow
@pytest.mark.parametrize("kmh", [50.0, 120.0, 200.0, 275.0, 350.0, 425.0, 500.0])
def test_the_papers_density_of_sines_keeps_its_step(kmh):
    assert step_of(*SINES, "numerics.modes_per_metre=6.5", f"train.speed_kmh={kmh}") == 2e-4


@pytest.mark.slow
@pytest.mark.parametrize("modes", [8.0, 11.0, 14.0])
def test_many_sines_are_stable_at_half_the_step(modes):
    assert step_of(*SINES, f"numerics.modes_per_metre={modes}", "numerics.time_step=1e-4", distance=60.0) == 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["default", "smooth", "paper", "train3", "braking", "defects"])
def test_presets_keep_their_step(scenario):
    assert prepare(load_scenario(scenario))[0].ingredients.newmark.dt == 2e-4
