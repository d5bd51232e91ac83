"""Forces of two patches a wheel: potential, action and reaction, work, and the end of the step."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tiengine.kernels import contact as ct
from tiengine.kernels import layout as at
from tiengine.kernels import wheel_rail as wr
from tiengine.model.spline_model import SplineModel

from ..engine.spline_bed import Floats
from ..models import Run, default_model, paper_model
from ..wheelsets import ROLL, TX, V_, W_, Wheelsets, Y, Z, with_friction

S1002 = (
    'train.vehicles=["Manchester"]', "train.wheel_profile=S1002", "track.rail_profile=60E1",
    "track.gauge_depth=0.014",
)  # fmt: skip
V = 40.0
FIRST, SECOND = 2, 4
"""Rows of the patches in the arrays of a wheelset."""


@cache
def model(patches: int = 2) -> SplineModel:
    return default_model(f"contact.patches={patches}", *S1002, V=V)


def at_the_root(count: int, seed: int = 0) -> Wheelsets:
    """Right wheels between tread and flange root, both patches loaded on most, by 60 to 100 kN."""
    rng = np.random.default_rng(seed)
    x = Wheelsets(count)
    x.u[:, 0, Y] = rng.uniform(5.0e-3, 5.3e-3, count)
    x.u[:, 0, ROLL] = rng.uniform(-1.0, 1.0, count) * 2e-4
    x.u[:, 0, 4] = rng.uniform(-3e-3, 3e-3, count)
    x.v[:, 0] = rng.uniform(-1, 1, (count, 5)) * [0.1, 0.1, 0.05, 0.5, 0.1]
    x.rail[:, 0, :, :3] = rng.uniform(-1, 1, (count, 2, 3)) * [1e-3, 5e-5, 2e-4]
    contact = x.evaluate(model(), V).contact[:, 0]
    lowest = contact[:, [1, FIRST + 1, SECOND + 1], wr.DELTA].max(axis=1)
    x.u[:, 0, Z] += rng.uniform(0.9e-4, 1.2e-4, count) - lowest
    return x


def both_loaded(local: Floats) -> NDArray[np.bool_]:
    """Whether both patches of the right wheel carry more than 2 kN, shape (B,)."""
    return np.asarray((local[:, 0, [FIRST + 1, SECOND + 1], 0] > 2e3).all(axis=1))


def test_wheels_are_the_sums_of_their_patches() -> None:
    """Forces add up; the state of a wheel is that of its heavier patch."""
    found = at_the_root(50).evaluate(model(), V)
    local, contact = found.local[:, 0], found.contact[:, 0]
    assert both_loaded(found.local).mean() > 0.5
    np.testing.assert_allclose(local[:, :2], local[:, FIRST:SECOND] + local[:, SECOND:], rtol=1e-14)
    second = local[:, SECOND:, 0] > local[:, FIRST:SECOND, 0]
    assert second.any()
    assert not second.all()
    expected = np.where(second[..., None], contact[:, SECOND:], contact[:, FIRST:SECOND])
    np.testing.assert_array_equal(contact[:, :2], expected)


def work(x: Wheelsets, pull: Floats) -> Floats:
    """Sum over the right wheel's patches of N cos gamma times their vertical penetrations, shape (B,)."""
    contact = x.evaluate(model(), V).contact[:, 0][:, [FIRST + 1, SECOND + 1]]
    gamma = np.arctan2(contact[..., wr.SIN], contact[..., wr.COS]) + x.rail[:, 0, 1, TX, None]
    return np.asarray((pull * contact[..., wr.DELTA] / np.cos(gamma)).sum(axis=1))


def test_normal_forces_do_the_work_of_both_patches() -> None:
    """Without friction the generalised forces are -N cos gamma dp/dq summed over patches, p the penetrations.

    To 0.5 % of the wheel's force and a lever of 5 mm: first order in the angles leaves 0.3 % and 3 mm with one patch
    (``validation/cases/contact_kinematics.py``), the smoothing of two gaps another thousandth.
    """
    x = at_the_root(30, seed=1)
    x.u[:, 0, 4] = 0.0
    found = x.evaluate(with_friction(model(), 1e-12), V)
    two = both_loaded(found.local)
    assert two.sum() > 10
    contact = found.contact[:, 0][:, [FIRST + 1, SECOND + 1]]
    gamma = np.arctan2(contact[..., wr.SIN], contact[..., wr.COS]) + x.rail[:, 0, 1, TX, None]
    pull = found.local[:, 0, [FIRST + 1, SECOND + 1], 0] * np.cos(gamma)
    left = found.local[:, 0, 0, 0]
    right_only = two & (left == 0.0)
    h, N = 1e-7, pull.sum(axis=1)
    for array, place, force in (
        *((x.u, (slice(None), 0, q), found.wheelset[:, 0, q]) for q in (Y, Z, ROLL)),
        *((x.rail, (slice(None), 0, 1, q), found.rail[:, 0, 1, q]) for q in (W_, V_, TX)),
    ):
        array[place] += h
        up = work(x, pull)
        array[place] -= 2.0 * h
        down = work(x, pull)
        array[place] += h
        error = np.abs(force + (up - down) / (2.0 * h)) / N
        alone = two if array is x.rail else right_only  # the left wheel pushes on the wheelset too
        assert error[alone].max(initial=0.0) < 5e-3


def test_action_is_reaction() -> None:
    """What the wheels push on the rails is what they are pushed by, along and across; creep forces included."""
    found = at_the_root(50).evaluate(model(), V)
    np.testing.assert_allclose(found.wheelset[:, 0, Z], -found.rail[:, 0, :, W_].sum(axis=1), rtol=1e-12)
    across = found.rail[:, 0, :, V_].sum(axis=1)
    np.testing.assert_allclose(found.wheelset[:, 0, Y], -across, rtol=1e-9, atol=1e-6)
    # moment about the track's centre at the crown's height of unworn wheels: arms of contact points
    contact, local = found.contact[:, 0], found.local[:, 0]
    sigma = np.array([-1.0, 1.0, -1.0, 1.0])
    c, s = contact[:, FIRST:, wr.COS], contact[:, FIRST:, wr.SIN]
    N, Fy = local[:, FIRST:, 0], local[:, FIRST:, 2]
    y, z = -sigma * s * N + c * Fy, -c * N - sigma * s * Fy
    arm, r = sigma * (0.75 + contact[:, FIRST:, wr.S_W]), contact[:, FIRST:, wr.R_C]
    np.testing.assert_allclose(found.wheelset[:, 0, ROLL], (arm * z - r * y).sum(axis=1), rtol=1e-9, atol=1e-3)


def test_creep_forces_never_feed_power() -> None:
    """Every patch slips its own way and dissipates."""
    found = at_the_root(200, seed=2).evaluate(model(), V)
    xi = found.contact[:, 0, FIRST:, wr.XI_X : wr.XI_S + 1]
    power = (found.local[:, 0, FIRST:, 1:] * xi).sum(axis=2)
    assert power.max() <= 0.0
    assert power.min() < -1.0
    two = both_loaded(found.local)
    different = np.abs(xi[two][:, 1, 0] - xi[two][:, 3, 0])  # rolling radii differ by 2 mm of 460
    assert different.min() > 2e-3


def disturbed(run: Run, shift: float) -> NDArray[np.float64]:
    """Push the wheelsets to the right, give every coordinate of the train a small velocity."""
    rng = np.random.default_rng(3)
    train = run.model.ingredients.train
    u = run.state.part(0, "vehicles")
    u[0, train.wheelset_dof[:, 0]] += shift
    u[1] += 1e-3 * rng.standard_normal(train.n)
    run.state.put(0, "vehicles", u[0])
    run.state.put(1, "vehicles", u[1])
    return np.asarray(1e-5 * rng.standard_normal((1, 1, len(train.wheelset_dof), at.N_IRREGULARITY)))


@pytest.mark.parametrize("make", [default_model, pytest.param(paper_model, marks=pytest.mark.slow)])
def test_newton_ends_at_the_law(make) -> None:
    """Wheelsets thrown to where both patches carry: few iterations, and the sum of recorded patches is the wheel's.

    With splines and with sines. Forces of the last pass are the law at the step's end to the solve's tolerance once
    the passes have converged.
    """
    built = make("contact.patches=2", *S1002, V=V, dt=2e-4, passes=6)
    run = Run(built, V, X=3.3, steps=30)
    track = disturbed(run, 5.1e-3)
    wheel = run.advance(30, np.broadcast_to(track, (1, 30, 4, at.N_IRREGULARITY)))
    patch = wheel[..., at.N_WHEEL :].reshape(*wheel.shape[:-1], 2, at.N_PATCH)
    N = patch[..., at.PATCH_NORMAL_FORCE]
    assert (N > 1e3).all(axis=-1).any()
    np.testing.assert_allclose(N.sum(axis=-1), wheel[..., at.NORMAL_FORCE], rtol=1e-12)
    assert run.state.iterations.max() <= 15
    assert run.state.iterations.max() < ct.ITERATIONS
