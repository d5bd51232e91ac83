"""A whole run: what rolls on a smooth track, action and reaction, the written file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray
from numpy.typing import NDArray

from tiengine.engine.kinds import state_at_rest
from tiengine.engine.state import ACCELERATION
from tiengine.engine.steady import steady_track
from tiengine.kernels import layout as at
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation import simulate

from ..reference.stepping import KMH, History, model_of, run_steps

SPEED = 350.0 * KMH
SEAT_PITCH, SLAB_PITCH = 0.63, 5.67
SETTLED = 0.2  # s: three and a half slabs after the start


@pytest.fixture(scope="module")
def smooth() -> tuple[History, NDArray[np.float64]]:
    """One second on the smooth track, and the balance of forces of every rail; see ``balanced``."""
    return balanced("smooth", "numerics.passes=4", duration=1.0)


def balanced(name: str, *overrides: str, duration: float) -> tuple[History, NDArray[np.float64]]:
    """A run at 2e-4 s with, per step, the sum of fastening forces and the inertia of each rail.

    The material momentum of a rail is m int (dw/dt - V w') ds; its w vanishes at both ends, so its rate is
    m sum_i a_i int phi_i ds. What the pinned ends carry is left out of the balance.

    Returns:
        Its history, and forces [N], shape (steps, fastenings or inertia, vertical or lateral, rail).
    """
    model = model_of(name, *overrides, dt=2e-4)
    knots = model.functions.knots
    node, weight = np.polynomial.legendre.leggauss(2)  # exact for cubics
    half = 0.5 * np.diff(knots)[:, None]
    s, weights = (knots[:-1, None] + half * (node + 1.0)).ravel(), (half * weight).ravel()
    whole = model.ingredients.rail.mass_per_length * (weights @ model.functions.shape(s))
    rows = []

    def each(_: int, stepper) -> None:
        state = stepper.state
        fastenings = state.seat_forces[0].sum(axis=2).T[:2]
        inertia = [
            state.part(0, name)[ACCELERATION].reshape(2, len(knots), -1)[..., 0] @ whole
            for name in ("vertical", "lateral")
        ]
        rows.append([fastenings, inertia])

    run = run_steps(name, *overrides, dt=2e-4, duration=duration, model=model, each=each)
    return run, np.array(rows)


def test_smooth_track_settles_to_the_static_load(smooth):
    """The mean over whole slabs is the weight: nothing else acts on the train from outside.

    0.01 % for a mean over a number of steps that is not exactly one of slabs.
    """
    run, _ = smooth
    train = run.model.ingredients.train
    weight = train.gravity[1 : train.n_dof : 5].sum()
    whole_slabs = round(10 * SLAB_PITCH / SPEED / 2e-4)
    np.testing.assert_allclose(run.vertical[-whole_slabs:].mean(axis=0), weight / 8.0, rtol=1e-4)


def test_only_the_ripple_of_seats_and_slabs_remains(smooth):
    """Everything after the start is periodic in the slabs; of their harmonics the ninth, the seats', is the largest.

    Residual: 0.1 % of the ripple is left by the start's decay (measured 0.07 %).
    """
    run, _ = smooth
    late = run.time > SETTLED
    force, phase = run.vertical[late].reshape(late.sum(), -1), 2.0 * np.pi * SPEED / SLAB_PITCH * run.time[late]
    h = np.arange(1, 101)  # to the eleventh harmonic of the seats, 1.7 kHz
    waves = np.hstack([np.ones((len(phase), 1)), np.cos(np.outer(phase, h)), np.sin(np.outer(phase, h))])
    found = np.linalg.lstsq(waves, force, rcond=None)[0]
    assert (force - waves @ found).std() < 1e-3 * force.std()
    amplitude = np.hypot(found[1:101], found[101:])
    assert np.all(amplitude.argmax(axis=0) == round(SLAB_PITCH / SEAT_PITCH) - 1)


def test_ripple_has_the_size_of_the_tracks_contrast(smooth):
    """Above the wheel's resonance on the track (60 Hz) the wheel stays and the track's varying stiffness pushes.

    A static deflection w that varies by a share c from seat to mid-span then gives an amplitude of F c / 2, times
    1 / (1 - (60 / 154)^2) = 1.2; slab ends add harmonics of similar size. Peak to peak: c/2 to 3 c of F.
    """
    run, _ = smooth
    model = run.model
    state = state_at_rest(model)
    deflection = []
    for X in np.linspace(0.5 * SEAT_PITCH, 1.5 * SEAT_PITCH, 8, endpoint=False):
        state.enter(1, 0)
        track = steady_track(model, state, 1.5 * SEAT_PITCH - X, SPEED)
        force = np.zeros((1, 4, 2, 3))
        force[..., 0] = 1.0
        deflection.append(track.under_wheels(force)[0, 1, 0, 0])
    contrast = np.ptp(deflection) / np.mean(deflection)
    ripple = np.ptp(run.vertical[run.time > SETTLED], axis=0).max() / run.vertical.mean()
    assert 0.5 * contrast < ripple < 3.0 * contrast


def test_left_and_right_mirror_each_other(smooth):
    """A symmetric train on a symmetric track: rounding of forces of 7e4 N over 5000 steps."""
    run, _ = smooth
    np.testing.assert_allclose(run.vertical[..., 0], run.vertical[..., 1], atol=1e-7)
    np.testing.assert_allclose(run.lateral[..., 0], -run.lateral[..., 1], atol=1e-7)


@pytest.mark.parametrize(("kind", "channel"), [(0, at.VERTICAL_FORCE), (1, at.LATERAL_FORCE)])
def test_fastenings_and_inertia_carry_the_wheels_on_a_smooth_track(smooth, kind, channel):
    """Action = reaction on either rail; the pinned ends, 8 m away, carry 3e-4 of the wheels' forces, laterally 3e-3.

    Ten decay lengths of 0.8 m to the end leave exp(-10) = 5e-5 of the static load (FACTS 3.6); the second and higher
    harmonics of the seats, 308 Hz and more, travel along the rail. Four passes leave less than these (measured 1.6e-4
    and 1.5e-3 with eight, 5e-4 and 3e-3 with two).
    """
    run, parts = smooth
    wheels = run.wheel[..., channel].sum(axis=1)
    scale = np.abs(run.wheel[..., channel]).sum(axis=1).mean()
    assert np.abs(wheels - parts[:, :, kind].sum(axis=1)).max() < 3e-4 * scale * (1 if kind == 0 else 10)


def test_fastenings_and_inertia_carry_the_wheels_on_a_rough_track():
    """The same where forces vary by 20 kN and 1.5 kN; lateral waves travel far, hence a window of 60 m.

    They leave 430 N at the ends of a window with 8 m at either end, 125 N with 12 m, 34 N with 20 m (measured), against
    peaks of 8 kN of the lateral sum; vertically the waves above the track's cut-on reach them.
    """
    run, parts = balanced("default", "numerics.window=60", "numerics.passes=4", duration=0.6)
    for kind, channel, share in ((0, at.VERTICAL_FORCE, 5e-4), (1, at.LATERAL_FORCE, 1e-2)):
        wheels = run.wheel[..., channel].sum(axis=1)
        scale = np.abs(wheels).max()
        assert np.abs(parts[:, 1, kind]).max() > 10.0 * share * scale  # inertia counts
        assert np.abs(wheels - parts[:, :, kind].sum(axis=1)).max() < share * scale


def test_wheels_carry_the_train_and_its_inertia():
    """Newton's law for all bodies together, vertically and laterally, at every step: rounding only."""
    run = run_steps("default", dt=2e-4, duration=0.4)
    train = run.model.ingredients.train
    mass, weight = np.diag(train.M)[: train.n_dof], train.gravity[1 : train.n_dof : 5].sum()
    acceleration = run.body[:, 2]
    down = acceleration[:, 1::5] @ mass[1::5]
    right = acceleration[:, 0::5] @ mass[0::5]
    np.testing.assert_allclose(run.vertical.sum(axis=(1, 2)) + down, weight, rtol=1e-13)
    np.testing.assert_allclose(run.lateral.sum(axis=(1, 2)) + right, 0.0, atol=1e-13 * weight)


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    """A real run over 250 m."""
    path = tmp_path_factory.mktemp("run") / "paper.h5"
    simulate.run(load_scenario("paper", ["train.distance=250"]), path).close()
    return path


def test_file_opens_in_xarray(file):
    """Units, labels, time and the chainage of the first vehicle's centre."""
    with xarray.open_dataset(file, group="trains/000/wheel", engine="h5netcdf") as wheel:
        force = wheel.vertical_force
        assert force.dims == ("time", "wheelset", "side")
        assert (force.attrs["units"], wheel.time.attrs["units"]) == ("N", "s")
        assert list(wheel.side.values) == ["left", "right"]
        offsets = wheel.wheelset_offset.values
        assert np.all(np.diff(offsets) < 0.0)  # wheelset 1 leads
        np.testing.assert_allclose(offsets, -offsets[::-1], atol=1e-12)
        time, position = wheel.time.values, wheel.position.values
        dt = time[0]
        np.testing.assert_allclose(time, dt * np.arange(1, len(time) + 1), rtol=1e-12)
        np.testing.assert_allclose(position, 18.0 + SPEED * time, atol=1e-7)  # centred in a window of 36 m
        assert position[-1] == pytest.approx(18.0 + 250.0, abs=SPEED * dt)
    with xarray.open_dataset(file, group="trains/000/body", engine="h5netcdf") as body:
        assert body.displacement.shape[1:] == (7, 5)
        assert list(body.dof.values) == ["y", "z", "roll", "pitch", "yaw"]
        np.testing.assert_allclose(np.diff(body.time.values), 1e-3, rtol=1e-9)


def test_forces_have_the_expected_size(file):
    """German low disturbance at 350 km/h: 69 +- 20 kN, lateral forces of a few kN (published codes and MODEL 11).

    The standard deviation from two seconds scatters by a fifth: 200 m hold few of its long waves (120 m).
    """
    with xarray.open_dataset(file, group="trains/000/wheel", engine="h5netcdf") as wheel:
        late = wheel.isel(time=wheel.position.values > 18.0 + 50.0)
        vertical, lateral = late.vertical_force.values, late.lateral_force.values
    assert vertical.mean() == pytest.approx(68747.0, rel=5e-3)
    assert 15e3 < vertical.std() < 25e3
    assert 0.5e3 < lateral.std() < 5e3
    assert np.abs(lateral).max() < 30e3
    assert np.isfinite(vertical).all()


def test_two_ways_of_reading_agree(file):
    """``tiengine.open`` and the irregularity under the wheels."""
    import tiengine
    from tiengine.irregularity.irregularity import at_wheels, make_irregularity

    with tiengine.open(file) as result:
        irregularity, wheel = result.irregularity(), result.wheel()
        scenario = result.scenario
        assert result.attributes["status"] == "complete"
    assert set(irregularity) >= {"time", "vertical", "lateral"}
    lead = 18.0 + float(wheel["wheelset_offset"].max())
    track = make_irregularity(scenario.irregularity, lead)
    rails = at_wheels(track.sample(wheel["position"][::100, None] + wheel["wheelset_offset"]))
    np.testing.assert_allclose(irregularity["vertical"][::100], rails[..., 0], atol=1e-9)  # single precision of 5 mm
    np.testing.assert_allclose(irregularity["lateral"][::100], rails[..., 1], atol=1e-9)
