r"""Rails and slabs at rest under their own weight, on a bed that does not pull (MODEL §14).

Rails and slabs carry their weight and lie on their fastenings and on the bed; slabs may be warped, the bed may lie
lower under parts of them, the ground may have settled, seats may hang:

    K q = f(weights, warp) - sum of what the bed and the hanging seats push
    bed:           p = factor k_m max(0, w - z_g - gap)
    hanging seat:  F = k_v (u - g) where u > g, k_v (u + g) where u < -g, else none; u its stretch

A hanging seat has the same play upwards, where its clips hold the rail. The pressure that a run starts from is signed:
factor k_m (w - z_g - gap), below zero where a gap is open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY
from tiengine.track.fastening import Fastening
from tiengine.track.mortar import Mortar
from tiengine.track.rail import Rail
from tiengine.track.rail_operators import RailOperators
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices, bed_points
from tiengine.track.splines import Splines
from tiengine.track.steady_track import SeatsInWindow, track_stiffness, vertical_stretch
from tiengine.track.unilateral import PushingSprings, at_rest
from tiengine.track.warp_load import warp_load

__all__ = ["RestingSlab", "RestingTrack", "TrackParts", "resting_track"]

KNOTS = 0.2  # m
SAMPLES = 0.05  # m


@dataclass(frozen=True)
class TrackParts:
    """Parts that all slabs of a track share.

    Attributes:
        rail: Section of the rails.
        fastening: Sound fastening.
        slab: The slab with its mesh.
        mortar: Its bed.
    """

    rail: Rail
    fastening: Fastening
    slab: Slab
    mortar: Mortar


@dataclass(frozen=True, eq=False)
class RestingSlab:
    """One slab, and what is wrong with it.

    Attributes:
        matrices: Matrices of its design.
        seat_factor: Factors of its fastenings, shape (seats, 2).
        play: Gap of hanging seats [m], 0 elsewhere, shape (seats, 2).
        low: How much lower the bed begins at its quadrature points, z_g + gap [m], shape (n_el, n_q).
        curvature: Of the slab if it were free [1/m].
    """

    matrices: SlabMatrices
    seat_factor: Reals
    play: Reals
    low: Reals
    curvature: float = 0.0


@dataclass(frozen=True, eq=False)
class RestingTrack:
    """A row of slabs with their rails at rest.

    Attributes:
        pressure: Signed pressure of the bed at its quadrature points [Pa], shape (slabs, n_el, n_q).
        seat_force: k_v u of every fastening, hanging ones included [N], shape (slabs, seats, 2).
        slabs: Coordinates of the slabs, shape (slabs, dofs).
        rails: Deflection of both rails [m] at ``SAMPLES`` or closer, ends included, shape (2, points).
    """

    pressure: Reals
    seat_force: Reals
    slabs: Reals
    rails: Reals


def resting_track(parts: TrackParts, slabs: Sequence[RestingSlab]) -> RestingTrack:
    """Compute a row of slabs at rest; the rails are pinned at its ends.

    Args:
        parts: Of the track.
        slabs: The slabs from the rear.

    Raises:
        InputError: No state of rest was found.
    """
    slab, count = parts.slab, len(slabs)
    length = count * slab.pitch
    operators = RailOperators(parts.rail, Splines(_knots(slab, count)))
    seat = np.arange(count * slab.fastenings)
    factor, play = (np.concatenate([getattr(each, name) for each in slabs]) for name in ("seat_factor", "play"))
    seats = SeatsInWindow(
        s=np.asarray((seat + 0.5) * slab.fastening_pitch, np.float64),
        slab=seat // slab.fastenings,
        seat=seat % slab.fastenings,
        scale=np.where(play > 0.0, 0.0, factor),
        length=parts.fastening.length,
    )
    designs = [each.matrices for each in slabs]
    K = track_stiffness(operators, parts.fastening, seats, designs, [_lateral(each) for each in designs], 0.0)
    bed = _bed(slabs, parts.mortar.stiffness, 10 * operators.functions.count)
    stretch = vertical_stretch(operators, seats, designs)
    hanging = np.flatnonzero(play.T.ravel() > 0.0)
    k_v = parts.fastening.vertical_stiffness
    springs = _joined(bed, _hanging(stretch, k_v * factor.T.ravel(), play.T.ravel(), hanging))
    q = at_rest(K, _loads(parts, operators, slabs), springs)
    n = operators.functions.count
    s = np.linspace(0.0, length, count * samples(slab) + 1)
    signed = bed.stiffness / np.tile(designs[0].bed_weight, len(bed.stiffness) // len(designs[0].bed_weight))
    return RestingTrack(
        pressure=(signed * (bed.rows @ q - bed.gap)).reshape(count, *designs[0].bed_factor.shape),
        seat_force=(k_v * (stretch @ q)).reshape(2, count, -1).transpose(1, 2, 0),
        slabs=q[10 * n :].reshape(count, -1),
        rails=q[: 10 * n].reshape(2, 5 * n)[:, : 2 * n : 2] @ operators.functions.shape(s).T,
    )


def _knots(slab: Slab, count: int) -> Reals:
    """Knots of the rails over a number of slabs [m], the same over each: rows of any length then agree."""
    return np.linspace(0.0, count * slab.pitch, count * int(np.ceil(slab.pitch / KNOTS)) + 1)


def samples(slab: Slab) -> int:
    """Steps between the samples of a rail over one slab pitch.

    Args:
        slab: Gives the pitch.
    """
    return int(np.ceil(slab.pitch / SAMPLES))


def _lateral(design: SlabMatrices) -> Reals:
    """Lateral bed of a slab alone, shape (dofs, dofs)."""
    bed = np.zeros_like(design.K_bed)
    bed[-2:, -2:] = design.K_bed[-2:, -2:]
    return bed


def _bed(slabs: Sequence[RestingSlab], stiffness: float, first: int) -> PushingSprings:
    """The bed's quadrature points as springs; the slabs' coordinates begin at ``first``."""
    points = sp.csr_array(bed_points(slabs[0].matrices).T)  # the same for all
    rows = sp.block_diag([points] * len(slabs), format="csr")
    before = sp.csr_array((rows.shape[0], first))
    weight = [(stiffness * each.matrices.bed_factor * each.matrices.bed_weight).ravel() for each in slabs]
    low = [each.low.ravel() for each in slabs]
    return PushingSprings(sp.csr_array(sp.hstack([before, rows])), np.concatenate(weight), np.concatenate(low))


def _hanging(stretch: sp.csr_array, stiffness: Reals, play: Reals, hanging: NDArray[np.intp]) -> PushingSprings:
    """Hanging seats as springs that push, each downwards and upwards."""
    rows = stretch[hanging]
    both = sp.csr_array(sp.vstack([rows, -rows]))
    return PushingSprings(both, np.tile(stiffness[hanging], 2), np.tile(play[hanging], 2))


def _joined(first: PushingSprings, second: PushingSprings) -> PushingSprings:
    return PushingSprings(
        sp.csr_array(sp.vstack([first.rows, second.rows])),
        np.concatenate([first.stiffness, second.stiffness]),
        np.concatenate([first.gap, second.gap]),
    )


def _loads(parts: TrackParts, operators: RailOperators, slabs: Sequence[RestingSlab]) -> Reals:
    """Weights of rails and slabs, and the loads that warp the slabs; shape (unknowns,)."""
    n, functions, slab = operators.functions.count, operators.functions, parts.slab
    node, weight = np.polynomial.legendre.leggauss(4)
    knots = _knots(slab, len(slabs))
    half = 0.5 * np.diff(knots)[:, None]
    s, ds = (knots[:-1, None] + half * (1.0 + node)).ravel(), (half * weight).ravel()
    vertical = np.zeros((n, 2))
    vertical[:, 0] = parts.rail.densities[0] * GRAVITY * (functions.shape(s).T @ ds)
    rail = np.concatenate([vertical.ravel(), np.zeros(3 * n)])
    first = slabs[0].matrices
    index, per_element = first.bed_index, slab.weight_pressure * (first.bed_weight @ first.bed_shape)
    weight_load = np.bincount(index.ravel(), np.tile(per_element, len(index)), first.n)
    warp = np.append(warp_load(slab), [0.0, 0.0])
    return np.concatenate([rail, rail, *(weight_load + each.curvature * warp for each in slabs)])
