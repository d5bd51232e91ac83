"""Bending moments of a slab, recovered on a mesh that is finer than the step's (MODEL §15).

    M_x = -D (w,xx + nu w,yy)        M_y = -D (w,yy + nu w,xx)        [N m/m]

with w positive down and D the plate's rigidity: a moment is positive where it stretches the underside. M_x bends the
slab along the track (stress in x), M_y across it.

The step's mesh carries the slab's motion well enough for the wheels, but holds less than half of the moment under a
baseplate. Its acceleration and rate and the seats' forces are right, though, and from these the moment follows by
statics: a plate of fine elements, a tenth of a metre long, is loaded by the seats on their baseplates, by the inertia
and by the bed's damping of the motion, and rests on the bed,

    (K + k_m B) u = S F - M a - c_m B dw/dt

so that what waves miss in the coarse mesh is its own inertia only ("mode acceleration"). Where the bed does not press
with k_m w + c_m dw/dt (a void, a bed without tension), the plate is free and its pressure p at the quadrature points of
the step's mesh is one of the loads,

    K u = S F - M a - int N^T p

The loads balance but for rounding; the rest is taken off as the inertia of a rigid motion. All of it is linear: a table
from the inputs to the moments at fixed places. The forces of the seats themselves follow from the motion of the step's
mesh, M a + C v + K u = S F, so that one operator takes (u, v, a) to the moments.

Under a load on a point the moment of a thin plate grows without bound (like a logarithm): with fastenings that have no
baseplate the moment below them is that of an element of the fine mesh and means nothing.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

from tiengine.kernels import plate
from tiengine.parameters.arrays import Reals
from tiengine.track.baseplate import seat_rows
from tiengine.track.fastening import POINT
from tiengine.track.mortar import GAUSS, Mortar
from tiengine.track.plate_shapes import WX, WXX, WY, WYY, W, element_dofs, locate, shapes_at, tabulate_shapes
from tiengine.track.slab import Slab
from tiengine.track.slab_matrices import SlabMatrices, bed_points, seat_shapes

__all__ = [
    "GAUSS_POINTS", "MomentTable", "bed_places", "fine_mesh", "moment_rows", "moment_table", "moments_of_motion",
    "moments_of_pressure", "nodes", "places", "plate_matrices", "pressures_felt",
]  # fmt: skip

GAUSS_POINTS = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)]) / np.sqrt(3.0)
"""Local coordinates of an element's points, shape (4, 2): second derivatives are closest to the exact ones there."""
ELEMENT = 0.105
"""Longest side of a fine element [m]: the moment in the middle of a baseplate of 0.36 x 0.18 m is within 1 %."""
MOST_ELEMENTS = 6000  # of the fine mesh: those of a slab of 25 m


def places(slab: Slab, points: Reals = GAUSS_POINTS) -> tuple[Reals, Reals]:
    """Coordinates of points of all elements, from the slab's centre [m], shape (elements points,) each.

    Args:
        slab: The slab.
        points: Local coordinates -1...1, shape (points, 2).
    """
    ex, ey = np.divmod(np.arange(slab.elements_x * slab.elements_y)[:, None], slab.elements_y)
    x = ((ex + (points[:, 0] + 1.0) / 2.0) / slab.elements_x - 0.5) * slab.length
    y = ((ey + (points[:, 1] + 1.0) / 2.0) / slab.elements_y - 0.5) * slab.width
    return x.ravel(), y.ravel()


def moment_rows(slab: Slab, x: Reals, y: Reals) -> sp.csr_array:
    """M_x, then M_y at places of a slab by its plate's DOFs [N m/m per m, or per rad], shape (2 points, dofs).

    Args:
        slab: The slab.
        x: From its centre, forward [m], shape (points,).
        y: From its centre line, to the right [m], shape (points,).
    """
    index, table = shapes_at(slab, x, y)
    along, across = -slab.rigidity * table[:, WXX], -slab.rigidity * table[:, WYY]
    values = np.stack([along + slab.nu * across, across + slab.nu * along])
    row = np.repeat(np.arange(2 * len(x)), 12)
    column = np.tile(index.ravel(), 2)
    return sp.csr_array((values.ravel(), (row, column)), shape=(2 * len(x), slab.plate_dofs))


def fine_mesh(slab: Slab) -> Slab:
    """The slab with the mesh on which moments are recovered."""
    side = max(ELEMENT, float(np.sqrt(slab.length * slab.width / MOST_ELEMENTS)))
    elements = {
        "elements_x": max(slab.elements_x, int(np.ceil(slab.length / side))),
        "elements_y": max(slab.elements_y, int(np.ceil(slab.width / side))),
    }
    return slab.model_copy(update=elements)


class MomentTable:
    """Moments at the places of a slab.

    Attributes:
        places: x and y from the slab's centre [m]: at the seats and midway between them along the track; under the
            rails and on the centre line across it; shape (2, points).
        matrix: From the inputs to M_x, then M_y, shape (inputs, 2 points). Inputs are the seats' forces (F_V left and
            right, M_b left and right, each of all seats), accelerations of the slab's n coordinates, then their rates
            on a bed, or the bed's pressure at its quadrature points [Pa].
    """

    def __init__(self, where: Reals, matrix: Reals) -> None:
        """Hold them."""
        self.places, self.matrix = where, matrix


@lru_cache(maxsize=4)  # a task asks again for the table of the last one
def moment_table(
    slab: Slab, mortar: Mortar | None, baseplate: tuple[float, float] = POINT, fine: Slab | None = None
) -> MomentTable:
    """Compute the table of a slab.

    Args:
        slab: The slab with the step's mesh.
        mortar: The bed on which it rests; None if the bed's pressure is given.
        baseplate: Rectangle on which a seat presses, along and across [m].
        fine: The slab with the fine mesh, if not that of :func:`fine_mesh`.
    """
    with threadpool_limits(1):  # the same bits for whoever asks first
        return _moment_table(slab, mortar, baseplate, fine or fine_mesh(slab))


def _moment_table(slab: Slab, mortar: Mortar | None, baseplate: tuple[float, float], fine: Slab) -> MomentTable:
    """The same on one thread."""
    K, M, B = plate_matrices(fine)
    along, across = np.arange(1 - slab.fastenings, slab.fastenings) / 2.0, np.array([-1.0, 0.0, 1.0])
    grid = np.meshgrid(slab.fastening_pitch * along, slab.seat_half_spacing * across, indexing="ij")
    where = np.stack([part.ravel() for part in grid])
    moments = moment_rows(fine, *where).T.toarray()
    loads = [*_seat_loads(fine, baseplate), -M @ (coarse := _interpolation(slab, fine))]
    # K is symmetric: one solution a moment, not one a load
    if mortar is not None:
        loads.append(-mortar.damping * (B @ coarse))
        answer = splu(sp.csc_array(K + mortar.stiffness * B)).solve(moments)
    else:
        loads.append(-_pressure_loads(slab, fine))
        answer = _of_free_plate(fine, K, M, moments)
    return MomentTable(where, sp.csr_array(sp.hstack(loads)).T @ answer)


def moments_of_motion(
    slab: Slab, mortar: Mortar, design: SlabMatrices, sound: MomentTable, by_pressure: MomentTable | None
) -> Reals:
    """Operator from a slab's displacements, rates and accelerations to M_x, then M_y, shape (3, n, 2 points).

    Args:
        slab: The slab with the step's mesh.
        mortar: Its bed, taken as linear.
        design: Its matrices.
        sound: Table of the slab on a bed without voids.
        by_pressure: Table of the slab under given pressures, for a design with voids.
    """
    n, forces = design.n, 4 * slab.fastenings
    from_loads = _seat_forces_of_loads(design)
    balance = np.stack([design.K_plate + design.K_bed, design.C_bed, design.M])
    balance[:, -2:] = 0.0  # the lateral motion has no part in it
    table = sound if by_pressure is None else by_pressure
    operator: Reals = balance @ from_loads @ table.matrix[:forces]
    operator[2] += table.matrix[forces : forces + n]
    if by_pressure is None:
        operator[1] += table.matrix[forces + n :]
        return operator
    felt = pressures_felt(design) @ table.matrix[forces + n :]
    operator[0] += mortar.stiffness * felt
    operator[1] += mortar.damping * felt
    return operator


def moments_of_pressure(slab: Slab, design: SlabMatrices, by_pressure: MomentTable) -> Reals:
    """Operator from pressures of the bed beyond the linear ones to M_x, then M_y, shape (points, 2 places).

    At a given motion the seats press by as much more as the bed does.

    Args:
        slab: The slab with the step's mesh.
        design: Its matrices.
        by_pressure: Table of the slab under given pressures.
    """
    points = design.bed_factor.size
    loads = np.zeros((len(design.bed_index), len(design.bed_weight), design.n))
    for e, index in enumerate(design.bed_index):
        loads[e][:, index] = design.bed_weight[:, None] * design.bed_shape
    forces = loads.reshape(points, design.n) @ _seat_forces_of_loads(design)
    operator: Reals = by_pressure.matrix[-points:] + forces @ by_pressure.matrix[: 4 * slab.fastenings]
    return operator


def _seat_forces_of_loads(design: SlabMatrices) -> Reals:
    """Forces of the seats, as in a table, from loads on the step's mesh that they make up, shape (n, 4 seats)."""
    loads = seat_shapes(design)[:, : 4 * len(design.seat_x)]
    inverse: Reals = np.asarray(np.linalg.pinv(loads), np.float64)
    return inverse.T


def pressures_felt(design: SlabMatrices) -> Reals:
    """Deflections at the bed's quadrature points times its factors, by the slab's coordinates, shape (n, points).

    Args:
        design: Matrices of the slab.
    """
    return bed_points(design) * design.bed_factor.ravel()


def _of_free_plate(slab: Slab, K: sp.csr_array, M: sp.csr_array, loads: Reals) -> Reals:
    """Answers of a free plate, to which loads do what they do to each of these once balanced, shape as ``loads``."""
    x, y = nodes(slab)
    motions = np.zeros((len(x), 3, 3))  # node, its coordinate, motion: down, turned along, turned across
    motions[:, 0, 0] = motions[:, 1, 1] = motions[:, 2, 2] = 1.0
    motions[:, 0, 1], motions[:, 0, 2] = x, y
    rigid = motions.reshape(-1, 3)
    corners = 3 * np.array([0, slab.elements_y, slab.elements_x * (slab.elements_y + 1)])
    held = np.setdiff1d(np.arange(slab.plate_dofs), corners)  # balanced loads leave no force at three corners
    answer = np.zeros_like(loads)
    answer[held] = splu(sp.csc_array(K[held][:, held])).solve(loads[held])
    inertia = M @ rigid
    answer -= rigid @ np.linalg.solve(rigid.T @ inertia, inertia.T @ answer)
    return answer


def _seat_loads(fine: Slab, baseplate: tuple[float, float]) -> tuple[sp.csr_array, sp.csr_array]:
    """Loads on the fine mesh by F_V, and by M_b, of the seats, left ones first, shape (fine dofs, 2 seats) each."""
    along = np.arange(0.5, fine.fastenings, dtype=np.float64) * fine.fastening_pitch - fine.pitch / 2.0
    x, y = np.tile(along, 2), fine.seat_half_spacing * np.repeat([-1.0, 1.0], fine.fastenings)
    index, *shapes = seat_rows(fine, x, y, baseplate)
    column = np.repeat(np.arange(len(index)), index.shape[1])
    force, couple = (
        sp.csr_array((part.ravel(), (index.ravel(), column)), shape=(fine.plate_dofs, len(index))) for part in shapes
    )
    return force, couple


def _pressure_loads(slab: Slab, fine: Slab) -> sp.csr_array:
    """Loads on the fine mesh by pressures at the quadrature points of the step's mesh, shape (fine dofs, points).

    Between its points an element's pressure is that of the polynomial through them.
    """
    local, area = _quadrature(fine)
    x, y = places(fine, local)
    ex, xi = locate(x, slab.length, slab.elements_x)
    ey, eta = locate(y, slab.width, slab.elements_y)
    along, across = _lagrange(xi), _lagrange(eta)
    shares = np.einsum("pi,pj->pij", along, across).reshape(len(x), -1)
    first = (ex * slab.elements_y + ey)[:, None] * GAUSS**2
    column = first + np.arange(GAUSS**2)
    row = np.repeat(np.arange(len(x)), GAUSS**2)
    spread = sp.csr_array(
        (shares.ravel(), (row, column.ravel())), shape=(len(x), slab.elements_x * slab.elements_y * GAUSS**2)
    )
    index, table = element_dofs(fine), tabulate_shapes(fine, local)[:, W]
    values = np.tile((area[:, None] * table).ravel(), len(index))
    target = np.repeat(index, len(local), axis=0).ravel()
    load = sp.csr_array((values, (target, np.repeat(np.arange(len(x)), 12))), shape=(fine.plate_dofs, len(x)))
    return sp.csr_array(load @ spread)


def _lagrange(t: Reals) -> Reals:
    """Polynomials that are one at one Gauss point of -1...1 and zero at the others, shape (len(t), GAUSS)."""
    node = np.polynomial.legendre.leggauss(GAUSS)[0]
    factors = np.where(
        np.eye(GAUSS, dtype=bool), 1.0, (t[:, None, None] - node) / (node[:, None] - node + np.eye(GAUSS))
    )
    values: Reals = factors.prod(axis=2)
    return values


def nodes(slab: Slab) -> tuple[Reals, Reals]:
    """Coordinates of a mesh's nodes, from the slab's centre [m], shape (nodes,) each."""
    nx, ny = slab.elements_x + 1, slab.elements_y + 1
    x = np.repeat(np.linspace(-slab.length / 2.0, slab.length / 2.0, nx), ny)
    return x, np.tile(np.linspace(-slab.width / 2.0, slab.width / 2.0, ny), nx)


def _interpolation(slab: Slab, fine: Slab) -> sp.csr_array:
    """Fine plate's coordinates from all of the slab's, shape (fine dofs, dofs + 2)."""
    index, table = shapes_at(slab, *nodes(fine))
    row = np.repeat(np.arange(fine.plate_dofs), 12)
    column = np.repeat(index, 3, axis=0)
    values = table[:, [W, WX, WY]]
    return sp.csr_array((values.ravel(), (row, column.ravel())), shape=(fine.plate_dofs, slab.plate_dofs + 2))


def bed_places(slab: Slab) -> tuple[Reals, Reals]:
    """Coordinates of the bed's quadrature points, from the slab's centre [m], shape (points,) each.

    Args:
        slab: The slab with its mesh.
    """
    return places(slab, _quadrature(slab)[0])


def plate_matrices(slab: Slab) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
    """Stiffness, mass and integral of N^T N of a plate, sparse, shape (dofs, dofs) each.

    Args:
        slab: The slab with its mesh.
    """
    local, area = _quadrature(slab)
    h = slab.thickness
    section = np.array([[slab.rigidity, slab.nu, slab.rho * h, slab.rho * h**3 / 12.0]])
    one = np.zeros((3, 1, 1, 12, 12))  # all elements are alike
    plate.element_matrices(tabulate_shapes(slab, local), area, section, np.ones((1, 1, len(area))), *one)
    index = element_dofs(slab)
    row, column = np.repeat(index, 12, axis=1).ravel(), np.tile(index, (1, 12)).ravel()
    shape = (slab.plate_dofs, slab.plate_dofs)
    stiffness, mass, bed = (
        sp.csr_array((np.tile(each.ravel(), len(index)), (row, column)), shape=shape) for each in one
    )
    return stiffness, mass, bed


def _quadrature(slab: Slab) -> tuple[Reals, Reals]:
    """Local coordinates (GAUSS^2, 2) and areas [m^2] of the bed's quadrature points of an element."""
    node, weight = np.polynomial.legendre.leggauss(GAUSS)
    local = np.stack(np.meshgrid(node, node, indexing="ij"), axis=-1).reshape(-1, 2)
    area = slab.length * slab.width / (4.0 * slab.elements_x * slab.elements_y)
    return local, area * np.outer(weight, weight).ravel()
