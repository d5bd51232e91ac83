"""Envelopes: what is kept of every step against the state itself, step by step."""

from __future__ import annotations

from collections import defaultdict
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.engine.kinds import make_stepper
from tiengine.engine.state import ACCELERATION, DISPLACEMENT, VELOCITY
from tiengine.kernels import layout as at
from tiengine.recording.seat_envelopes import SeatEnvelopes, watched_seats
from tiengine.recording.slab_envelopes import SlabEnvelopes
from tiengine.scenario.scenario import load_scenario
from tiengine.track.slab_moments import moment_table

from ..models import V350, Run, paper_model

DT = 2e-4


@pytest.mark.parametrize("zone", [0.0, 6.0])
def test_envelopes_are_the_extremes_of_every_step(zone):
    """Kept as the window goes 20 m, against the largest and smallest of all forces of each seat outside the zones."""
    run = Run(paper_model(absorbing_zone=zone, dt=DT), V350, steps=1050)
    stepper, state = run.stepper, run.state
    envelopes = SeatEnvelopes.of(stepper)
    seen: dict[int, list[NDArray[np.float64]]] = defaultdict(list)
    first, end = watched_seats(run.model.ingredients)
    length, d = run.model.ingredients.length, run.model.ingredients.slab.fastening_pitch

    def look() -> None:
        s = stepper.chunk.clock[stepper.rows.step, at.FIRST_SEAT_S] + np.arange(state.seat_forces.shape[-1]) * d
        assert zone <= s[first] < zone + 2.0 * d
        assert length - zone - 2.0 * d < s[end - 1] <= length - zone
        for place in range(first, end):
            seen[state.first_seat + place].append(state.seat_forces[0, :, :2, place].copy())

    stepper.watch("envelopes", envelopes.watch)
    stepper.watch("look", look)
    run.advance(1050)
    none = np.zeros(0)
    passed, last = envelopes.blocks(none, none)[0], envelopes.remainder()[0]
    assert len(passed.along) == state.first_seat > 25
    np.testing.assert_array_equal(np.concatenate([passed.along, last.along]), sorted(seen))
    np.testing.assert_allclose(np.concatenate([passed.chainage, last.chainage]), (np.array(sorted(seen)) + 0.5) * d)
    for extreme, reduce in (("largest", np.max), ("smallest", np.min)):
        for row, kind in enumerate(("vertical", "lateral")):
            name = f"{extreme}_{kind}_force"
            expected = [reduce([force[:, row] for force in seen[seat]], axis=0) for seat in sorted(seen)]
            np.testing.assert_array_equal(np.concatenate([passed.channels[name], last.channels[name]]), expected)


def test_after_one_step_the_seats_carry_the_train():
    """Largest and smallest are the force itself; their sum is the weight but for what the window's ends carry, 1e-4.

    Ten decay lengths of 0.8 m from the outer wheels to the ends leave exp(-10) = 5e-5
    (tests/simulation/test_simulate.py).
    """
    run = Run(paper_model(dt=DT), V350, steps=1)
    envelopes = SeatEnvelopes.of(run.stepper)
    run.stepper.watch("envelopes", envelopes.watch)
    run.advance(1)
    channels = envelopes.remainder()[0].channels
    train = run.model.ingredients.train
    weight = train.gravity[1 : train.n_dof : 5].sum()
    np.testing.assert_array_equal(channels["largest_vertical_force"], channels["smallest_vertical_force"])
    assert channels["largest_vertical_force"].sum() == pytest.approx(weight, rel=1e-4)
    spin = np.abs(channels["largest_lateral_force"].sum(axis=0))  # spin creep pushes both rails, outward or inward
    assert channels["largest_lateral_force"].sum() == pytest.approx(0.0, abs=1e-3 * spin.max())
    assert spin.min() > 100.0


@pytest.mark.parametrize("mortar", ["implicit", "explicit"])
def test_slabs_against_their_coordinates(mortar):
    """Deflection at nodes and seats, moments and pressures of every sample of the bodies."""
    run = Run(paper_model(f'numerics.mortar="{mortar}"', dt=DT), V350, steps=500)
    scenario = load_scenario("paper")
    stepper, slab = run.stepper, run.model.ingredients.slab
    envelopes = SlabEnvelopes.of(scenario, stepper)
    slots, sound = run.model.ingredients.slots, run.model.ingredients.designs.matrices[0]
    table, arm = moment_table(slab, run.model.ingredients.mortar), run.model.ingredients.rail.arm_fastening
    seen: dict[int, list[tuple[float, ...]]] = defaultdict(list)
    held: list[int] = []

    def look() -> None:
        held.append(run.state.first_slab)
        for number in range(held[-1], held[-1] + slots):
            u = run.state.slab_motion(DISPLACEMENT)[0, number % slots]
            v, a = (run.state.slab_motion(kind)[0, number % slots] for kind in (VELOCITY, ACCELERATION))
            forces = np.zeros((4, slab.fastenings))
            for k, (down, across, roll) in enumerate(np.moveaxis(run.state.seat_forces[0], 2, 0).transpose(0, 2, 1)):
                on, seat = divmod(run.state.first_seat + k, slab.fastenings)
                if on == number:
                    forces[:2, seat], forces[2:, seat] = down, roll + arm * across
            moments = (np.concatenate([forces.ravel(), a, v]) @ table.matrix).reshape(2, -1)
            under_seats = [
                shape @ u[index]
                for index, shape in zip(sound.seat_index.reshape(-1, 12), sound.seat_w.reshape(-1, 12), strict=True)
            ]
            w = np.append(u[: slab.plate_dofs : 3], under_seats)
            seen[number].append((w.max(), *moments.max(axis=1), w.min(), *moments.min(axis=1)))

    stepper.watch("look", look)
    run.advance(500)
    stepper.finish(500)
    none = np.zeros(0)
    passed, last = envelopes.blocks(none, none)[0], envelopes.remainder()[0]
    assert len(passed.along) == run.state.first_slab > 0
    numbers = np.concatenate([passed.along, last.along])
    found = {name: np.concatenate([passed.channels[name], last.channels[name]]) for name in passed.channels}
    np.testing.assert_array_equal(numbers, sorted(seen))
    for i, name in enumerate(("deflection", "moment_x", "moment_y")):
        expected = [(max(row[i] for row in seen[k]), min(row[3 + i] for row in seen[k])) for k in sorted(seen)]
        scale = np.abs(expected).max()
        for extreme, values in zip(("largest", "smallest"), np.transpose(expected), strict=True):
            # the same sums in another order: rounding; the seats' forces are those of the last pass, not yet converged
            allowed = 1e-12 if name == "deflection" else 2e-3
            np.testing.assert_allclose(found[f"{extreme}_{name}"], values, atol=allowed * scale)
    pressure = run.chunk.mortar[0]
    for i, number in enumerate(numbers):
        rows = [k for k, first in enumerate(held) if first <= number < first + slots]
        slot = pressure[rows, number % slots]
        assert (found["largest_pressure"][i], found["smallest_pressure"][i]) == (slot[:, 0].max(), slot[:, 1].min())
    np.testing.assert_array_equal(found["mortar_factor"], 1.0)


def test_what_is_kept_can_be_saved_and_restored():
    """A run that stops halfway and is continued by another stepper ends with the same envelopes."""
    none = np.zeros(0)

    def watched(run: Run) -> list[Any]:
        watchers = [SeatEnvelopes.of(run.stepper), SlabEnvelopes.of(load_scenario("paper"), run.stepper)]
        run.stepper.watch("envelopes", watchers[0].watch)
        return watchers

    def give_out(run: Run, watchers: list[Any]) -> list[Any]:
        run.stepper.finish(150)
        return [each.blocks(none, none)[0] for each in watchers]

    model = paper_model(dt=DT)
    whole = Run(model, V350, steps=150)
    kept = watched(whole)
    whole.advance(150)
    give_out(whole, kept)
    saved, state = [deepcopy(each.saved()) for each in kept], deepcopy(whole.state)
    whole.advance(150)
    expected = give_out(whole, kept) + [each.remainder()[0] for each in kept]

    half = Run(model, V350, X=whole.X - 150 * V350 * DT, steps=150, start=False)
    half.state = state
    half.stepper = make_stepper(model, state, half.chunk)
    others = watched(half)
    for each, values in zip(others, saved, strict=True):
        each.restore(values)
    half.advance(150)
    found = give_out(half, others) + [each.remainder()[0] for each in others]
    assert sum(len(block.along) for block in found) > 60
    for mine, theirs in zip(expected, found, strict=True):
        np.testing.assert_array_equal(mine.along, theirs.along)
        for name, values in mine.channels.items():
            np.testing.assert_array_equal(values, theirs.channels[name])
