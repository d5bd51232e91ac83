"""Wheels and rails that differ: tables of single wheels, radii, steady rolling off the middle, mirror images."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import state_at_rest
from tiengine.engine.state import DISPLACEMENT, VELOCITY, State
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.model.constant_data import Model
from validation.cases.unequal_wheels import free_wagon, rolling

from ..models import V350, Run, default_model, paper_model
from ..wheelsets import PITCH, ROLL, Wheelsets, Y, Z, scattered

MAKERS = pytest.mark.parametrize("make", [default_model, paper_model])
FOUND = 1e-3  # N: the start is found to 1e-4 N in each of its equations
LARGER = 0.5e-3  # m


def stated(*entries: str, **rails: str) -> tuple[str, ...]:
    """Overrides: entries of ``train.wheel_profiles``, and profiles of the left or the right rail."""
    keys = tuple(f'track.rail_profile_{side}="{profile}"' for side, profile in rails.items())
    return (f"train.wheel_profiles=[{', '.join(entries)}]", *keys)


def motion(model: Model, V: float, X: float = 100.0) -> tuple[State, Model]:
    state = state_at_rest(model)
    equilibrium(model, state, X, V)
    return state, model


def test_profiles_alike_share_the_trains_table():
    same = default_model(*stated('{profile="LMA", side="left"}', "{radius=0.43, wheelsets=[2]}", right="CHN60"))
    assert same.ingredients.contacts is None
    assert same.ingredients.contact.values.tobytes() == default_model().ingredients.contact.values.tobytes()
    assert same.wheel.tobytes() == default_model().wheel.tobytes()


@MAKERS
def test_a_profile_of_one_wheelset_changes_its_table_only(make: Any):
    """Bits of the longer kernel differ by rounding."""
    alike, mixed = make(), make(*stated('{profile="S1002", wheelsets=[1], side="right"}'))
    worn = make("train.wheel_profile=S1002")
    contacts = mixed.ingredients.contacts
    assert contacts is not None
    assert contacts.number.tolist() == [[0, 1], [0, 0], [0, 0], [0, 0]]
    x = scattered(4, 200)
    found = x.evaluate(mixed)
    for side, other in ((0, alike), (1, worn)):
        expected = x.evaluate(other)
        for got, wanted in ((found.contact, expected.contact), (found.local, expected.local)):
            scale = np.abs(wanted[:, 0, side]).max(axis=0)
            assert (np.abs(got - wanted)[:, 0, side] <= 1e-11 * scale).all()
    assert np.abs(found.contact[:, 0, 1] - x.evaluate(alike).contact[:, 0, 1]).max() > 1e-3


def test_each_rail_has_its_own_profile():
    mixed, other = default_model(*stated(right="60E1")), default_model("track.rail_profile=60E1")
    assert mixed.ingredients.contacts is not None
    assert mixed.ingredients.contacts.number.tolist() == [[0, 1]] * 4
    assert mixed.wheel[0, at.CROWN_LEFT] != mixed.wheel[0, at.CROWN_RIGHT]
    x = scattered(5, 100)
    for side, model in ((0, default_model()), (1, other)):
        got, wanted = (x.evaluate(m).local[:, 0, side] for m in (mixed, model))
        assert (np.abs(got - wanted) <= 1e-11 * np.abs(wanted).max(axis=0)).all()


@pytest.mark.parametrize("patches", [1, 2])
def test_a_larger_wheel_reaches_deeper_and_runs_ahead(patches: int):
    """Without roll: penetration grows by the difference, the creepage by -(1 - rate r0/V) of it over r0."""
    keys = (f"contact.patches={patches}",)
    plain = default_model(*keys)
    entries = (f'{{radius_difference={LARGER}, side="left"}}', f'{{radius_difference=-{LARGER}, side="right"}}')
    model = default_model(*keys, *stated(*entries))
    x = Wheelsets(50)
    rng = np.random.default_rng(6)
    x.u[:, 0, Y], x.v[:, 0, PITCH] = rng.uniform(-5e-3, 5e-3, 50), rng.uniform(-1.0, 1.0, 50)
    x.u[:, 0, Z] = 10.0 * LARGER
    before, after = x.evaluate(plain).contact[:, 0, :2], x.evaluate(model).contact[:, 0, :2]
    d = LARGER * np.array([1.0, -1.0])
    cosine = after[..., wr.COS]
    r0 = plain.wheel[0, at.NOMINAL_RADIUS]
    np.testing.assert_allclose(after[..., wr.DELTA] - before[..., wr.DELTA], d * cosine, rtol=1e-9)
    np.testing.assert_allclose(after[..., wr.R_C] - before[..., wr.R_C], np.broadcast_to(d, (50, 2)), rtol=1e-9)
    slip = d * (x.v[:, 0, PITCH, None] / V350 - 1.0 / r0)
    np.testing.assert_allclose(after[..., wr.XI_X] - before[..., wr.XI_X], slip, atol=1e-15)
    x.u[:, 0, ROLL] = 1e-3  # the lever of the roll is the wheel's own radius
    shift = [x.evaluate(m).contact[:, 0, :2, wr.SHIFT] for m in (plain, model)]
    np.testing.assert_allclose(shift[1] - shift[0], -1e-3 * d * [[-1.0, 1.0]] * np.ones((50, 1)), atol=1e-17)


@pytest.mark.parametrize("trial_functions", ["splines", "sines"])
@pytest.mark.parametrize(("slope", "difference"), [(0.025, 1e-4), (0.05, 2e-4), (0.05, 1e-3), (0.05, -1e-3)])
def test_free_wheelset_rolls_where_its_radii_are_equal(slope: float, difference: float, trial_functions: str):
    """(r_L - r_R)/(2 lambda) from the middle of the rails: 10 mm for diameters of 920 and 918 mm on cones of 1:20.

    Off the middle, one rail carries y/b0 more and sinks w = 1 mm times that deeper: the axle rolls and the wheelset
    moves by r0 w/b0^2 = 8e-4 of y. Terms of second order in the cone's slope remain.
    """
    model, state = rolling(free_wagon(slope, difference, trial_functions))
    u = state.part(0, "vehicles")[DISPLACEMENT][model.ingredients.train.wheelset_dof]
    y = difference / (2.0 * slope)
    shift = state.relative_shift[0]
    assert 0.5 * (shift[:, 1] - shift[:, 0]) == pytest.approx(y, rel=slope**2)
    assert u[:, Y] == pytest.approx(y, rel=slope**2 + 1e-3)
    load = state.forces_on_rails[0][..., 0]
    assert load.sum() == pytest.approx(model.ingredients.train.gravity.sum(), rel=1e-9)  # nominal axle loads stay
    assert load.sum(axis=1) == pytest.approx(load.sum() / 2.0, rel=1e-6)


@MAKERS
def test_start_with_unequal_wheels_reaches_the_flange(make: Any):
    """Radii of 1 mm apart on all wheelsets: the wheels' conicity alone does not make up for it."""
    sides = ('{side="left", radius=0.43}', '{side="right", radius=0.429}')
    state, model = motion(make(*stated(*sides), V=60.0), 60.0)
    train = model.ingredients.train
    u = state.part(0, "vehicles")
    force = state.forces_on_rails[0][..., :2].sum(axis=1)
    axle = float(train.gravity.sum()) / 4.0
    assert force[:, 0].sum() == pytest.approx(4.0 * axle, abs=FOUND)
    assert force[:, 0] == pytest.approx(axle, rel=0.02)  # the bogies' pitch
    assert force[:, 1].sum() == pytest.approx(0.0, abs=FOUND)
    assert (u[DISPLACEMENT][train.wheelset_dof[:, 0]] > 4e-3).all()  # the larger wheel pushes over
    assert np.isfinite(u[VELOCITY]).all()


@pytest.mark.parametrize(
    ("make", "patches"),
    [
        (default_model, 1),
        *(pytest.param(make, p, marks=pytest.mark.slow) for make, p in ((paper_model, 1), (default_model, 2))),
        pytest.param(paper_model, 2, marks=pytest.mark.slow),
    ],
)
def test_exchanged_sides_give_mirrored_forces(make: Any, patches: int):
    """Start and steps, with profiles, rails and radii that all differ between left and right."""
    wheels = '{{profile="S1002", wheelsets=[1, 3], side="{0}"}}', '{{radius_difference=-3e-4, side="{0}"}}'
    found = []
    for side in ("left", "right"):
        entries = (wheels[0].format(side), wheels[1].format(side))
        run = Run(make(f"contact.patches={patches}", *stated(*entries, **{side: "60E1"})), V350)
        steps = 40
        rough = np.zeros((1, steps, 4, at.N_IRREGULARITY))
        s = V350 * run.model.ingredients.newmark.dt * np.arange(1, steps + 1)
        sign = 1.0 if side == "left" else -1.0
        rough[0, :, :, at.Z_V] = 5e-4 * np.sin(s)[:, None] ** 2
        rough[0, :, :, at.Y_A] = sign * 1e-3 * np.sin(s)[:, None] ** 2
        rough[0, :, :, at.CROSS_LEVEL] = sign * 1e-4 * np.sin(s)[:, None] ** 2
        wheel = run.advance(steps, rough)
        found.append(wheel[..., [at.VERTICAL_FORCE, at.LATERAL_FORCE]])
    left, right = found
    assert right[..., ::-1, 0] == pytest.approx(left[..., 0], abs=FOUND)
    assert right[..., ::-1, 1] == pytest.approx(-left[..., 1], abs=FOUND)
    assert np.abs(left[..., 1].sum(axis=-1)).max() > 10.0
