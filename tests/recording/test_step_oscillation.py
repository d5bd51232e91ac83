"""Forces that alternate from step to step are told from real ones."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.recording.step_oscillation import WINDOW, StepOscillation

DT, LOAD = 2e-4, 7e4
INTERVAL = StepOscillation.interval(DT)


def found(signal, dt=DT) -> float | None:
    """Time at which an oscillation of the lateral force of one wheel of one train is found [s]; None: it is not."""
    interval = StepOscillation.interval(dt)
    watch = StepOscillation.none(1, 2)
    force = np.zeros((1, len(signal), 2, 2, 2))
    force[..., 0] = LOAD
    force[0, :, 1, 0, 1] = signal
    for step in range(interval, len(signal) + 1, interval):
        oscillates, size = watch.look(force[:, step - WINDOW : step], interval * dt, LOAD)
        if oscillates.any():
            assert np.argwhere(oscillates).tolist() == [[0, 1, 0]]
            assert size[0, 1, 0] == pytest.approx(abs(alternating(signal, step)), rel=0.3)
            return step * dt
    return None


def alternating(signal, step: int) -> float:
    """Part of the last eight values that alternates."""
    last = signal[step - 8 : step]
    return float(np.dot(last, (-1.0) ** np.arange(8)) / 8.0)


def growing(first: float, rate: float, steps: int = 8000):
    n = np.arange(steps)
    return first * np.exp(rate * n) * (-1.0) ** n


def real(steps: int = 8000):
    """Guiding, and a wave as short as the irregularity may hold: eight steps long, a tenth of the load."""
    n = np.arange(steps)
    return 5e3 * np.sin(2 * np.pi * 1.3 * n * DT) + 7e3 * np.sin(2 * np.pi * n / 8.0 + 0.3)


@pytest.mark.parametrize("rate", [1e-3, 3e-3])
def test_a_slow_instability_is_found_before_it_reaches_the_load(rate):
    """From 2 N, as measured with 8 sines a metre at 350 km/h and 2e-4 s (rate 1e-3), on top of guiding forces."""
    n = np.arange(20000)
    guiding = 5e3 * np.sin(2 * np.pi * 1.3 * n * DT)
    time = found(guiding + growing(2.0, rate, len(n)))
    assert time is not None
    amplitude = 2.0 * np.exp(rate * time / DT)
    assert 0.01 * LOAD < amplitude < 0.3 * LOAD


def test_seats_that_modulate_an_oscillation_do_not_hide_it():
    """It vanishes in every third look: a stretch takes three times as long."""
    signal = growing(2e3, 5e-4, 4000) * (np.arange(4000) // INTERVAL % 3 > 0)
    time = found(signal)
    assert time is not None
    assert time < 0.7


def test_a_saturated_oscillation_is_found():
    """Friction bounds it: it no longer grows from one stretch to the next."""
    assert found(2e4 * (-1.0) ** np.arange(2000)) == pytest.approx(0.19, abs=0.021)


def test_real_forces_are_left_alone():
    assert found(real()) is None


@pytest.mark.parametrize("rate", [-1e-3, -2e-4])
def test_ringing_that_dies_out_is_left_alone(rate):
    """A blow of 0.7 of the load rings on at the step's own frequency for 0.1 s and longer above a fifth of the load."""
    n = np.arange(8000)
    assert found(5e4 * np.exp(rate * n) * (-1.0) ** n) is None


@pytest.mark.parametrize("beat", [7.0, 23.0, 61.0])
def test_ringing_that_beats_while_it_dies_out_is_left_alone(beat):
    """Two frequencies near the step's own, from 10 kN, with a time constant of 0.1 s as knots of 0.15 m have it."""
    time = np.arange(4000) * DT
    envelope = 1e4 * np.exp(-time / 0.1) * (0.05 + np.abs(np.cos(np.pi * beat * time + 0.4)))
    assert found(envelope * (-1.0) ** np.arange(4000)) is None


def test_growth_after_a_blow_is_found():
    """An instability that the blow leaves behind grows from what is left of the ringing, not from the blow."""
    n = np.arange(8000)
    time = found((5e4 * np.exp(-3e-3 * n) + 50.0 * np.exp(1e-3 * n)) * (-1.0) ** n)
    assert time is not None
    assert time < 1.3


@pytest.mark.parametrize("frequency", [500.0, 1000.0, 1500.0])
def test_blows_on_the_flange_are_left_alone(frequency):
    """Twenty blows of 50 kN a second, each ringing at up to 1.5 kHz for 20 ms."""
    time = np.arange(10000) * DT
    ringing = 5e4 * np.exp(-(time % 0.05) / 0.02) * np.sin(2 * np.pi * frequency * (time % 0.05))
    assert found(real(10000) + ringing) is None


def test_white_noise_below_one_per_cent_is_left_alone():
    """Its differences alternate as well; forces are not wrong by as much as counts."""
    random = np.random.default_rng(0)
    assert found(0.005 * LOAD * random.standard_normal(8000)) is None


@pytest.mark.parametrize(("dt", "interval"), [(1e-3, 20), (2e-4, 100), (2.5e-5, 800), (5e-3, 8)])
def test_looks_are_twenty_milliseconds_apart(dt, interval):
    assert StepOscillation.interval(dt) == interval
