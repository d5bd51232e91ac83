"""Thin rectangular plates: free, on a bed, and a large one under a point load.

References: Ritz's method with Legendre polynomials (``closed_forms/plate_ritz``), converged to 1e-6; A. W. Leissa, The
free vibration of rectangular plates, J. Sound Vib. 31 (1973) 257-293, table C16 (all edges free, nu = 0.3), whose
digits follow from his own 36 beam functions (``closed_forms/plate_beam_functions``) and lie up to 1 % above the exact
ones; omega^2 = omega_free^2 + k / (rho h) on a Winkler bed; the point load on an infinite plate on such a bed
(``closed_forms/plate_winkler``). x along the side a, w down; parameters are omega a^2 sqrt(rho h/D).

Tolerances of meshes: see ``plates``.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.linalg

from tiengine.parameters.arrays import Reals
from tiengine.track.mortar import Mortar
from tiengine.track.slab import Slab, load_slab
from tiengine.track.slab_matrices import slab_matrices
from validation.cases.plates import RITZ_DEGREE, SLAB, WAVE, dispersion, lowest
from validation.closed_forms.plate_beam_functions import leissa_parameters
from validation.closed_forms.plate_ritz import frequencies
from validation.closed_forms.plate_winkler import mesh_excess, point_load_deflection
from validation.frame.case import Case

__all__ = ["CASES"]

LEISSA = "Leissa, J. Sound Vib. 31 (1973) 257, table C16"
NU = 0.3
ASPECTS = {1.0: (12, 12), 1.5: (12, 8), 2.5: (20, 8)}
"""a/b of thin plates, and their meshes of square elements."""
PRINTED = {
    1.0: (13.489, 19.789, 24.432, 35.024, 35.024, 61.526),
    1.5: (20.128, 21.603, 46.654, 50.293, 58.201, 67.494),
    2.5: (21.643, 33.050, 60.137, 71.484, 117.45, 119.38),
}
"""omega a^2 sqrt(rho h / D)."""
DIGIT = {1.0: np.full(6, 1e-3), 1.5: np.full(6, 1e-3), 2.5: np.repeat([1e-3, 1e-2], [4, 2])}
"""One unit of the last printed digit: 35.02347 is printed as 35.024."""
THIN = 1e-3  # h/b of thin plates: rotary inertia lowers their frequencies by (q h)^2 / 24 < 1e-5
BED = 50.0  # k b^4/D of thin plates on a bed
QUARTER = 6.0  # l: from the point load to the edges of the plate on its bed
PLACES = np.array([0.0, 1.0, 2.0, 3.0, np.sqrt(2.0), np.sqrt(8.0)])
"""Places r/l: under the load, three along the mesh, two along its diagonal."""
_EXCESS = {per_radius: mesh_excess((1.0 + NU) / 48.0, 1.0 / per_radius) for per_radius in (2, 4)}


# stiffness goes with twice the frequency, the mean over all directions is half of that at 45 degrees
def _bed(stiffness: float) -> Mortar:
    return load_slab(SLAB)[1].model_copy(update={"stiffness": stiffness})


def _plate(length: float, width: float, nx: int, ny: int, thickness: float) -> Slab:
    """A plate with negligible fastenings."""
    return Slab(
        length=length, width=width, thickness=thickness, gap=0.0, fastening_pitch=length / 2.0, fastenings=2, E=3e10,
        nu=NU, rho=2500.0, seat_half_spacing=0.3 * width, elements_x=nx, elements_y=ny,
    )  # fmt: skip


@cache
def _thin(aspect: float, bed: bool = False) -> Reals:
    """Elastic omega a^2 sqrt(rho h/D) of a thin plate, b = 1 m, six in free space or three on a bed of k = 50 D."""
    slab = _plate(aspect, 1.0, *ASPECTS[aspect], THIN)
    matrices = slab_matrices(slab, _bed(BED * slab.rigidity))
    f = lowest(matrices.K_plate + bed * matrices.K_bed, matrices, 9)
    scale = 2.0 * np.pi * aspect**2 * np.sqrt(slab.rho * slab.thickness / slab.rigidity)
    return scale * f[0 if bed else 3 :]


@cache
def _thin_exact(aspect: float) -> Reals:
    return aspect**2 * frequencies(aspect, 1.0, 1.0, NU, 1.0, 0.0, RITZ_DEGREE)[3:9]


def _thin_allowed(aspect: float) -> Reals:
    """Allowed error of the mesh and of rotary inertia."""
    exact = _thin_exact(aspect)
    wave = exact / aspect**2
    return exact * (dispersion(NU, wave, 1.0 / ASPECTS[aspect][1]) + wave * THIN**2 / 24.0)


def _thin_bed_exact(aspect: float) -> Reals:
    """Nine modes on the bed: rigid motions, then elastic ones."""
    return np.sqrt(np.append(np.zeros(3), _thin_exact(aspect)) ** 2 + BED * aspect**4)


def _thin_bed_allowed(aspect: float) -> Reals:
    f = _thin_bed_exact(aspect)
    return THIN**2 * f + np.append(np.zeros(3), _thin_exact(aspect) * _thin_allowed(aspect)) / f


def _leissa_excess(aspect: float) -> Reals:
    """Excess of Leissa's 36 functions over the exact values."""
    return leissa_parameters(aspect, NU, 6) - _thin_exact(aspect)


@cache
def _field(per_radius: int) -> Reals:
    """Point load: w over w(0) of the infinite plate at :data:`PLACES`, elements of side l/per_radius.

    A quarter of a square plate on its bed with symmetry conditions and the load in its corner; l = 1 m.
    """
    n = round(QUARTER * per_radius)
    slab = _plate(QUARTER, QUARTER, n, n, 0.01)
    m = slab_matrices(slab, _bed(slab.rigidity))
    ix, iy = np.divmod(np.arange((n + 1) ** 2), n + 1)
    held = np.concatenate([3 * np.flatnonzero(ix == 0) + 1, 3 * np.flatnonzero(iy == 0) + 2])  # slopes
    free = np.setdiff1d(np.arange(slab.plate_dofs), held)
    load = np.zeros(slab.plate_dofs)
    load[0] = 0.25 * 8.0 * slab.rigidity  # P = 8 D: w(0) = 1 m
    u = np.zeros_like(load)
    u[free] = scipy.linalg.solve((m.K_plate + m.K_bed)[np.ix_(free, free)], load[free], assume_a="pos")
    w = u[0::3].reshape(n + 1, n + 1)[::per_radius, ::per_radius]
    return np.concatenate([w[:4, 0], np.diag(w)[1:3]])


CASES = (
    *(
        Case(
            name=f"plate-aspect-{aspect:g}",
            kind="verification",
            quantity=f"free thin plate, a/b = {aspect:g}, omega a^2 sqrt(rho h/D), {nx} x {ny} elements, six modes",
            source="Ritz's method, Legendre polynomials to degree 14, without rotary inertia",
            reference=lambda aspect=aspect: _thin_exact(aspect),
            atol=_thin_allowed(aspect),
            why=f"{WAVE}; rotary inertia of h = b/1000",
            compute=lambda aspect=aspect: _thin(aspect),
        )
        for aspect, (nx, ny) in ASPECTS.items()
    ),
    *(
        Case(
            name=f"plate-leissa-{aspect:g}",
            kind="validation",
            quantity=f"the same against Leissa's table, a/b = {aspect:g}",
            source=LEISSA,
            reference=PRINTED[aspect],
            atol=_thin_allowed(aspect) + _leissa_excess(aspect) + DIGIT[aspect],
            why="his 36 functions are above the exact values by 0.1 to 1.1 %; the mesh; printed digits",
            compute=lambda aspect=aspect: _thin(aspect),
        )
        for aspect in ASPECTS
    ),
    Case(
        name="plate-leissa-method",
        kind="validation",
        quantity="Ritz's method with Leissa's 36 functions against his table, 18 numbers (not the engine)",
        source=LEISSA,
        reference=tuple(PRINTED.values()),
        atol=np.concatenate(list(DIGIT.values())),
        why="one unit of the last printed digit",
        compute=lambda: [leissa_parameters(aspect, NU, 6) for aspect in ASPECTS],
    ),
    *(
        Case(
            name=f"plate-bed-{aspect:g}",
            kind="verification",
            quantity=f"thin plate on a bed of k = 50 D/b^4, a/b = {aspect:g}, omega a^2 sqrt(rho h/D), nine modes",
            source="omega^2 = omega_free^2 + k/(rho h), omega_free by Ritz's method, 0 for three rigid motions",
            reference=lambda aspect=aspect: _thin_bed_exact(aspect),
            atol=_thin_bed_allowed(aspect),
            why=f"{WAVE}, times (f_free/f)^2; rotary inertia of h = b/1000, up to h^2/b^2",
            compute=lambda aspect=aspect: _thin(aspect, bed=True),
        )
        for aspect in ASPECTS
    ),
    *(
        Case(
            name=f"plate-point-load-{per_radius}",
            kind="verification",
            quantity=f"point load on a large plate on its bed, w(r) over P l^2/8D, six places, h = l/{per_radius}",
            source="-4/pi kei(r/l): P/(8 sqrt(k D)) under the load (Hertz 1884, Westergaard 1926)",
            reference=point_load_deflection(8.0, 1.0, 1.0, PLACES),
            atol=_EXCESS[per_radius],
            why="effect of the mesh's dispersion under the load, to first order",
            compute=lambda per_radius=per_radius: _field(per_radius),
        )
        for per_radius in (2, 4)
    ),
    Case(
        name="plate-point-load-order",
        kind="convergence",
        quantity="excess under the load over P l^2/8D, h = l/2, l/4",
        source="(1 + nu)/(12 pi) (h/l)^2 [ln(pi l/h) - 1/4], from the element's dispersion",
        reference=[_EXCESS[per_radius] for per_radius in (2, 4)],
        atol=[0.35 * 4.0 / np.pi * (1.0 + NU) / 48.0 / per_radius**2 for per_radius in (2, 4)],
        why="shortest wave of a square mesh: pi/h to sqrt(2) pi/h, ln sqrt(2) = 0.35",
        compute=lambda: [_field(per_radius)[0] - 1.0 for per_radius in (2, 4)],
    ),
)
