"""The contact search against CONTACT, Manchester benchmark, row by row; see ``validation/manchester.py``."""

from __future__ import annotations

import numpy as np
import pytest

from validation.cases.manchester import RAIL, REFERENCE, approach, located, radius

ROWS = range(21)
AT_JUMP = (10,)  # 5.0 mm: just past the jump from tread to flange root, one patch covers both


def test_the_reference_has_all_rows() -> None:
    """Shifts 0 to 10 mm in steps of 0.5 mm, one patch each."""
    np.testing.assert_allclose(REFERENCE["y_ws"], np.arange(21) * 0.5)


@pytest.mark.parametrize("row", [row for row in ROWS if row not in AT_JUMP])
def test_contact_position(row: int) -> None:
    """CONTACT's station by its own definition, to 10 um: its grid is 0.2 mm and its splines are its own."""
    assert located(row)[1] * 1e3 == pytest.approx(REFERENCE["ycp_w"][row], abs=0.010)


@pytest.mark.parametrize("row", AT_JUMP)
def test_contact_position_at_the_jump(row: int) -> None:
    """Where two regions 10 mm apart share a patch the weights are what they are: 0.5 % of that distance."""
    assert located(row)[1] * 1e3 == pytest.approx(REFERENCE["ycp_w"][row], abs=0.05)


@pytest.mark.parametrize("row", range(13, 21))
def test_flank_contact(row: int) -> None:
    """On the flange the definitions meet: station to 5 um, angle to 0.3 mrad (5 um on R13 to R20)."""
    s, _weighted, gamma, _ahead = located(row)
    assert s * 1e3 == pytest.approx(REFERENCE["ycp_w"][row], abs=0.005)
    assert gamma == pytest.approx(-REFERENCE["deltcp"][row], abs=3e-4)


@pytest.mark.parametrize("row", range(3, 10))
def test_tread_contact(row: int) -> None:
    """Point of least gap on the tread: within 0.1 mm and 1.2 mrad of its weighted centre (patch: 10 mm).

    Rows 0 to 2 (shifts 0 to 1 mm, close to the jump at 0.2 mm, patches 15 mm wide) differ by 1.4, 2.5 and 0.3
    mm and rows 10 to 12 (flange root, R14 in R13) by 0.5, 0.02 and 0.05 mm: the definitions differ, see the
    weighted test.
    """
    s, _weighted, gamma, _ahead = located(row)
    assert s * 1e3 == pytest.approx(REFERENCE["ycp_w"][row], abs=0.1)
    assert gamma == pytest.approx(-REFERENCE["deltcp"][row], abs=1.2e-3)


@pytest.mark.parametrize("row", [row for row in ROWS if row not in (0, 1, *AT_JUMP)])
def test_rolling_radius(row: int) -> None:
    """CONTACT's height on the wheel lies on the rail's surface, ahead of the axle: r - x^2/2r - depth.

    12 um: the depth it takes at its own, weighted point; less by the definitions of the point.
    """
    assert radius(row) * 1e3 == pytest.approx(REFERENCE["zcp_w"][row], abs=0.012)


@pytest.mark.parametrize(
    ("row", "span", "rtol"),
    [(row, 0.5e-3, 0.005) for row in range(3, 10)]  # tread: three or four printed digits
    + [(row, 0.5e-3, 0.013) for row in range(13, 21)]  # flank: CONTACT's patch bends around R13
    + [(row, 4e-3, 0.07) for row in (*range(2, 10), *range(11, 21))],  # 10 kN: patches shorter than the span
)
def test_approach(row: int, span: float, rtol: float) -> None:
    """Hertz's approach under CONTACT's normal force against CONTACT's, for point and for patch curvature.

    Left out: rows 0, 1 (9 and 30 %) and 10 (11 %), where the gap has two minima within the patch; with point
    curvature also 2, 11 and 12 (up to 3 %), where curvature changes within it.
    """
    assert approach(row, span) * 1e3 == pytest.approx(REFERENCE["approach_mm"][row], rel=rtol)


def test_reference_point_of_a_canted_profile() -> None:
    """The benchmark's rail has y = 0 near its top; its crown is R sin(atan 1/40) inside it."""
    assert float(RAIL.canted(0.025).y[0] - RAIL.y[0]) == pytest.approx(0.3 * np.sin(np.arctan(0.025)), abs=2e-5)
