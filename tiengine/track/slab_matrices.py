"""Matrices of a slab with its bed, and the slab designs of a track; the plate elements need Taichi."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.kernels import plate
from tiengine.parameters.errors import InputError
from tiengine.track.baseplate import seat_rows
from tiengine.track.fastening import POINT
from tiengine.track.mortar import GAUSS, Mortar, MortarVoid, bed_factors
from tiengine.track.plate_shapes import element_dofs, tabulate_shapes
from tiengine.track.slab import Slab


@dataclass(frozen=True)
class SlabMatrices:
    """Matrices and tables of one slab design, that is one arrangement of voids.

    It has n DOFs, n_el elements and n_q quadrature points per element.

    Attributes:
        n: DOFs: the plate's, then lateral displacement and yaw.
        M: Mass matrix, shape (n, n).
        K_plate: Stiffness of the plate, shape (n, n); zero for lateral displacement and yaw.
        K_bed: Stiffness of the bed, lateral bed included, shape (n, n).
        C_bed: Damping of the bed, lateral bed included, shape (n, n).
        seat_index: DOFs that every seat touches, 12 if it lies within an element, shape (fastenings, 2, touched).
        seat_w: Shapes: w at a seat is seat_w . u[seat_index], shape (fastenings, 2, touched).
        seat_slope: dw/dy at a seat is seat_slope . u[seat_index] [1/m for the w DOFs], shape (fastenings, 2,
            touched).
        seat_x: Seats from the slab's centre [m], shape (fastenings,); lateral motion there is y + psi seat_x.
        bed_index: DOFs of every element, shape (n_el, 12).
        bed_shape: Shapes at the quadrature points of an element, shape (n_q, 12).
        bed_weight: Areas of the quadrature points [m^2], shape (n_q,).
        bed_factor: Bed factor at every quadrature point, shape (n_el, n_q).
        bed_weight_pressure: Pressure at rest under the slab's weight [Pa], shape (n_el, n_q).
    """

    n: int
    M: NDArray[np.float64]
    K_plate: NDArray[np.float64]
    K_bed: NDArray[np.float64]
    C_bed: NDArray[np.float64]
    seat_index: NDArray[np.int32]
    seat_w: NDArray[np.float64]
    seat_slope: NDArray[np.float64]
    seat_x: NDArray[np.float64]
    bed_index: NDArray[np.int32]
    bed_shape: NDArray[np.float64]
    bed_weight: NDArray[np.float64]
    bed_factor: NDArray[np.float64]
    bed_weight_pressure: NDArray[np.float64]


def seat_shapes(slab: SlabMatrices) -> NDArray[np.float64]:
    """Slab coordinates to the motion at its seats: w left and right, dw/dy left and right, y.

    Args:
        slab: Its matrices; the last two coordinates are lateral displacement and yaw.

    Returns:
        Shape (dofs, 5 seats), seat by seat within each of the five.
    """
    seats = len(slab.seat_x)
    shapes = np.zeros((slab.n, 5, seats))
    for seat in range(seats):
        for side in range(2):
            shapes[slab.seat_index[seat, side], side, seat] = slab.seat_w[seat, side]
            shapes[slab.seat_index[seat, side], 2 + side, seat] = slab.seat_slope[seat, side]
        shapes[-2:, 4, seat] = 1.0, slab.seat_x[seat]
    return shapes.reshape(slab.n, 5 * seats)


def bed_points(slab: SlabMatrices) -> NDArray[np.float64]:
    """Slab coordinates to w at the quadrature points of all elements, shape (dofs, points).

    Args:
        slab: Its matrices.
    """
    elements, points = len(slab.bed_index), len(slab.bed_shape)
    shapes = np.zeros((slab.n, elements, points))
    for e, index in enumerate(slab.bed_index):
        shapes[index, e] = slab.bed_shape.T
    return shapes.reshape(slab.n, -1)


def slab_matrices(
    slab: Slab, mortar: Mortar, voids: Sequence[MortarVoid] = (), baseplate: tuple[float, float] = POINT
) -> SlabMatrices:
    """Compute the matrices of one slab.

    Args:
        slab: The slab.
        mortar: Its bed.
        voids: Voids of this slab, all of the same slab index.
        baseplate: Rectangle on which a seat presses, along and across [m].

    Returns:
        The matrices and tables.

    Raises:
        InputError: A void extends beyond the slab, overlaps another, or belongs to another slab than the first
            one.
    """
    if len({void.slab for void in voids}) > 1:
        raise InputError(f"mortar void on slab {voids[-1].slab}: every void must be on slab {voids[0].slab}")
    return _build(slab, mortar, [list(voids)], baseplate)[0]


def slab_designs(
    slab: Slab, mortar: Mortar, voids: Sequence[MortarVoid], baseplate: tuple[float, float] = POINT
) -> tuple[list[SlabMatrices], dict[int, int]]:
    """Compute the matrices of the intact slab and of every slab with voids.

    Args:
        slab: The slab.
        mortar: Its bed.
        voids: Voids of the whole track.
        baseplate: Rectangle on which a seat presses, along and across [m].

    Returns:
        The designs, the intact one first, and the design of each slab index that has voids.

    Raises:
        InputError: A void extends beyond its slab or overlaps another one.
    """
    damaged = sorted({void.slab for void in voids})
    groups: list[list[MortarVoid]] = [[]]
    groups += [[void for void in voids if void.slab == index] for index in damaged]
    return _build(slab, mortar, groups, baseplate), {index: 1 + i for i, index in enumerate(damaged)}


def _build(
    slab: Slab, mortar: Mortar, groups: list[list[MortarVoid]], baseplate: tuple[float, float]
) -> list[SlabMatrices]:
    """Build one design for each group of voids."""
    elements = (slab.elements_x, slab.elements_y)
    points, weight = _quadrature(slab)
    table = tabulate_shapes(slab, points)
    factor = np.stack([bed_factors(slab.length, slab.width, elements, voids) for voids in groups])
    index = element_dofs(slab)
    stiffness, mass, bed = _assemble(slab, table, weight, factor)
    seat_index, seat_w, seat_slope, seat_x = _seats(slab, baseplate)
    designs = []
    for d in range(len(groups)):
        area = bed[d].copy()
        area[-2:, -2:] = _lateral_bed(slab, points, weight, factor[d])
        stiff, damp = (
            np.full(slab.plate_dofs + 2, mortar.stiffness),
            np.full(slab.plate_dofs + 2, mortar.damping),
        )
        stiff[-2:], damp[-2:] = mortar.lateral_stiffness, mortar.lateral_damping
        K_bed = stiff[:, None] * area
        designs.append(
            SlabMatrices(
                n=slab.plate_dofs + 2,
                M=mass[d],
                K_plate=stiffness[d],
                K_bed=K_bed,
                C_bed=damp[:, None] * area,
                seat_index=seat_index,
                seat_w=seat_w,
                seat_slope=seat_slope,
                seat_x=seat_x,
                bed_index=index,
                bed_shape=np.ascontiguousarray(table[:, 0]),
                bed_weight=weight,
                bed_factor=factor[d],
                bed_weight_pressure=_weight_pressure(
                    slab, mortar, stiffness[d] + K_bed, index, table[:, 0], weight, factor[d]
                ),
            )
        )
    return designs


def _quadrature(slab: Slab) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return local coordinates (GAUSS^2, 2) and areas [m^2] of the quadrature points of an element."""
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    area = slab.length * slab.width / (slab.elements_x * slab.elements_y)
    return points, np.outer(w, w).ravel() * area / 4.0


def _assemble(
    slab: Slab, table: NDArray[np.float64], weight: NDArray[np.float64], factor: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Assemble stiffness, mass and integral of factor N^T N of every design, shape (n_design, n, n) each."""
    h = slab.thickness
    section = np.tile([slab.rigidity, slab.nu, slab.rho * h, slab.rho * h**3 / 12.0], (len(factor), 1))
    element = np.zeros((3, *factor.shape[:2], 12, 12))
    plate.element_matrices(table, weight, section, factor, *element)
    n = slab.plate_dofs + 2
    stiffness, mass, bed = np.zeros((3, len(factor), n, n))
    for part, matrix in zip(element, (stiffness, mass, bed), strict=True):
        plate.assemble_plates(slab.elements_x, slab.elements_y, part, matrix)
    mass[:, -2, -2] = slab.mass
    mass[:, -1, -1] = slab.mass * (slab.length**2 + slab.width**2) / 12.0
    return stiffness, mass, bed


def _lateral_bed(
    slab: Slab, points: NDArray[np.float64], weight: NDArray[np.float64], factor: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Integral of factor [1, x]^T [1, x] over the slab, x from its centre: the lateral bed on (y, psi)."""
    side = slab.length / slab.elements_x
    ex = np.arange(len(factor)) // slab.elements_y
    x = side * (ex[:, None] + (points[:, 0] + 1.0) / 2.0) - slab.length / 2.0
    moment = [np.sum(weight * factor * x**power) for power in range(3)]
    return np.array([[moment[0], moment[1]], [moment[1], moment[2]]])


def _seats(
    slab: Slab, baseplate: tuple[float, float]
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """DOFs, shapes of w and dw/dy, and x of every seat; seat j lies (j + 1/2) d beyond the centre of the joint."""
    seat_x = np.arange(0.5, slab.fastenings, dtype=np.float64) * slab.fastening_pitch - slab.pitch / 2.0
    seat_y = slab.seat_half_spacing * np.array([-1.0, 1.0])
    x, y = np.meshgrid(seat_x, seat_y, indexing="ij")
    index, w, slope = seat_rows(slab, x.ravel(), y.ravel(), baseplate)
    shape = (slab.fastenings, 2, -1)
    return index.reshape(shape), w.reshape(shape), slope.reshape(shape), seat_x


def _weight_pressure(
    slab: Slab,
    mortar: Mortar,
    K: NDArray[np.float64],
    index: NDArray[np.int32],
    shape: NDArray[np.float64],
    weight: NDArray[np.float64],
    factor: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Pressure of the linear bed under the slab's own weight [Pa], shape (n_el, n_q).

    It is rho g h everywhere on an intact bed, and larger next to a void, since the slab spans the void.
    """
    if np.all(factor == 1.0):
        return np.full(factor.shape, slab.weight_pressure)
    element_load = slab.weight_pressure * (weight @ shape)
    load = np.bincount(index.ravel(), np.tile(element_load, len(index)))
    # least squares: a bed with too little area left leaves the stiffness singular
    w = np.linalg.lstsq(K[:-2, :-2], load, rcond=None)[0]
    pressure: NDArray[np.float64] = mortar.stiffness * factor * np.einsum("ei,qi->eq", w[index], shape)
    return pressure
