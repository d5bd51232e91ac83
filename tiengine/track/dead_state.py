r"""State in which a track on a bed without tension waits for the train (MODEL §14).

The rails were laid and levelled on sound track: even slabs on an even bed, all seats sound, the weight of rails and
slabs on it. Since then slabs have warped, gaps have opened, ground has settled, fastenings have come to hang, and the
rails have followed. What a run needs of every slab is

- the signed pressure of its bed at rest, and k_v u of its hanging seats at rest;
- the shape of both rails over it, at rest as it is less at rest as it was laid. To a wheel it is one of the running
  surface.

Both decay within some metres. A slab is therefore known by what it and its neighbours are like; slabs of one kind in
neighbourhoods of one kind share a result, so that a long line of slabs that are all warped costs as much as one.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.interpolate import CubicSpline

from tiengine.parameters.arrays import Ints, Reals
from tiengine.parameters.errors import InputError
from tiengine.track.dead_load import RestingSlab, RestingTrack, TrackParts, resting_track, samples

__all__ = ["DeadState", "LaidRail", "SlabsAsTheyAre", "dead_state"]

REACH = 15.0
"""Metres over which a slab feels its neighbours: fifteen decay lengths of a rail on its fastenings."""
TOGETHER = 20
"""Most slabs whose state is sought at once."""
MOST_STATES = 2000
"""Most different slabs of a run; each takes a tenth of a second and 10 kB."""


class SlabsAsTheyAre(Protocol):
    """The slabs of a track by their index."""

    def kind(self, slab: int) -> Hashable:
        """Distinguish slabs of one kind from others; None for a sound one."""

    def resting(self, slab: int | None) -> RestingSlab:
        """The slab; None for a sound one."""


@dataclass(frozen=True, eq=False)
class DeadState:
    """State at rest of every slab of a run.

    Attributes:
        pitch: Distance of joints [m].
        kind: Number of each slab's state by its index, shape (slabs,); 0 is sound among sound ones.
        pressure: Signed pressure of the bed [Pa], shape (states, n_el, n_q).
        seat_force: k_v u of every fastening [N], shape (states, seats, 2).
        slabs: Coordinates of the slab [m, rad], shape (states, dofs).
        rails: Shape of both rails over the slab and one sample beyond either end [m], shape (states, 2, points).
    """

    pitch: float
    kind: Ints
    pressure: Reals
    seat_force: Reals
    slabs: Reals
    rails: Reals

    def of(self, slab: int) -> int:
        """Number of a slab's state.

        Args:
            slab: Its index; slabs before the first and beyond the last are as these are.
        """
        return int(self.kind[min(max(slab, 0), len(self.kind) - 1)])

    @property
    def uneven(self) -> bool:
        """Whether any slab is not as it was when the rails were laid."""
        return bool(self.kind.any())


class LaidRail:
    """Shape that the state at rest gives to one rail's running surface."""

    shortest = float("inf")

    def __init__(self, state: DeadState, side: int) -> None:
        """Make splines of the shapes by state.

        Args:
            state: The state at rest.
            side: 0 left, 1 right.
        """
        self._state = state
        points = state.rails.shape[2]
        step = state.pitch / (points - 1 - 2 * MARGIN)
        x = step * np.arange(-MARGIN, points - MARGIN)
        self._shapes = [CubicSpline(x, rail[side], bc_type="natural") for rail in state.rails]
        self._slopes = [shape.derivative() for shape in self._shapes]

    def evaluate(self, x: Reals) -> tuple[Reals, Reals]:
        """Heights [m] and slopes at chainages [m], shape (n,) each."""
        state = self._state
        slab = np.floor(x / state.pitch).astype(np.int64)
        kind = state.kind[np.clip(slab, 0, len(state.kind) - 1)]
        height, slope = np.zeros_like(x), np.zeros_like(x)
        for number in np.unique(kind[kind > 0]).tolist():
            here = kind == number
            along = x[here] - slab[here] * state.pitch
            height[here], slope[here] = self._shapes[number](along), self._slopes[number](along)
        return height, slope


MARGIN = 8
"""Samples of a rail beyond either end of a slab: the spline's free ends are forgotten there."""


def dead_state(parts: TrackParts, slabs: SlabsAsTheyAre, count: int) -> DeadState:
    """Find the state at rest of the slabs of a run.

    Args:
        parts: Of the track.
        slabs: The slabs.
        count: Slabs of the run.

    Raises:
        InputError: Too many slabs differ, or no state of rest was found.
    """
    around = int(np.ceil(REACH / parts.slab.pitch))
    sound = slabs.resting(None)
    laid = _cut(parts, resting_track(parts, [sound] * (2 * around + 1)), around)
    states = [(laid[0], laid[1], laid[2], np.zeros_like(laid[3]))]
    kind, first_of = _states_by_slab(slabs, count, around)
    if len(first_of) > MOST_STATES:
        raise InputError(
            f"track.mortar_no_tension = true: {len(first_of)} slabs of this run differ in what they and their"
            f" neighbours lie on; must be at most {MOST_STATES}"
        )
    for first, end in _rows(first_of):
        row = [slabs.resting(min(max(i, 0), count - 1)) for i in range(first - around, end + around)]
        found = resting_track(parts, row)
        for i in range(around, end - first + around):
            pressure, force, moved, rails = _cut(parts, found, i)
            states.append((pressure, force, moved, rails - laid[3]))
    return DeadState(parts.slab.pitch, kind, *(np.stack(part) for part in zip(*states, strict=True)))


def _states_by_slab(slabs: SlabsAsTheyAre, count: int, around: int) -> tuple[Ints, list[int]]:
    """Number the neighbourhoods of the slabs.

    Args:
        slabs: The slabs.
        count: Slabs of the run.
        around: Neighbours on either side that matter.

    Returns:
        Number of each slab's state, 0 where it and its neighbours are sound, shape (count,), and the slab at which each
        other one is met first.
    """
    number: dict[Hashable, int] = {None: 0}
    kinds = [number.setdefault(slabs.kind(i), len(number)) for i in range(count)]
    row = np.pad(np.array(kinds, np.int32), around, mode="edge")
    width = 2 * around + 1
    known: dict[bytes, int] = {np.zeros(width, np.int32).tobytes(): 0}
    states, first_of = np.zeros(count, np.int64), []
    for i in range(count):
        near = row[i : i + width].tobytes()
        if near not in known:
            known[near] = len(known)
            first_of.append(i)
        states[i] = known[near]
    return states, first_of


def _rows(slabs: Sequence[int]) -> list[tuple[int, int]]:
    """Ascending slabs in rows of neighbours, first and end, none too long to be solved at once."""
    rows: list[tuple[int, int]] = []
    for i in slabs:
        if rows and rows[-1][1] == i and i - rows[-1][0] < TOGETHER:
            rows[-1] = (rows[-1][0], i + 1)
        else:
            rows.append((i, i + 1))
    return rows


def _cut(parts: TrackParts, track: RestingTrack, i: int) -> tuple[Reals, Reals, Reals, Reals]:
    """Slab i of a row: pressure, seat forces, coordinates, rails with their margins."""
    steps = samples(parts.slab)
    rails = track.rails[:, i * steps - MARGIN : (i + 1) * steps + MARGIN + 1]
    return track.pressure[i], track.seat_force[i], track.slabs[i], rails
