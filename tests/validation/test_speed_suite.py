"""Data and verdicts of the speed suite, without measuring any speed."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tiengine.kernels import spline_layout as at
from tiengine.model.from_scenario import ingredients
from tiengine.scenario.scenario import load_scenario
from validation.speed import figures, findings
from validation.speed.__main__ import CASES as MEASURED
from validation.speed.accuracy import Error, difference, enough
from validation.speed.bench import Bench
from validation.speed.effort import effort
from validation.speed.features import FEATURES, PLAIN, features
from validation.speed.figures import draw
from validation.speed.full_length import STAGES
from validation.speed.page import page
from validation.speed.roofline import LAUNCH_STEPS, stage_times
from validation.speed.runs import CASES, RUNS, Run, median_of, settings_of
from validation.speed.scaling import AXES, exponent
from validation.speed.spline_work import STAGES as STAGES_OF_STEP
from validation.speed.spline_work import Sizes, counts, sizes_of

SEEN = {
    "date": "now", "effort": "quick", "load_average": 0.5, "others_cores": 0.0, "commit": "abc",
    "machine": {"cpu": "a processor", "cores": 2, "memory_bytes": 2**34, "blas": "a library"},
    "versions": {"python": "3"},
}  # fmt: skip


def case(values, **data):
    return {"circumstances": SEEN, "values": values, "data": data}


@pytest.mark.parametrize("name", RUNS)
def test_runs_are_scenarios_with_default_numerics(name):
    run = RUNS[name]
    scenario = load_scenario(run.scenario, settings_of(run, 100.0))
    if run.modes_per_metre is None:
        assert scenario.numerics == load_scenario(run.scenario).numerics
    assert scenario.train.distance == 100.0
    assert len(scenario.members) == {"batch": 64, "batch_one_worker": 64, "batch8": 16}.get(name, 1)
    if name != "kilometres":
        assert scenario.output == load_scenario(run.scenario).output


def test_a_run_with_an_unknown_key_is_refused():
    with pytest.raises(TypeError, match="wrkers"):
        Run(words="", scenario="paper", distance=1.0, wrkers=2)


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
    assert row["limit"] or "target" not in row
    assert set(row) <= {"key", "quantity", "unit", "target", "rule", "limit"}


@pytest.mark.parametrize(
    ("key", "measured", "met"),
    [("one_car.rtf_default", 0.35, True), ("one_car.rtf_default", 0.36, False),
     ("one_car.rtf_default", float("nan"), False), ("full_length.ratio_one", 25.0, True),
     ("full_length.ratio_one", 24.9, False), ("one_car.peak_memory_mb", 9.0, None)],
)  # fmt: skip
def test_verdicts(key, measured, met):
    name, _, short = key.partition(".")
    (row,) = findings.rows({name: case({short: measured})})
    assert row.met is met


def test_a_limit_shows_measured_numbers_and_says_what_is_missing():
    (row,) = findings.rows({"one_car": case({"rtf_default": 0.5, "us_default": 100.4})})
    assert row.limit.startswith("100 µs per step")
    assert findings.MISSING in row.limit  # the roofline's


def test_what_was_found_is_kept(tmp_path):
    file = tmp_path / "speed.json"
    assert findings.read(file) == {}
    rounds = {"default": {"rtf": [0.3, 0.2], "others_cores": [0.0, 0.0]}}
    found = {"one_car": case({"rtf_default": 0.3}, rounds=rounds)}
    findings.write(file, found)
    assert findings.read(file) == found
    assert json.loads(file.read_text())["rows"][0]["met"] is True
    content = json.loads(file.read_text()) | {"format_version": 0}
    file.write_text(json.dumps(content))
    assert findings.read(file) == {}


def test_power_laws_are_found():
    x = [1.0, 2.0, 5.0, 10.0]
    assert exponent(x, 3.0 * np.array(x) ** 1.7) == pytest.approx(1.7, rel=1e-12)  # rounding


@pytest.mark.parametrize("name", AXES)
def test_axes_are_scenarios_and_change_what_they_say(name):
    """Functions per metre and slab coordinates rise with the points, cars and trains are the points."""
    axis, found = AXES[name], []
    for point in axis.points[:2]:
        scenario = load_scenario("default", {"train.distance": 100.0} | axis.settings(point))
        given = ingredients(scenario, 2e-4)
        found.append(
            {
                "cars": len(scenario.train.vehicles),
                "trains": point,
                "knots": given.functions.count / given.length,
                "mesh": given.designs.matrices[0].n,
            }[name]
        )
    assert found[0] < found[1]
    if axis.x is None:
        assert tuple(found) == axis.points[:2]


def test_a_stage_is_counted_from_sizes():
    """One function and lane of a rail in two passes, and a slab whose band is its diagonal."""
    one = Sizes(
        chunks=1, lanes=1, functions=1, seats=0, touched=0, groups=1, slab_dofs=1, half_width=0, slab_seats=0,
        slab_touched=0, cars=1, car_dofs=3, car_numbers=8, elements=0, rows=0, wheelsets=0, passes=2,
    )  # fmt: skip
    found = counts(one)
    couplings = 6 + 7 + 9 + 10 + 11  # fields before w, theta_y, v, theta_z, theta_x in a band of 7 and 11
    assert found["rails, forward"].flops == 2 * (2 * couplings + 3) + 2 * 7 * (9 + 5) + 2 * 7 * 5
    assert found["slabs"].flops == 8 * (9 + 4 + 2 * (2 + 9))
    assert found["cars"].flops == 2 * 4 * 3 * 8 + 8 * (6 + 8)
    assert set(found) == set(STAGES_OF_STEP)
    twice = counts(replace(one, chunks=2, groups=2, cars=2))
    for name, count in found.items():
        assert (twice[name].flops, twice[name].traffic) == (2 * count.flops, 2 * count.traffic)


def test_stages_of_the_report_are_all_of_the_kernel():
    """The predictors of a launch's first step apart, no bit is left out or done twice."""
    assert sum(STAGES_OF_STEP.values()) == at.ALL_STAGES - at.PREDICT_STAGE


def test_stages_are_timed_and_sizes_taken_without_a_trace():
    """Sizes as the default's model has them, for one train: two lanes, one group of eight slots."""
    scenario = load_scenario("default", {"train.distance": 100.0})
    bench, twin = (Bench.of(scenario, 1, 2) for _ in range(2))
    stepper = bench.run.stepper
    sizes, given = sizes_of(stepper), stepper.ingredients
    assert (sizes.lanes, sizes.chunks, sizes.groups) == (2, 1, -(-given.slots // 8))
    assert (sizes.functions, sizes.slab_dofs) == (given.functions.count, given.designs.matrices[0].n)
    assert 4 <= sizes.touched / sizes.seats <= at.TOUCHED
    launch_us, times = stage_times(bench, STAGES_OF_STEP)
    assert launch_us > 0.0
    assert set(times) == set(STAGES_OF_STEP)
    for each in (bench, twin):
        each.block_us(40 if each is bench else 40 + LAUNCH_STEPS)
    for name, array in stepper.state.arrays().items():
        np.testing.assert_array_equal(array, twin.run.stepper.state.arrays()[name], err_msg=name)


def test_the_cheapest_numerics_that_are_as_accurate_are_taken():
    errors = {(6.5, 1e-4): Error(0.5, 0.3), (10.0, 2e-4): Error(0.2, 0.1), (2.0, 2e-4): Error(3.0, 2.0)}
    assert enough(Error(0.4, 0.3), errors) == (10.0, 2e-4)  # 50 000 sines per metre and second, against 65 000
    assert enough(Error(0.4, 0.05), errors) is None


def test_errors_are_over_the_peak_and_after_the_run_in():
    time = np.arange(4) * 2e-4
    position = np.array([0.0, 30.0, 50.0, 60.0])
    normal = np.ones((4, 4, 2)) * np.array([9.0, 9.0, 2.0, 1.0])[:, None, None]
    reference = SimpleNamespace(time=time, position=position, normal=normal)
    run = SimpleNamespace(time=time, position=position, normal=normal + np.array([5.0, 5.0, 0.1, 0.0])[:, None, None])
    assert difference(run, reference).largest == pytest.approx(5.0)  # 0.1 of 2


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
        "trains": case(
            {"rtf_train8": 2.0, "rtf_train16": 4.4, "ratio_train16": 2.2, "us_train8": 400.0, "us_train16": 880.0},
            rounds={"train8": {"rtf": [2.0], "others_cores": [0.5]}},
        )
    }
    drawn = draw(found, tmp_path)
    assert drawn == ["speed_factors.png"]
    assert (tmp_path / drawn[0]).stat().st_size > 10_000
    text = page(findings.rows(found), found, drawn)
    assert "1 of 2 targets met" in text
    assert "a processor" in text
    assert "| eight cars | 1 | 2.000 | 2.000 | 2.000 | 0.5 |" in text
    assert "880 and 400 µs per step" in text  # the limit of the row that is missed
    assert "{" not in text


def test_page_and_figures_of_stages_scaling_and_accuracy(tmp_path):
    stage = {"name": "slabs", "us": 10.0, "flops": 2e4, "traffic": 8e3, "floor_us": 1.0}
    roofs = {"dgemm_gflops": 50.0, "triad_l2_gb_per_s": 40.0, "triad_dram_gb_per_s": 10.0}
    group = {"words": "one car", "trains": 1, "lanes": 2, "step_us": 70.0, "launch_us": 15.0, "steps_a_launch": 5.0,
             "stages": [stage], "roofs": roofs}  # fmt: skip
    axis = {"words": "cars", "unit": "step", "x": [1.0, 2.0], "us": [70.0, 130.0], "exponent": 0.9,
            "exponent_upper": 0.9}  # fmt: skip
    error = {"largest": 0.4, "p99": 0.2}
    found = {
        "roofline": case({}, **dict.fromkeys(("one", "many", "eight"), group)),
        "scaling": case({}, **dict.fromkeys(AXES, axis)),
        "full_length": case(
            {}, profile={"us_per_step": 3.0, "stages_us_per_step": {"slabs": 3.0}},
            accuracy={"default": error, "numerics": [[6.5, 1e-4]], "full_length": [error]},
        ),
    }  # fmt: skip
    drawn = draw(found, tmp_path)
    assert drawn == ["speed_scaling.png", "speed_roofline.png"]
    text = page([], found, drawn)
    assert "| 1 x one car | slabs | 10.0 | 20.0 | 8.0 | 2.0 | 10% |" in text  # 2e4 flop in 10 us
    assert "| cars | 1: 70, 2: 130 | 0.90 | 0.90 |" in text
    assert "| full length, 6.5 sines per metre, 100 µs | 0.40 | 0.20 |" in text


def test_the_eight_car_train_comes_first_in_the_figure():
    found = {"trains": case({"rtf_train8": 2.0, "rtf_train16": 4.4})}
    assert [bar[2] for bar in figures._bars(found)][:2] == [2.0, 4.4]


def test_features_are_compared_within_each_round():
    """A machine half as fast in the second round changes the cost of a step, not by how much more a feature takes."""
    pace = (1.0, 2.0, 1.0)
    rounds = {
        name: [
            {"real_time_factor": (0.5 + (0.0 if name == PLAIN else 0.1)) * p, "time_step": 2e-4, "others_cores": 0.0}
            for p in pace
        ]
        for name in FEATURES
    }
    rows = features(rounds).data["features"]
    assert FEATURES[0] == PLAIN
    assert [round(row["us"], 6) for row in rows[:2]] == [100.0, 120.0]
    assert [round(row["added"], 6) for row in rows[:2]] == [0.0, 20.0]
