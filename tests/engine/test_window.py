"""The window moving on: slabs stay where they are, seats come and go, counts of slabs."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine.sine_state import SineState
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.model.model import Model

from ..models import V350, Run, paper_model

PITCH, D = 5.67, 0.63


@pytest.fixture(scope="module")
def model() -> Model:
    return paper_model()


def test_positions_count_every_seat_and_slab(model: Model) -> None:
    """At random chainages, joints and seats: first seat in (0, d], first slab under the rear end."""
    rng = np.random.default_rng(1)
    edges = np.concatenate([np.arange(100) * PITCH, (np.arange(300) + 0.5) * D])
    X = np.concatenate([rng.uniform(0.0, 2e4, 2000), edges, edges + 1e-9, np.maximum(edges - 1e-9, 0.0)])
    clock = window_clock(model.ingredients.slab, X, np.full(len(X), 50.0), np.full(len(X), -1.0))
    s0, first_seat, first_slab = (clock[:, column] for column in (at.FIRST_SEAT_S, at.FIRST_SEAT, at.FIRST_SLAB))
    assert np.all((s0 > -1e-9) & (s0 <= D + 1e-9))
    np.testing.assert_allclose((first_seat + 0.5) * D - X, s0, atol=1e-9)
    inside = np.floor((36.0 - s0) / D).astype(int) + 1
    assert inside.max() <= model.dims[at.SEATS]
    for i in rng.integers(0, len(X), 200):
        j = np.arange(int(X[i] / D) - 2, int((X[i] + 36.0) / D) + 3)
        x = (j + 0.5) * D
        assert abs(np.sum((x > X[i]) & (x < X[i] + 36.0)) - inside[i]) <= 1  # a seat on the very end counts or not
    assert np.all(first_slab * PITCH <= X + 1e-6)
    assert np.all(X < (first_slab + 1) * PITCH + 1e-6)
    # seats belong to slabs: 9 j .. 9 j + 8; all of the window's are among the slots
    last = (first_seat + inside - 1) // 9
    assert np.all(last - first_slab < model.ingredients.slots)
    assert np.all(first_seat // 9 - first_slab >= 0)
    np.testing.assert_array_equal(clock[:, at.SPEED_RATE], -1.0)


def test_slabs_keep_their_state() -> None:
    """Window moved slab by slab and by leaps: who stays is untouched, who enters is at rest with its own design."""
    void = "track.mortar_voids=[{slab=9, x=[1.0, 1.65], y=[-1.25, 1.25]}, {slab=4, x=[0.5, 1.0], y=[-1.0, 1.0]}]"
    model = paper_model(void)
    state = SineState.at_rest(model)
    slots = model.ingredients.slots
    rng = np.random.default_rng(2)
    memory: dict[int, np.ndarray] = {}
    state.enter(0, 0)
    rows = [at.U, at.V, at.A]
    before = range(0)
    for first in (0, 1, 2, 3, 3, 5, 6, 11, 12, 40, 41):
        state.enter(first * 9, first)
        now = range(first, first + slots)
        for slab in now:
            q = np.stack([state.view(row, "slabs")[0, slab % slots] for row in rows])
            if slab in before:
                np.testing.assert_array_equal(q, memory[slab])
            else:
                assert not q.any()
            assert state.design[0, slab % slots] == {4: 1, 9: 2}.get(slab, 0)
            for row in rows:
                state.view(row, "slabs")[0, slab % slots] = rng.standard_normal(q.shape[1])
            memory[slab] = np.stack([state.view(row, "slabs")[0, slab % slots] for row in rows])
        before = now


def test_fresh_slab_is_at_rest_and_leaves_no_trace(model: Model) -> None:
    """While a real run passes joints, slabs enter without motion, and the wheels do not notice the change."""
    run = Run(model, V350, X=PITCH - 0.1)
    wheel = run.advance(40)  # the joint is passed at step 11
    assert run.state.first_slab == 1
    force = wheel[..., at.VERTICAL_FORCE]
    jump = np.abs(np.diff(force, n=2, axis=0)).max(axis=(1, 2))
    # the second difference of the seat-passing ripple; a jolt at step 10 would stand out
    assert jump[8:12].max() < 3.0 * jump[20:].max() + 1.0


def test_count_of_slabs_hardly_matters() -> None:
    """The paper's count of slabs against full cover: wheel forces within 0.01 % (MODEL 2), 0.1 s on a rough track."""
    X = V350 * 1e-4 * np.arange(1, 1001)
    forces = []
    for cover in (True, False):
        model = paper_model(cover=cover)
        run = Run(model, V350)
        x = X[:, None] + model.ingredients.wheel_s
        track = np.zeros((1, 1000, 4, at.N_IRREGULARITY))
        k = 2.0 * np.pi / 3.0
        taper = np.minimum(X / 5.0, 1.0)[:, None]
        track[0, ..., at.Z_V], track[0, ..., at.Z_V_SLOPE] = (
            2e-4 * taper * np.sin(k * x),
            2e-4 * taper * k * np.cos(k * x),
        )
        track[0, ..., at.Y_A], track[0, ..., at.Y_A_SLOPE] = (
            2e-4 * taper * np.cos(k * x),
            -2e-4 * taper * k * np.sin(k * x),
        )
        forces.append(run.advance(1000, track)[..., [at.VERTICAL_FORCE, at.LATERAL_FORCE]])
    full, paper = forces
    assert paper_model(cover=False).ingredients.slots == 7
    assert paper_model(cover=True).ingredients.slots == 8
    peak = np.abs(full).max(axis=(0, 1, 2))
    difference = np.abs(full - paper).max(axis=(0, 1, 2))
    assert np.all(difference < 1e-4 * peak), difference / peak
    assert difference.max() > 0.0  # the end slab was missed by someone
