"""Validation table: verdicts, and outcomes that are kept from run to run."""

from dataclasses import replace

import pytest

from validation.frame.case import Case, evaluate
from validation.frame.table import headlines, keep, markdown

CASE = Case(
    name="half",
    kind="verification",
    quantity="a half",
    source="arithmetic",
    reference=0.5,
    rtol=0.01,
    why="one per cent",
    compute=lambda: 0.501,
)


@pytest.mark.parametrize(
    ("ours", "rule", "verdict"),
    [(0.504, "within", "ok"), (0.506, "within", "MISS"), (0.3, "at most", "ok"), (0.6, "at most", "MISS"),
     (0.3, "at least", "MISS"), (float("nan"), "at most", "MISS")],
)  # fmt: skip
def test_verdicts(ours, rule, verdict):
    case = replace(CASE, compute=lambda: ours, rule=rule, rtol=0.01 if rule == "within" else 0.0)
    assert evaluate(case).verdict == verdict


def test_an_engine_that_refuses_is_a_miss_that_says_why():
    def refuse():
        raise ValueError("no such thing")

    outcome = evaluate(replace(CASE, compute=refuse))
    assert (outcome.verdict, outcome.ours) == ("MISS", "no such thing")


def test_outcomes_are_kept_until_their_case_is_gone(tmp_path):
    file = tmp_path / "outcomes.json"
    other = replace(CASE, name="other", compute=lambda: 0.6)
    first = keep([evaluate(CASE)], file, [CASE, other])
    assert [o.verdict for o in first] == ["ok", "not run"]
    assert "1 of 1 cases met; 1 not run since" in markdown(first)
    assert "other" not in headlines(first, ["other"])
    both = keep([evaluate(other)], file, [CASE, other])
    assert [o.verdict for o in both] == ["ok", "MISS"]
    assert "1 of 2 cases met; missed: other." in markdown(both)
    assert "a half" in headlines(both, ["half"])
    assert [o.case.name for o in keep([], file, [other])] == ["other"]
