"""Data and verdicts of the speed suite, without measuring any speed."""

import json
import re

import numpy as np
import pytest

from tiengine.scenario.scenario import load_scenario
from validation.speed import findings
from validation.speed.__main__ import CASES as MEASURED
from validation.speed.effort import effort
from validation.speed.figures import draw
from validation.speed.full_length import STAGES
from validation.speed.page import page
from validation.speed.runs import CASES, RUNS, Run, median_of, settings_of
from validation.speed.scaling import AXES, exponent

SEEN = {
    "date": "now", "effort": "quick", "load_average": 0.5, "others_cores": 0.0, "commit": "abc",
    "machine": {"cpu": "a processor", "cores": 2, "memory_bytes": 2**34, "blas": "a library"},
    "versions": {"python": "3"},
}  # fmt: skip


def case(values, **data):
    return {"circumstances": SEEN, "values": values, "data": data}


@pytest.mark.parametrize("name", RUNS)
def test_runs_are_scenarios(name):
    run = RUNS[name]
    scenario = load_scenario(run.scenario, settings_of(run, 100.0))
    assert scenario.numerics.time_step == 2.5e-4
    assert scenario.train.distance == 100.0
    assert len(scenario.members) == (64 if name.startswith("batch") else 1)
    if name != "kilometres":
        assert scenario.output.wheel_interval == "step"


def test_a_run_with_an_unknown_key_is_refused():
    with pytest.raises(TypeError, match="wrkers"):
        Run(words="", scenario="paper", wrkers=2)


def test_cases_name_runs_that_exist():
    assert {run for each in MEASURED.values() for run in each.runs} <= set(RUNS)


@pytest.mark.parametrize("row", CASES["rows"], ids=lambda row: row["key"])
def test_rows_belong_to_cases_and_say_what_limits_them(row):
    assert row["key"].partition(".")[0] in MEASURED
    named = {
        re.sub(r":.*", "", field)
        for text in (row["quantity"], row["limit"])
        for field in re.findall(r"{([^}]+)}", text)
    }
    assert {key.partition(".")[0] for key in named} <= set(MEASURED)
    assert row["limit"]
    assert set(row) <= {"key", "quantity", "unit", "target", "rule", "limit"}


@pytest.mark.parametrize(
    ("key", "measured", "met"),
    [("one_train.rtf", 0.4, True), ("one_train.rtf", 0.41, False), ("one_train.rtf", float("nan"), False),
     ("full_length.ratio_one", 25.0, True), ("full_length.ratio_one", 24.9, False),
     ("one_train.rtf_default", 9.0, None)],
)  # fmt: skip
def test_verdicts(key, measured, met):
    name, _, short = key.partition(".")
    (row,) = findings.rows({name: case({short: measured})})
    assert row.met is met


def test_a_limit_shows_measured_numbers_and_says_what_is_missing():
    (row,) = findings.rows({"one_train": case({"rtf": 0.5, "us_per_step": 100.4})})
    assert row.limit.startswith("100 µs per step")
    assert findings.MISSING in row.limit  # the roofline's


def test_what_was_found_is_kept(tmp_path):
    file = tmp_path / "speed.json"
    assert findings.read(file) == {}
    found = {"one_train": case({"rtf": 0.3}, rounds={"paper": {"rtf": [0.3, 0.2], "others_cores": [0.0, 0.0]}})}
    findings.write(file, found)
    assert findings.read(file) == found
    assert json.loads(file.read_text())["rows"][0]["met"] is True
    content = json.loads(file.read_text()) | {"format_version": 0}
    file.write_text(json.dumps(content))
    assert findings.read(file) == {}


def test_power_laws_are_found():
    x = [1.0, 2.0, 5.0, 10.0]
    assert exponent(x, 3.0 * np.array(x) ** 1.7) == pytest.approx(1.7, rel=1e-12)  # rounding


def test_axes_change_what_they_say():
    pitch = 5.67
    for slabs in AXES["slabs"].x:
        given = AXES["slabs"].change(slabs)
        assert int(given["length"] / pitch) + 2 == slabs  # Ingredients.slots
        assert given["modes"] == 60
    assert AXES["window"].change(36.0) == {"length": 36.0, "modes": 60}
    assert all(list(axis.x) == sorted(axis.x) for axis in AXES.values())


def test_quick_is_less_than_whole():
    quick, whole, far = effort(True, False), effort(False, False), effort(False, True)
    assert quick.rounds < whole.rounds
    assert max(quick.lengths_km) < max(whole.lengths_km) < max(far.lengths_km) == 100.0


def test_medians():
    assert median_of([{"x": 3.0}, {"x": 1.0}, {"x": 2.0}], "x") == 2.0


def test_the_full_length_stepper_has_the_stages_that_are_timed():
    from validation.msm.step import FullStepper

    # two are bound when the stepper is made
    assert set(STAGES) - {"_forces", "_contact"} <= set(vars(FullStepper))


def test_page_and_figure_of_a_single_case(tmp_path):
    found = {
        "one_train": case(
            {"rtf": 0.3, "rtf_default": 1.0, "us_per_step": 60.0},
            rounds={"paper": {"rtf": [0.3], "others_cores": [0.5]}},
        )
    }
    drawn = draw(found, tmp_path)
    assert drawn == ["speed_factors.png"]
    assert (tmp_path / drawn[0]).stat().st_size > 10_000
    text = page(findings.rows(found), found, drawn)
    assert "1 of 1 targets met" in text
    assert "a processor" in text
    assert "| the paper's case, one train | 1 | 0.300 | 0.300 | 0.300 | 0.5 |" in text
    assert "{" not in text
