"""Static compliance of the sines left out (``truncation = "static"``): steady track, start, run."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tiengine.engine.compliant_track import CompliantTrack
from tiengine.engine.sine_state import SineState
from tiengine.engine.static_track import StaticTrack
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.model.omitted_tables import OmittedTables
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario

from ..models import V350, Run, paper_model

STATIC = {"local_compliance": True, "static_compliance": True}
DEFECT = 'track.failed_fastenings=[{rail="left", seats=[180, 182]}, {rail="both", seats=[200, 200], factor=0.3}]'
LOAD = np.broadcast_to([69e3, 3e3, 300.0], (1, 4, 2, 3))


def under_window(model: SineModel, V: float, X: float = 101.35) -> tuple[SineState, float]:
    """A state whose window has its rear end at X, and the place of the rear seat in it."""
    state = SineState.at_rest(model)
    clock = window_clock(model.ingredients.slab, np.array([X]), np.array([V]), np.zeros(1))[0]
    state.enter(int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB]))
    return state, float(clock[at.FIRST_SEAT_S])


@cache
def deflection(modes: int, V: float, *, static: bool) -> Reals:
    """w, v, theta_x under the wheels, shape (W, 2, 3)."""
    model = paper_model(modes=modes, **(STATIC if static else {}))
    state, s0 = under_window(model, V)
    if static:
        assert model.omitted is not None
        return CompliantTrack(model, model.omitted, state, s0, V).under_wheels(LOAD)[0, ..., :3]
    return StaticTrack(model, state, s0, V).under_wheels(LOAD)[0, ..., :3]


@pytest.mark.parametrize(("modes", "most"), [(60, 5e-3), (72, 2e-4)])
def test_static_limit(modes: int, most: float) -> None:
    """At rest 60 sines deflect as 288 do, in w, v and theta_x: 3, 2 and 11 % without.

    72 sines in 36 m have a half wave of 0.5 m; with 60 it is 0.6 m, almost that between seats, 0.63 m, so that the
    faded tails of many seats add up.
    """
    exact = deflection(288, 1e-9, static=True)
    size = np.abs(exact).max(axis=(0, 1))
    with_it, without = (np.abs(deflection(modes, 1e-9, static=static) - exact) for static in (True, False))
    assert np.all(with_it.max(axis=(0, 1)) < most * size)
    assert np.all(without.max(axis=(0, 1)) > 0.01 * size)


def test_without_omitted_sines_it_is_the_static_track() -> None:
    """Tables of nothing leave the track assembled the other way: defects, slabs, dampers under convection."""
    model = paper_model(DEFECT, **STATIC)
    state, s0 = under_window(model, V350)
    given = model.omitted
    assert given is not None

    class Nothing:
        def compliance(self, x: Reals, seats: int) -> Reals:
            return np.zeros((3, *x.shape))

        slope = compliance

    none = OmittedTables(Nothing(), given.by_wheel, given.by_seat, 0.0 * given.by_place, given.wheel_s)  # type: ignore[arg-type]
    found, expected = CompliantTrack(model, none, state, s0, V350), StaticTrack(model, state, s0, V350)
    np.testing.assert_allclose(found.under_wheels(LOAD), expected.under_wheels(LOAD), rtol=1e-9, atol=1e-14)
    for own, other in zip(found.motion(LOAD[0]), expected.motion(LOAD[0]), strict=True):
        np.testing.assert_allclose(own, other, atol=1e-9 * np.abs(other).max())


def test_a_start_at_walking_pace_stays_as_it_is() -> None:
    """Equilibrium, and the step from it: at 0.01 m/s seats hardly move in ten steps, so nothing may happen.

    Forces of seats and omitted sines of the start are those that the kernel finds.
    """
    V = 0.01
    model = paper_model(DEFECT, V=V, **STATIC)
    run = Run(model, V, X=101.35, steps=10)
    before = run.state.seat_force.copy(), run.state.omitted.copy(), run.state.forces_on_rails.copy()
    wheels = run.advance(10)
    # seats move by 10 um: of a force that changes by 70 kN over 0.6 m, 1 N
    np.testing.assert_allclose(
        wheels[:, :, :, at.VERTICAL_FORCE], before[2][0, None, :, :, 0] * np.ones((10, 1, 1)), atol=2.0
    )
    np.testing.assert_allclose(run.state.seat_force, before[0], atol=2.0)
    np.testing.assert_allclose(run.state.omitted[..., 0], before[1][..., 0], atol=1e-9 + 1e-3 * np.abs(before[1]).max())


def test_the_seats_passing_comes_back() -> None:
    """Smooth track, seats of 0.15 m: 60 sines carry no wave as short as the seats' pitch and feel a twentieth of them.

    With those left out the force of a wheel varies as with 144 sines, whose half wave is 0.4 of the pitch.
    """
    varying = {}
    for modes, static in ((60, False), (60, True), (144, True)):
        base = paper_model(dt=2e-4)
        pads = base.ingredients.fastening.model_copy(update={"length": 0.15})
        model = paper_model(modes=modes, dt=2e-4, fastening=pads, **(STATIC if static else {}))
        force = Run(model, V350, steps=450).advance(450)[150:, :, :, at.VERTICAL_FORCE]
        varying[modes, static] = float(force.std(axis=0).mean())
    assert varying[60, False] < 0.1 * varying[144, True]
    assert varying[60, True] == pytest.approx(varying[144, True], rel=0.05)


def test_splines_refuse_it() -> None:
    """One line names the key, the value and the rule."""
    with pytest.raises(InputError, match=r'numerics.truncation = "static": must be "local" or "none" with splines'):
        load_scenario("default", ['numerics.truncation="static"'])


def test_going_on_from_stored_arrays_has_the_same_bits() -> None:
    """All that the steps to come depend on is in the state's arrays, while seats enter and leave."""
    model = paper_model(**STATIC)
    first, second = Run(model, V350, steps=100), Run(model, V350, steps=100, start=False)
    first.advance(100)
    for name, values in first.state.arrays().items():
        second.state.arrays()[name][...] = values
    second.state.first_seat, second.state.first_slab = first.state.first_seat, first.state.first_slab
    second.X = first.X
    second.stepper.factor(V350)
    assert second.advance(100).tobytes() == first.advance(100).tobytes()
