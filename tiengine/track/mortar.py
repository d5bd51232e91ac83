"""Mortar bed under the slabs: Winkler foundation, voids and quadrature.

The bed presses on the slab with k_m w + c_m dw/dt per area, consistent with the plate's shape functions
(integral of N^T N), and holds its rigid lateral motion. A void scales both over a rectangle of one slab.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationInfo, field_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["GAUSS", "Mortar", "MortarVoid", "bed_factors"]

GAUSS = 4
"""Gauss points per direction: N^T N of the ACM shapes has degree 6 in x and in y, four points integrate 7."""


class Mortar(Params):
    """Winkler bed of a slab.

    Attributes:
        stiffness: Vertical stiffness k_m per area.
        damping: Vertical damping c_m per area.
        lateral_stiffness: Lateral stiffness per area, acting on the slab's rigid lateral motion.
        lateral_damping: Lateral damping per area.
        no_tension: The bed does not pull: its total pressure, the slab's weight included, stays >= 0.
    """

    stiffness: Annotated[float, Q("N/m^3", gt=0.0)]
    damping: Annotated[float, Q("N s/m^3", ge=0.0)]
    lateral_stiffness: Annotated[float, Q("N/m^3", ge=0.0)]
    lateral_damping: Annotated[float, Q("N s/m^3", ge=0.0)]
    no_tension: bool = False


class MortarVoid(Params):
    """Rectangle of one slab under which the bed is weaker, missing or (factor > 1) stiffer.

    Attributes:
        slab: Index of the slab along the track, from 0.
        x_from: Beginning, from the slab's rear edge.
        x_to: End, from the slab's rear edge.
        y_from: Left edge, from the slab's centre line, positive to the right.
        y_to: Right edge, from the slab's centre line.
        factor: Factor on k_m and c_m and on the lateral bed; 0 is a void.
    """

    slab: Annotated[int, Q("-", ge=0)]
    x_from: Annotated[float, Q("m", ge=0.0)]
    x_to: Annotated[float, Q("m")]
    y_from: Annotated[float, Q("m")]
    y_to: Annotated[float, Q("m")]
    factor: Annotated[float, Q("-", ge=0.0, le=10.0)] = 0.0

    @field_validator("x_to", "y_to")
    @classmethod
    def _ends_after_it_begins(cls, value: float, info: ValidationInfo) -> float:
        begin = str(info.field_name).replace("to", "from")
        if begin in info.data and value <= info.data[begin]:
            raise ValueError(f"must be greater than {begin} = {info.data[begin]:g} m")
        return value


def bed_factors(
    length: float, width: float, elements: tuple[int, int], voids: Sequence[MortarVoid]
) -> NDArray[np.float64]:
    """Compute the bed factor at every quadrature point of one slab.

    An element's quadrature points own cells whose sides are the Gauss weights, so the cells tile the slab. A
    point's factor is 1 - sum (1 - factor) (share of its cell under the void): the area and the total
    stiffness of a void are exact wherever its edges lie.

    Args:
        length: Length of the slab [m].
        width: Width of the slab [m].
        elements: Elements along x and y.
        voids: Voids of this slab; they may touch but not overlap.

    Returns:
        Factors, shape (elements, GAUSS^2), element ex n_y + ey, point GAUSS qx + qy.

    Raises:
        InputError: A void extends beyond the slab or overlaps another one.
    """
    for i, void in enumerate(voids):
        _check(void, length, width, voids[:i])
    factor = np.ones((elements[0], GAUSS, elements[1], GAUSS))
    for void in voids:
        share_x = _shares(elements[0], length, void.x_from, void.x_to)
        share_y = _shares(elements[1], width, void.y_from + width / 2.0, void.y_to + width / 2.0)
        factor -= (1.0 - void.factor) * share_x[:, :, None, None] * share_y
    # voids that touch within a cell may leave a rounding error below zero
    return np.maximum(factor.transpose(0, 2, 1, 3), 0.0).reshape(-1, GAUSS**2)


def _shares(elements: int, size: float, begin: float, end: float) -> NDArray[np.float64]:
    """Share of the cell of every point between two distances from the slab edge [m], shape (elements, GAUSS)."""
    weight = np.polynomial.legendre.leggauss(GAUSS)[1] / 2.0
    within = np.append(0.0, np.cumsum(weight[:-1]))
    left = size / elements * (np.arange(elements)[:, None] + within).ravel()
    right = np.append(left[1:], size)
    covered = np.minimum(right, end) - np.maximum(left, begin)
    share: NDArray[np.float64] = np.maximum(covered, 0.0) / (right - left)  # exactly 1 inside
    return share.reshape(elements, GAUSS)


def _check(void: MortarVoid, length: float, width: float, others: Sequence[MortarVoid]) -> None:
    """Refuse a void that extends beyond its slab or overlaps another one (1 nm is allowed for rounding)."""
    name = f"mortar void on slab {void.slab}"
    if void.x_to > length + 1e-9:
        raise InputError(f"{name}: x_to = {void.x_to:g}: must be <= the slab's length, {length:g} m")
    for key, y in (("y_from", void.y_from), ("y_to", void.y_to)):
        if abs(y) > width / 2.0 + 1e-9:
            raise InputError(f"{name}: {key} = {y:g}: must be within half the slab's width, {width / 2.0:g} m")
    for other in others:
        overlap_x = min(void.x_to, other.x_to) - max(void.x_from, other.x_from)
        overlap_y = min(void.y_to, other.y_to) - max(void.y_from, other.y_from)
        if other.slab == void.slab and overlap_x > 1e-9 and overlap_y > 1e-9:
            raise InputError(
                f"{name}: x_from = {void.x_from:g}: overlaps the void from x = {other.x_from:g} to "
                f"{other.x_to:g} m; voids of a slab must not overlap"
            )
