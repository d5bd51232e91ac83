"""The slabs of a scenario as they wait for the train, on a bed without tension."""

from __future__ import annotations

from collections.abc import Hashable
from functools import cached_property

import numpy as np

from tiengine.irregularity.ground import Ground, ground_shape, reach_of
from tiengine.model.ingredients import SlabDesigns
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import Scenario
from tiengine.track.dead_load import RestingSlab, TrackParts
from tiengine.track.dead_state import DeadState, dead_state
from tiengine.track.defects import fastening_factors, fastening_plays
from tiengine.track.mortar import GAUSS, MortarVoid, bed_gaps
from tiengine.track.slab_moments import bed_places
from tiengine.track.slab_warp import curvature_of

__all__ = ["slabs_at_rest"]


def slabs_at_rest(scenario: Scenario, designs: SlabDesigns) -> DeadState | None:
    """State of rest of the slabs of a run; None if its bed transmits tension, or its step knows no shapes of rails.

    Args:
        scenario: Checked scenario.
        designs: Its slabs.
    """
    parts = scenario.parts
    if not scenario.slabs_may_lift:
        return None
    end = scenario.rear + scenario.train.distance + scenario.window_length
    count = int(np.floor(end / parts.slab.pitch)) + 2
    track = TrackParts(parts.rail, parts.fastening, parts.slab, parts.mortar)
    return dead_state(track, _Slabs(scenario, designs), count)


class _Slabs:
    """Slabs by their index along the track."""

    def __init__(self, scenario: Scenario, designs: SlabDesigns) -> None:
        self._track, self._parts, self._designs = scenario.track, scenario.parts, designs
        self._voids: dict[int, list[MortarVoid]] = {}
        for void in scenario.track.mortar_voids:
            self._voids.setdefault(void.slab, []).append(void)
        per_slab = self._parts.slab.fastenings
        self._seats: set[int] = set()
        for row in scenario.track.failed_fastenings:
            self._seats.update(range(row.seats[0] // per_slab, row.seats[1] // per_slab + 1))

    def kind(self, slab: int) -> Hashable:
        """Distinguish slabs of one kind from others; None for a sound one."""
        seats: tuple[bytes, ...] = ()
        if slab in self._seats:
            factors, plays = self._seats_of(slab)
            if plays.any() or np.any(factors != 1.0):
                seats = factors.tobytes(), plays.tobytes()
        voids = tuple(
            (each.x, each.y, each.factor, each.gap)
            for each in self._voids.get(slab, ())
            if each.gap or each.factor != 1.0
        )
        curvature, low = curvature_of(self._track.slab_warps, slab), self._ground(slab)
        kind = (seats, voids, curvature, low.tobytes() if low.any() else None)
        return kind if seats or voids or curvature or low.any() else None

    def resting(self, slab: int | None) -> RestingSlab:
        """The slab; None for a sound one."""
        s, matrices = self._parts.slab, self._designs.matrices
        if slab is None:
            even = np.zeros_like(matrices[0].bed_factor)
            return RestingSlab(matrices[0], np.ones((s.fastenings, 2)), np.zeros((s.fastenings, 2)), even)
        gaps = bed_gaps(s.length, s.width, (s.elements_x, s.elements_y), self._voids.get(slab, ()))
        return RestingSlab(
            matrices[self._designs.of_slab.get(slab, 0)],
            *self._seats_of(slab),
            self._ground(slab) + gaps,
            curvature_of(self._track.slab_warps, slab),
        )

    def _seats_of(self, slab: int) -> tuple[Reals, Reals]:
        """Factors and play [m] of a slab's fastenings, shape (seats, 2) each."""
        failed, per_slab = self._track.failed_fastenings, self._parts.slab.fastenings
        first = slab * per_slab
        return fastening_factors(failed, first, per_slab), fastening_plays(failed, first, per_slab)

    def _ground(self, slab: int) -> Reals:
        """Displacement of the ground at a slab's quadrature points [m], shape (n_el, n_q)."""
        middle = (slab + 0.5) * self._parts.slab.pitch
        low = np.zeros_like(self._along)
        for each, rear in self._ground_from:
            if rear < middle + 0.5 * self._parts.slab.pitch:
                low += ground_shape(each, middle + self._along)
        return low

    @cached_property
    def _ground_from(self) -> list[tuple[Ground, float]]:
        """Displacements of the ground and the chainages where they begin [m]."""
        return [(each, reach_of(each)[0]) for each in self._track.ground]

    @cached_property
    def _along(self) -> Reals:
        """Quadrature points of a slab from its middle [m], shape (n_el, n_q)."""
        return bed_places(self._parts.slab)[0].reshape(-1, GAUSS**2)
