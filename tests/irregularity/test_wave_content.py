"""Wave content of measured tracks: rows close together do not shorten the shortest wave, content does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tiengine.irregularity.irregularity import IrregularityParams
from tiengine.irregularity.track_checks import check_step, shortest_wavelength
from tiengine.irregularity.wave_content import NEGLIGIBLE_SHARE, shortest_content
from tiengine.parameters.errors import InputError

DATA = Path(__file__).parents[1] / "data" / "tracks"
ONE = np.ones(1)


def series(z: np.ndarray, step: float) -> np.ndarray:
    """Chainage and one channel."""
    return np.column_stack([step * np.arange(len(z)), z])


@pytest.mark.parametrize("step", [0.005, 0.01, 0.1])
@pytest.mark.parametrize("rounding", [0.0, 1e-8])
def test_waves_decide_and_not_rows(step, rounding):
    """A wave of 2 m at any spacing, printed to 1e-5 mm or in full, is 2 m long but for a window's side lobes."""
    x = step * np.arange(round(200.0 / step))
    z = 1e-3 * np.sin(np.pi * x)
    if rounding:
        z = np.round(z / rounding) * rounding
    assert 1.6 < shortest_content(series(z, step), ONE) <= 2.0


@pytest.mark.parametrize("share", [0.1, 10.0])
def test_the_share_is_that_of_slope(share):
    """A short wave counts if its share of the slope's variance is above the limit, and not below it."""
    step, long, short = 0.01, 5.0, 0.1
    x = step * np.arange(20_000)
    ratio = np.sqrt(share * NEGLIGIBLE_SHARE)  # of the slopes' amplitudes
    z = 1e-3 * (np.sin(2 * np.pi * x / long) + ratio * short / long * np.sin(2 * np.pi * x / short))
    found = shortest_content(series(z, step), ONE)
    assert (0.09 < found <= 0.1) if share > 1.0 else (found > 3.0)


def test_one_short_place_in_a_long_file_counts():
    """One metre of 0.1 m waves in 4 km of smooth 20 m waves: 2e-5 of the whole file's slope variance."""
    step = 0.01
    x = step * np.arange(400_000)
    z = 1e-3 * np.sin(2 * np.pi * x / 20.0) + np.where(np.abs(x - 2000.0) < 0.5, 1e-6 * np.sin(20 * np.pi * x), 0.0)
    assert shortest_content(series(z, step), ONE) < 0.11


def test_a_flat_file_and_a_coarse_one():
    """Nothing at all, and noise from row to row: two rows a wave."""
    assert shortest_content(series(np.zeros(50), 0.25), ONE) == np.inf
    noise = np.random.default_rng(0).normal(size=2000)
    assert shortest_content(series(noise, 0.25), ONE) == 0.5


def test_a_weld_recorded_every_5_mm_runs_at_ordinary_steps():
    """A weld of 1 m with a spike of 0.1 m: steps of 1e-4 s are enough at 200 km/h, where rows would ask for 2e-5 s."""
    params = IrregularityParams(file=str(DATA / "weld_5mm.csv"))
    shortest = shortest_wavelength(params)
    assert 0.04 < shortest < 0.1  # the spike's own spectrum reaches from 0.1 to 0.05 m
    check_step(params, shortest, 200.0 / 3.6, 1e-4)
    with pytest.raises(InputError) as caught:
        check_step(params, shortest, 350.0 / 3.6, 2e-4)
    message = str(caught.value)
    for word in ("file_band_pass", "wavelength_min >= 0.1556", "numerics.time_step <= ", "99.9 %", "0.0002 s"):
        assert word in message
    smooth = params.model_copy(update={"file_band_pass": True, "wavelength_min": 0.16, "wavelength_max": 3.0})
    check_step(smooth, shortest_wavelength(smooth), 350.0 / 3.6, 2e-4)  # the advice, taken
