"""Static shape that displaced ground leaves to the rails (MODEL §14).

The bed of the slabs is displaced by z_g(x) and presses with k_m (w - z_g), and with its lateral stiffness likewise
against y_g(x). It transmits tension, so that the track is linear: the rails lie in a static shape, that of slabs and
rails on the displaced bed, and the train moves them from there as it moves those of an even track. To a wheel the
static shape is one of the running surface.

    K q = f,   f = int N^T k_m z_g of every slab,   no train, at rest

A slab is rigid laterally: k_y int (y_g, x y_g) act on its displacement and yaw.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from tiengine.parameters.arrays import Reals
from tiengine.track.fastening import Fastening
from tiengine.track.knots import uniform_knots
from tiengine.track.mortar import GAUSS, Mortar
from tiengine.track.rail import Rail
from tiengine.track.rail_operators import RailOperators
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices
from tiengine.track.slab_moments import places
from tiengine.track.splines import Splines
from tiengine.track.steady_track import SeatsInWindow, SteadyTrack

__all__ = ["GroundShape", "settled_rail"]

BEYOND = 15.0  # m of track beyond either end of a displacement: fifteen decay lengths of a rail on its fastenings
KNOTS = 0.2  # m
SAMPLES = 0.05  # m

GroundShape = Callable[[Reals, int], Reals]
"""Displacement of the ground [m] at chainages [m], down (0) or to the right (1)."""


def settled_rail(
    ground: GroundShape,
    reach: tuple[float, float],
    rail: Rail,
    fastening: Fastening,
    slab: Slab,
    mortar: Mortar,
    design_of: Callable[[int], SlabMatrices],
    seat_factors: Callable[[int, int], Reals],
) -> CubicSpline:
    """Compute the static shape of the rails over displaced ground.

    The rails' ends are held, another ``BEYOND`` from where the shape ends, since a ramp leaves the ground displaced.

    Args:
        ground: Displacement of the ground.
        reach: Chainages between which it is not constant [m].
        rail: Section of the rails.
        fastening: Sound fastening.
        slab: The slab with its mesh.
        mortar: Its bed.
        design_of: Gives the matrices of a slab by its index along the track.
        seat_factors: Factors of consecutive seats, from the first and their number, shape (count, 2).

    Returns:
        Over chainage [m], from ``BEYOND`` before the displacement to as far behind it: down and to the right [m], shape
        (2,), mean of both rails.
    """
    first = max(int(np.floor((reach[0] - 2.0 * BEYOND) / slab.pitch)), 0)
    count = int(np.ceil((reach[1] + 2.0 * BEYOND) / slab.pitch)) - first
    start, length = first * slab.pitch, count * slab.pitch
    operators = RailOperators(rail, Splines(uniform_knots(length, KNOTS)))
    seat = np.arange(count * slab.fastenings)
    seats = SeatsInWindow(
        s=np.asarray((seat + 0.5) * slab.fastening_pitch, np.float64),
        slab=seat // slab.fastenings,
        seat=seat % slab.fastenings,
        scale=seat_factors(first * slab.fastenings, len(seat)),
        length=fastening.length,
    )
    designs = [design_of(first + i) for i in range(count)]
    track = SteadyTrack(operators, fastening, seats, designs, 0.0, np.array([0.5 * length]))
    n = operators.functions.count
    loads = [_load(ground, design, slab, mortar, start + (i + 0.5) * slab.pitch) for i, design in enumerate(designs)]
    vertical, lateral, _ = track.respond(np.concatenate([np.zeros(10 * n), *loads]))
    w = vertical.reshape(2, n, 2)[..., 0].mean(axis=0)
    v, _, turned = np.moveaxis(lateral.reshape(2, n, 3).mean(axis=0), -1, 0)
    begin, end = max(reach[0] - BEYOND, start), reach[1] + BEYOND
    x = np.linspace(begin, end, int(np.ceil((end - begin) / SAMPLES)) + 1)
    shape = operators.functions.shape(x - start)
    surface = np.column_stack([shape @ w, shape @ (v + rail.arm_head * turned)])
    return CubicSpline(x, surface, bc_type="natural")


def _load(ground: GroundShape, design: SlabMatrices, slab: Slab, mortar: Mortar, centre: float) -> Reals:
    """Generalised forces of the displaced bed on a slab, shape (dofs,) [N, N m]; its centre is at a chainage [m]."""
    node = np.polynomial.legendre.leggauss(GAUSS)[0]
    along = places(slab, np.stack(np.meshgrid(node, node, indexing="ij"), axis=-1).reshape(-1, 2))[0]
    area = design.bed_factor * design.bed_weight
    z, y = (ground(centre + along, direction).reshape(area.shape) for direction in range(2))
    pressed = (mortar.stiffness * area * z) @ design.bed_shape
    load = np.asarray(np.bincount(design.bed_index.ravel(), pressed.ravel(), design.n), np.float64)
    pushed = mortar.lateral_stiffness * area * y
    load[-2:] = pushed.sum(), (pushed * along.reshape(area.shape)).sum()
    return load
