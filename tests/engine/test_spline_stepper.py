"""The spline step behind the frame: balance, sines, speeds, extremes, trains beside each other."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.model_tables import ModelTables, coupled_coordinates
from tiengine.engine.spline_state import SplineState
from tiengine.engine.spline_stepper import REFACTOR, SplineStepper
from tiengine.engine.state import ACCELERATION, DISPLACEMENT, PARTS, VELOCITY
from tiengine.engine.stepper import Plan
from tiengine.kernels import layout as at
from tiengine.model.spline_model import SplineModel
from tiengine.recording.seat_envelopes import SeatEnvelopes, watched_seats

from ..models import V350, Run, default_model, paper_model

DEFECTS = (
    'track.failed_fastenings=[{rail="left", seats=[20, 22]}, {rail="both", seats=[30, 30], factor=0.3}]',
    "track.mortar_voids=[{slab=3, x=[1.0, 1.65], y=[-1.25, 1.25]}]",
)


def stepper_of(model: SplineModel, steps: int, X: float = 0.0, V: float = V350) -> SplineStepper:
    """A step from steady rolling."""
    state = SplineState.at_rest(model)
    equilibrium(model, state, X, V)
    return SplineStepper(model, state, Chunk.empty(model.ingredients, steps, steps))


def load(
    stepper: SplineStepper, X: NDArray[np.float64], V: float | NDArray[np.float64] = V350, rough: float = 0.0
) -> None:
    """Load a chunk; every train has rough rails of its own."""
    irregularity = np.zeros_like(stepper.chunk.irregularity)
    for b in range(len(irregularity)):
        irregularity[b] = rough * np.random.default_rng((7, b)).standard_normal(irregularity[b].shape)
    stepper.load(X, np.broadcast_to(V, X.shape).copy(), np.zeros(len(X)), irregularity[:, : len(X)])


@pytest.mark.parametrize(("X", "overrides"), [(0.0, ()), (101.35, ()), (0.0, DEFECTS), (7.77, DEFECTS)])
def test_steady_rolling_is_in_balance(X: float, overrides: tuple[str, ...]) -> None:
    """With the seats held where they are, what the host's matrices find in balance stays so in the kernel."""
    stepper = stepper_of(default_model(*overrides), 20, X)
    state = stepper.state
    force = state.normal_force.copy()
    before = [state.part(0, name)[DISPLACEMENT].copy() for name in PARTS]
    load(stepper, np.full(20, X))
    for i in range(20):
        stepper.step(i)
    # the start is found to 1e-4 N, and forces of 1e7 N cancel in the rails
    assert np.abs(state.normal_force - force).max() < 0.01
    spin = stepper.ingredients.train.wheelset_dof[:, 3]  # wheels roll on
    for name, start in zip(PARTS, before, strict=True):
        u, _, a = state.part(0, name)
        moved = np.abs(u - start)
        if name == "vehicles":
            moved[spin] = 0.0
        else:
            assert np.abs(a).max() < 0.05  # m/s^2; a force of 0.01 N on the 0.2 kg of a function
        assert moved.max() < 1e-6 * max(np.abs(start).max(), 1e-3)
    assert force.min() > 5e4


def test_forces_are_those_of_many_sines() -> None:
    """12 sines a metre, which need four passes, against the graded splines: 0.3 % of the peak (MODEL section 1a)."""
    found, steps = [], 500
    size = 2e-5 * np.random.default_rng(3).standard_normal(40)
    k = 2.0 * np.pi * np.arange(1, 41) / 20.0  # waves of 0.5 m and more
    for model in (default_model(length=24.0), sines_model()):
        run = Run(model, V350, steps=steps)
        way = V350 * 2e-4 * np.arange(1, steps + 1)
        ramp = np.sin(0.5 * np.pi * np.minimum(way / 4.0, 1.0)) ** 2  # over 4 m: a jump would strike all waves
        phase = np.multiply.outer(way[:, None] + model.ingredients.wheel_s, k)
        felt = np.zeros((1, steps, 4, at.N_IRREGULARITY))
        felt[0, ..., at.Z_V] = ramp[:, None] * (np.sin(phase) @ size)
        felt[0, ..., at.Z_V_SLOPE] = ramp[:, None] * (np.cos(phase) @ (k * size))
        found.append(run.advance(steps, felt)[..., at.NORMAL_FORCE])
    splines, sines = found
    difference = np.abs(splines - sines)
    assert np.percentile(difference, 99) < 0.003 * sines.max()
    assert sines.max() > 1.2 * sines.mean()  # it was not smooth


def sines_model() -> Any:
    """The same train and track in sines."""
    given = default_model(length=24.0).ingredients
    return paper_model(dt=2e-4, length=24.0, modes=288, fastening=given.fastening, local_compliance=True, passes=4)


def test_a_train_has_the_same_bits_in_any_company() -> None:
    """Alone, or one of three or six: lanes are filled up with trains that stay at rest."""
    motions = {}
    for trains in (1, 3, 6):
        stepper = stepper_of(default_model(trains=trains), 40)
        load(stepper, V350 * 2e-4 * np.arange(1, 41), rough=1e-5)
        for i in range(40):
            stepper.step(i, i, i)
        state = stepper.state
        motions[trains] = [state.part(0, name) for name in PARTS] + [stepper.chunk.wheel[0], stepper.chunk.body[0]]
    for trains in (3, 6):
        for mine, alone in zip(motions[trains], motions[1], strict=True):
            np.testing.assert_array_equal(mine, alone)
    assert np.ptp(motions[1][4][:, 0, 0, at.NORMAL_FORCE]) > 100.0


def test_arrays_carry_a_run_on_with_the_same_bits() -> None:
    """Copied into a state at rest between two chunks, over a seat and a slab that enter."""
    model = default_model(*DEFECTS)
    X = 5.6 + V350 * 2e-4 * np.arange(1, 61)
    whole = stepper_of(model, 60, 5.6)
    load(whole, X, rough=1e-5)
    for i in range(30):
        whole.step(i, i, i)
    half = SplineStepper(model, SplineState.at_rest(model), Chunk.empty(model.ingredients, 60, 60))
    for name, target in half.state.arrays().items():
        target[...] = whole.state.arrays()[name]
    half.state.first_seat, half.state.first_slab = whole.state.first_seat, whole.state.first_slab
    half.factor(whole.factored_speed)
    load(half, X, rough=1e-5)
    half.moves[30] = True  # the first step of a chunk always moves
    for i in range(30, 60):
        whole.step(i, i, i)
        half.step(i, i, i)
    np.testing.assert_array_equal(half.chunk.wheel[:, 30:], whole.chunk.wheel[:, 30:])
    np.testing.assert_array_equal(half.chunk.body[:, 30:], whole.chunk.body[:, 30:])
    half.finish(60)
    whole.finish(60)
    np.testing.assert_array_equal(half.chunk.mortar[:, 30:], whole.chunk.mortar[:, 30:])


def test_tables_follow_the_speed() -> None:
    """Made again where the speed has changed by a thousandth, and then those of that speed."""
    model = default_model()
    stepper = stepper_of(model, 3)
    speeds = V350 * np.array([1.0, 1.0 - 0.5 * REFACTOR, 1.0 - 2.0 * REFACTOR])
    load(stepper, np.cumsum(2e-4 * speeds), speeds)
    made = []
    for i in range(3):
        stepper.step(i)
        made.append(stepper.factored_speed)
    assert made == [speeds[0], speeds[0], speeds[2]]
    fresh = ModelTables.of(default_model(V=speeds[2]))
    np.testing.assert_array_equal(stepper.state.tables.rails.coefficient, fresh.rails.coefficient)
    np.testing.assert_array_equal(stepper.state.tables.cars.columns, fresh.cars.columns)
    assert not np.array_equal(fresh.rails.coefficient, ModelTables.of(model).rails.coefficient)


def test_extremes_are_those_of_every_step() -> None:
    """Extremes kept by the launch between two moves of the window equal those of the forces after each step."""
    stepper = stepper_of(default_model(trains=2), 150, 30.0)
    envelopes = SeatEnvelopes.of(stepper)
    stepper.watch("envelopes", envelopes.watch)
    load(stepper, 30.0 + V350 * 2e-4 * np.arange(1, 151), rough=1e-5)
    seen: dict[int, list[NDArray[np.float64]]] = {}
    first, end = watched_seats(stepper.ingredients)

    def look() -> None:
        forces = stepper.state.seat_forces
        for place in range(first, end):
            seen.setdefault(stepper.state.first_seat + place, []).append(forces[..., place])

    stepper.watch("look", look)
    for i in range(150):
        stepper.step(i)
    moved = envelopes.blocks(np.zeros(0), np.zeros(0))
    kept = envelopes.remainder()
    for b in range(2):
        seats = np.concatenate([moved[b].along, kept[b].along])
        assert sorted(seats) == sorted(seen)
        for name, reduce, row in (
            ("largest_vertical_force", np.max, 0),
            ("smallest_lateral_force", np.min, 1),
        ):
            values = np.concatenate([moved[b].channels[name], kept[b].channels[name]])
            for seat, value in zip(seats, values, strict=True):
                np.testing.assert_array_equal(value, reduce(seen[int(seat)], axis=0)[b, :, row])


def test_steps_may_be_put_off() -> None:
    """Several steps in a launch between two that something reads: same bits, and the reader sees its own step."""
    found = []
    for every in (1, 5):
        stepper = stepper_of(default_model(), 100, 5.6)
        force: list[NDArray[np.float64]] = []

        def look(stepper: SplineStepper = stepper, force: list[NDArray[np.float64]] = force) -> None:
            if (stepper.rows.step + 1) % 5 == 0:
                force.append(stepper.state.normal_force.copy())

        stepper.watch("look", look, due=lambda plan, every=every: (plan.step + 1) % every == 0)
        load(stepper, 5.6 + V350 * 2e-4 * np.arange(1, 101), rough=1e-5)
        steps = np.arange(100)
        stepper.take(Plan(steps, steps, np.where(steps % 10 == 9, steps // 10, -1)))
        found.append((np.array(force), stepper.chunk.wheel[:, :100], stepper.chunk.body[:, :10]))
    for one, many in zip(*found, strict=True):
        np.testing.assert_array_equal(one, many)
    assert np.ptp(found[0][0][:, 0, 0, 0]) > 100.0


@pytest.mark.parametrize("no_tension", [False, True])
def test_the_bed_may_be_explicit(no_tension: bool) -> None:
    """Forces and pressures of an explicit bed are those of an implicit one, but for the remainder of the passes."""
    found = []
    for explicit in (False, True):
        base = default_model()
        mortar = base.ingredients.mortar.model_copy(update={"no_tension": no_tension})
        model = default_model(mortar=mortar, explicit_mortar=explicit, passes=4, dt=1e-4)
        stepper = stepper_of(model, 40)
        load(stepper, V350 * 1e-4 * np.arange(1, 41))
        for i in range(40):
            stepper.step(i, i, i)
        stepper.finish(40)
        found.append((stepper.chunk.wheel.copy(), stepper.chunk.mortar.copy()))
    (wheel, pressure), (other, other_pressure) = found
    load_scale = wheel[..., at.NORMAL_FORCE].max()
    assert np.abs(wheel - other)[..., at.NORMAL_FORCE].max() < 1e-4 * load_scale
    assert np.abs(pressure - other_pressure).max() < 1e-2 * pressure.max()
    assert np.ptp(pressure[0, :, :, 0]) > 1e3


def test_a_cleared_train_leaves_the_others_alone() -> None:
    """Numbers that ran away are zero then, and the other trains keep their bits."""
    steppers = []
    for _ in range(2):
        stepper = stepper_of(default_model(trains=3), 20)
        load(stepper, V350 * 2e-4 * np.arange(1, 21), rough=1e-5)
        for i in range(10):
            stepper.step(i)
        steppers.append(stepper)
    cleared, whole = steppers
    cleared.state.put(VELOCITY, "vertical", np.where(np.arange(3)[:, None, None] == 1, np.nan, 0.0))
    assert not np.isfinite(cleared.state.squares()[1])
    for name in ("vertical",):  # the others back to what they were
        values = np.stack([whole.state.part(b, name)[VELOCITY] for b in range(3)])
        values[1] = np.nan
        cleared.state.put(VELOCITY, name, values)
    cleared.state.clear(1)
    assert np.all(np.isfinite(cleared.state.squares()))
    assert not any(cleared.state.part(1, name).any() for name in PARTS)
    for i in range(10, 20):
        cleared.step(i)
        whole.step(i)
    for b in (0, 2):
        for name in PARTS:
            np.testing.assert_array_equal(cleared.state.part(b, name), whole.state.part(b, name))


def test_rail_motion_and_deflection_agree() -> None:
    """Values along a rail and their derivatives, by differences."""
    stepper = stepper_of(default_model(trains=2), 1)
    state = stepper.state
    rng = np.random.default_rng(5)
    for kind in (DISPLACEMENT, VELOCITY, ACCELERATION):
        for name in ("vertical", "lateral"):
            shape = (2, *state.part(0, name).shape[1:])
            state.put(kind, name, 1e-3 * rng.standard_normal(shape))
    s = np.array([0.0, 7.3, 9.4, 18.0, 36.0])
    bent = state.rail_deflection(s)()
    for side in range(2):
        for i, place in enumerate(s):
            np.testing.assert_allclose(
                state.rail_motion(side, place)[1, 0, 0], bent[:, side, i], rtol=1e-12, atol=1e-18
            )
    h, here = 1e-5, 9.4
    low, mid, high = (state.rail_motion(1, here + d) for d in (-h, 0.0, h))
    np.testing.assert_allclose(mid[:, :, 1], (high - low)[:, :, 0] / (2.0 * h), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(mid[:, :, 2], (high - low)[:, :, 1] / (2.0 * h), rtol=1e-5, atol=1e-6)


def test_coordinates_go_with_their_vehicle() -> None:
    """Three vehicles, three groups; a wheelset's spin, which nothing holds, stays with its body."""
    train = default_model('train.vehicles=["CRH380A_v2", "CRH380A_v2", "CRH380A_v2"]').ingredients.train
    groups = coupled_coordinates(train)
    assert [len(group) for group in groups] == [35, 35, 35]
    np.testing.assert_array_equal(np.concatenate(groups), np.arange(105))
