"""Static shape that settled ground leaves to the rails (MODEL §14).

The bed of the slabs is displaced by z_g(x) and presses with k_m (w - z_g). It transmits tension, so that the track is
linear: the rails lie in a static shape, that of slabs and rails on the displaced bed, and the train moves them from
there as it moves those of an even track. To a wheel the static shape is one of the running surface.

    K q = f,   f = int N^T k_m z_g of every slab,   no train, at rest
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import CubicSpline

from tiengine.parameters.arrays import Reals
from tiengine.track.fastening import Fastening
from tiengine.track.knots import uniform_knots
from tiengine.track.mortar import GAUSS
from tiengine.track.rail import Rail
from tiengine.track.rail_operators import RailOperators
from tiengine.track.settlement import Settlement, ground_shape
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices
from tiengine.track.slab_moments import places
from tiengine.track.splines import Splines
from tiengine.track.steady_track import SeatsInWindow, SteadyTrack

__all__ = ["settled_rail"]

BEYOND = 15.0  # m of track beyond either end of a settlement: fifteen decay lengths of a rail on its fastenings
KNOTS = 0.2  # m
SAMPLES = 0.05  # m


def settled_rail(
    settlement: Settlement,
    rail: Rail,
    fastening: Fastening,
    slab: Slab,
    bed_stiffness: float,
    design_of: Callable[[int], SlabMatrices],
    seat_factors: Callable[[int, int], Reals],
) -> tuple[float, float, CubicSpline]:
    """Compute the static vertical shape of both rails over a settlement.

    Args:
        settlement: The settlement.
        rail: Section of the rails.
        fastening: Sound fastening.
        slab: The slab with its mesh.
        bed_stiffness: k_m [N/m^3].
        design_of: Gives the matrices of a slab by its index along the track.
        seat_factors: Factors of consecutive seats, from the first and their number, shape (count, 2).

    Returns:
        Chainage of its ends [m], and the shape between them [m] over chainage, mean of both rails.
    """
    rear, front = settlement.reach
    first = max(int(np.floor((rear - BEYOND) / slab.pitch)), 0)
    count = int(np.ceil((front + BEYOND) / slab.pitch)) - first
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
    node = np.polynomial.legendre.leggauss(GAUSS)[0]
    along = places(slab, np.stack(np.meshgrid(node, node, indexing="ij"), axis=-1).reshape(-1, 2))[0]
    loads: list[Reals] = [np.zeros(10 * n)]
    for i, design in enumerate(designs):
        z = ground_shape(settlement, start + (i + 0.5) * slab.pitch + along).reshape(design.bed_factor.shape)
        pressed = (bed_stiffness * design.bed_factor * design.bed_weight * z) @ design.bed_shape
        loads.append(np.asarray(np.bincount(design.bed_index.ravel(), pressed.ravel(), design.n), np.float64))
    vertical = track.respond(np.concatenate(loads))[0].reshape(2, n, 2)[..., 0].mean(axis=0)
    s = np.linspace(0.0, length, int(np.ceil(length / SAMPLES)) + 1)
    w: Reals = operators.functions.shape(s) @ vertical
    return start, start + length, CubicSpline(start + s, w, bc_type="natural")
