"""A plate pressed by the rectangle of a baseplate: moments in its middle, and what is recovered from a coarse mesh.

References: Navier's series of a simply supported plate on a bed (``closed_forms/plate_navier``) for the elements and
the rectangle's loads; the full dynamic run on a mesh four times as fine for the moments of the default.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from tiengine.track.baseplate import seat_rows
from tiengine.track.slab import load_slab
from tiengine.track.slab_moments import moment_rows, nodes, plate_matrices
from validation.closed_forms.plate_navier import patch_moments
from validation.frame.case import Case

__all__ = ["CASES"]

SLAB = "CRTS_III"
PATCH = (0.36, 0.18)
SEAT = (0.0, 0.7465)
"""Middle of the rectangle from the slab's centre [m]: a seat in the middle of the slab."""
FINE = (54, 24)
"""Mesh of the recovery."""
MESHES = ((9, 15), (27, 45), (81, 135))
"""Meshes with the middle of the rectangle at nearly the same place of an element: its order in h can be seen."""
NAMES = tuple(f"{extreme}_moment_{axis}" for axis in "xy" for extreme in ("largest", "smallest"))


@cache
def _exact() -> Reals:
    """M_x, M_y under 1 N by the series."""
    slab, mortar = load_slab(SLAB)
    middle = slab.length / 2.0 + SEAT[0], slab.width / 2.0 + SEAT[1]
    return patch_moments((slab.length, slab.width), slab.rigidity, slab.nu, mortar.stiffness, PATCH, middle)


@cache
def _found(nx: int, ny: int) -> Reals:
    """The same by elements: w and the slope along an edge are held there."""
    slab, mortar = load_slab(SLAB)
    slab = slab.model_copy(update={"elements_x": nx, "elements_y": ny})
    K, _, B = plate_matrices(slab)
    x, y = nodes(slab)
    end, side = np.abs(x) > 0.4999 * slab.length, np.abs(y) > 0.4999 * slab.width
    held = np.stack([end | side, side, end], axis=1).ravel()
    index, w, _ = seat_rows(slab, np.array([SEAT[0]]), np.array([SEAT[1]]), PATCH)
    load = np.bincount(index[0], w[0], slab.plate_dofs)
    u = np.zeros(slab.plate_dofs)
    A = sp.csc_array(K + mortar.stiffness * B)
    u[~held] = spsolve(A[~held][:, ~held], load[~held])
    found: Reals = moment_rows(slab, np.array([SEAT[0]]), np.array([SEAT[1]])) @ u
    return found


def _order() -> float:
    """Order in h of the larger relative error of both moments, between the last two meshes of odd numbers."""
    coarse, fine = (np.abs(_found(*mesh) / _exact() - 1.0).max() for mesh in MESHES[1:])
    return float(np.log(coarse / fine) / np.log(3.0))


@cache
def _run(mesh: tuple[int, int]) -> Reals:
    """Largest and smallest moments of the slabs of 60 m of the default, away from both ends, shape (4, slabs)."""
    nx, ny = mesh
    changes = [
        "train.distance=60",
        "train.start=60",
        f"track.slab={{like='{SLAB}', elements_x={nx}, elements_y={ny}}}",
    ]
    with run(load_scenario("default", changes)) as result:
        slabs = result.slabs()
    return np.stack([slabs[name][6:-6] for name in NAMES])


def _of_the_default() -> Reals:
    """Largest difference of the slabs' moments from the fine mesh's, over their largest [%], shape (4,)."""
    coarse, fine = _run((9, 2)), _run((18, 6))
    return 100.0 * np.abs(coarse - fine).max(axis=1) / np.abs(fine).max(axis=1)


CASES = (
    *(
        Case(
            name=f"patch-{nx}x{ny}",
            kind="verification",
            quantity=f"M_x, M_y in the middle of a baseplate of 0.36 x 0.18 m under 1 N, {nx} x {ny} elements [N m/m]",
            source="Navier's series, plate simply supported, on its bed",
            reference=_exact,
            rtol=rtol,
            why=why,
            compute=lambda nx=nx, ny=ny: _found(nx, ny),
        )
        for (nx, ny), rtol, why in (
            (FINE, 0.03, "mesh of the recovery; the rectangle's middle lies anywhere in its element"),
            (MESHES[1], 0.05, "elements of 0.21 m along a rectangle of 0.36 m"),
            (MESHES[2], 0.05 / 9.0, "h^2"),
        )
    ),
    Case(
        name="patch-order",
        kind="convergence",
        quantity="order in h of the same moments, 27 x 45 to 81 x 135",
        source="second derivatives of complete cubics: h^2 within an element",
        reference=2.0,
        atol=0.6,
        why="the edge of the load cuts elements",
        compute=_order,
    ),
    Case(
        name="patch-default",
        kind="convergence",
        quantity="bending moments of the slabs of `default`: largest and smallest along, then across, less those of"
        " 18 x 6 elements, over the largest [%]",
        source="own run with slabs of 18 x 6 elements",
        reference=(5.0,) * 4,
        rule="at most",
        why="required bound",
        compute=_of_the_default,
        quick=False,
    ),
)
