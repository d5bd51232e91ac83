"""Runs on a track that a Python function gives: one train, ensembles in one process and in several, resumed runs."""

from __future__ import annotations

import functools
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tiengine
from tiengine.parameters.errors import InputError, RunStoppedError
from tiengine.report.scenario_words import scenario_words
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.simulation import simulate

SHORT = {
    "train.distance": 45.0,  # three chunks of 1000 steps at 300 km/h
    "train.speed_kmh": 300.0,
    "numerics.truncation": "none",
    "numerics.time_step": 2e-4,
    "output.precision": "double",
    "irregularity.taper": 1e-3,  # the hill begins with a step of 1 mm, whose ringing dies out
}


def scenario(**changes: Any) -> Scenario:
    """One train over three chunks; two underscores stand for a dot."""
    return load_scenario("default", SHORT | {key.replace("__", "."): value for key, value in changes.items()})


def hill(x, height=1e-3):
    """Vertical cosine of 20 m."""
    return height * np.cos(0.1 * np.pi * x), 0.0, 0.0, 0.0


def slopes(x):
    """Slope of the hill."""
    return -1e-4 * np.pi * np.sin(0.1 * np.pi * x), 0.0, 0.0, 0.0


def broken(x):
    """A hill that ends at 50 m."""
    if x.max() > 50.0:
        raise RuntimeError("no more track")
    return hill(x)


def test_one_train_runs_on_the_function():
    """The irregularity of the file is the function's at the wheels; the file and its description name it."""
    with tiengine.run(scenario(), irregularity=tiengine.TrackFunction(hill, slopes=slopes)) as result:
        position, offset = result.wheel()["position"], result.wheel()["wheelset_offset"]
        x = np.asarray(position)[:, None] + np.asarray(offset)
        vertical = result.irregularity()["vertical"]
        begun = x >= x[0, 0]  # the taper of 1 mm begins ahead of the leading wheel at t = 0
        assert begun.sum() > 4000
        assert np.abs(vertical[begun] - hill(x[begun])[0][:, None]).max() < 1e-15  # rounding; no grid between
        assert result.scenario.irregularity.function == "hill"
        assert "given by the Python function hill" in str(scenario_words(result.scenario))


def test_an_ensemble_gets_one_function_or_one_for_each_train():
    """The same bits from two workers; each train as if it ran alone."""
    several = scenario(ensemble__size=3)
    hills = [functools.partial(hill, height=height) for height in (1e-3, 2e-3, 1e-3)]
    with simulate.run(several, irregularity=hills, workers=1) as here:
        one, two, three = (here.wheel(train)["normal_force"] for train in range(3))
        assert np.array_equal(one, three)
        assert np.abs(one - two).max() > 1e3
        vary = scenario(ensemble__size=3, ensemble__vary={"train.speed_kmh": [300.0, 300.0, 290.0]})
        with (
            simulate.run(vary, irregularity=hills, workers=2) as apart,
            simulate.run(vary, irregularity=hills, workers=1) as alone,
        ):
            for train in range(3):
                assert np.array_equal(apart.wheel(train)["normal_force"], alone.wheel(train)["normal_force"])


def test_functions_that_workers_cannot_get_are_refused():
    several = scenario(ensemble__size=2, ensemble__vary={"train.speed_kmh": [300.0, 290.0]})
    with pytest.raises(InputError, match=r"cannot be sent to worker processes .* workers=1"):
        simulate.run(several, irregularity=lambda x: hill(x), workers=2)


def test_a_resumed_run_needs_its_function(tmp_path: Path):
    """The same bits when it is given again; one line when it is not, or another one is."""
    path, whole = tmp_path / "run.h5", tmp_path / "whole.h5"
    simulate.run(scenario(), whole, irregularity=hill).close()
    asked = count()
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(), path, irregularity=hill, stop=lambda: next(asked) >= 0)
    with pytest.raises(InputError, match=r"irregularity\.function = 'hill': .* must be passed again"):
        simulate.resume(path)
    with pytest.raises(InputError, match=r"function 'slopes': must be 'hill', with which the run was begun"):
        simulate.resume(path, irregularity=slopes)
    with simulate.resume(path, irregularity=hill) as resumed, tiengine.open(whole) as straight:
        assert np.array_equal(resumed.wheel()["normal_force"], straight.wheel()["normal_force"])


def test_a_resumed_run_without_a_function_takes_none(tmp_path: Path):
    path, asked = tmp_path / "run.h5", count()
    with pytest.raises(RunStoppedError):
        simulate.run(scenario(), path, stop=lambda: next(asked) >= 0)
    with pytest.raises(InputError, match=r"function 'hill': must be left out; the run was begun without one"):
        simulate.resume(path, irregularity=hill)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_function_that_fails_on_the_way_is_told(workers: int):
    """In this process and in a worker."""
    several = scenario(ensemble__size=2, ensemble__vary={"train.speed_kmh": [300.0, 290.0]})
    with pytest.raises(InputError, match=r"function 'broken': fails between .*no more track"):
        simulate.run(several, irregularity=tiengine.TrackFunction(broken, slopes=slopes), workers=workers)


def test_a_recorded_scenario_cannot_be_run_without_its_function(tmp_path: Path):
    path = tmp_path / "recorded.toml"
    path.write_text(to_toml(scenario(irregularity__function="hill")))
    with pytest.raises(InputError, match=r"irregularity\.function = 'hill': .* must be passed again"):
        simulate.run(path)
