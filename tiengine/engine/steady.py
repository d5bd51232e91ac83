"""Steady track of a model: the compliance from which a train starts."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from tiengine.engine.compliant_track import CompliantTrack
from tiengine.engine.sine_state import SineState
from tiengine.engine.state import DISPLACEMENT, State
from tiengine.engine.static_track import StaticTrack
from tiengine.kernels import layout as at
from tiengine.model.constant_data import Model
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals
from tiengine.track.steady_track import RIGID_GROUND, SeatsInWindow, SteadyTrack

__all__ = ["Track", "put_track", "steady_track"]


class Track(Protocol):
    """Both rails on seats on slabs under steady loads."""

    def under_wheels(self, force: Reals) -> Reals:
        """w, v, theta_x under the wheels, their slopes, their (zero) rates, shape (B, W, 2, 9).

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (B, W, 2, 3).
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

    def __init__(self, model: Model, state: State, first_seat_s: float, V: float) -> None:
        """Assemble and factorise; arguments as for :func:`steady_track`."""
        g = model.ingredients
        slabs = state.first_slab + np.arange(g.slots)
        self._slots = slabs % g.slots
        self._track = SteadyTrack(
            g.operators,
            g.fastening,
            _seats(model, state, first_seat_s),
            [g.designs.matrices[g.designs.of_slab.get(int(slab), 0)] for slab in slabs],
            V,
            g.wheel_s,
            np.tile(model.constants[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1], (len(g.wheel_s), 1)),
        )

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
        scale=g.seat_factors(state.first_seat, g.seats)[j],
        length=g.fastening.length,
    )
