"""The summary of a run on the screen."""

from __future__ import annotations

import pytest

from tiengine.result_files.summary import SUMMARY, summary

ATTRIBUTES = {"trains": 1, "simulated_time": 12.0, "real_time_factor": 0.5, "wall_time_loop": 6.0}


def test_one_train() -> None:
    """Wall time of the loop over simulated time."""
    shown = dict(summary(ATTRIBUTES))
    assert shown["simulated time"] == "12.000 s"
    assert shown["real-time factor (wall over simulated time)"] == "0.50"


@pytest.mark.parametrize("trains", [2, 1000])
def test_an_ensemble_states_that_the_factor_is_per_train(trains: int) -> None:
    """Four trains of 3 s in 6 s of wall time are 0.5 per train; the ensemble itself takes twice as long as a train."""
    shown = dict(summary(ATTRIBUTES | {"trains": trains}))
    assert shown["simulated time, sum of all trains"] == "12.000 s"
    assert shown["real-time factor per train (wall time over the sum of simulated times)"] == "0.50"


@pytest.mark.parametrize("odd", ["x", None, [1, 2]])
def test_manipulated_attributes_are_shown_as_they_are(odd: object) -> None:
    for key in SUMMARY:
        assert str(odd) in [text for _, text in summary(ATTRIBUTES | {key: odd})]
