"""The track under steady loads: the sine model's own solution, a bed's closed form, invariants of long windows."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine.sine_state import SineState
from tiengine.engine.static_track import StaticTrack
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.track.knots import graded_knots
from tiengine.track.rail_operators import RailOperators
from tiengine.track.residual_compliance import Foundation, ResidualCompliance
from tiengine.track.sines import Sines
from tiengine.track.splines import Splines
from tiengine.track.steady_track import SeatsInWindow, SteadyTrack

from ..models import V350, paper_model


def seats_of(model, clock, length=0.0):
    """The window's seats as the engine's clock places them."""
    g = model.ingredients
    d, per_slab, first = g.slab.fastening_pitch, g.slab.fastenings, int(clock[at.FIRST_SEAT])
    s = clock[at.FIRST_SEAT_S] + d * np.arange(int(model.dims[at.SEATS]))
    s = s[s < g.length]
    slab, seat = np.divmod(first + np.arange(len(s)), per_slab)
    return SeatsInWindow(s, slab - int(clock[at.FIRST_SLAB]), seat, g.seat_factors(first, len(s)), length)


def force_on(model, seed=4):
    rng = np.random.default_rng(seed)
    return rng.standard_normal((len(model.ingredients.wheel_s), 2, 3)) * np.array([7e4, 1e4, 1e3])


@pytest.fixture(scope="module")
def case():
    model = paper_model(modes=60)
    state = SineState.at_rest(model)
    clock = window_clock(model.ingredients.slab, np.array([33.3]), np.array([V350]), np.zeros(1))[0]
    state.enter(int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB]))
    return model, state, clock


def slabs_of(model, slots):
    return [model.ingredients.designs.matrices[0]] * slots


def test_sines_are_todays(case):
    """With sines and point seats, the engine's sine model: rails, slabs, motion under the wheels."""
    model, state, clock = case
    old = StaticTrack(model, state, float(clock[at.FIRST_SEAT_S]), V350)
    n, slots = model.ingredients.modes, model.ingredients.slots
    new = SteadyTrack(
        RailOperators(model.ingredients.rail, Sines(model.ingredients.length, n)), model.ingredients.fastening,
        seats_of(model, clock), slabs_of(model, slots), V350, model.ingredients.wheel_s,
    )  # fmt: skip
    force = force_on(model)
    old_vertical, old_lateral, slabs = old.motion(force)
    rails = np.hstack([old_vertical, old_lateral])
    vertical, lateral, found = new.motion(force)
    by_field = np.concatenate([x.reshape(2, n, -1).transpose(0, 2, 1).reshape(2, -1) for x in (vertical, lateral)], 1)
    scale = np.abs(rails).max(axis=1, keepdims=True)
    assert np.all(np.abs(by_field - rails) < 1e-9 * scale)  # condition of the stiffness 1e6
    order = (int(clock[at.FIRST_SLAB]) + np.arange(slots)) % slots  # the engine's slots are a ring
    assert np.all(np.abs(found - slabs[order]) < 1e-9 * np.abs(slabs).max())
    a, b = old.under_wheels(force[None]), new.under_wheels(force[None])
    assert np.all(np.abs(a - b) < 1e-9 * np.abs(a).max(axis=(0, 1, 2)) + 1e-300)


def test_splines_and_sines_are_one_track(case):
    """95 graded splines against 720 sines, seats with a length: what each lacks under a wheel makes up the rest."""
    model, _, clock = case
    g, seats = model.ingredients, seats_of(model, clock, 0.15)
    fastening, d, head = g.fastening, g.slab.fastening_pitch, g.rail.arm_head
    foundation = Foundation.of(g.rail, fastening, d)
    force = force_on(model)
    force[..., 2] = head * force[..., 1]  # a wheel's lateral force acts on the railhead
    found, lacking = [], []
    for functions in (Splines(graded_knots(g.length, model.ingredients.wheel_s)), Sines(g.length, 720)):
        operators = RailOperators(g.rail, functions)
        residual = ResidualCompliance(operators, foundation, model.ingredients.wheel_s).wheels
        track = SteadyTrack(
            operators, fastening, seats, slabs_of(model, g.slots), V350, model.ingredients.wheel_s, residual
        )
        for out, motion in ((found, track.under_wheels(force[None])[0, ..., :3]), (lacking, residual[:, None] * force)):
            out.append(np.stack([motion[..., 0], motion[..., 1] + head * motion[..., 2]]))
    alike, alone = (
        np.abs(a - b).max(axis=(1, 2)) / np.abs(found[1]).max(axis=(1, 2))
        for a, b in (found, np.subtract(found, lacking))
    )
    assert np.all(alike < [5e-4, 1.5e-3])  # of what a seat near a wheel lacks; it is left out
    assert np.all(alike < 0.3 * alone)


def test_residual_adds_to_its_own_wheel(case):
    """Missing compliance moves a wheel by its own force only, and leaves the coordinates."""
    model, _, clock = case
    g, seats = model.ingredients, seats_of(model, clock, 0.15)
    f = RailOperators(g.rail, Splines(graded_knots(g.length, model.ingredients.wheel_s)))
    residual = np.array([[3e-11, 5e-11, 6e-8]]) * np.arange(1, 5)[:, None]
    tracks = [
        SteadyTrack(f, g.fastening, seats, slabs_of(model, g.slots), V350, model.ingredients.wheel_s, r)
        for r in (None, residual)
    ]
    force = force_on(model)
    a, b = (track.under_wheels(force[None])[0] for track in tracks)
    np.testing.assert_allclose(b[..., :3] - a[..., :3], residual[:, None] * force, rtol=1e-9)
    np.testing.assert_array_equal(a[..., 3:], b[..., 3:])


def test_reciprocity_at_rest(case):
    """At V = 0 the compliance is symmetric; at speed dampers drag."""
    model, _, clock = case
    g, seats = model.ingredients, seats_of(model, clock, 0.15)
    f = RailOperators(g.rail, Splines(graded_knots(g.length, model.ingredients.wheel_s)))
    track = SteadyTrack(f, g.fastening, seats, slabs_of(model, g.slots), 0.0, model.ingredients.wheel_s)
    W = len(model.ingredients.wheel_s)
    unit = np.eye(6 * W).reshape(6 * W, W, 2, 3)
    C = track.under_wheels(unit)[..., :3].reshape(6 * W, 6 * W)
    np.testing.assert_allclose(C, C.T, atol=1e-11 * np.abs(C).max())
    moving = SteadyTrack(f, g.fastening, seats, slabs_of(model, g.slots), V350, model.ingredients.wheel_s)
    M = moving.under_wheels(unit)[..., :3].reshape(6 * W, 6 * W)
    assert np.abs(M - M.T).max() > 1e-4 * np.abs(M).max()
