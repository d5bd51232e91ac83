"""Warped slabs, gaps under slabs and hanging seats: closed forms, and limits that are another model of the engine.

References: a free slab under a gradient T' bends to a bowl of curvature alpha T' in both directions; held flat it has
the moment D (1 + nu) alpha T'. A bed without tension carries the dead weight of slab and rails, wherever it carries.
A gap too high to close is a void, or a failed fastening; one of no height is sound.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.engine import backend
from tiengine.kernels import mortar as kernel
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.track.dead_load import RestingSlab, TrackParts, resting_track
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices, slab_matrices
from tiengine.track.slab_moments import nodes
from tiengine.track.warp_load import warp_load
from validation.frame.case import Case

__all__ = ["CASES"]

GRADIENT, EXPANSION = 90.0, 1e-5
CURVATURE = GRADIENT * EXPANSION  # 1/m
GRADIENTS = (-45.0, 45.0, 90.0)
ROW = 7  # slabs: from the pinned ends of the rails the middle one is 17 m away
WAY = (
    "train.distance=25", "train.start=60", "irregularity.spectrum='none'", "irregularity.taper=1",
    "track.mortar_no_tension=true", "output.run_in=0",
)  # fmt: skip
SEATS = "track.failed_fastenings=[{{rail='left', seats=[121, 122], {}}}]"
VOID = "track.mortar_voids=[{{slab=13, x=[1.8666666666666667, 3.7333333333333333], y=[-1.25, 1.25], {}}}]"
DROP, GAP, STEP, STEPS = 0.2, 2e-5, 2e-6, 1500  # m/s, m, s


@cache
def _track() -> tuple[TrackParts, SlabMatrices]:
    """Default track with the slab of the closed forms: E 36 GPa, h 0.2 m, nu 0.2, 5.6 x 2.5 m."""
    backend.start()
    parts = load_scenario("default").parts
    slab = parts.slab.model_copy(update={"E": 36e9, "nu": 0.2})
    matrices = slab_matrices(slab, parts.mortar, (), parts.fastening.baseplate)
    return TrackParts(parts.rail, parts.fastening, slab, parts.mortar), matrices


def _slab() -> Slab:
    return _track()[0].slab


def _bowl() -> float:
    """Corner of the free slab against its centre [mm]."""
    K = _track()[1].K_plate[:-2, :-2]
    w = np.linalg.lstsq(K, CURVATURE * warp_load(_slab()), rcond=1e-12)[0][::3]
    x, y = nodes(_slab())
    corners = w[(np.abs(x) > x.max() - 1e-9) & (np.abs(y) > y.max() - 1e-9)].mean()
    rows = np.column_stack([np.ones_like(x), x, y, x**2, y**2])  # the mesh may have no node at the centre
    return float(1e3 * (corners - np.linalg.lstsq(rows, w, rcond=None)[0][0]))


def _held() -> list[float]:
    """Moments along and across of the slab held flat, by the work on unit curvatures [kN m/m]."""
    x, y = nodes(_slab())
    found = []
    for place, bent in ((1, x), (2, y)):
        motion = np.zeros((len(x), 3))
        motion[:, 0], motion[:, place] = 0.5 * bent**2, bent
        work = CURVATURE * warp_load(_slab()) @ motion.ravel()
        found.append(1e-3 * float(work) / (_slab().length * _slab().width))
    return found


@cache
def _pressures(gradient: float) -> Reals:
    """Signed pressure under the middle one of a row of slabs that are all warped [Pa], shape (n_el, n_q)."""
    parts, matrices = _track()
    seats = parts.slab.fastenings
    none, one = np.zeros((seats, 2)), np.ones((seats, 2))
    slab = RestingSlab(matrices, one, none, np.zeros_like(matrices.bed_factor), EXPANSION * gradient)
    return resting_track(parts, [slab] * ROW).pressure[ROW // 2]


def _carried() -> list[float]:
    """Force of the bed over the dead weight of slab and rails."""
    parts, matrices = _track()
    weight = (parts.slab.mass + 2.0 * parts.rail.densities[0] * parts.slab.pitch) * GRAVITY
    return [float(np.sum(matrices.bed_weight * np.maximum(_pressures(T), 0.0)) / weight) for T in GRADIENTS]


def _at_corner() -> float:
    """Pressure at the corner of a slab with a cold top [Pa]."""
    return float(np.maximum(_pressures(-45.0), 0.0)[0, 0])


@cache
def _forces(*changes: str) -> Reals:
    with run(load_scenario("default", [*WAY, *changes])) as result:
        return np.asarray(result.wheel()["normal_force"], np.float64)


def _apart(first: str, second: str = "output.run_in=0") -> float:
    """Largest difference of normal forces between two tracks over their mean [%]."""
    a, b = _forces(first), _forces(second)
    return float(100.0 * np.abs(a - b).max() / b.mean())


def _returned(damping: float) -> float:
    """Largest energy of a free slab that is thrown onto a bed 20 um below it, over that at the start."""
    parts, m = _track()
    k, rest = parts.mortar.stiffness, np.full((1, *m.bed_factor.shape), -parts.mortar.stiffness * GAP)
    lateral, motion = np.zeros((1, 2, 2)), np.zeros((3, m.n))
    motion[1, :-2:3] = DROP * (1.0 + 0.3 * np.arange(m.n // 3) / m.n)
    inverse, energies = np.linalg.inv(m.M), []
    for _ in range(STEPS):
        motion[2] = -m.K_plate @ motion[0]
        kernel.add_bed_forces(
            1, m.n, m.n, np.zeros(1, np.int32), np.zeros((1, 1), np.int32), m.bed_index, m.bed_shape, m.bed_weight,
            np.ones_like(rest), rest, lateral, lateral, k, damping, 1, 1, motion, np.zeros((1, 1, 2)),
        )  # fmt: skip
        w = np.einsum("ei,qi->eq", motion[0][m.bed_index], m.bed_shape)
        spring = k * np.sum(m.bed_weight * np.maximum(w - GAP, 0.0) ** 2)
        energies.append(0.5 * (motion[1] @ m.M @ motion[1] + motion[0] @ m.K_plate @ motion[0] + spring))
        motion[1] += STEP * (inverse @ motion[2])
        motion[0] += STEP * motion[1]
    return float(max(energies) / energies[0])


CASES = (
    Case(
        name="warp-free-corner",
        kind="verification",
        quantity="corner of a free slab of 5.6 x 2.5 m against its centre under 90 K/m [mm]",
        source="closed form alpha T' (x^2 + y^2)/2",
        reference=lambda: 1e3 * CURVATURE * (2.8**2 + 1.25**2) / 2.0,
        rtol=1e-6,
        why="the element has all quadratics: rounding of a singular system",
        compute=_bowl,
    ),
    Case(
        name="warp-held-moment",
        kind="verification",
        quantity="moment of a slab held flat under 90 K/m, along and across [kN m/m]",
        source="closed form D (1 + nu) alpha T'",
        reference=(27.0, 27.0),
        rtol=1e-9,
        why="rounding",
        compute=_held,
    ),
    Case(
        name="warp-dead-weight",
        kind="verification",
        quantity="pressure under a warped slab, summed, over the weight of slab and rails, at -45, 45, 90 K/m [-]",
        source="equilibrium",
        reference=(1.0, 1.0, 1.0),
        rtol=1e-4,
        why="the rails' pinned ends are 17 m away; slabs that lift lean on each other through the rails",
        compute=_carried,
    ),
    Case(
        name="warp-lifted-corner",
        kind="verification",
        quantity="pressure under a lifted corner [Pa]",
        source="a bed without tension",
        reference=0.0,
        why="exact",
        compute=_at_corner,
    ),
    Case(
        name="gap-huge",
        kind="verification",
        quantity="wheel forces over a gap of 0.1 m against a void of factor 0, largest difference over the mean [%]",
        source="the same track without the bed",
        reference=0.0,
        atol=0.05,
        why="the open bed is taken out of the implicit block by two passes a step, the void is not in it",
        compute=lambda: _apart(VOID.format("gap=0.1"), VOID.format("factor=0.0")),
    ),
    Case(
        name="gap-none",
        kind="verification",
        quantity="wheel forces over a gap of no height against a sound bed, largest difference over the mean [%]",
        source="the sound track",
        reference=0.0,
        why="exact",
        compute=lambda: _apart(VOID.format("gap=0.0")),
    ),
    Case(
        name="hanging-seat-huge",
        kind="verification",
        quantity="wheel forces over seats that hang by 0.1 m against failed ones, largest difference over the mean [%]",
        source="the track with failed seats",
        reference=0.0,
        why="exact",
        compute=lambda: _apart(SEATS.format("gap=0.1"), SEATS.format("factor=0.0")),
    ),
    Case(
        name="hanging-seat-none",
        kind="verification",
        quantity="wheel forces over seats that hang by nothing against sound ones, largest difference [%]",
        source="the sound track",
        reference=0.0,
        why="exact",
        compute=lambda: _apart(SEATS.format("gap=0.0")),
    ),
    Case(
        name="gap-energy",
        kind="verification",
        quantity="largest energy of a slab thrown onto a bed across a gap over that at the start, undamped, damped [-]",
        source="energy is not created",
        reference=(1.0, 1.0),
        atol=0.01,
        rule="at most",
        why="central differences at a tenth of the shortest period",
        compute=lambda: [_returned(0.0), _returned(3.458e4)],
    ),
)
