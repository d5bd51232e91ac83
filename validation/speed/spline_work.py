"""Operations and bytes of the spline step, stage by stage, counted from its sizes.

Counted are the loops whose length the sizes give: functions times bands, slab coordinates times bands, columns of the
cars, one-sided rows and columns of the wheels. Not counted is the scalar code: search for the contact point, Newton's
iterations, shapes and slots of the seats. All lanes of a vector count, those of empty slots and of a missing fourth
train too, since the processor works on them. A byte counts once in every sweep that touches it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tiengine.engine.spline_stepper import SplineStepper
from tiengine.kernels import layout
from tiengine.kernels import spline_layout as at

__all__ = ["STAGES", "Count", "Sizes", "counts", "sizes_of"]

REAL = 8  # bytes
EIGHT = 8  # lanes of slabs and cars

STAGES = {
    "rails, forward": at.FORWARD_STAGE,
    "rails, backward": at.BACKWARD_STAGE,
    "seats": at.SEATS_STAGE | at.SEAT_FORCE_STAGE,
    "slabs": at.SLAB_STAGE | at.PULL_STAGE | at.EXCHANGE_STAGE,
    "cars": at.CAR_STAGE,
    "wheels": at.CONTACT_STAGE,
}
"""Stages of the report, and the bits that make a launch do them."""


@dataclass(frozen=True)
class Count:
    """Work of a step.

    Attributes:
        flops: Multiplications and additions.
        traffic: Bytes that are read or written.
    """

    flops: float
    traffic: float


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Sizes of a group of trains.

    Attributes:
        chunks: Chunks of trains.
        lanes: Lanes of a rail's vector.
        functions: Functions of a field.
        seats: Seats in the window.
        touched: Functions that all seats together touch.
        groups: Groups of eight slots of all chunks.
        slab_dofs: Coordinates of a slab.
        half_width: K of a slab's band.
        slab_seats: Seats a slab.
        slab_touched: Coordinates of a slab that a seat touches.
        cars: Cars of all chunks.
        car_dofs: Coordinates of a car.
        car_numbers: The same filled up to whole vectors.
        elements: Nonlinear elements of all trains.
        rows: Functions of all wheelsets' one-sided rows.
        wheelsets: Wheelsets of a train.
        passes: Passes of a step.
    """

    chunks: int
    lanes: int
    functions: int
    seats: int
    touched: int
    groups: int
    slab_dofs: int
    half_width: int
    slab_seats: int
    slab_touched: int
    cars: int
    car_dofs: int
    car_numbers: int
    elements: int
    rows: int
    wheelsets: int
    passes: int


def sizes_of(stepper: SplineStepper) -> Sizes:
    """Sizes of a stepper that has made at least one step."""
    tables, held, size = stepper.state.tables, stepper.state.held, stepper.launch.size
    chunks = int(size[at.CHUNKS])
    whole = chunks * held.lanes // 2
    return Sizes(
        chunks=chunks,
        lanes=held.lanes,
        functions=held.functions,
        seats=int(size[at.SEATS]),
        touched=int(tables.seats.place[:, at.TOUCH_COUNT].sum()),
        groups=whole * int(size[at.GROUPS]),
        slab_dofs=held.slab_dofs,
        half_width=tables.slabs.half_width,
        slab_seats=int(stepper.model.dims[layout.SEATS_PER_SLAB]),
        slab_touched=tables.slabs.seat_index.shape[2],
        cars=whole * int(size[at.CARS]),
        car_dofs=int(size[at.CAR_DOFS]),
        car_numbers=EIGHT * tables.cars.blocks,
        elements=held.trains * int(size[at.ELEMENTS]),
        rows=int(np.sum(tables.rails.wheel_place[:, at.ROWS_COUNT])),
        wheelsets=len(tables.rails.wheel_place),
        passes=int(size[at.PASSES]),
    )


def counts(s: Sizes) -> dict[str, Count]:
    """Work of each stage in a step of the whole group."""
    return {
        "rails, forward": _forward(s),
        "rails, backward": _backward(s),
        "seats": _seats(s),
        "slabs": _slabs(s),
        "cars": _cars(s),
        "wheels": _wheels(s),
    }


def _forward(s: Sizes) -> Count:
    """-(C v~ + K u~) in the first pass, A_s a in later ones; loads; forward substitution."""
    later = s.passes - 1
    substitution = 2 * at.N_FORWARD + at.LOAD_X - at.LOAD_W + 1
    linear, stand_in = at.NEIGHBOURS * at.N_LINEAR, at.NEIGHBOURS * at.N_STAND_IN
    flops = s.passes * substitution + 2 * linear + later * 2 * stand_in
    coefficients = s.passes * at.N_FORWARD + linear + later * stand_in
    vectors = 26 + later * 21  # u~, v~ or LINEAR, a; loads read and zeroed; results
    return _rails(s, flops, coefficients, vectors)


def _backward(s: Sizes) -> Count:
    """Backward substitution, correctors in every pass, the next predictors in the last."""
    flops = s.passes * (2 * at.N_FORWARD + 5 + 20) + 30
    coefficients = s.passes * (at.N_FORWARD + 5)
    vectors = s.passes * 30 + 10  # result, predictors, motion; then the next predictors
    return _rails(s, flops, coefficients, vectors)


def _rails(s: Sizes, flops: int, coefficients: int, vectors: int) -> Count:
    """Work of the rails from that of a function: flops of a lane, coefficients, vectors."""
    functions = s.chunks * s.functions
    return Count(functions * s.lanes * flops, functions * REAL * (coefficients + s.lanes * vectors))


def _seats(s: Sizes) -> Count:
    """Forces of the fastenings and their loads on the rails."""
    lanes = s.chunks * s.lanes * s.passes
    flops = lanes * (22 * s.touched + 27 * s.seats)
    shapes = s.chunks * s.passes * at.N_SEAT_SHAPE * s.touched
    return Count(flops, REAL * (shapes + lanes * (12 * s.touched + 13 * s.seats)))


def _slabs(s: Sizes) -> Count:
    """Predictors, bands of K and C once a step; seats, banded solve and correctors in every pass."""
    width, P = 2 * s.half_width + 1, s.passes
    at_seats = 4 * s.slab_seats * s.slab_touched * P  # pull and push, both rails
    flops = s.slab_dofs * (9 + 4 * width + P * (2 * width + 9)) + 4 * at_seats
    coefficients = s.slab_dofs * (2 * width + P * width)
    vectors = s.slab_dofs * (6 + 3 + P * 11) + at_seats
    return Count(s.groups * EIGHT * flops, s.groups * REAL * (coefficients + EIGHT * vectors))


def _cars(s: Sizes) -> Count:
    """Columns of -A^-1 K and -A^-1 C once, of A^-1 in every pass; predictors, correctors, suspension."""
    columns = (2 + s.passes) * s.car_dofs * s.car_numbers
    flops = s.cars * (2 * columns + s.car_numbers * (6 + 4 * s.passes)) + s.elements * s.passes * 60
    return Count(flops, REAL * s.cars * (columns + s.car_numbers * (5 + 7 * s.passes)))


def _wheels(s: Sizes) -> Count:
    """Rails at the predictors; one-sided rows before contact, one-sided columns after it."""
    lanes = s.chunks * s.lanes
    flops = lanes * (72 * s.wheelsets + s.passes * s.rows * (32 + 16))
    tables = s.chunks * s.passes * s.rows * at.N_WHEEL_FUNCTION
    return Count(flops, REAL * (tables + lanes * (24 * s.wheelsets + s.passes * 15 * s.rows)))
