"""Track slabs: a thin free plate of ACM elements plus rigid lateral displacement and yaw.

DOFs of a slab: (w, dw/dx, dw/dy) of every node, node (ix, iy) being number ix (elements_y + 1) + iy, then the
lateral displacement y and the yaw psi of its centre. x forward, y right, w down; side index 0 left, 1 right.
The matrices come from the Taichi kernels of ``kernels/plate.py``, so :func:`tiengine.backend.start` must have
been called.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationInfo, field_validator

from tiengine.kernels import plate
from tiengine.mortar import GAUSS, Mortar, MortarVoid, bed_factors
from tiengine.parameters.errors import InputError
from tiengine.parameters.input_files import load_toml
from tiengine.parameters.presets import find_preset, preset_names
from tiengine.parameters.quantity import Params, Q, build
from tiengine.plate_shapes import WY, W, element_dofs, shapes_at, tabulate_shapes

__all__ = ["GRAVITY", "Slab", "SlabMatrices", "load_slab", "slab_designs", "slab_matrices", "slab_names"]

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2]."""

MOST_DOFS = 5000  # of a slab: its matrices are full
THIN = 0.1
"""Largest thickness over length or width of a thin plate (the source paper, section 2.1.2)."""


class Slab(Params):
    """Geometry, material and mesh of one slab.

    Attributes:
        name: What the slab is called.
        source: Where its numbers come from.
        length: Length along the track.
        width: Width across the track.
        thickness: Thickness h.
        gap: Joint between two slabs.
        fastening_pitch: Seat spacing d, uniform across the joints.
        fastenings: Pairs of fastenings a slab; fastenings d is the pitch of the slabs.
        E: Young's modulus.
        nu: Poisson's ratio.
        rho: Density.
        elements_x: Elements along the track.
        elements_y: Elements across the track.
        seat_half_spacing: Lateral distance of the seats from the centre line.
    """

    name: str = "slab"
    source: str = ""
    length: Annotated[float, Q("m", gt=0.0, le=200.0)]
    width: Annotated[float, Q("m", gt=0.0)]
    thickness: Annotated[float, Q("m", gt=0.0)]
    gap: Annotated[float, Q("m", ge=0.0)]
    fastening_pitch: Annotated[float, Q("m", ge=0.1, le=10.0)]
    fastenings: Annotated[int, Q("-", ge=1, le=1000)]
    E: Annotated[float, Q("N/m^2", gt=0.0)]
    nu: Annotated[float, Q("-", ge=0.0, lt=0.5)]
    rho: Annotated[float, Q("kg/m^3", gt=0.0)]
    elements_x: Annotated[int, Q("-", ge=1, le=200)] = 9
    elements_y: Annotated[int, Q("-", ge=1, le=100)] = 2
    seat_half_spacing: Annotated[float, Q("m", gt=0.0, validate_default=True)] = 0.7465

    @field_validator("thickness")
    @classmethod
    def _is_thin(cls, value: float, info: ValidationInfo) -> float:
        side = min(info.data.get("length", np.inf), info.data.get("width", np.inf))
        if value > THIN * side:
            raise ValueError(f"must be at most {THIN:g} of length and width for a thin plate, {THIN * side:g} m")
        return value

    @field_validator("fastenings")
    @classmethod
    def _seats_are_uniform(cls, value: int, info: ValidationInfo) -> int:
        known = info.data
        if not {"length", "gap", "fastening_pitch"} <= known.keys():
            return value  # one of them has been refused already
        pitch = known["length"] + known["gap"]
        if abs(value * known["fastening_pitch"] - pitch) > 1e-6:
            raise ValueError(
                f"times fastening_pitch is {value * known['fastening_pitch']:.6f} m; "
                f"it must equal length + gap = {pitch:.6f} m"
            )
        if known["fastening_pitch"] <= known["gap"]:
            raise ValueError("the outer seats, fastening_pitch / 2 from the joint's middle, must lie on the slab")
        return value

    @field_validator("elements_y")
    @classmethod
    def _is_not_too_fine(cls, value: int, info: ValidationInfo) -> int:
        dofs = 3 * (info.data.get("elements_x", 1) + 1) * (value + 1)
        if dofs > MOST_DOFS:
            raise ValueError(f"gives the slab {dofs} degrees of freedom with elements_x; must be at most {MOST_DOFS}")
        return value

    @field_validator("seat_half_spacing")
    @classmethod
    def _seats_are_on_the_slab(cls, value: float, info: ValidationInfo) -> float:
        if "width" in info.data and value >= info.data["width"] / 2.0:
            raise ValueError(f"must be less than half the slab's width, {info.data['width'] / 2.0:g} m")
        return value

    @property
    def pitch(self) -> float:
        """Distance between joints, length + gap [m]."""
        return self.length + self.gap

    @property
    def mass(self) -> float:
        """Mass of the slab [kg]."""
        return self.rho * self.length * self.width * self.thickness

    @property
    def rigidity(self) -> float:
        """Plate rigidity D_0 = E h^3 / 12 (1 - nu^2) [N m]."""
        return self.E * self.thickness**3 / (12.0 * (1.0 - self.nu**2))

    @property
    def weight_pressure(self) -> float:
        """Pressure rho g h of the slab's weight on its bed [Pa]."""
        return self.rho * GRAVITY * self.thickness

    @property
    def plate_dofs(self) -> int:
        """DOFs of the plate, three a node."""
        return 3 * (self.elements_x + 1) * (self.elements_y + 1)


@dataclass(frozen=True)
class SlabMatrices:
    """Matrices and tables of one slab design, that is one arrangement of voids.

    It has n DOFs, n_el elements and n_q quadrature points an element.

    Attributes:
        n: DOFs: the plate's, then lateral displacement and yaw.
        M: Mass matrix, shape (n, n).
        K_plate: Stiffness of the plate, shape (n, n); zero for lateral displacement and yaw.
        K_bed: Stiffness of the bed, lateral bed included, shape (n, n).
        C_bed: Damping of the bed, lateral bed included, shape (n, n).
        seat_index: DOFs of the element under every seat, shape (fastenings, 2, 12).
        seat_w: Shapes: w at a seat is seat_w . u[seat_index], shape (fastenings, 2, 12).
        seat_slope: dw/dy at a seat is seat_slope . u[seat_index] [1/m for the w DOFs], shape (fastenings, 2,
            12).
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


def slab_names() -> list[str]:
    """Names of the library's slabs, sorted."""
    return preset_names("slabs")


def load_slab(name_or_path: str, folder: Path | None = None) -> tuple[Slab, Mortar]:
    """Slab and mortar of the library or of a TOML file of the same form.

    Args:
        name_or_path: ``"CRTS_III"``, or the path of a file: keys of :class:`Slab` and a table ``[mortar]``.
        folder: Where relative paths start; the working directory if None.

    Returns:
        The slab and its bed.

    Raises:
        InputError: There is no such preset or file, or a value breaks a rule.
    """
    path = find_preset("slabs", name_or_path, folder=folder)
    table = load_toml(path)
    mortar = table.pop("mortar", None)
    if not isinstance(mortar, dict):
        raise InputError(f"{path.stem}.mortar: missing; a table of the bed's values is required")
    return build(Slab, table, path.stem), build(Mortar, mortar, f"{path.stem}.mortar")


def slab_matrices(slab: Slab, mortar: Mortar, voids: Sequence[MortarVoid] = ()) -> SlabMatrices:
    """Matrices of one slab.

    Args:
        slab: The slab.
        mortar: Its bed.
        voids: Voids of this slab, all of the same slab index.

    Returns:
        The matrices and tables.

    Raises:
        InputError: If a void leaves the slab, overlaps another, or belongs to another slab than the first
            one.
    """
    if len({void.slab for void in voids}) > 1:
        raise InputError(f"mortar void on slab {voids[-1].slab}: every void must be on slab {voids[0].slab}")
    return _build(slab, mortar, [list(voids)])[0]


def slab_designs(slab: Slab, mortar: Mortar, voids: Sequence[MortarVoid]) -> tuple[list[SlabMatrices], dict[int, int]]:
    """Matrices of the intact slab and of every slab with voids.

    Args:
        slab: The slab.
        mortar: Its bed.
        voids: Voids of the whole track.

    Returns:
        The designs, the intact one first, and the design of each slab index that has voids.

    Raises:
        InputError: If a void leaves its slab or overlaps another one.
    """
    damaged = sorted({void.slab for void in voids})
    groups: list[list[MortarVoid]] = [[]]
    groups += [[void for void in voids if void.slab == index] for index in damaged]
    return _build(slab, mortar, groups), {index: 1 + i for i, index in enumerate(damaged)}


def _build(slab: Slab, mortar: Mortar, groups: list[list[MortarVoid]]) -> list[SlabMatrices]:
    """One design for each group of voids."""
    elements = (slab.elements_x, slab.elements_y)
    points, weight = _quadrature(slab)
    table = tabulate_shapes(slab, points)
    factor = np.stack([bed_factors(slab.length, slab.width, elements, voids) for voids in groups])
    index = element_dofs(slab)
    stiffness, mass, bed = _assemble(slab, table, weight, factor)
    seat_index, seat_w, seat_slope, seat_x = _seats(slab)
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
    """Local coordinates (GAUSS^2, 2) and areas [m^2] of the quadrature points of an element."""
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    points = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    area = slab.length * slab.width / (slab.elements_x * slab.elements_y)
    return points, np.outer(w, w).ravel() * area / 4.0


def _assemble(
    slab: Slab, table: NDArray[np.float64], weight: NDArray[np.float64], factor: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness, mass and integral of factor N^T N of every design, shape (n_design, n, n) each."""
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
    slab: Slab,
) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """DOFs, w row, dw/dy row and place of every seat; seat j is (j + 1/2) d past the joint's middle."""
    seat_x = np.arange(0.5, slab.fastenings, dtype=np.float64) * slab.fastening_pitch - slab.pitch / 2.0
    seat_y = slab.seat_half_spacing * np.array([-1.0, 1.0])
    x, y = np.meshgrid(seat_x, seat_y, indexing="ij")
    index, table = shapes_at(slab, x.ravel(), y.ravel())
    shape = (slab.fastenings, 2, 12)
    return index.reshape(shape), table[:, W].reshape(shape), table[:, WY].reshape(shape), seat_x


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

    rho g h everywhere on an intact bed. Beside a void it is larger: the slab spans the void.
    """
    if np.all(factor == 1.0):
        return np.full(factor.shape, slab.weight_pressure)
    element_load = slab.weight_pressure * (weight @ shape)
    load = np.bincount(index.ravel(), np.tile(element_load, len(index)))
    # least squares, since a bed with too little area left does not hold the slab at all
    w = np.linalg.lstsq(K[:-2, :-2], load, rcond=None)[0]
    pressure: NDArray[np.float64] = mortar.stiffness * factor * np.einsum("ei,qi->eq", w[index], shape)
    return pressure
