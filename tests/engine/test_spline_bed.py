"""A bed that is explicit, or does not pull, on slabs that are swept by their bands."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.kernels import layout as at
from tiengine.kernels import spline_layout as sl

from ..models import V350, paper_model
from .spline_bed import make_bed
from .spline_reference import motion_of

DT = 1e-4


def test_an_explicit_bed_gives_the_same_motion() -> None:
    """Implicit or explicit, with passes enough to converge: the same step, but for the passes' own remainder."""
    motions = []
    for explicit in (False, True):
        bed = make_bed(paper_model(dt=DT, explicit_mortar=explicit), V350, passes=12)
        bed.start(2, 0.1)
        bed.step(0, 2)
        motions.append(motion_of(bed, 0))
        assert int(bed.model.dims[at.MORTAR_MODE]) == (2 if explicit else 0)
    a, b = (motion.slabs[0] for motion in motions)
    assert np.abs(a - b).max() < 1e-3 * np.abs(a).max()
    assert np.abs(a).max() > 0.0


def test_a_bed_without_tension_carries_no_less_than_nothing() -> None:
    """Slabs thrown up: the pressure stops at zero, and the bed's missing pull lets them rise further."""
    heights = []
    for no_tension in (False, True):
        given = paper_model(
            dt=DT, mortar=paper_model(dt=DT).ingredients.mortar.model_copy(update={"no_tension": no_tension})
        )
        bed = make_bed(given, V350)
        bed.start(2, 0.0)
        bed.state.slabs(sl.V)[..., 0:-2:3] = -0.5  # m/s, upwards, every node's w
        bed.step(0, 8)
        heights.append(float(bed.state.slabs(sl.U)[..., 0:-2:3].mean()))
        if no_tension:
            assert bed.slab_bed.pressure[..., 1].min() == pytest.approx(0.0, abs=1e-9)
    assert heights[1] < heights[0] < 0.0  # z is down
