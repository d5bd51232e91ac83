"""Progress as a line, and tables that notebooks ask for."""

from __future__ import annotations

import re

from tiengine.report.live_progress import LiveProgress
from tiengine.scenario.scenario import load_scenario

from .. import hand_made as by


def test_progress_is_a_line_outside_notebooks(capsys):
    """How far, how long, how long to go."""
    with LiveProgress("trains") as progress:
        progress(1.0, 4.0)
        progress(4.0, 4.0)
    lines = capsys.readouterr().err.split("\r")
    assert re.match(r"trains 1 of 4, \d+ s, \d+ s left", lines[1])
    assert re.match(r"trains 4 of 4, \d+ s +\n$", lines[-1])


def test_a_scenario_as_a_table():
    """What it states itself, with marks of HTML escaped."""
    text = load_scenario("default", {"name": "a < b", "track.friction": 0.25})._repr_html_()
    assert "a &lt; b" in text
    assert "<th style='text-align:left'>track.friction</th><td style='text-align:left'>0.25</td>" in text


def test_a_result_as_a_table_and_its_figures(tmp_path):
    """Status of the run; a figure is a picture that a notebook shows."""
    Q = 70e3 + by.np.zeros((3000, 4, 2))
    with by.made(tmp_path / "run.h5", by.scenario(), {"wheel": by.wheel(Q, 0.01 * Q, normal_force=Q)}) as result:
        assert "complete" in result._repr_html_()
        assert result.plot("forces")._repr_png_().startswith(b"\x89PNG")
