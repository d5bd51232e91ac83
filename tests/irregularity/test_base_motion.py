"""Record of the ground's acceleration: reading, integration, drift, delay."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.irregularity.base_motion import BaseMotion, GroundRecord, check_record
from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario

FREQUENCY = 3.0  # Hz


def written(path, t, vertical, lateral=None, heads="time [s], vertical [m/s^2]"):
    """Write a record; its file."""
    heads += ", lateral [m/s^2]" if lateral is not None else ""
    columns = [t, vertical] if lateral is None else [t, vertical, lateral]
    text = "\n".join([heads, *(", ".join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True))])
    path.write_text(text)
    return str(path)


def burst(t):
    """Second derivative of sin(w t) bell(t), which begins and ends at rest: displacement and acceleration."""
    fine = np.linspace(0.0, 4.0, 200_001)
    u = 0.01 * np.sin(2.0 * np.pi * FREQUENCY * fine) * np.sin(np.pi * fine / 4.0) ** 4
    a = np.gradient(np.gradient(u, fine), fine)
    return np.interp(t, fine, u), np.interp(t, fine, a)


def test_a_record_is_integrated_to_the_displacement(tmp_path):
    """A burst in rows of 10 ms, without taper or correction to speak of: to 1e-4 of its size.

    The spline's error is 5/384 (w h)^4 = 2e-5 of the acceleration; the taper of 1 us and the steps of 2e-5 s of the
    differences add little.
    """
    t = np.arange(0.0, 4.0001, 0.01)
    u, a = burst(t)
    record = GroundRecord(
        BaseMotion(file=written(tmp_path / "a.csv", t, a, -2.0 * a), taper=1e-6, baseline="none", start=1.5)
    )
    at = np.linspace(0.0, 4.0, 777)
    u, a = burst(at)
    np.testing.assert_allclose(record.at(at + 1.5, 2), np.stack([a, -2.0 * a], axis=1), atol=2e-4 * np.abs(a).max())
    np.testing.assert_allclose(record.at(at + 1.5, 0), np.stack([u, -2.0 * u], axis=1), atol=1e-4 * np.abs(u).max())
    assert not record.at(np.array([0.0, 1.49]), 0).any()
    assert record.highest == pytest.approx(FREQUENCY, abs=1.0)


def test_rows_of_any_steps_give_the_same_motion(tmp_path):
    """Uneven rows, in gal and milliseconds, of the same motion: to 1e-3 after two integrations."""
    even = np.arange(0.0, 4.0001, 0.01)
    uneven = even + np.where((even > 0.0) & (even < 4.0), np.random.default_rng(3).uniform(-3e-3, 3e-3, len(even)), 0.0)
    file = written(tmp_path / "a.csv", even, burst(even)[1], heads="time [s], lateral [m/s^2]")
    first = GroundRecord(BaseMotion(file=file, taper=0.1))
    heads = "time [ms], lateral [gal]"
    file = written(tmp_path / "b.csv", 1e3 * uneven, 1e2 * burst(uneven)[1], heads=heads)
    second = GroundRecord(BaseMotion(file=file, taper=0.1))
    at = np.linspace(-0.5, 5.0, 500)
    for derivative in range(3):
        expected = first.at(at, derivative)
        assert not expected[:, 0].any()
        np.testing.assert_allclose(second.at(at, derivative), expected, atol=1e-3 * np.abs(expected).max())


def test_drift_is_taken_off(tmp_path):
    """An instrument that is off by 0.01 m/s^2 drifts by 0.08 m in 4 s; corrected, it comes to rest where it was.

    The correction changes accelerations by what drifted, a few times 0.01 m/s^2, and no more.
    """
    t = np.arange(0.0, 4.0001, 0.01)
    a = burst(t)[1] + 0.01
    file = written(tmp_path / "a.csv", t, a)
    raw, corrected = (GroundRecord(BaseMotion(file=file, taper=0.2, baseline=b)) for b in ("none", "corrected"))
    assert abs(raw.at(np.array([4.0]), 0)[0, 0]) > 0.06
    late = np.array([4.0, 10.0])
    moved = np.abs(corrected.at(late, 0)).max(), np.abs(corrected.at(late, 1)).max()
    assert max(moved) < 1e-12
    between = np.linspace(0.0, 4.0, 300)
    assert np.abs(raw.at(between, 2) - corrected.at(between, 2)).max() < 0.05
    past = raw.at(np.array([4.0, 5.0, 6.0]), 0)[:, 0]
    assert np.diff(past, 2) == pytest.approx(0.0, abs=1e-12)  # it moves on as it came to


def test_vertical_up_and_scale(tmp_path):
    t = np.arange(0.0, 4.0001, 0.01)
    file = written(tmp_path / "a.csv", t, burst(t)[1], burst(t)[1])
    down, up = (GroundRecord(BaseMotion(file=file, vertical_up=u, scale=s)) for u, s in ((False, 1.0), (True, 2.0)))
    a, b = (record.at(np.array([1.9]), 2)[0] for record in (down, up))
    np.testing.assert_allclose(b, [-2.0 * a[0], 2.0 * a[1]], rtol=1e-9)


def test_a_wave_comes_later_where_it_travels_to(tmp_path):
    t = np.arange(0.0, 4.0001, 0.01)
    record = GroundRecord(BaseMotion(file=written(tmp_path / "a.csv", t, burst(t)[1]), wave_speed=-500.0, at=100.0))
    np.testing.assert_allclose(record.delay(np.array([100.0, 50.0])), [0.0, 0.1], rtol=1e-12)


def test_steps_and_waves_that_are_too_long_or_short_are_refused(tmp_path):
    t = np.arange(0.0, 4.0001, 0.01)
    file = written(tmp_path / "a.csv", t, burst(t)[1])
    check_record(GroundRecord(BaseMotion(file=file)), 100.0, 1e-3)
    with pytest.raises(
        InputError, match=r"track\.base_motion\.file: holds frequencies up to .* Hz .* numerics\.time_step"
    ):
        check_record(GroundRecord(BaseMotion(file=file)), 100.0, 0.05)
    with pytest.raises(
        InputError, match=r"track\.base_motion\.wave_speed = 40: makes waves of .* must be 20 m or longer"
    ):
        check_record(GroundRecord(BaseMotion(file=file, wave_speed=40.0)), 100.0, 1e-4)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time [s], vertical [m/s^2]\n0, 1\n1, 2\n", "2 rows; must have at least 4"),
        ("time, vertical [m/s^2]\n0, 1\n1, 2\n2, 1\n3, 1\n", "column 'time': must be time [s], vertical or lateral"),
        ("time [s], vertical [N]\n0, 1\n1, 2\n2, 1\n3, 1\n", "must be time [s], vertical or lateral [m/s^2], [cm/s^2]"),
        ("vertical [g], time [s]\n0, 1\n1, 2\n2, 1\n3, 1\n", "must name the column time first"),
        ("time [s], lateral [g], lateral [g]\n0, 1, 1\n1, 2, 1\n2, 1, 1\n3, 1, 1\n", "once each"),
        ("time [s], lateral [g]\n0, 1\n1, 2\n1, 1\n3, 1\n", "line 4: the time must rise"),
        ("time [s], lateral [g]\n0, 1\n1, x\n2, 1\n3, 1\n", "line 3: must be 2 numbers"),
        ("time [s], lateral [g]\n0, 1\n1, 20\n2, 1\n3, 1\n", "line 3: acceleration above 50 m/s^2"),
    ],
)
def test_bad_records_are_refused(tmp_path, text, said):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        GroundRecord(BaseMotion(file=str(path)))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("scenario", "table", "said"),
    [
        ("default", "scale=2.0", "track.base_motion.file: missing"),
        ("default", "file='a.csv', wave_speed=3.0", "track.base_motion.wave_speed = 3: must be at least 20 m/s"),
        ("default", "file='a.csv', at=3.0", "track.base_motion.at = 3: must be left out without wave_speed"),
        ("default", "file='a.csv', taper=0.0", "track.base_motion.taper = 0.0: must be greater than 0"),
        ("default", "file='a.csv', baseline='x'", "track.base_motion.baseline = 'x'"),
        ("paper", "file='a.csv'", "track.base_motion: must be left out with numerics.trial_functions"),
    ],
)
def test_bad_keys_are_refused(scenario, table, said):
    with pytest.raises(InputError) as caught:
        load_scenario(scenario, [f"track.base_motion={{{table}}}"])
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
