"""Ground that has settled or heaved under the slabs, and the shape that it leaves to the rails (MODEL §14).

The bed of the slabs is displaced by z_g(x) and presses with k_m (w - z_g). It transmits tension, so that the track is
linear: the rails lie in a static shape, that of slabs and rails on the displaced bed, and the train moves them from
there as it moves those of an even track. To a wheel the static shape is one of the running surface.

    K q = f,   f = int N^T k_m z_g of every slab,   no train, at rest
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.interpolate import CubicSpline

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q
from tiengine.track.fastening import Fastening
from tiengine.track.knots import uniform_knots
from tiengine.track.mortar import GAUSS
from tiengine.track.rail import Rail
from tiengine.track.rail_operators import RailOperators
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices
from tiengine.track.slab_moments import places
from tiengine.track.splines import Splines
from tiengine.track.steady_track import SeatsInWindow, SteadyTrack

__all__ = ["Settlement", "check_settlements", "ground_shape", "settled_rail"]

BEYOND = 15.0  # m of track beyond either end of a settlement: fifteen decay lengths of a rail on its fastenings
KNOTS = 0.2  # m
SAMPLES = 0.05  # m


class Settlement(Params):
    """A settlement of the ground under the slabs, or a heave; it is symmetrical about its middle.

    `cosine` is one wave depth (1 + cos)/2; `angles` are two straight ramps that meet in the middle, as where a pier has
    sunk between its neighbours. Slabs and rails follow with their stiffness; the bed transmits tension.
    """

    kind: Annotated[Literal["cosine", "angles"], Field(description="shape")]
    at: Annotated[float, Q("m", "chainage of the middle", ge=0, le=1e7)]
    length: Annotated[float, Q("m", "length of the whole settlement", ge=1, le=500)]
    depth: Annotated[float, Q("m", "depth in the middle; negative for a heave", ge=-0.2, le=0.2)]

    @property
    def reach(self) -> tuple[float, float]:
        """Chainage of its ends [m]."""
        return self.at - 0.5 * self.length, self.at + 0.5 * self.length


def ground_shape(settlement: Settlement, x: Reals) -> Reals:
    """Displacement z_g of the ground at chainages [m], down positive, shape as x.

    Args:
        settlement: The settlement.
        x: Chainages [m].
    """
    t = np.minimum(np.abs(x - settlement.at) / (0.5 * settlement.length), 1.0)
    form = 0.5 * (1.0 + np.cos(np.pi * t)) if settlement.kind == "cosine" else 1.0 - t
    return settlement.depth * form


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


def check_settlements(settlements: Sequence[Settlement], *, begin: float, end: float, no_tension: bool) -> None:
    """Refuse settlements that no wheel reaches, and a bed that would leave a gap under them.

    Args:
        settlements: Entries of the scenario.
        begin: Chainage of the leading wheel at the start [m].
        end: Its chainage at the end of the run [m].
        no_tension: Whether the bed transmits no tension.

    Raises:
        InputError: Names the entry, its value and the rule.
    """
    if settlements and no_tension:
        raise InputError(
            "track.settlements: must be left out with a bed that transmits no tension (mortar_no_tension); gaps between"
            " slab and settled ground are not modelled"
        )
    for i, each in enumerate(settlements):
        rear, front = each.reach
        if front <= begin or rear >= end:
            raise InputError(
                f"track.settlements[{i}].at = {each.at:g}: must lie between {begin:g} and {end:g} m, which the leading"
                " wheel covers in this run"
            )
