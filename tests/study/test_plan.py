"""Plans: expansion of factors, points that are drawn, constraints, and the one line of every bad plan."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tiengine.parameters.errors import InputError
from tiengine.scenario.scenario import load_scenario
from tiengine.study.constraints import Constraint
from tiengine.study.design import Design, expand
from tiengine.study.plan import load_plan
from tiengine.study.points import points_of
from tiengine.study.sampling import drawn_values, unit_points

SPEED = {"key": "train.speed_kmh", "name": "speed", "values": [300.0, 350.0]}
FRICTION = {"key": "track.friction", "range": [0.1, 0.5]}
DRAWN = {"method": "latin_hypercube", "size": 8}


def points(folder: Path = Path(), **plan: Any) -> list[Any]:
    """Points of a plan."""
    return points_of(load_plan({"scenario": "default", **plan})[0], folder)


def design(together: int = 16, folder: Path = Path(), **plan: Any) -> Design:
    """Study of a plan."""
    return expand(load_plan({"scenario": "default", **plan})[0], folder, together)


def test_grids_are_crossed_and_lists_advance_together():
    """Two speeds times three rows of two factors in step, the last design fastest."""
    rows = [
        {"key": "track.friction", "values": [0.2, 0.3, 0.4], "together": "wear"},
        {"key": "track.rail_profile", "values": ["CHN60", "60E1", "60E2"], "together": "wear"},
    ]
    found = [point.factors for point in points(factors=[SPEED, *rows])]
    assert len(found) == 6
    assert found[1] == {"speed": 300.0, "friction": 0.3, "rail_profile": "60E1"}
    assert [each["speed"] for each in found] == [300.0] * 3 + [350.0] * 3


def test_a_table_gives_rows(tmp_path):
    """Keys in the first row; names stay names, numbers become numbers, files beside the plan are found."""
    (tmp_path / "worn.csv").write_text("", encoding="utf-8")
    text = "track.friction, track.rail_profile\n0.2, 60E1\n0.3, worn.csv\n"
    (tmp_path / "rows.csv").write_text(text, encoding="utf-8")
    found = points(tmp_path, table={"file": "rows.csv"})
    assert [point.changes["track.friction"] for point in found] == [0.2, 0.3]
    assert found[0].changes["track.rail_profile"] == "60E1"
    assert found[1].changes["track.rail_profile"] == str((tmp_path / "worn.csv").resolve())


def test_any_key_may_vary_with_labels_in_tables():
    """Lists of defects stand as numbers in tables."""
    failed = [[], [{"seats": [60, 60]}], [{"seats": [60, 61]}]]
    factor = {"key": "track.failed_fastenings", "name": "failed", "values": failed, "labels": [0, 1, 2]}
    made = design(factors=[factor], set={"train.distance": 20.0})
    assert [made.values(i) for i in range(3)] == [{"failed": 0}, {"failed": 1}, {"failed": 2}]
    assert made.scenario(2).track.failed_fastenings[0].seats == (60, 61)


@pytest.mark.parametrize("method", ["latin_hypercube", "sobol", "halton", "random"])
def test_marginals(method):
    """A Latin hypercube has one point in each of n slices of every factor; Sobol' points too, by pairs of bounds."""
    unit = unit_points(load_plan({"factors": [FRICTION], "sample": {"method": method, "size": 64}})[0].sample, 3)
    assert unit.shape == (64, 3)
    if method in ("latin_hypercube", "sobol"):
        for column in unit.T:
            assert sorted(np.floor(64 * column)) == list(range(64))
    else:  # a sample that were not uniform would be below 1e-3 at once
        assert all(stats.kstest(column, "uniform").pvalue > 1e-3 for column in unit.T)


def test_marginals_of_a_distribution():
    """Values through a log-normal distribution: their quantiles in n slices are uniform again."""
    factor = {"key": "track.friction", "distribution": "lognorm", "parameters": {"s": 0.2, "scale": 0.3}}
    plan = load_plan({"factors": [factor], "sample": {"size": 50}})[0]
    values = drawn_values(plan.factors[0], unit_points(plan.sample, 1)[:, 0])
    slices = np.floor(50 * stats.lognorm(0.2, scale=0.3).cdf(values))
    assert sorted(slices) == list(range(50))


def test_the_design_for_sobol_indices():
    """Blocks of factors + 2 rows: between the first and row i + 1 only factor i differs, and it is that of the last."""
    plan = load_plan({"factors": [FRICTION], "sample": {"method": "saltelli", "size": 4}})[0]
    blocks = unit_points(plan.sample, 3).reshape(4, 5, 3)
    for i in range(3):
        differs = blocks[:, i + 1] != blocks[:, 0]
        assert differs[:, i].all()
        assert not np.delete(differs, i, axis=1).any()
        np.testing.assert_array_equal(blocks[:, i + 1, i], blocks[:, -1, i])


def test_draws_repeat():
    """The same plan draws the same points; another seed others."""
    first, again = (points(factors=[FRICTION], sample=DRAWN) for _ in range(2))
    assert first == again
    assert first != points(factors=[FRICTION], sample={**DRAWN, "seed": 2})


def test_constraints_leave_points_out():
    """By names and by keys, with arithmetic."""
    speeds = {"key": "train.speed_kmh", "name": "speed", "values": [200.0, 300.0, 400.0]}
    frictions = {"key": "track.friction", "values": [0.2, 0.3, 0.4]}
    found = points(factors=[speeds, frictions], constraints=["speed * friction <= 90", "not (track.friction == 0.2)"])
    assert [tuple(p.factors.values()) for p in found] == [(200.0, 0.3), (200.0, 0.4), (300.0, 0.3)]


def test_seeds_are_nested_and_like_trains_run_together():
    """Two speeds with five seeds each: trains of a speed share tasks whose sizes differ by one at most."""
    made = design(together=3, factors=[SPEED], seeds=5)
    assert [(m.point, m.seed) for m in made.members] == [(p, s) for p in (0, 1) for s in (1, 2, 3, 4, 5)]
    assert [len(task) for task in made.tasks] == [3, 2, 3, 2]
    assert {made.members[i].point for i in made.tasks[0]} == {0}


def test_own_seeds():
    """Every point has tracks of its own."""
    made = design(factors=[SPEED], seeds=3, own_seeds=True)
    assert [member.seed for member in made.members] == [1, 2, 3, 4, 5, 6]


def test_trains_that_differ_in_their_irregularity_run_together():
    """The ensemble of a task has the very scenarios that its trains would have alone."""
    scale = {"key": "irregularity.scale", "values": [0.5, 1.0]}
    made = design(factors=[scale], seeds=2, set={"train.distance": 20.0})
    assert made.tasks == ((0, 1, 2, 3),)
    for member, train in zip(made.members, made.scenario(0).members, strict=True):
        changes = {"irregularity.scale": (0.5, 1.0)[member.point], "irregularity.seed": member.seed}
        alone = load_scenario("default", {"train.distance": 20.0, **changes})
        assert train.irregularity == alone.irregularity
        assert train.train == alone.train


def test_a_study_survives_its_file():
    """What study.json holds makes the same study again, tuples and presets included."""
    profiles = {"key": "track.rail_profile", "values": ["CHN60", "60E1"]}
    made = design(factors=[SPEED, profiles, FRICTION], sample=DRAWN, seeds=2)
    again = Design.from_tables(json.loads(json.dumps(made.tables())), "study.json")
    assert again.digest == made.digest
    assert again.scenario(5) == made.scenario(5)
    assert "60E1" not in made.scenario(0).presets["profiles"]


BAD: list[tuple[dict[str, Any], str]] = [
    ({"factors": [{"key": "train.speed_kmh"}]}, "must have values, range or distribution, has none"),
    ({"factors": [{**SPEED, "range": [1.0, 2.0]}]}, "has values and range"),
    ({"factors": [FRICTION]}, "'friction': has a range or a distribution; [sample] must say"),
    ({"factors": [SPEED, {**SPEED}]}, "two are called 'speed'"),
    ({"factors": [SPEED], "sample": DRAWN}, "no factor has a range"),
    ({"factors": [{**FRICTION, "range": [0.5, 0.1]}], "sample": DRAWN}, "the second bound must be the greater"),
    ({"factors": [FRICTION], "sample": {"method": "sobol", "size": 6}}, "must be a power of two"),
    ({"factors": [SPEED, FRICTION], "sample": {"method": "saltelli", "size": 4}}, "all factors must have a range"),
    ({"factors": [{"key": "track.friction", "distribution": "norml"}], "sample": DRAWN}, "did you mean 'norm'?"),
    (
        {"factors": [{"key": "track.friction", "distribution": "lognorm"}], "sample": DRAWN},
        "must be loc, scale and those of lognorm (s)",
    ),
    ({"factors": [{**SPEED, "key": "train.sped_kmh"}]}, "point 0 (speed = 300.0): train.sped_kmh: unknown key"),
    ({"factors": [{**SPEED, "values": [300.0, 2000.0]}]}, "point 1 (speed = 2000.0): train.speed_kmh"),
    ({"factors": [SPEED], "constraints": ["speeed < 3"]}, "'speeed' is no factor; did you mean 'speed'?"),
    ({"factors": [SPEED], "constraints": ["speed < 3"]}, "none of 2 points fulfils them"),
    ({"factors": [SPEED], "constraints": ["__import__('os').system('true') == 0"]}, "must be a comparison of factors"),
    ({"seeds": [1, 1]}, "two are equal"),
    ({"seeds": 2, "factors": [{"key": "irregularity.seed", "values": [1, 2]}]}, "must be left out where a factor"),
    ({"factor": []}, "factor: unknown key; did you mean 'factors'?"),
    ({"set": {"ensemble.size": 3}}, "a study states its trains by seeds and factors"),
    ({"table": {"file": "missing.csv"}}, "missing.csv: cannot be read"),
    (
        {"factors": [{**SPEED, "together": "a"}, {"key": "track.friction", "values": [0.1], "together": "a"}]},
        "must have the same number",
    ),
]


@pytest.mark.parametrize(("plan", "words"), BAD, ids=[words[:40] for _, words in BAD])
def test_a_bad_plan_is_refused_in_one_line(plan, words, tmp_path):
    with pytest.raises(InputError) as error:
        design(folder=tmp_path, **plan)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["a <", "a < 'x'", "1 / (a - a) > 0", "(" * 300 + "a"])
def test_expressions_that_cannot_be_evaluated(text):
    with pytest.raises(InputError, match="constraint"):
        Constraint(text, {"a": 1.0}).holds({"a": 1.0})
