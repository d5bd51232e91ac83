"""Steady track of a model: the compliance from which a train starts."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from tiengine.engine.compliant_track import CompliantTrack
from tiengine.engine.sine_state import SineState
from tiengine.engine.start_on_bed import BedAtStart
from tiengine.engine.state import DISPLACEMENT, State
from tiengine.engine.static_track import StaticTrack
from tiengine.kernels import layout as at
from tiengine.model.constant_data import Model
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Flags, Reals
from tiengine.track.steady_track import RIGID_GROUND, SeatsInWindow, SteadyTrack, track_stiffness
from tiengine.vehicle.train import static_wheel_loads

__all__ = ["Track", "put_track", "steady_track"]


class Track(Protocol):
    """Both rails on seats on slabs under steady loads."""

    def under_wheels(self, force: Reals) -> Reals:
        """w, v, theta_x under the wheels, their slopes, their (zero) rates, shape (B, W, 2, 9).

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (B, W, 2, 3).
        """

    def settled(self, force: Reals) -> Track | None:
        """The track whose bed carries where it does under given forces; None if it is this one.

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (W, 2, 3).
        """

    def motion(self, force: Reals) -> tuple[Reals, Reals, Reals]:
        """Vertical and lateral coordinates of both rails, and those of the slabs by slot, as the parts of a state.

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (W, 2, 3).
        """


def steady_track(model: Model, state: State, first_seat_s: float, V: float) -> Track:
    """The track under a state's window at speed V [m/s].

    Args:
        model: Constant data.
        state: Gives the rear seat and slab of the window.
        first_seat_s: Rear seat [m from the window's rear end].
        V: Speed [m/s].
    """
    if isinstance(model, SineModel) and isinstance(state, SineState):
        if model.omitted is not None:
            return CompliantTrack(model, model.omitted, state, first_seat_s, V)
        return StaticTrack(model, state, first_seat_s, V)
    return SplineTrack(model, state, first_seat_s, V)


def put_track(track: Track, state: State, force: Reals) -> None:
    """Put rails, slabs and seats of all trains of a state into steady motion.

    Args:
        track: The track under the state's window.
        state: Written.
        force: Forces on w, v, theta_x at the wheels, shape (W, 2, 3).
    """
    for name, values in zip(("vertical", "lateral", "slabs"), track.motion(force), strict=True):
        state.put(DISPLACEMENT, name, values)
    if isinstance(track, CompliantTrack) and isinstance(state, SineState):
        track.put_seats(state, force)


class SplineTrack:
    """Steady track with rails in splines; slabs by their slots in memory."""

    def __init__(
        self, model: Model, state: State, first_seat_s: float, V: float, carrying: Flags | None = None
    ) -> None:
        """Assemble and factorise.

        Args:
            model: Constant data.
            state: Gives the rear seat and slab of the window.
            first_seat_s: Rear seat [m from the window's rear end].
            V: Speed [m/s].
            carrying: Quadrature points of a bed without tension that carry, shape (slabs, points); those under
                standing wheels by default.
        """
        self._of, g = (model, state, first_seat_s, V), model.ingredients
        slabs = state.first_slab + np.arange(g.slots)
        self._slots = slabs % g.slots
        designs = [g.designs.matrices[g.designs.of_slab.get(int(slab), 0)] for slab in slabs]
        seats, beds, loads = _seats(model, state, first_seat_s), None, None
        self._bed, self._carrying = None, carrying
        if g.dead is not None:
            self._bed = BedAtStart.of(designs, g.mortar.stiffness, [g.pressure_at_rest(int(slab)) for slab in slabs])
            self._carrying = self._under_standing(self._bed, seats) if carrying is None else carrying
            beds, loads = self._bed.beds(self._carrying), self._bed.loads(self._carrying)
        self._track = SteadyTrack(
            g.operators,
            g.fastening,
            seats,
            designs,
            V,
            g.wheel_s,
            np.tile(model.constants[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1], (len(g.wheel_s), 1)),
            beds,
            loads,
        )

    def _under_standing(self, bed: BedAtStart, seats: SeatsInWindow) -> Flags:
        """Points that carry under standing wheels with their static loads."""
        g = self._of[0].ingredients
        nothing = np.zeros_like(bed.stiffness, dtype=np.bool_)
        K = track_stiffness(g.operators, g.fastening, seats, bed.slabs, bed.beds(nothing), 0.0)
        load = np.zeros(K.shape[0])
        loads = g.operators.under(g.wheel_s)[0].T @ static_wheel_loads(g.train)
        for side, vertical in enumerate(loads.T):
            first = side * 5 * g.functions.count
            load[first : first + len(vertical)] = vertical
        return bed.under(K, load)

    def settled(self, force: Reals) -> Track | None:
        """See :class:`Track`."""
        if self._bed is None or self._carrying is None:
            return None
        carrying = self._bed.carrying(self._track.motion(force)[2])
        return None if np.array_equal(carrying, self._carrying) else SplineTrack(*self._of, carrying)

    def under_wheels(self, force: Reals) -> Reals:
        """See :class:`Track`."""
        return self._track.under_wheels(force)

    def motion(self, force: Reals) -> tuple[Reals, Reals, Reals]:
        """See :class:`Track`."""
        vertical, lateral, slabs = self._track.motion(force)
        by_slot = np.empty_like(slabs)
        by_slot[self._slots] = slabs
        return vertical, lateral, by_slot


def _seats(model: Model, state: State, first_seat_s: float) -> SeatsInWindow:
    """Fastenings under the window, those that reach into it included."""
    g = model.ingredients
    j = np.arange(g.seats)
    s: Reals = np.asarray(first_seat_s + j * g.slab.fastening_pitch, np.float64)
    j = j[(s > -g.seat_reach) & (s < g.length + g.seat_reach)]
    slab, seat = np.divmod(state.first_seat + j, g.slab.fastenings)
    modelled = slab < state.first_slab + g.slots  # beyond the modelled slabs the ground is rigid
    return SeatsInWindow(
        s=s[j],
        slab=np.where(modelled, slab - state.first_slab, RIGID_GROUND),
        seat=seat,
        scale=g.bound_factors(state.first_seat, g.seats)[j],
        length=g.fastening.length,
    )
