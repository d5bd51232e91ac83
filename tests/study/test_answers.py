"""Answers of studies against functions and laws whose answers are known."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tiengine import result as results
from tiengine.parameters.errors import InputError
from tiengine.study.bands import draw_study_bands
from tiengine.study.convergence import course
from tiengine.study.extreme_values import fit_extremes
from tiengine.study.merge import merge
from tiengine.study.page import render
from tiengine.study.percentiles import percentiles
from tiengine.study.sensitivity import swings
from tiengine.study.study import Study, study

from .short import PLAN

A, B = 7.0, 0.1  # of Ishigami's function


def ishigami(x: Mapping[str, Any]) -> dict[str, float]:
    """Ishigami and Homma's function (1990)."""
    return {"y": math.sin(x["x1"]) + A * math.sin(x["x2"]) ** 2 + B * x["x3"] ** 4 * math.sin(x["x1"])}


def of_ishigami(method: str, size: int) -> dict[str, Any]:
    """Plan over its three factors."""
    factors = [{"key": f"x{i}", "range": [-math.pi, math.pi]} for i in (1, 2, 3)]
    return {"factors": factors, "sample": {"method": method, "size": size}}


@pytest.fixture(scope="module")
def ishigamis(tmp_path_factory) -> Study:
    """Ishigami's function in place of the engine, over the design for Sobol' indices."""
    return study(of_ishigami("saltelli", 512), tmp_path_factory.mktemp("ishigami") / "s", evaluate=ishigami)


def test_sobol_indices_of_ishigamis_function(ishigamis):
    """Closed form: first order 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437. Within the estimated intervals."""
    pytest.importorskip("SALib")
    found = ishigamis.sobol("y")
    for index, first, total in zip(found, (0.3139, 0.4424, 0.0), (0.5576, 0.4424, 0.2437), strict=True):
        assert abs(index.first - first) < max(index.first_error, 0.005), index
        assert abs(index.total - total) < max(index.total_error, 0.005), index
        assert index.first_error < 0.1
    rough = ishigamis.sobol("y", blocks=64)  # convergence: fewer blocks have wider intervals
    assert all(a.total_error > b.total_error for a, b in zip(rough, found, strict=True))


def test_indices_need_their_design(tmp_path):
    with pytest.raises(InputError, match=r"need sample\.method = 'saltelli'"):
        study(of_ishigami("sobol", 8), tmp_path / "s", evaluate=ishigami).sobol("y")


def test_swings_of_ishigamis_function(tmp_path):
    """The conditional mean over x2 is 7 sin² x2 and over x1 sin x1 (1 + 0.1 π⁴ / 5): in fifths, x1 moves most."""
    table = study(of_ishigami("sobol", 1024), tmp_path / "s", evaluate=ishigami).table()
    found = {each.factor: each for each in swings(table, "y")}
    edges = np.linspace(-math.pi, math.pi, 6)
    x1 = -np.diff(np.cos(edges)) / np.diff(edges) * (1.0 + B * math.pi**4 / 5.0) + A / 2.0
    assert found["x1"].low == pytest.approx(x1.min(), abs=0.1)  # 1 % of the swing of 9
    assert found["x1"].high == pytest.approx(x1.max(), abs=0.1)
    assert found["x1"].correlation > 0.3
    assert abs(found["x2"].correlation) < 0.1
    assert next(iter(found)) == "x1"


def test_quantiles_of_a_gumbel_sample_lie_within_their_intervals():
    """60 samples of 100 blocks: the exact level of 1 in 1000 lies within 57 intervals, less five deviations."""
    law = stats.gumbel_r(100.0, 8.0)
    exact = law.ppf(1.0 - 1e-3)
    generator = np.random.default_rng(3)
    inside = 0
    for _ in range(60):
        level = fit_extremes(law.rvs(100, random_state=generator), "gumbel", resamples=60).levels([1000.0])[0]
        inside += level.low <= exact <= level.high
    assert inside >= 48  # 57 - 5 sqrt(60 · 0.95 · 0.05)


@pytest.mark.parametrize("shape", [-0.3, 0.0, 0.3])
def test_the_law_is_found(shape):
    """From 1000 blocks: shape within four standard errors (about 0.025), and Gumbel's law where it holds."""
    values = stats.genextreme(-shape, 100.0, 8.0).rvs(1000, random_state=np.random.default_rng(1))
    found = fit_extremes(values, resamples=20)
    assert found.law == ("gumbel" if shape == 0.0 else "gev")
    assert found.shape == pytest.approx(shape, abs=0.1)
    assert found.levels([100.0])[0].value == pytest.approx(stats.genextreme(-shape, 100.0, 8.0).ppf(0.99), rel=0.05)
    mirrored = fit_extremes(-values, found.law, smallest=True, resamples=20).levels([100.0])[0].value
    assert mirrored == pytest.approx(-found.levels([100.0])[0].value)


def test_percentiles_and_their_intervals():
    """Of a normal sample: the exact 90 % lies within; the interval is that of theory within a third."""
    values = np.random.default_rng(5).standard_normal(1000)
    found = percentiles(values, [90.0, 99.99])
    exact = stats.norm.ppf(0.9)
    assert found[0].low < exact < found[0].high
    theory = 2 * 1.96 * math.sqrt(0.9 * 0.1 / 1000) / stats.norm.pdf(exact)
    assert found[0].high - found[0].low == pytest.approx(theory, rel=0.33)
    assert (found[0].reached, found[1].reached) == (True, False)
    narrowing = course(values, 50.0)
    width = narrowing.high - narrowing.low
    assert width[-1] < 0.3 * width[0]
    assert list(narrowing.counts[:2]) == [8, 16]


@pytest.fixture(scope="module")
def trains(tmp_path_factory) -> Study:
    """Six trains and one that derails."""
    constraints = ["speed < 310 or scale > 0.7"]
    factors = [PLAN["factors"][0], {**PLAN["factors"][1], "values": [0.5, 1.0, 100.0]}]
    constraints.append("scale < 50 or speed > 310")
    plan = {**PLAN, "factors": factors, "constraints": constraints}
    return study(plan, tmp_path_factory.mktemp("trains") / "s", workers=1)


def test_table(trains, tmp_path):
    """One row a train with factors, figures and the reason of a failure, as CSV and Parquet."""
    table = trains.table()
    assert table.factors == ("speed", "scale")
    assert table.complete.sum() == 6
    table.write(tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["speed"], row["scale"], row["seed"]) for row in rows[:2]] == [
        ("300.0", "0.5", "1"),
        ("300.0", "0.5", "2"),
    ]
    assert "t = " in rows[-1]["status"]
    with results.open(trains.folder.part(0)) as part:
        largest = 1e-3 * part.wheel(1)["vertical_force"].max()
    assert float(rows[1]["largest_vertical_wheel_force_Q_kN"]) == pytest.approx(largest, rel=0.1)  # before the filter
    parquet = pytest.importorskip("pyarrow.parquet")
    table.write(tmp_path / "t.parquet")
    read = parquet.read_table(tmp_path / "t.parquet")
    assert read.num_rows == len(rows)
    assert read["train"].to_pylist() == list(range(8))
    with pytest.raises(InputError, match="did you mean 'largest_vertical_wheel_force_Q_kN'"):
        table.values("largest_vertical_wheel_force_Q_N")


def test_merged_parts_are_a_result(trains, tmp_path):
    """One file with every train in its place, whose scenario gives each its own."""
    assert merge(trains.folder, tmp_path / "all.h5") == 8
    with results.open(tmp_path / "all.h5") as merged:
        assert (merged.trains, len(merged.failures)) == (8, 2)
        assert merged.scenario_of(4).train.speed_kmh == 320.0
        assert merged.scenario_of(1).irregularity.scale == 0.5
        assert merged.scenario_of(1).irregularity.seed == 2
        with results.open(trains.folder.part(0)) as part:
            assert (merged.wheel(1)["normal_force"] == part.wheel(1)["normal_force"]).all()
    with pytest.raises(InputError, match="exists already"):
        merge(trains.folder, tmp_path / "all.h5")


def test_page(trains, ishigamis):
    """Percentiles, law, influences, convergence, bands and failures; nothing from elsewhere."""
    page = render(trains.folder)
    for text in (
        "largest vertical wheel force Q [kN]",
        "rank correlation",
        "factor speed",
        "Along the track",
        "2 trains did",
    ):
        assert text in page
    assert page.count("<img") == 3 * 4 + 1  # three figures in full, each with its four pictures, and the bands
    assert "http" not in page.replace("http://www.w3.org", "")
    draw_study_bands(trains.folder)
    pytest.importorskip("SALib")
    assert "first-order index" in render(ishigamis.folder)


def test_a_study_of_a_function_needs_it(tmp_path):
    with pytest.raises(InputError, match="scenario: missing"):
        study(of_ishigami("sobol", 8), tmp_path / "s")
    with pytest.raises(InputError, match="must be left out where a function"):
        study({"scenario": "default"}, tmp_path / "s", evaluate=ishigami)
    assert not Path(tmp_path / "s").exists()
