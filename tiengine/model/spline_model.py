"""Constant data of the step with splines: matrices of a rail, stand-in of the seats, missing compliance."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tiengine.kernels import layout as at
from tiengine.model.constant_data import MassAndStiffness, Model, shared_arrays
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.errors import InputError
from tiengine.track.residual_compliance import Foundation, ResidualCompliance
from tiengine.track.seat_passes import SeatPasses, least_factor
from tiengine.track.splines import Splines

__all__ = ["DivergingPassesError", "SplineModel", "build_spline_model"]


class DivergingPassesError(InputError):
    """The step is too long for the stiffness or damping of the seats."""


@dataclass(frozen=True, eq=False)
class SplineModel(Model):
    """Constant data of the step with splines.

    Attributes:
        functions: Trial functions of a rail.
        seats: Stand-in of the seats in the implicit blocks of the rails.
        speed: V at which the stand-in was chosen [m/s].
    """

    functions: Splines
    seats: SeatPasses
    speed: float

    @property
    def rails_at_rest(self) -> tuple[MassAndStiffness, MassAndStiffness]:
        """M and K at V = 0, function by function."""
        operators = self.ingredients.operators
        (M_v, _, K_v), (M_l, _, K_l) = operators.vertical(0.0), operators.lateral(0.0)
        return (M_v, K_v), (M_l, K_l)


def build_spline_model(ingredients: Ingredients, V: float) -> SplineModel:
    """Assemble everything for a speed V [m/s].

    Raises:
        DivergingPassesError: The passes over the seats cannot be made to converge.
    """
    functions = ingredients.functions
    assert isinstance(functions, Splines)
    newmark, fastening = ingredients.newmark, ingredients.fastening
    seats = SeatPasses(
        ingredients.operators,
        fastening,
        ingredients.slab.fastening_pitch,
        fastening.length,
        newmark.beta_dt2,
        newmark.gamma_dt,
        V,
        stiffest=float(ingredients.designs.seat_scale.max()),
    )
    factor = least_factor(seats)
    if factor is None:
        raise DivergingPassesError("the passes over the seats do not converge")
    shared = shared_arrays(ingredients)
    if ingredients.local_compliance:
        foundation = Foundation.of(ingredients.rail, fastening, ingredients.slab.fastening_pitch)
        residual = ResidualCompliance(ingredients.operators, foundation, ingredients.wheel_s, fastening.length)
        shared["constants"][at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1] = residual.wheels.mean(axis=0)
    return SplineModel(**shared, functions=functions, seats=replace(seats, factor=factor), speed=V)
