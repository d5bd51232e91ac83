"""Kinds of step: state and stepper that belong to a model."""

from __future__ import annotations

from tiengine.engine.chunk import Chunk
from tiengine.engine.sine_state import SineState
from tiengine.engine.sine_stepper import SineStepper
from tiengine.engine.spline_state import SplineState
from tiengine.engine.spline_stepper import SplineStepper
from tiengine.engine.state import State
from tiengine.engine.stepper import Stepper
from tiengine.model.constant_data import Model
from tiengine.model.sine_model import SineModel
from tiengine.model.spline_model import SplineModel

__all__ = ["make_stepper", "state_at_rest"]


def state_at_rest(model: Model, lanes: int | None = None) -> State:
    """State in which nothing moves and no forces act.

    Args:
        model: Constant data.
        lanes: Of the vectors of rails in splines; by default as many as suit the number of trains.
    """
    if isinstance(model, SplineModel):
        return SplineState.at_rest(model, lanes)
    if isinstance(model, SineModel):
        return SineState.at_rest(model)
    raise TypeError(f"no step for a {type(model).__name__}")


def make_stepper(model: Model, state: State, chunk: Chunk, *, parallel: bool = False, public: bool = False) -> Stepper:
    """Bind the step of a model to a state and to buffers.

    Args:
        model: Constant data.
        state: Is advanced in place.
        chunk: Buffers.
        parallel: Trains in parallel in Taichi, with sines.
        public: Public Taichi calls only, with sines.
    """
    if isinstance(model, SplineModel) and isinstance(state, SplineState):
        return SplineStepper(model, state, chunk)
    if isinstance(model, SineModel) and isinstance(state, SineState):
        return SineStepper(model, state, chunk, parallel=parallel, public=public)
    raise TypeError(f"no step of a {type(model).__name__} for a {type(state).__name__}")
