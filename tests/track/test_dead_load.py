"""Rails and slabs at rest under their own weight on a bed that does not pull."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tiengine.engine import backend
from tiengine.parameters.conventions import GRAVITY
from tiengine.scenario.scenario import load_scenario
from tiengine.track.dead_load import RestingSlab, TrackParts, resting_track
from tiengine.track.dead_state import LaidRail, dead_state
from tiengine.track.mortar import MortarVoid, bed_gaps
from tiengine.track.slab_matrices import SlabMatrices, slab_matrices

MIDDLE = 2
HUGE = 0.1  # m


@pytest.fixture(scope="module")
def track() -> tuple[TrackParts, SlabMatrices]:
    backend.start()
    parts = load_scenario("default").parts
    return (
        TrackParts(parts.rail, parts.fastening, parts.slab, parts.mortar),
        slab_matrices(parts.slab, parts.mortar, (), parts.fastening.baseplate),
    )


def sound(track: tuple[TrackParts, SlabMatrices]) -> RestingSlab:
    seats = track[0].slab.fastenings
    return RestingSlab(track[1], np.ones((seats, 2)), np.zeros((seats, 2)), np.zeros_like(track[1].bed_factor))


def row(track: tuple[TrackParts, SlabMatrices], middle: RestingSlab):
    """Five slabs, the middle one as given, at rest."""
    return resting_track(track[0], [sound(track)] * MIDDLE + [middle] + [sound(track)] * MIDDLE)


def carried(track: tuple[TrackParts, SlabMatrices], pressure: np.ndarray) -> np.ndarray:
    """Force of the bed on each slab [N]."""
    return np.sum(track[1].bed_weight * np.maximum(pressure, 0.0), axis=(1, 2))


def dead_weight(parts: TrackParts) -> float:
    """Weight of a slab and the rails on it [N]."""
    return (parts.slab.mass + 2.0 * parts.rail.densities[0] * parts.slab.pitch) * GRAVITY


@pytest.mark.parametrize("gradient", [0.0, 45.0, -45.0, 90.0])
def test_the_pressure_carries_slab_and_rail(track, gradient: float) -> None:
    """The middle one of warped slabs in a row carries its own weight and its rails': they share by symmetry."""
    warped = replace(sound(track), curvature=1e-5 * gradient)
    found = resting_track(track[0], [warped] * 7)
    # the rails' ends, three slabs away, are pinned: 1e-4 where long lifted slabs lean on each other
    assert carried(track, found.pressure)[3] == pytest.approx(dead_weight(track[0]), rel=1e-4)
    assert (found.pressure.min() < 0.0) == (gradient != 0.0)


def test_corners_lift_off_under_a_cold_top_and_the_middle_under_a_warm_one(track) -> None:
    """Where a gap is open the bed carries nothing; the slab's own shape says where."""
    ny = 4 * track[0].slab.elements_y
    for gradient, corners_lift in ((-45.0, True), (45.0, False)):
        pressure = row(track, replace(sound(track), curvature=1e-5 * gradient)).pressure[MIDDLE]
        by_place = pressure.reshape(track[0].slab.elements_x, track[0].slab.elements_y, 4, 4).transpose(0, 2, 1, 3)
        grid = by_place.reshape(-1, ny)
        assert (grid[0, 0] < 0.0) == (grid[-1, -1] < 0.0) == corners_lift
        assert (grid[len(grid) // 2, ny // 2] < 0.0) != corners_lift


def test_a_huge_gap_is_a_void_and_none_is_sound(track) -> None:
    """Two rows of elements of the slab, over its whole width, as edges of cells."""
    parts, matrices = track
    s = parts.slab
    x = tuple(s.length / s.elements_x * np.array([2.0, 4.0]))
    void = MortarVoid(slab=0, x=x, y=(-0.5 * s.width, 0.5 * s.width))
    design = slab_matrices(s, parts.mortar, [void], parts.fastening.baseplate)
    mesh = (s.length, s.width, (s.elements_x, s.elements_y))
    low = bed_gaps(*mesh, [void.model_copy(update={"gap": HUGE})])
    assert np.array_equal(low > 0.0, design.bed_factor == 0.0)
    by_gap = row(track, replace(sound(track), low=low))
    by_factor = row(track, replace(sound(track), matrices=design))
    np.testing.assert_allclose(by_gap.slabs, by_factor.slabs, atol=1e-12)  # rounding of a sparse solution
    np.testing.assert_allclose(by_gap.rails, by_factor.rails, atol=1e-12)
    assert carried(track, by_gap.pressure).sum() == pytest.approx(carried(track, by_factor.pressure).sum(), rel=1e-9)
    none = row(track, replace(sound(track), low=bed_gaps(*mesh, [void.model_copy(update={"gap": 0.0})])))
    np.testing.assert_array_equal(none.slabs, row(track, sound(track)).slabs)
    assert matrices.bed_factor.min() == 1.0


def test_a_gap_closes_when_it_is_used_up(track) -> None:
    """A bed that is lower all over: the slab comes down by as much and weighs on it as before, less what rails hold."""
    gap = 1e-6
    even = row(track, sound(track))
    lowered = row(track, replace(sound(track), low=np.full_like(track[1].bed_factor, gap)))
    stiffness = track[0].mortar.stiffness * track[0].slab.length * track[0].slab.width
    fallen = (lowered.slabs - even.slabs)[MIDDLE, :-2:3].mean()
    lost = carried(track, even.pressure)[MIDDLE] - carried(track, lowered.pressure)[MIDDLE]
    assert fallen == pytest.approx(gap - lost / stiffness, rel=2e-3)  # mean over nodes for that over the slab
    assert 0.0 < lost < 0.2 * gap * stiffness
    assert lowered.pressure[MIDDLE].min() > 0.0


def test_hanging_seats(track) -> None:
    """A huge gap is a failed seat; a small one is used up by the rail's weight; the rest is carried."""
    seats = track[0].slab.fastenings
    play, factor = np.zeros((seats, 2)), np.ones((seats, 2))
    play[4, 0], factor[4, 0] = HUGE, 0.0
    hanging = row(track, replace(sound(track), play=play))
    failed = row(track, replace(sound(track), seat_factor=factor))
    np.testing.assert_allclose(hanging.rails, failed.rails, atol=1e-12)
    stretch = hanging.seat_force[MIDDLE, 4, 0] / track[0].fastening.vertical_stiffness
    assert 1e-5 < stretch < 3e-5  # rail of 60 kg/m over two seat pitches
    play[4, 0] = 0.5 * stretch
    closed = row(track, replace(sound(track), play=play))
    u = closed.seat_force[MIDDLE, 4, 0] / track[0].fastening.vertical_stiffness
    assert play[4, 0] < u < stretch
    lifted = (failed.rails - closed.rails)[0].max()
    assert lifted > 0.0


class Row:
    """Slabs of a run by what is wrong with each."""

    def __init__(self, track, curvature) -> None:
        self.track, self.curvature = track, curvature

    def kind(self, slab: int):
        return self.curvature[slab] or None

    def resting(self, slab: int | None) -> RestingSlab:
        return replace(sound(self.track), curvature=0.0 if slab is None else self.curvature[slab])


def test_slabs_of_one_kind_share_their_state(track) -> None:
    """All warped: one state for any number. One warped: its neighbours feel it, within 15 m."""
    everywhere = dead_state(track[0], Row(track, [-4e-4] * 200), 200)
    assert set(everywhere.kind) == {1}
    single = [0.0] * 20
    single[10] = -4e-4
    found = dead_state(track[0], Row(track, single), 20)
    assert np.flatnonzero(found.kind).tolist() == list(range(7, 14))
    moved = [np.abs(found.rails[found.of(slab)]).max() for slab in range(7, 11)]
    assert moved[0] < 1e-2 * moved[1] < 1e-4 * moved[2] < 1e-4 * moved[3]  # the next slab's end rises with it
    x = np.arange(35.0, 85.0, 0.01)
    for side in range(2):
        height, slope = LaidRail(found, side).evaluate(x)
        # from one slab to the next the splines differ by what reaches over 15 m
        assert np.abs(np.gradient(height, x) - slope)[1:-1].max() < 1e-3 * np.abs(slope).max()
        assert height[0] == height[-1] == 0.0
