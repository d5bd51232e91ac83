"""Constant data of a group of trains, for the trial functions that its ingredients ask for."""

from __future__ import annotations

from tiengine.model.constant_data import Model
from tiengine.model.ingredients import Ingredients, SlabDesigns
from tiengine.model.sine_model import build_sine_model
from tiengine.model.spline_model import build_spline_model

__all__ = ["Ingredients", "Model", "SlabDesigns", "build_model"]


def build_model(ingredients: Ingredients, V: float) -> Model:
    """Assemble everything for a speed V [m/s]."""
    build = build_sine_model if ingredients.grading is None else build_spline_model
    return build(ingredients, V)
