"""Runs of trains whose wheels or rails differ: the same bits where they do not, after a break, in an ensemble."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tiengine.figures import contact as contact_figure
from tiengine.parameters.errors import RunStoppedError
from tiengine.report.scenario_words import scenario_words
from tiengine.scenario.scenario import Scenario, load_scenario, to_toml
from tiengine.simulation import simulate

from .test_resume import assert_same, stopped_after

UNEQUAL: list[dict[str, Any]] = [
    {"wheelsets": [1], "side": "right", "radius_difference": -3e-4},
    {"wheelsets": [3, 4], "profile": "S1002"},
]


def scenario(**changes: Any) -> Scenario:
    """Two underscores stand for a dot."""
    settings = {"numerics.time_step": 2e-4, "output.precision": "double", "output.run_in": 1.0, "train.distance": 6.0}
    return load_scenario("default", settings | {key.replace("__", "."): value for key, value in changes.items()})


@pytest.mark.parametrize("trial_functions", ["splines", pytest.param("sines", marks=pytest.mark.slow)])
def test_wheels_and_rails_stated_alike_keep_the_bits(tmp_path: Path, trial_functions: str):
    alike = [{"profile": "LMA", "vehicles": [1], "radius": 0.43}]
    paths = tmp_path / "plain.h5", tmp_path / "stated.h5"
    kind = {"numerics__trial_functions": trial_functions, "track__fastening__length": 0.0}
    simulate.run(scenario(**kind), paths[0]).close()
    stated = scenario(**kind, train__wheel_profiles=alike, track__rail_profile_right="CHN60")
    simulate.run(stated, paths[1]).close()
    assert_same(*paths)


def test_a_resumed_run_has_the_same_bits(tmp_path: Path):
    chosen = scenario(train__wheel_profiles=UNEQUAL, track__rail_profile_left="60E1", train__distance=45.0)
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    simulate.run(chosen, whole).close()
    with pytest.raises(RunStoppedError):
        simulate.run(chosen, path, stop=stopped_after(1))
    simulate.resume(path).close()
    assert_same(whole, path)


@pytest.mark.slow
def test_trains_of_an_ensemble_may_differ_in_their_wheels():
    """Trains of one radius difference are those of runs of their own: they form a task apart."""
    vary = {"train.wheel_profiles": [(), UNEQUAL[:1]]}
    smooth = {"irregularity__spectrum": "none"}  # another train would have another seed
    both, one = (
        scenario(**smooth, ensemble__size=2, ensemble__vary=vary),
        scenario(**smooth, train__wheel_profiles=UNEQUAL[:1]),
    )
    with simulate.run(both) as found, simulate.run(one) as single:
        first, second = (found.wheel(train)["lateral_force"] for train in range(2))
        assert second.tobytes() == single.wheel()["lateral_force"].tobytes()
        assert np.abs(first - second).max() > 10.0


def test_report_and_figures_tell_the_wheels_apart(tmp_path: Path):
    chosen = scenario(train__wheel_profiles=UNEQUAL, track__rail_profile_left="60E1")
    assert load_scenario(_saved(chosen, tmp_path)).parts.radii.tolist() == chosen.parts.radii.tolist()
    words = dict(scenario_words(chosen))
    assert "LMA wheels, 4 of S1002 (1 with radii of their own, all from 0.4297 to 0.43 m)" in words["Train"]
    assert "60E1 profile on the left and CHN60 on the right" in words["Track"]
    with simulate.run(chosen) as result:
        figure = contact_figure.draw(result)
    titles = [axes.get_title() or axes.get_title("left") for axes in figure.axes]
    assert "Wheel: LMA, S1002" in titles
    assert "Rail: 60E1 on the left, CHN60 on the right" in titles


def _saved(chosen: Scenario, folder: Path) -> Path:
    path = folder / "resolved.toml"
    path.write_text(to_toml(chosen), encoding="utf-8")
    return path
