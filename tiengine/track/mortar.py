"""Mortar bed under the slabs: Winkler foundation, voids and quadrature.

The bed presses on the slab with k_m w + c_m dw/dt per area, consistent with the plate's shape functions
(integral of N^T N), and holds its rigid lateral motion. A void scales both over a rectangle of one slab, or lies lower
by a gap, which the slab must close before the bed carries.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["GAUSS", "LARGEST_GAP", "Mortar", "MortarVoid", "bed_factors", "bed_gaps", "check_void", "sound_with_gap"]

GAUSS = 4
"""Gauss points per direction: N^T N of the ACM shapes has degree 6 in x and in y, four points integrate 7."""

TOLERANCE = 1e-9  # m, for the rounding of edges

LARGEST_GAP = 0.1  # m


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


def sound_with_gap(table: Any) -> Any:
    """Take what lies beyond a gap as sound unless a factor is given.

    Args:
        table: Keys of a void or of fastenings, before they are checked.
    """
    if isinstance(table, dict) and table.get("gap") is not None and "factor" not in table:
        return {**table, "factor": 1.0}
    return table


class MortarVoid(Params):
    """A rectangle of one slab whose bed is missing or scaled, or begins lower by a gap.

    x is measured from the slab's rear edge, y from its centre line, positive to the right. With a gap the bed carries
    nothing until the slab has come down by it, and is then as stiff as `factor` says, which is 1 if it is left out; a
    bed that transmits no tension is needed (`mortar_no_tension`).
    """

    slab: Annotated[int, Q("-", "slab i lies between i and i + 1 slab pitches", ge=0)]
    x: Annotated[tuple[float, float], Field(description="from, to", json_schema_extra={"unit": "m"})]
    y: Annotated[tuple[float, float], Field(description="from, to", json_schema_extra={"unit": "m"})]
    factor: Annotated[float, Q("-", "0 void, 1 sound; scales stiffness and damping", ge=0, le=10)] = 0.0
    gap: Annotated[
        float | None, Q("m", "height that the slab must come down before the bed carries", ge=0, le=LARGEST_GAP)
    ] = None

    _sound = model_validator(mode="before")(sound_with_gap)


def bed_gaps(
    length: float, width: float, elements: tuple[int, int], voids: Sequence[MortarVoid]
) -> NDArray[np.float64]:
    """Height of the gap under every quadrature point of one slab [m], shape (elements, GAUSS^2).

    A point has a gap whole or not at all: where a void covers half of its cell or more.

    Args:
        length: Length of the slab [m].
        width: Width of the slab [m].
        elements: Elements along x and y.
        voids: Voids of this slab.
    """
    gap = np.zeros((elements[0], elements[1], GAUSS, GAUSS))
    for void in voids:
        if void.gap:
            gap += np.where(_covered(length, width, elements, void) >= 0.5 - TOLERANCE, void.gap, 0.0)
    return gap.reshape(-1, GAUSS**2)


def _covered(length: float, width: float, elements: tuple[int, int], void: MortarVoid) -> NDArray[np.float64]:
    """Share of every quadrature point's cell under a void, shape (elements_x, elements_y, GAUSS, GAUSS)."""
    share_x = _shares(elements[0], length, *void.x)
    share_y = _shares(elements[1], width, void.y[0] + width / 2.0, void.y[1] + width / 2.0)
    covered: NDArray[np.float64] = share_x[:, None, :, None] * share_y[None, :, None, :]
    return covered


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
        check_void(void, length, width, voids[:i], f"mortar void on slab {void.slab}")
    factor = np.ones((elements[0], elements[1], GAUSS, GAUSS))
    for void in voids:
        factor -= (1.0 - void.factor) * _covered(length, width, elements, void)
    # voids that touch within a cell may leave a rounding error below zero
    return np.maximum(factor, 0.0).reshape(-1, GAUSS**2)


def _shares(elements: int, size: float, begin: float, end: float) -> NDArray[np.float64]:
    """Share of the cell of every point between two distances from the slab edge [m], shape (elements, GAUSS)."""
    weight = np.polynomial.legendre.leggauss(GAUSS)[1] / 2.0
    within = np.append(0.0, np.cumsum(weight[:-1]))
    left = size / elements * (np.arange(elements)[:, None] + within).ravel()
    right = np.append(left[1:], size)
    covered = np.minimum(right, end) - np.maximum(left, begin)
    share: NDArray[np.float64] = np.maximum(covered, 0.0) / (right - left)  # exactly 1 inside
    return share.reshape(elements, GAUSS)


def check_void(void: MortarVoid, length: float, width: float, others: Sequence[MortarVoid], name: str) -> None:
    """Refuse a void that extends beyond its slab or overlaps another one (1 nm is allowed for rounding).

    Args:
        void: The void.
        length: Length of the slab [m].
        width: Width of the slab [m].
        others: Other voids; those of other slabs are ignored.
        name: Name of the void in the message.

    Raises:
        InputError: Names the key, its value and the rule.
    """
    for key, span, low, high in (("x", void.x, 0.0, length), ("y", void.y, -width / 2.0, width / 2.0)):
        if not low - TOLERANCE <= span[0] < span[1] <= high + TOLERANCE:
            side = "length" if key == "x" else "width"
            rule = f"must be [from, to] with {low:g} <= from < to <= {high:g} m (the slab's {side})"
            raise InputError(f"{name}.{key} = {list(span)}: {rule}")
    for other in others:
        overlap_x, overlap_y = (
            min(mine[1], its[1]) - max(mine[0], its[0]) for mine, its in ((void.x, other.x), (void.y, other.y))
        )
        if other.slab == void.slab and min(overlap_x, overlap_y) > TOLERANCE:
            raise InputError(
                f"{name}.x = {list(void.x)}: overlaps the void from x = {other.x[0]:g} to {other.x[1]:g} m;"
                " voids of a slab must not overlap"
            )
