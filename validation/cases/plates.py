"""Slabs of the library in free space and on their bed.

References: Ritz's method with Legendre polynomials (``closed_forms/plate_ritz``), converged to 1e-6; the bounce of a
rigid plate on a Winkler bed, omega^2 = k / (rho h), in closed form. Plain plates: ``thin_plates``.

Tolerances of meshes: a plane wave of wave number q at an angle theta to square elements of side h runs
(1 + nu)/48 sin^2(2 theta) (q h)^2 too slow in this element (from the Fourier symbol of its stencil; along the mesh it
is exact to h^4), so a mode with q^4 = rho h omega^2 / D is allowed (1 + nu)/48 (q h)^2, h the longer side.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.linalg

from tiengine.parameters.arrays import Reals
from tiengine.track.slab import load_slab
from tiengine.track.slab_matrices import SlabMatrices, slab_matrices
from validation.closed_forms.plate_ritz import frequencies
from validation.frame.case import Case

__all__ = ["CASES", "RITZ_DEGREE", "SLAB", "WAVE", "dispersion", "lowest"]

RITZ_DEGREE = 14
SLAB = "CRTS_III"
RITZ = "Ritz's method, Legendre polynomials to degree 14, rotary inertia included"
WAVE = "(1 + nu)/48 (q h)^2, the element's dispersion at 45 degrees to the mesh"


def dispersion(nu: float, wave: Reals, h: float) -> Reals:
    """Allowed relative error of frequency for squared wave numbers q^2 [1/m^2] and a longest side h [m]."""
    return (1.0 + nu) / 48.0 * wave * h**2


def lowest(K: Reals, matrices: SlabMatrices, count: int) -> Reals:
    """Lowest frequencies of a plate of stiffness K [Hz]; lateral displacement and yaw are left out."""
    omega2 = scipy.linalg.eigvalsh(K[:-2, :-2], matrices.M[:-2, :-2], subset_by_index=(0, count - 1))
    return np.sqrt(np.abs(omega2)) / (2.0 * np.pi)


@cache
def _meshed(name: str, nx: int, ny: int) -> SlabMatrices:
    slab, mortar = load_slab(name)
    return slab_matrices(slab.model_copy(update={"elements_x": nx, "elements_y": ny}), mortar)


@cache
def _free(nx: int, ny: int, name: str = SLAB) -> Reals:
    """Nine lowest frequencies of a slab in free space, mesh of nx by ny elements [Hz]."""
    matrices = _meshed(name, nx, ny)
    return lowest(matrices.K_plate, matrices, 9)


def _on_bed(name: str, nx: int, ny: int) -> Reals:
    """Nine lowest frequencies of a slab on its bed [Hz]."""
    matrices = _meshed(name, nx, ny)
    return lowest(matrices.K_plate + matrices.K_bed, matrices, 9)


@cache
def _exact(name: str = SLAB, bed: bool = False) -> Reals:
    """Six lowest elastic frequencies of a slab in free space, or nine lowest on its bed [Hz]."""
    slab, mortar = load_slab(name)
    h, stiffness = slab.thickness, mortar.stiffness if bed else 0.0
    section = slab.rigidity, slab.nu, slab.rho * h, slab.rho * h**3 / 12.0
    omega = frequencies(slab.length, slab.width, *section, RITZ_DEGREE, stiffness)
    return omega[0 if bed else 3 : 9] / (2.0 * np.pi)


def _allowed(name: str, ny: int) -> Reals:
    """Allowed error of the six lowest elastic frequencies [Hz]."""
    slab, f = load_slab(name)[0], _exact(name)
    wave = 2.0 * np.pi * f * np.sqrt(slab.rho * slab.thickness / slab.rigidity)
    return f * dispersion(slab.nu, wave, slab.width / ny)


def _allowed_on_bed(name: str, ny: int) -> Reals:
    """Allowed error on the bed, whose share of omega^2 has no error.

    Of the rigid motions the tilts bend a little by their rotary inertia, which takes (h/B)^2/2 off their frequency.
    """
    slab, f, allowed = load_slab(name)[0], _exact(name, bed=True), _allowed(name, ny)
    tilts = 0.5 * (slab.thickness / slab.width) ** 2 * np.max(allowed / _exact(name)) * f[:3]
    return np.concatenate([tilts, _exact(name) * allowed / f[3:]])


def _order() -> float:
    """Order of the largest error of six frequencies between 18 x 4 and 36 x 8 elements."""
    coarse, fine = (np.abs(_free(*mesh)[3:] / _exact() - 1.0).max() for mesh in ((18, 4), (36, 8)))
    return float(np.log2(coarse / fine))


def _bounce(name: str) -> float:
    """Frequency of the mode of the slab on its bed that is most like w = 1 [Hz]."""
    m = _meshed(name, 9, 2)
    omega2, modes = scipy.linalg.eigh((m.K_plate + m.K_bed)[:-2, :-2], m.M[:-2, :-2])
    rigid = np.zeros(m.n - 2)
    rigid[0::3] = 1.0
    share = np.abs(modes.T @ m.M[:-2, :-2] @ rigid)
    return float(np.sqrt(omega2[np.argmax(share)]) / (2.0 * np.pi))


def _bounce_exact(name: str) -> float:
    slab, mortar = load_slab(name)
    return float(np.sqrt(mortar.stiffness / (slab.rho * slab.thickness)) / (2.0 * np.pi))


CASES = (
    *(
        Case(
            name=f"plate-{nx}x{ny}",
            kind="verification",
            quantity=f"six free-free frequencies of the CRTS III slab, {nx} x {ny} elements [Hz]",
            source=RITZ,
            reference=_exact,
            rtol=rtol,
            why=why,
            compute=lambda nx=nx, ny=ny: _free(nx, ny)[3:],
        )
        for nx, ny, rtol, why in (
            (9, 2, 0.015, "two elements across, where mode 6 has a half wave in 1.9 m; h^2 for finer meshes"),
            (18, 4, 0.015 / 3.0, "h^2: a quarter of 9 x 2, or a third where that mesh is not yet in the range of h^2"),
            (36, 8, 0.015 / 12.0, "h^2: a quarter of 18 x 4"),
        )
    ),
    *(
        Case(
            name=f"plate-{name}",
            kind="verification",
            quantity=f"six free-free frequencies of the {name} slab, 36 x 8 elements [Hz]",
            source=RITZ,
            reference=lambda name=name: _exact(name),
            atol=_allowed(name, 8),
            why=WAVE,
            compute=lambda name=name: _free(36, 8, name)[3:],
        )
        for name in ("CRTS_I", "CRTS_II", "Zhai_slab")
    ),
    Case(
        name="plate-order",
        kind="convergence",
        quantity="order in h of the largest error, 18 x 4 to 36 x 8",
        source="ACM element: complete cubics, not conforming: h^2 in frequency",
        reference=2.0,
        atol=0.3,
        why="next term h^4 at four elements across",
        compute=_order,
    ),
    Case(
        name="plate-rigid",
        kind="verification",
        quantity="third rigid frequency over the first elastic one",
        source="rigid motions carry no energy",
        reference=0.0,
        atol=1e-4,
        why="root of rounding, 1.5e-8, times the span of the spectrum",
        compute=lambda: float(_free(9, 2)[2] / _free(9, 2)[3]),
    ),
    *(
        Case(
            name=f"slab-bounce-{name}",
            kind="verification",
            quantity=f"bounce of the {name} slab on its bed [Hz]",
            source="sqrt(k/(rho h))/(2 pi)",
            reference=lambda name=name: _bounce_exact(name),
            rtol=1e-9,
            why="rounding of the eigenvalue solver: the shapes contain w = 1",
            compute=lambda name=name: _bounce(name),
        )
        for name in ("CRTS_I", "CRTS_II", "CRTS_III", "Zhai_slab")
    ),
    *(
        Case(
            name=f"slab-bed-{name}",
            kind="verification",
            quantity=f"nine lowest frequencies of the {name} slab on its bed, 18 x 4 elements [Hz]",
            source=f"{RITZ}; for CRTS II only the bounce: its lowest modes on the bed are waves of 1.6 m",
            reference=lambda name=name: _exact(name, bed=True),
            atol=_allowed_on_bed(name, 4),
            why="mesh as in free space, times (f_free/f)^2: the bed's share has no error; tilts: times (h/B)^2/2",
            compute=lambda name=name: _on_bed(name, 18, 4),
        )
        for name in ("CRTS_I", "CRTS_III", "Zhai_slab")
    ),
)
