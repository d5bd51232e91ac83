"""Blocks of the rails by powers of the speed, against the blocks assembled at that speed."""

from __future__ import annotations

import numpy as np
import pytest

from tiengine.engine.banded import BandedBlock
from tiengine.engine.model_tables import ModelTables
from tiengine.engine.spline_tables import RailTables

from ..models import default_model


@pytest.mark.parametrize("V", [0.0, 30.0, 120.0])
def test_tables_at_any_speed_are_those_of_the_assembled_blocks(V: float) -> None:
    """Rounding of sums of three terms, which the factors pass on: condition 40."""
    model = default_model()
    tables, g = ModelTables.of(model), model.ingredients
    tables.factor(V)
    blocks = (
        BandedBlock(*matrices, stand_in)
        for matrices, stand_in in zip(
            (g.operators.vertical(V), g.operators.lateral(V)), model.seats.smeared, strict=True
        )
    )
    expected = RailTables.of(*blocks, tables.spans, g.wheel_s, g.newmark.beta_dt2, g.newmark.gamma_dt)
    for name in ("coefficient", "coupling"):
        mine, theirs = getattr(tables.rails, name), getattr(expected, name)
        np.testing.assert_allclose(mine, theirs, atol=1e-13 * np.abs(theirs).max(), rtol=1e-9)
    assert not np.allclose(tables.rails.coefficient, ModelTables.of(model).rails.coefficient, rtol=1e-4)
