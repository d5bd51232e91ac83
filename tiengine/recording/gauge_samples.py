"""Samples of gauges: motion of a place of rail or slab, force of a fastening, while the window is over them.

The rail's fields are those of the window, w(s, t) with s = x - X(t). At a fixed x the rate is D = d/dt - V d/ds, so
that with V = dX/dt and a = dV/dt

    Dw = w' - V w,s        D^2 w = w'' - 2 V w',s + V^2 w,ss - a w,s

where primes are rates at constant s. Slabs stand still: their rates are those of their coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from tiengine.engine.state import ACCELERATION, DISPLACEMENT, VELOCITY, State
from tiengine.engine.stepper import Plan, Stepper
from tiengine.kernels import layout as at
from tiengine.model.ingredients import Ingredients
from tiengine.parameters.arrays import Flags, Reals
from tiengine.parameters.conventions import SIDES
from tiengine.recording.seat_envelopes import watched_seats
from tiengine.recording.slab_openings import opening_at_rest
from tiengine.result_files.channels import GAUGE_FORCE, GAUGE_MOTION, GAUGE_OPENING
from tiengine.result_files.layout import Block
from tiengine.scenario.gauges import Gauge, nearest_seat, slab_under
from tiengine.track.plate_shapes import W, shapes_at
from tiengine.track.slab_matrices import bed_points
from tiengine.track.slab_moments import bed_places

__all__ = ["GaugeSamples", "gauge_samples"]

KINDS = (DISPLACEMENT, VELOCITY, ACCELERATION)

NEAR = 1.0
"""Margin of the window within which a gauge is asked [m]: it may stand for a fastening half a pitch away."""


class Place(Protocol):
    """Place that a gauge watches."""

    def read(self, X: float, V: float, V_rate: float) -> Reals | None:
        """Read its channels, shape (channels, B, ...), or None if it lies outside the window.

        Args:
            X: Chainage of the window's rear end [m].
            V: Speed [m/s].
            V_rate: Its rate [m/s^2].
        """


@dataclass(eq=False)
class RailPlace:
    """A place of a rail.

    Attributes:
        state: Is watched.
        length: Of the window [m].
        chainage: Of the place [m].
        side: 0 left, 1 right.
    """

    state: State
    length: float
    chainage: float
    side: int

    def read(self, X: float, V: float, V_rate: float) -> Reals | None:
        """Displacement, velocity, acceleration to the right and down, shape (3, B, 2)."""
        s = self.chainage - X
        if not 0.0 <= s <= self.length:
            return None
        found = np.empty((3, self.state.trains, 2))
        for direction, motion in enumerate(self.state.rail_motion(self.side, s)):
            (u, u_s, u_ss), (v, v_s, _), (a, *_) = motion
            found[0, :, direction] = u
            found[1, :, direction] = v - V * u_s
            found[2, :, direction] = a - 2.0 * V * v_s + V**2 * u_ss - V_rate * u_s
        return found


@dataclass(eq=False)
class SlabPlace:
    """A place of a slab.

    Attributes:
        state: Is watched.
        ingredients: Give slab and window.
        chainage: Of the place [m].
        y: From the centre line, to the right [m].
    """

    state: State
    ingredients: Ingredients
    chainage: float
    y: float

    def __post_init__(self) -> None:
        """Shapes at the place."""
        slab = self.ingredients.slab
        self._slab, self._x = slab_under(self.chainage, slab)
        index, table = shapes_at(slab, np.array([self._x]), np.array([self.y]))
        self._index, self._shape = index[0], table[0, W]

    def read(self, X: float, V: float, V_rate: float) -> Reals | None:
        """Displacement, velocity, acceleration to the right and down, shape (3, B, 2)."""
        first, slots = self.state.first_slab, self.state.slots
        inside = 0.0 <= self.chainage - X <= self.ingredients.length
        if not (inside and first <= self._slab < first + slots):
            return None
        found = np.empty((3, self.state.trains, 2))
        for kind in KINDS:
            motion = self.state.slab_motion(kind)[:, self._slab % slots]
            found[kind, :, 0] = motion[:, -2] + self._x * motion[:, -1]  # rigid in its plane
            found[kind, :, 1] = motion[:, self._index] @ self._shape
        return found


@dataclass(eq=False)
class GapPlace:
    """A place of the bed under a slab: its quadrature point nearest to a gauge.

    Attributes:
        stepper: Is watched.
        chainage: Of the gauge [m].
        y: From the centre line, to the right [m].
    """

    stepper: Stepper
    chainage: float
    y: float

    def __post_init__(self) -> None:
        """Find the point, its opening at rest and its shapes."""
        g = self.stepper.ingredients
        self._slab, x = slab_under(self.chainage, g.slab)
        along, across = bed_places(g.slab)
        point = int(np.argmin((along - x) ** 2 + (across - self.y) ** 2))
        rest = float(opening_at_rest(self.stepper, self._slab)[point])
        self._rest = rest if np.isfinite(rest) else np.nan
        self._shape = bed_points(g.designs.matrices[0])[:, point]

    def read(self, X: float, V: float, V_rate: float) -> Reals | None:
        """Opening, 0 in contact, shape (1, B)."""
        state = self.stepper.state
        first, slots = state.first_slab, state.slots
        inside = 0.0 <= self.chainage - X <= self.stepper.ingredients.length
        if not (inside and first <= self._slab < first + slots):
            return None
        w = state.slab_motion(DISPLACEMENT)[:, self._slab % slots] @ self._shape
        return np.asarray(np.maximum(self._rest - w, 0.0)[None])


@dataclass(eq=False)
class SeatPlace:
    """A fastening.

    Attributes:
        state: Is watched.
        seat: Its index.
        side: 0 left, 1 right.
        places: First and end of the window's places where forces are those of fastenings alone.
    """

    state: State
    seat: int
    side: int
    places: tuple[int, int]

    def read(self, X: float, V: float, V_rate: float) -> Reals | None:
        """Force of the rail on it, down and to the right, shape (2, B)."""
        place = self.seat - self.state.first_seat
        if not self.places[0] <= place < self.places[1]:
            return None
        return self.state.seat_forces[:, self.side, :2, place].T.copy()


@dataclass(eq=False)
class GaugeSamples:
    """Samples of one gauge, at the wheels' interval.

    Attributes:
        stepper: Is watched.
        place: Where it is.
        chainage: Of the gauge [m].
        channels: Names of the quantities that are read there.
        empty: No samples, shape (0, channels, B, ...).
    """

    stepper: Stepper
    place: Place
    chainage: float
    channels: tuple[str, ...]
    empty: Reals
    _steps: list[int] = field(default_factory=list)
    _values: list[Reals] = field(default_factory=list)

    @property
    def stage(self) -> str:
        """Name of its stage of the step."""
        return "gauges"

    def due(self, plan: Plan) -> Flags:
        """Steps that sample the wheels while the window is over the gauge, or nearly so."""
        X = self.stepper.chunk.clock[plan.step, at.POSITION]
        passed = self.chainage - X
        over = (passed > -NEAR) & (passed < self.stepper.ingredients.length + NEAR)
        return np.asarray((plan.wheel >= 0) & over, np.bool_)

    def watch(self) -> None:
        """Read, if the step samples the wheels."""
        step, row, _ = self.stepper.rows
        if row < 0:
            return
        X, V, V_rate = self.stepper.chunk.clock[step, :3].tolist()
        values = self.place.read(X, V, V_rate)
        if values is not None:
            self._steps.append(step)
            self._values.append(values)

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """Samples of the chunk whose steps end at the given times [s], with the train at the given chainages [m]."""
        steps, values = np.array(self._steps, dtype=np.int64), np.array(self._values) if self._values else self.empty
        self._steps.clear()
        self._values.clear()
        return [
            Block(time[steps], position[steps], {name: values[:, i, b] for i, name in enumerate(self.channels)})
            for b in range(values.shape[2])
        ]

    def remainder(self) -> list[Block]:
        """Nothing is kept back."""
        return []

    def saved(self) -> dict[str, Reals]:
        """Coming samples depend on nothing past."""
        return {}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Nothing to continue from."""


def gauge_samples(gauge: Gauge, stepper: Stepper) -> GaugeSamples:
    """The samples of a gauge of the scenario.

    Args:
        gauge: A checked gauge.
        stepper: Is watched.
    """
    ingredients, state, trains = stepper.ingredients, stepper.state, stepper.state.trains
    if gauge.on == "fastening":
        seat = nearest_seat(gauge.chainage, ingredients.slab)
        place: Place = SeatPlace(state, seat, SIDES.index(gauge.side or "left"), watched_seats(ingredients))
        return GaugeSamples(stepper, place, gauge.chainage, tuple(GAUGE_FORCE), np.empty((0, 2, trains)))
    if gauge.on == "gap":
        place = GapPlace(stepper, gauge.chainage, gauge.y or 0.0)
        return GaugeSamples(stepper, place, gauge.chainage, tuple(GAUGE_OPENING), np.empty((0, 1, trains)))
    if gauge.on == "rail":
        place = RailPlace(state, ingredients.length, gauge.chainage, SIDES.index(gauge.side or "left"))
    else:
        place = SlabPlace(state, ingredients, gauge.chainage, gauge.y or 0.0)
    return GaugeSamples(stepper, place, gauge.chainage, tuple(GAUGE_MOTION), np.empty((0, 3, trains, 2)))
