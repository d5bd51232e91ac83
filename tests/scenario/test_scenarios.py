"""Scenarios beyond the paper's: many modes, slow trains, defects, three vehicles, braking, a start from zero."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine.stability import step_growth
from tiengine.kernels import layout as at
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate
from tiengine.track.splines import Splines
from tiengine.vehicle.train import static_wheel_loads

from ..reference.stepping import KMH, model_of, run_steps, scenario

DEFECTS = (
    "track.failed_fastenings=[{rail = 'left', seats = [60, 62], factor = 0.0}]",
    "track.mortar_voids=[{slab = 8, x = [2.5, 3.15], y = [-1.25, 1.25], factor = 0.0}]",
    "irregularity.spectrum='none'",
)
"""Chainages 38.1 to 39.4 m and 47.9 to 48.5 m, met by the leading wheelset (at s = 28 m) within 0.3 s."""


SINES = ("numerics.trial_functions='sines'", "track.fastening={like = 'ACE2021', length = 0.0}")
"""Rails and seats as the paper has them."""

DAMPED = "track.fastening={like = 'ACE2021', vertical_damping = 2e6}"
"""Forty times the damping: at 1 ms two passes over the seats do not converge."""


def assert_sane(vertical: np.ndarray, lateral: np.ndarray, static: float) -> None:
    """Finite, the mean load the weight within 2 %, no peak beyond what irregularity at 350 km/h gives."""
    assert np.isfinite(vertical).all()
    assert np.isfinite(lateral).all()
    assert vertical.mean() == pytest.approx(static, rel=0.02)
    assert vertical.max() < 3.0 * static
    assert np.abs(lateral).max() < static


@pytest.mark.parametrize(
    ("overrides", "dt", "duration"),
    [
        ((*SINES, "numerics.modes_per_metre=4", "numerics.window=36"), 2e-4, 0.5),  # 144 modes
        (("numerics.knots.finest=0.1", "numerics.knots.coarsest=0.3"), 2e-4, 0.5),
        (("train.speed_kmh=5",), 2e-4, 0.5),
        (
            ("train.speed_kmh=20", "irregularity.spectrum='china_ballastless'", "irregularity.wavelength_min=2"),
            2e-4,
            0.5,
        ),
    ],
    ids=["144 modes", "fine knots", "5 km/h", "20 km/h"],
)
def test_stable(overrides, dt, duration):
    """The default step holds with many modes and at walking pace."""
    run = run_steps("default", *overrides, "irregularity.taper=5", dt=dt, duration=duration)
    assert_sane(run.vertical, run.lateral, run.model.constants[at.STATIC_LOAD])
    assert run.state.iterations.max() <= 12  # Newton's method is far from its limit of 25


def test_walking_pace_is_quiet():
    """At 5 km/h on a smooth track nothing is excited: forces stay at the static load within 0.1 %."""
    run = run_steps("smooth", "train.speed_kmh=5", dt=2e-4, duration=0.5)
    np.testing.assert_allclose(run.vertical, run.model.constants[at.STATIC_LOAD], rtol=1e-3)


@pytest.fixture(scope="module")
def seats() -> dict[str, np.ndarray]:
    """Largest fastening forces of seats 40 to 89 while a train passes, sound and failed; shape (50, 2)."""
    return {name: _largest_seat_forces(*overrides) for name, overrides in (("sound", DEFECTS[2:]), ("failed", DEFECTS))}


def _largest_seat_forces(*overrides: str) -> np.ndarray:
    largest = np.zeros((50, 2))

    def each(_: int, stepper) -> None:
        force = stepper.state.seat_forces[0, :, 0].T
        here = np.arange(40, 90) - stepper.state.first_seat
        inside = (here >= 0) & (here < len(force))
        largest[inside] = np.maximum(largest[inside], np.abs(force[here[inside]]))

    run = run_steps("paper", *overrides, dt=2e-4, duration=0.4, each=each)
    assert_sane(run.vertical, run.lateral, run.model.constants[at.STATIC_LOAD])
    return largest


def test_failed_fastenings_carry_nothing(seats):
    """The three seats are without force and their neighbours on the same rail carry more, the other rail the same."""
    failed, sound = seats["failed"], seats["sound"]
    np.testing.assert_array_equal(failed[20:23, 0], 0.0)
    for neighbour in (19, 23):
        assert failed[neighbour, 0] > 1.2 * sound[neighbour, 0]
        assert failed[neighbour, 1] == pytest.approx(sound[neighbour, 1], rel=0.1)
    np.testing.assert_allclose(failed[:10], sound[:10], rtol=0.02)  # 6 m and more before


def test_a_void_is_felt():
    """Fastenings near the hollow place (seats 76 and 77) stand on a softer bed; those 6 m before do not know."""
    change = np.abs(_largest_seat_forces(*DEFECTS[1:]) / _largest_seat_forces(*DEFECTS[2:]) - 1.0).max(axis=1)
    assert change.max() > 1e-3
    assert 73 <= 40 + change.argmax() <= 80
    assert change[:26].max() < 0.1 * change.max()


@pytest.mark.parametrize("defect", DEFECTS[:2])
def test_a_defect_under_the_first_window(defect):
    """The slabs that the start lets in are solved with their own inverses from the first step on.

    A start over the defect is in equilibrium with it: forces move by no more than the ripple of seats, 1 %.
    """
    here = defect.replace("[60, 62]", "[25, 27]").replace("slab = 8", "slab = 3")
    track = ("irregularity.spectrum='none'", here)
    inverses = []

    def each(_: int, stepper) -> None:
        inverses.append(set(stepper._odd))

    run = run_steps("paper", *track, dt=2e-4, duration=0.004, each=each)
    first = {(int(slot), int(run.state.design[0, slot])) for slot in np.flatnonzero(run.state.design[0])}
    assert first
    assert all(found == first for found in inverses)
    np.testing.assert_allclose(run.vertical[:5], run.model.constants[at.STATIC_LOAD], rtol=0.01)


def test_no_tension_differs_only_where_the_bed_lets_go():
    """Under a heavy slab the bed always presses: the bits of the linear bed. Under a light one it lets go."""
    density = "track.slab={like = 'CRTS_III', rho = %g}"
    light, heavy = (
        [
            run_steps("paper", density % rho, f"track.mortar_no_tension={free}", dt=2e-4, duration=0.3)
            for free in ("false", "true")
        ]
        for rho in (250.0, 2.5e5)
    )
    np.testing.assert_array_equal(heavy[0].wheel, heavy[1].wheel)
    assert heavy[1].state.pressure[..., 1].min() > 0.0
    assert np.abs(light[0].vertical - light[1].vertical).max() > 1.0
    assert light[1].state.pressure[..., 1].min() == 0.0
    assert_sane(light[1].vertical, light[1].lateral, light[1].model.constants[at.STATIC_LOAD])


def test_three_vehicles():
    """Twelve wheelsets in one window; the first train's load on each, and wheels that are named by their vehicle."""
    with simulate.run(load_scenario("train3", ["train.distance=30"])) as result:
        wheel = result.wheel()
        assert result.attributes["dofs_vehicles"] == 105
    assert wheel["vertical_force"].shape[1:] == (12, 2)
    assert list(wheel["wheelset_vehicle"]) == [0] * 4 + [1] * 4 + [2] * 4
    assert_sane(wheel["vertical_force"], wheel["lateral_force"], 68747.0)


def test_braking():
    """350 to 330 km/h over 600 m: T is a cubic of chainage, so the time is the integral of 1/V; the train nods.

    Braking by a: the cars' inertia shifts load to the leading bogies by m a h / L, 0.5 % of the wheel load.
    """
    braking = ["irregularity.spectrum='none'", "output.wheel_interval=1e-3", "output.precision='double'"]
    with simulate.run(load_scenario("braking", braking)) as result:
        wheel, body, attributes = result.wheel(), result.body(), result.attributes
    V = np.diff(wheel["position"]) / np.diff(wheel["time"])
    start = wheel["position"][0] - V[0] * wheel["time"][0]
    assert V[0] == pytest.approx(350.0 * KMH, rel=1e-3)
    assert V[-1] == pytest.approx(330.0 * KMH, rel=1e-4)  # the table ends at chainage 600, the run 18 m further on
    assert attributes["simulated_time"] == pytest.approx(600.0 / (340.0 * KMH), rel=5e-3)
    assert wheel["position"][-1] - start == pytest.approx(600.0, abs=0.2)
    assert np.all(np.diff(V) < 1e-6)
    force = wheel["vertical_force"].sum(axis=2)
    middle = slice(len(force) // 3, 2 * len(force) // 3)
    lead, rear = force[middle, :2].mean(), force[middle, 2:].mean()
    assert 0.001 < (lead - rear) / (lead + rear) < 0.02
    assert (lead + rear) / 4.0 == pytest.approx(68747.0, rel=1e-3)
    pitch = body["displacement"][len(body["time"]) // 2, 0, 3]
    assert -5e-3 < pitch < 0.0  # right-handed about y, z down: nose down is negative


def test_start_from_zero_rings():
    """Dropped on the track: wheels are unloaded at first, overshoot, and come back to the weight."""
    run = run_steps("smooth", dt=2e-4, duration=0.6, start="zero")
    force = run.vertical.mean(axis=(1, 2))
    static = run.model.constants[at.STATIC_LOAD]
    assert force[0] < 0.5 * static
    assert np.abs(force - static).max() > 0.05 * static
    assert np.isfinite(run.wheel).all()


def test_the_papers_slab_count():
    """Eq. (16): 7 slabs in 36 m; wheel forces within 0.01 % of the peak of those with full cover (MODEL 2)."""
    paper, cover = (
        run_steps("paper", f"numerics.slab_count='{count}'", dt=2e-4, duration=0.4) for count in ("paper", "cover")
    )
    assert (paper.model.ingredients.slots, cover.model.ingredients.slots) == (7, 8)
    for kind in ("vertical", "lateral"):
        a, b = getattr(paper, kind), getattr(cover, kind)
        assert np.abs(a - b).max() < 1e-4 * np.abs(b).max()


def test_auto_takes_the_longest_stable_step():
    """Whatever is stable in the trial and short enough for the irregularity."""
    assert simulate.prepare(scenario("default"))[0].ingredients.newmark.dt == 2e-4
    fine = scenario("default", "irregularity.wavelength_min=0.1")
    assert simulate.prepare(fine)[0].ingredients.newmark.dt == 1e-4  # 8 V dt <= 0.1 m


def test_a_measured_series_limits_the_step(tmp_path):
    """Points every 0.05 m that go up and down have waves of 0.1 m: 8 V dt is 0.156 m at 350 km/h and 2e-4 s, 0.078 m at
    1e-4 s.
    """
    file = tmp_path / "track.csv"
    file.write_text("x,z_v\n" + "".join(f"{0.05 * i:.2f},{1e-4 * (i % 2)}\n" for i in range(2000)))
    measured = f"irregularity.file='{file}'"
    assert simulate.prepare(scenario("default", measured))[0].ingredients.newmark.dt == 1e-4
    with pytest.raises(InputError, match=r"waves longer than [0-9.]+ m; must be >= 8 V dt = 0\.1556 m"):
        simulate.prepare(scenario("default", measured, "numerics.time_step=2e-4"))


def test_threads_are_for_sines():
    """With splines a step has one thread: a number that would do nothing is refused."""
    assert scenario("default", "numerics.threads=2", *SINES).numerics.threads == 2
    with pytest.raises(InputError, match=r"numerics\.threads = 2: must be 1 with splines"):
        scenario("default", "numerics.threads=2")


@pytest.mark.parametrize("functions", [(*SINES, "numerics.modes_per_metre=8"), (DAMPED,)])
def test_an_unstable_step_is_refused(functions):
    """With the reason and what to change."""
    settings = ("numerics.time_step=1e-3", "train.distance=20", *functions, "irregularity.spectrum='none'")
    advice = r"numerics\.time_step = [\d.e-]+( or numerics\.passes = \d)? is stable$"
    with pytest.raises(InputError, match=r"numerics\.time_step = 0\.001: unstable; .*; " + advice):
        simulate.prepare(scenario("default", *settings))


@pytest.mark.parametrize(
    ("modes", "dt", "passes", "damping", "stable"),
    [
        (4, 4e-4, 1, 1, False),
        (4, 4e-4, 2, 1, True),
        (4, 1e-4, 1, 4, False),
        (4, 1e-4, 3, 4, True),
        (2, 2e-4, 1, 4, False),
        (2, 4e-4, 3, 4, False),
        (2, 2e-4, 2, 4, True),
    ],
)
def test_the_trial_tells_what_blows_up(modes, dt, passes, damping, stable):
    """Near the boundary of stability the trial and a run of its own agree.

    The whole grid of 1, 2, 4 modes a metre, 1 to 3 passes, 5e-5 to 4e-4 s and damping times 1 and 4 was tried once:
    72 of 72 cases agreed.
    """
    overrides = (*SINES, "numerics.window=36", f"numerics.modes_per_metre={modes}")
    fastening = scenario("default", *SINES).parts.fastening
    stiffened = fastening.model_copy(
        update={name: damping * getattr(fastening, name) for name in ("vertical_damping", "lateral_damping")}
    )
    model = model_of("default", *overrides, dt=dt, passes=passes, fastening=stiffened)
    with np.errstate(all="ignore"):
        assert step_growth(model, 350.0 * KMH, 0.2 / dt).tolerable(0.2 / dt) == stable
        run = run_steps("default", *overrides, dt=dt, duration=0.2, model=model)
    bounded = (
        bool(np.isfinite(run.wheel).all())
        and np.abs(run.vertical).max() < 4.0 * static_wheel_loads(model.ingredients.train).max()
    )
    assert bounded == stable


@pytest.mark.parametrize(
    "defect",
    [
        'track.failed_fastenings=[{rail="left", seats=[100, 102], factor=0.0}]',
        "track.mortar_voids=[{slab=12, x=[0.0, 1.0], y=[-1.0, 1.0], factor=0.0}]",
    ],
)
def test_knots_are_closer_where_the_track_has_defects(defect: str) -> None:
    """The splines of a defective track, and those of the sound one as before."""
    sound, defective = (load_scenario("default", overrides).trial_functions for overrides in ([], [defect]))
    assert isinstance(sound, Splines)
    assert isinstance(defective, Splines)
    assert np.diff(sound.knots).max() > 0.8
    assert np.diff(defective.knots).max() <= 0.5 + 1e-9
