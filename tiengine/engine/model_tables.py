"""Tables of the step with splines from its model, made again in place when the speed changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.engine.moving_rails import MovingRails
from tiengine.engine.spline_tables import CarTables, RailTables, SeatTables, SlabTables, Spans
from tiengine.kernels import spline_layout as at
from tiengine.model.constant_data import slab_operators
from tiengine.model.spline_model import SplineModel
from tiengine.track.pieces import Pieces
from tiengine.vehicle.train import TrainModel

__all__ = ["ModelTables"]

Matrix: TypeAlias = "sp.csr_array"


@dataclass(frozen=True, eq=False)
class ModelTables:
    """All tables of a group of trains.

    Attributes:
        model: Constant data.
        spans: Spans of the knots.
        moving: Blocks of a rail by powers of the speed.
        rails, seats, slabs, cars: Tables of the kernel; those of rails and cars depend on the speed.
    """

    model: SplineModel
    spans: Spans
    moving: MovingRails
    rails: RailTables
    seats: SeatTables
    slabs: SlabTables
    cars: CarTables

    @classmethod
    def of(cls, model: SplineModel) -> ModelTables:
        """Make the tables at the model's speed."""
        g = model.ingredients
        spans = _spans(model.functions.displacement)
        moving = MovingRails.of(g.operators, model.seats.smeared, g.newmark)
        first = g.designs.matrices[0]
        return cls(
            model=model,
            spans=spans,
            moving=moving,
            rails=_rails(model, spans, moving, model.speed),
            seats=SeatTables.of(g.seats, g.fastening.length, spans),
            slabs=SlabTables.of(
                slab_operators(g), first.seat_index, first.seat_w, first.seat_slope, first.seat_x
            ),
            cars=_cars(model, model.speed, coupled_coordinates(g.train)),
        )  # fmt: skip

    def factor(self, V: float) -> None:
        """Make the tables that depend on the speed V [m/s] again."""
        self.rails.refill(_rails(self.model, self.spans, self.moving, V))
        self.cars.refill(_cars(self.model, V, self.cars.car))


def _spans(functions: Pieces) -> Spans:
    """Spans of the knots in the kernel's order."""
    count = len(functions.first)
    ends = np.stack([functions.breaks[:-1], functions.breaks[1:]], axis=1)
    return Spans(np.hstack([ends, functions.coefficients.reshape(count, -1), functions.first[:, None]]))


def _rails(model: SplineModel, spans: Spans, moving: MovingRails, V: float) -> RailTables:
    """Tables of the rails; the wheels' rows have room for all functions, since their length changes with the speed."""
    g = model.ingredients
    made = RailTables.of_factors(*moving.at(V), spans, g.wheel_s)
    W = len(g.wheel_s)
    rows = made.wheel_rows.reshape(W, -1, at.N_WHEEL_FUNCTION)
    room = np.zeros((W, model.functions.count, at.N_WHEEL_FUNCTION))
    room[:, : rows.shape[1]] = rows
    return replace(made, wheel_rows=room.ravel())


def _cars(model: SplineModel, V: float, car: Sequence[NDArray[np.intp]]) -> CarTables:
    """Tables of the vehicles, whose coordinates are given."""
    train, newmark = model.ingredients.train, model.ingredients.newmark
    return CarTables.of(
        train.M, train.C + V * train.C_speed, train.K, car,
        train.wheelset_dof, train.element_index, newmark.beta_dt2, newmark.gamma_dt,
    )  # fmt: skip


def coupled_coordinates(train: TrainModel) -> list[NDArray[np.intp]]:
    """Coordinates of the train in groups that M, C and K do not couple, one group a vehicle, in the train's order.

    A body is never divided: the spin of a wheelset is coupled to nothing and stays with the wheelset.
    """
    linked = sp.coo_array((train.K != 0.0) | (train.C != 0.0) | (train.C_speed != 0.0) | (train.M != 0.0))
    body = np.arange(train.n)
    body[: train.n_dof] -= body[: train.n_dof] % 5  # first coordinate of its body
    rows, columns = np.append(linked.row, np.arange(train.n)), np.append(linked.col, body)
    graph = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(train.n, train.n))
    count, number = sp.csgraph.connected_components(graph, directed=False)
    groups = [np.flatnonzero(number == k) for k in range(count)]
    return sorted(groups, key=lambda group: int(group[0]))
