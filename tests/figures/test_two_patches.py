"""Figures of two patches a wheel: both on the profiles, at the places and shares that the file or the search give."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.contact.profile import load_profile
from tiengine.contact.table import ContactSettings
from tiengine.figures import contact
from tiengine.report.contact_report import contact_report, draw

from .. import hand_made as by


def test_both_patches_are_counted_where_they_carry(tmp_path) -> None:
    """Right wheels all the time at 5.1 mm, half of it at -25.1 mm besides; a thousandth of the load is no patch."""
    position = np.zeros((400, 4, 2, 2))
    position[..., 0], position[..., 1] = 5.1e-3, -25.1e-3
    share = np.zeros((400, 4, 2, 2))
    share[..., 0], share[..., 1] = 0.999, 0.001
    share[:200, :, 1] = 0.7, 0.3
    patch = {"share": share, "contact_position_wheel": position, "contact_position_rail": position}
    N = np.full((400, 4, 2), 70e3)
    groups = {"wheel": by.wheel(N, 0.0 * N), "patch": {**by.clock(400, 2e-4), **patch}}
    with by.made(tmp_path / "a.h5", by.scenario(contact__patches=2), groups) as result:
        figure = contact.draw(result)
    left, left_second, right, right_second = (p.get_data() for p in figure.axes[0].patches)
    edges = left.edges
    tread, root = (int(np.searchsorted(edges, 1e3 * place)) - 1 for place in (5.1e-3, -25.1e-3))
    assert left.values[tread] == pytest.approx(100.0)
    assert left_second.values.sum() == 0.0
    assert right.values[tread] == pytest.approx(100.0 * 2 / 3)
    assert right.values[root] == right_second.values[root] == pytest.approx(100.0 / 3)


def test_report_names_the_second_patch(tmp_path) -> None:
    """S1002 on 60E1 touches tread and root at once near 5 mm, 10 mm apart (CONTACT's case); LMA on CHN60 nowhere."""
    s1002 = ContactSettings(half_spacing=0.75, gauge_depth=0.014, wheel_radius=0.46)
    two = contact_report(load_profile("S1002", "wheel"), load_profile("60E1", "rail"), s1002)
    (words,) = [value for name, value in two.rows() if name == "second patch"]
    assert words.startswith("right wheel, y = 4.")
    at = int(np.argmin(np.where(np.isnan(two.second_depth), 1.0, two.second_depth)))
    assert two.shift[at] == pytest.approx(5.0e-3, abs=0.2e-3)
    assert abs(two.second_wheel_station[at] - two.wheel_station[at]) == pytest.approx(10e-3, abs=1e-3)
    draw(two, tmp_path / "a.svg")
    assert b"<!-- second patch -->" in (tmp_path / "a.svg").read_bytes()
    one = contact_report(load_profile("LMA", "wheel"), load_profile("CHN60", "rail"), ContactSettings())
    assert not [name for name, _ in one.rows() if name == "second patch"]
    assert '"second_depth"' in one.to_json()
