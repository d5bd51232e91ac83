"""A slab for the full-length model: free-free modes of its plate, bed and seats on them.

Independent of the engine's slab, in NumPy: the Adini-Clough-Melosh element is built from its monomials. With its
shape functions w, the plate's matrices are

    K = D_0 int [w_xx^2 + w_yy^2 + 2 nu w_xx w_yy + 2 (1 - nu) w_xy^2]
    M = rho h int w^2 + rho h^3/12 int (w_x^2 + w_y^2)

K phi = omega^2 M phi gives mass-normalised modes; with all of them the plate is the mesh's, with the lowest 20 it is
the traditional model's. Two rigid coordinates follow: lateral displacement and yaw of the slab.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.track.mortar import Mortar, MortarVoid
from tiengine.track.slab import Slab

__all__ = ["ModalSlab", "modal_slab"]

POWERS = np.array([(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3)])
GAUSS = 4  # points per direction, enough for products of two cubics


@dataclass(frozen=True, eq=False)
class ModalSlab:
    """One slab in modal coordinates: m plate modes, lateral displacement, yaw.

    Attributes:
        mass: Diagonal of M, shape (m + 2,).
        stiffness: Stiffness of plate and bed, shape (m + 2, m + 2).
        damping: Damping of the bed, shape (m + 2, m + 2).
        seat: Vertical and slope dw/dy at the seats, shape (2, 2, m, seats): quantity, side, mode, seat.
        seat_x: Position of the seats from the slab's centre [m], shape (seats,).
        bed: w of the modes at the bed's sampling points, shape (m, points).
        bed_factor: Factor of the bed there, shape (points,).
        bed_x: Place of the points from the slab's centre [m], shape (points,).
        bed_area: Area of a point [m^2].
        omega: Circular frequencies of the free plate [rad/s], shape (m,).
    """

    mass: Reals
    stiffness: Reals
    damping: Reals
    seat: Reals
    seat_x: Reals
    bed: Reals
    bed_factor: Reals
    bed_x: Reals
    bed_area: float
    omega: Reals


@dataclass(frozen=True)
class _Mesh:
    """Rectangular elements of half sides a, b; nodes counted along y first, three DOFs each."""

    nx: int
    ny: int
    a: float
    b: float

    def dofs(self, ex: int, ey: int) -> NDArray[np.int64]:
        """The twelve DOFs of an element."""
        corner = ex * (self.ny + 1) + ey
        nodes = np.array([corner, corner + 1, corner + self.ny + 1, corner + self.ny + 2])
        return (3 * nodes[:, None] + np.arange(3)).ravel()

    @property
    def size(self) -> int:
        """DOFs of the plate."""
        return 3 * (self.nx + 1) * (self.ny + 1)


def modal_slab(
    slab: Slab, mortar: Mortar, voids: Sequence[MortarVoid], modes: int, baseplate: tuple[float, float]
) -> ModalSlab:
    """Reduce a slab to its lowest free-free modes.

    Args:
        slab: Geometry and material.
        mortar: Its bed.
        voids: Voids of this slab.
        modes: Number of plate modes kept, including rigid ones; all of the mesh if it has fewer.
        baseplate: Length along and width across the track on which a seat presses [m]; both 0 for points.
    """
    mesh = _Mesh(
        slab.elements_x,
        slab.elements_y,
        slab.length / (2 * slab.elements_x),
        slab.width / (2 * slab.elements_y),
    )
    K, M, bed = _plate(slab, mesh, voids)
    kept = min(modes, mesh.size)
    omega2, phi = scipy.linalg.eigh(K, M, subset_by_index=(0, kept - 1))
    omega2[:3] = 0.0  # rigid motions, up to rounding
    x = (np.arange(0.0, slab.fastenings) + 0.5) * slab.fastening_pitch - slab.pitch / 2.0
    y = slab.seat_half_spacing
    at_seats = np.stack([_at_seats(mesh, slab, x, side * y, baseplate) for side in (-1.0, 1.0)], axis=1)
    lateral = _lateral_bed(slab, voids)
    modal_bed = phi.T @ bed @ phi
    yaw = slab.mass * (slab.length**2 + slab.width**2) / 12.0
    points = np.stack(np.meshgrid(*_bed_points(slab), indexing="ij"), axis=-1).reshape(-1, 2)
    sampled = np.stack([_values(mesh, slab, np.array([px]), py)[0, 0] for px, py in points])
    return ModalSlab(
        mass=np.concatenate([np.ones(kept), [slab.mass, yaw]]),
        stiffness=scipy.linalg.block_diag(
            np.diag(omega2) + mortar.stiffness * modal_bed, mortar.lateral_stiffness * lateral
        ),
        damping=scipy.linalg.block_diag(mortar.damping * modal_bed, mortar.lateral_damping * lateral),
        seat=np.einsum("qsjn,nm->qsmj", at_seats, phi),  # quantity, side, seat, DOF
        seat_x=x,
        bed=(sampled @ phi).T,
        bed_factor=np.array([_factor(slab, voids, px, py) for px, py in points]),
        bed_x=points[:, 0],
        bed_area=slab.length * slab.width / len(points),
        omega=np.sqrt(omega2),
    )


def _shapes(mesh: _Mesh, x: Reals, y: Reals) -> Reals:
    """w, w_x, w_y, w_xx, w_yy, w_xy of the twelve shape functions at points of an element, shape (6, points, 12)."""
    corners = np.array([(sx * mesh.a, sy * mesh.b) for sx in (-1, 1) for sy in (-1, 1)])
    nodal = np.stack([_monomials(corners[:, 0], corners[:, 1], *order) for order in ((0, 0), (1, 0), (0, 1))], axis=1)
    coefficients = np.linalg.inv(nodal.reshape(12, 12))
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (0, 2), (1, 1))
    return np.stack([_monomials(x, y, *order) @ coefficients for order in orders])


def _monomials(x: Reals, y: Reals, dx: int, dy: int) -> Reals:
    """Derivatives of the twelve monomials, shape (points, 12)."""
    out = np.zeros((len(x), len(POWERS)))
    for k, (p, q) in enumerate(POWERS):
        if p >= dx and q >= dy:
            factor = np.prod(np.arange(p - dx + 1, p + 1)) * np.prod(np.arange(q - dy + 1, q + 1))
            out[:, k] = factor * x ** (p - dx) * y ** (q - dy)
    return out


def _plate(slab: Slab, mesh: _Mesh, voids: Sequence[MortarVoid]) -> tuple[Reals, Reals, Reals]:
    """Stiffness, mass and int factor w^2 of the plate, shape (n, n) each."""
    x, y, weight = _box(-mesh.a, mesh.a, -mesh.b, mesh.b)
    w, w_x, w_y, w_xx, w_yy, w_xy = _shapes(mesh, x, y)

    def integral(f: Reals, g: Reals) -> Reals:
        product: Reals = np.einsum("p,pi,pj->ij", weight, f, g)
        return product

    nu, h = slab.nu, slab.thickness
    mixed = integral(w_xx, w_yy)
    k = slab.rigidity * (
        integral(w_xx, w_xx) + integral(w_yy, w_yy) + nu * (mixed + mixed.T) + 2.0 * (1.0 - nu) * integral(w_xy, w_xy)
    )
    m = slab.rho * h * integral(w, w) + slab.rho * h**3 / 12.0 * (integral(w_x, w_x) + integral(w_y, w_y))
    K, M, bed = np.zeros((3, mesh.size, mesh.size))
    for ex in range(mesh.nx):
        for ey in range(mesh.ny):
            at = np.ix_(mesh.dofs(ex, ey), mesh.dofs(ex, ey))
            K[at] += k
            M[at] += m
            bed[at] += integral(w, w) - _lost(slab, mesh, ex, ey, voids)
    return K, M, bed


def _lost(slab: Slab, mesh: _Mesh, ex: int, ey: int, voids: Sequence[MortarVoid]) -> Reals:
    """Part of int w^2 of an element removed by voids: (1 - factor) times the integral over their share of it."""
    lost = np.zeros((12, 12))
    cx, cy = (2 * ex + 1) * mesh.a, (2 * ey + 1) * mesh.b - slab.width / 2.0
    for void in voids:
        left, right = max(void.x[0] - cx, -mesh.a), min(void.x[1] - cx, mesh.a)
        low, high = max(void.y[0] - cy, -mesh.b), min(void.y[1] - cy, mesh.b)
        if right > left and high > low:
            x, y, weight = _box(left, right, low, high)
            w = _shapes(mesh, x, y)[0]
            lost += (1.0 - void.factor) * np.einsum("p,pi,pj->ij", weight, w, w)
    return lost


def _box(left: float, right: float, low: float, high: float) -> tuple[Reals, Reals, Reals]:
    """Gauss points and weights of a rectangle."""
    node, weight = np.polynomial.legendre.leggauss(GAUSS)
    x = 0.5 * (left + right) + 0.5 * (right - left) * node
    y = 0.5 * (low + high) + 0.5 * (high - low) * node
    X, Y = np.meshgrid(x, y, indexing="ij")
    return X.ravel(), Y.ravel(), np.outer(weight, weight).ravel() * (right - left) * (high - low) / 4.0


def _values(mesh: _Mesh, slab: Slab, x: Reals, y: float) -> Reals:
    """Matrices from the slab's DOFs to w and w_y at points x and y from its centre, shape (2, points, n)."""
    rows = np.zeros((2, len(x), mesh.size))
    ey = int(np.clip((y + slab.width / 2.0) // (2 * mesh.b), 0, mesh.ny - 1))
    for i, place in enumerate(x):
        ex = int(np.clip((place + slab.length / 2.0) // (2 * mesh.a), 0, mesh.nx - 1))
        local_x = place + slab.length / 2.0 - (2 * ex + 1) * mesh.a
        local_y = y + slab.width / 2.0 - (2 * ey + 1) * mesh.b
        shapes = _shapes(mesh, np.array([local_x]), np.array([local_y]))
        rows[:, i, mesh.dofs(ex, ey)] = shapes[[0, 2], 0]
    return rows


def _at_seats(mesh: _Mesh, slab: Slab, x: Reals, y: float, baseplate: tuple[float, float]) -> Reals:
    """Matrices from the slab's DOFs to w and w_y of seats at x and y, means over their baseplates, (2, seats, n).

    The mean of w_y weighs w by 12 (eta - y) / width^2, as a linear pressure across presses.
    """
    length, width = baseplate
    if length == width == 0.0:
        return _values(mesh, slab, x, y)
    rows = np.zeros((2, len(x), mesh.size))
    for i, place in enumerate(x):
        for ex in range(mesh.nx):
            for ey in range(mesh.ny):
                cx, cy = (2 * ex + 1) * mesh.a - slab.length / 2.0, (2 * ey + 1) * mesh.b - slab.width / 2.0
                left, right = max(place - length / 2.0 - cx, -mesh.a), min(place + length / 2.0 - cx, mesh.a)
                low, high = max(y - width / 2.0 - cy, -mesh.b), min(y + width / 2.0 - cy, mesh.b)
                if right > left and high > low:
                    px, py, weight = _box(left, right, low, high)
                    share = weight[:, None] / (length * width) * _shapes(mesh, px, py)[0]
                    rows[0, i, mesh.dofs(ex, ey)] += share.sum(axis=0)
                    rows[1, i, mesh.dofs(ex, ey)] += 12.0 / width**2 * ((cy + py - y) @ share)
    return rows


def _bed_points(slab: Slab) -> tuple[Reals, Reals]:
    """Sampling points of the bed's pressure: centres of a grid twice as fine as the mesh."""
    return tuple(
        size * ((np.arange(2 * n) + 0.5) / (2 * n) - 0.5)
        for size, n in ((slab.length, slab.elements_x), (slab.width, slab.elements_y))
    )  # type: ignore[return-value]


def _factor(slab: Slab, voids: Sequence[MortarVoid], x: float, y: float) -> float:
    """Factor of the bed at a point from the slab's centre."""
    along = x + slab.length / 2.0
    inside = [v.factor for v in voids if v.x[0] <= along <= v.x[1] and v.y[0] <= y <= v.y[1]]
    return inside[0] if inside else 1.0


def _lateral_bed(slab: Slab, voids: Sequence[MortarVoid]) -> Reals:
    """Int factor [1, x]^T [1, x] over the slab, x from its centre, shape (2, 2)."""

    def moments(left: float, right: float, width: float) -> Reals:
        a, b, c = ((right**p - left**p) / p * width for p in (1, 2, 3))
        return np.array([[a, b], [b, c]])

    half = slab.length / 2.0
    total = moments(-half, half, slab.width)
    for void in voids:
        total -= (1.0 - void.factor) * moments(void.x[0] - half, void.x[1] - half, void.y[1] - void.y[0])
    return total
