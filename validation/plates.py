"""Slabs: free-free plates and a plate on its bed.

References: Ritz's method with Legendre polynomials (``closed_forms/plate_ritz``), converged to 1e-6; A.
W. Leissa, The free vibration of rectangular plates, J. Sound Vib. 31 (1973) 257-293, table C16 (square,
nu = 0.3); the bounce of a rigid plate on a Winkler bed, omega^2 = k / (rho h), in closed form.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from tiengine.slab import Slab, SlabMatrices, load_slab, slab_matrices
from validation.case import Case
from validation.closed_forms.plate_ritz import frequencies

RITZ_DEGREE = 14
SLAB = "CRTS_III"
RITZ = "Ritz's method, Legendre polynomials to degree 14, rotary inertia included"
LEISSA = "Leissa, J. Sound Vib. 31 (1973) 257"
Reals = NDArray[np.float64]


def _lowest(slab: Slab, matrices: SlabMatrices, count: int) -> Reals:
    """Frequencies of the plate in free space [Hz]."""
    K, M = matrices.K_plate[:-2, :-2], matrices.M[:-2, :-2]
    omega2 = scipy.linalg.eigvalsh(K, M, subset_by_index=(0, count - 1))
    return np.sqrt(np.abs(omega2)) / (2.0 * np.pi)


@cache
def _free(nx: int, ny: int) -> Reals:
    """Nine lowest frequencies of the slab on a mesh of nx by ny elements [Hz]."""
    slab, mortar = load_slab(SLAB)
    slab = slab.model_copy(update={"elements_x": nx, "elements_y": ny})
    return _lowest(slab, slab_matrices(slab, mortar), 9)


@cache
def _exact() -> Reals:
    """Six lowest elastic frequencies [Hz]."""
    slab, _ = load_slab(SLAB)
    h = slab.thickness
    omega = frequencies(
        slab.length, slab.width, slab.rigidity, slab.nu, slab.rho * h, slab.rho * h**3 / 12.0, RITZ_DEGREE
    )
    return omega[3:9] / (2.0 * np.pi)


def _order() -> float:
    """Order of the largest error of six frequencies between 18 x 4 and 36 x 8 elements."""
    coarse, fine = (np.abs(_free(*mesh)[3:] / _exact() - 1.0).max() for mesh in ((18, 4), (36, 8)))
    return float(np.log2(coarse / fine))


def _bounce() -> float:
    """Frequency of the mode of the slab on its bed that is most like w = 1 [Hz]."""
    slab, mortar = load_slab(SLAB)
    m = slab_matrices(slab, mortar)
    omega2, modes = scipy.linalg.eigh((m.K_plate + m.K_bed)[:-2, :-2], m.M[:-2, :-2])
    rigid = np.zeros(m.n - 2)
    rigid[0::3] = 1.0
    share = np.abs(modes.T @ m.M[:-2, :-2] @ rigid)
    return float(np.sqrt(omega2[np.argmax(share)]) / (2.0 * np.pi))


def _bounce_exact() -> float:
    slab, mortar = load_slab(SLAB)
    return float(np.sqrt(mortar.stiffness / (slab.rho * slab.thickness)) / (2.0 * np.pi))


def _square() -> Reals:
    """Omega a^2 sqrt(rho h / D) of a thin square plate on 16 x 16 elements."""
    slab = Slab(
        length=1.0, width=1.0, thickness=1e-3, gap=0.0, fastening_pitch=0.5, fastenings=2, E=3e10, nu=0.3,
        rho=2500.0, seat_half_spacing=0.3, elements_x=16, elements_y=16,
    )  # fmt: skip
    f = _lowest(slab, slab_matrices(slab, load_slab(SLAB)[1]), 8)[3:]
    return 2.0 * np.pi * f * np.sqrt(slab.rho * slab.thickness / slab.rigidity)


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
            (9, 2, 0.015, "two elements across, where mode 6 has a half wave in 1.9 m; h^2 from there"),
            (18, 4, 0.015 / 3.0, "h^2: a quarter of 9 x 2, or a third where that is not yet in its range"),
            (36, 8, 0.015 / 12.0, "h^2: a quarter of 18 x 4"),
        )
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
        name="plate-leissa",
        kind="validation",
        quantity="free square plate, omega a^2 sqrt(rho h/D), 16 x 16 elements, five modes",
        source=LEISSA,
        reference=(13.47, 19.60, 24.27, 34.80, 34.80),
        rtol=0.15 / 16.0**2,
        atol=0.005,
        why="printed digits, and 0.15 h^2 of the mesh",
        compute=_square,
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
    Case(
        name="slab-bounce",
        kind="verification",
        quantity="bounce of the slab on its bed [Hz]",
        source="sqrt(k/(rho h))/(2 pi)",
        reference=_bounce_exact,
        rtol=1e-9,
        why="rounding of the eigenvalue solver: the shapes contain w = 1",
        compute=_bounce,
    ),
)
