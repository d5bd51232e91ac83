"""Constant data of a group of trains, for the trial functions that its ingredients ask for."""

from __future__ import annotations

from tiengine.model.constant_data import Model
from tiengine.model.coupled_cars import MOST_RETURNED, coupling_returned
from tiengine.model.ingredients import Ingredients, SlabDesigns
from tiengine.model.sine_model import build_sine_model
from tiengine.model.spline_model import DivergingPassesError, build_spline_model

__all__ = ["Ingredients", "Model", "SlabDesigns", "build_model"]


def build_model(ingredients: Ingredients, V: float) -> Model:
    """Assemble everything for a speed V [m/s].

    Raises:
        DivergingPassesError: The passes over seats or couplings cannot be made to converge.
    """
    returned = coupling_returned(ingredients)
    if returned > MOST_RETURNED:
        raise DivergingPassesError(
            f"train.couplings change their bodies' motion by {returned:.2g} of itself in a pass, more than"
            f" {MOST_RETURNED:g}: too stiff or damped for their masses"
        )
    build = build_sine_model if ingredients.grading is None else build_spline_model
    return build(ingredients, V)
