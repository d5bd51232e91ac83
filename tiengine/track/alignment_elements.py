"""Alignment of a scenario: elements or rows of a file, checked, and the line that they give (MODEL §12)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from tiengine.parameters.arrays import Reals
from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q
from tiengine.track.alignment import CANT_BASE, Alignment

__all__ = [
    "LARGEST_CANT",
    "SMALLEST_RADIUS",
    "AlignmentElement",
    "AlignmentRows",
    "alignment_of",
    "line_of_elements",
    "line_of_rows",
]

SMALLEST_RADIUS = 250.0
"""[m]; the model leaves out the curvature of the rails themselves."""

LARGEST_CANT = 0.2
"""[m], over 1.5 m."""

LARGEST_TWIST = 2.5e-3
"""Change of cant over distance: 1 in 400."""

STEEPEST = 0.05
"""Gradient."""

SMALLEST_VERTICAL_RADIUS = 500.0
"""[m]."""

_ROUNDING = 1.0 + 1e-9  # of decimal input


class AlignmentElement(Params):
    """Stretch of a line; elements are joined end to end from chainage 0 on, and the last one goes on for ever.

    ``straight`` and ``arc`` have constant curvature and cant. A ``transition`` leads from those of the element before
    it to those of the element after it, both in proportion to its length: a clothoid with its cant ramp.
    """

    kind: Annotated[Literal["straight", "transition", "arc"], Field(description="shape in plan")]
    length: Annotated[float, Q("m", "length along the track", ge=1, le=1e6)]
    radius: Annotated[float | None, Q("m", "radius of an arc, positive to the right, negative to the left")] = None
    cant_mm: Annotated[
        float | None,
        Q("mm", "cant of a straight or an arc over 1.5 m, positive where the left rail is raised; by default 0"),
    ] = None
    gradient_permille: Annotated[
        float | None,
        Q(
            "-",
            "gradient at the end of the element in permille, positive uphill; by default that of the element before. It"
            " grows in proportion to the length: a vertical curve",
        ),
    ] = None

    @model_validator(mode="after")
    def _check(self) -> AlignmentElement:
        if self.kind == "arc" and self.radius is None:
            raise ValueError("an arc needs its radius")
        if self.kind != "arc" and self.radius is not None:
            raise ValueError(f"a {self.kind} has no radius; only an arc has")
        if self.kind == "transition" and self.cant_mm is not None:
            raise ValueError("a transition takes its cant from the elements before and after it")
        return self

    @property
    def curvature(self) -> float:
        """Curvature of a straight or an arc [1/m]."""
        return 1.0 / self.radius if self.radius else 0.0

    @property
    def name(self) -> str:
        """The element in words."""
        return self.kind if self.radius is None else f"arc of radius {self.radius:g} m"


def _check_rows(value: Any) -> Any:
    """Check rows of four finite numbers."""
    if not isinstance(value, tuple) or not all(
        isinstance(row, tuple)
        and len(row) == 4
        and all(isinstance(x, int | float) and not isinstance(x, bool) for x in row)
        for row in value
    ):
        raise ValueError("must be rows [chainage_m, curvature in 1/m, cant in mm, gradient in permille]")
    return tuple(tuple(float(x) for x in row) for row in value)


AlignmentRows = Annotated[tuple[tuple[float, float, float, float], ...], BeforeValidator(_check_rows)]


def alignment_of(
    elements: Sequence[AlignmentElement], rows: Sequence[Sequence[float]], rounding: float
) -> Alignment | None:
    """Line of a scenario; None if it is straight and level throughout.

    Args:
        elements: Elements, if it is given by these.
        rows: Rows of chainage [m], curvature [1/m], cant [mm], gradient [permille], if by these.
        rounding: Length over which corners are rounded [m].

    Raises:
        InputError: Names element or row, its value and the rule.
    """
    if elements and rows:
        raise InputError("track.alignment_rows: must not be set together with track.alignment")
    if not elements and not rows:
        return None
    points, names = line_of_elements(elements) if elements else line_of_rows(rows)
    _check_points(points, names)
    x, curvature, cant, gradient = points.T
    return Alignment(x, curvature, np.arcsin(cant / CANT_BASE), gradient, rounding)


def line_of_elements(elements: Sequence[AlignmentElement]) -> tuple[Reals, list[str]]:
    """Points of a line of elements.

    Args:
        elements: End to end.

    Returns:
        Rows of chainage [m], curvature [1/m], cant [m], gradient, shape (elements + 1, 4); the name of each point's
        element.

    Raises:
        InputError: Elements that do not meet.
    """
    where = [f"track.alignment[{i}] ({element.name})" for i, element in enumerate(elements)]
    for i, (before, after) in enumerate(pairwise(elements)):
        if before.kind == after.kind == "transition":
            raise InputError(f"{where[i + 1]}: follows a transition; must be a straight or an arc")
        if "transition" in (before.kind, after.kind):
            continue
        if before.curvature != after.curvature or (before.cant_mm or 0.0) != (after.cant_mm or 0.0):
            raise InputError(
                f"{where[i + 1]}: follows {before.name} with another curvature or cant; must be joined by a transition"
            )
    for i in (0, len(elements) - 1):
        if elements[i].kind == "transition":
            raise InputError(f"{where[i]}: must lie between two elements with a curvature of their own")
    fixed = [(e.curvature, 1e-3 * (e.cant_mm or 0.0)) for e in elements]
    ends = [fixed[i + 1] if e.kind == "transition" else fixed[i] for i, e in enumerate(elements)]
    gradient = [1e-3 * (elements[0].gradient_permille or 0.0)]
    for element in elements:
        given = element.gradient_permille
        gradient.append(gradient[-1] if given is None else 1e-3 * given)
    x = np.cumsum([0.0, *(element.length for element in elements)])
    plan = np.array([fixed[0], *ends])
    return np.column_stack([x, plan, gradient]), [where[0], *where]


def line_of_rows(rows: Sequence[Sequence[float]]) -> tuple[Reals, list[str]]:
    """Points of a line of rows, and the name of each.

    Args:
        rows: Chainage [m], curvature [1/m], cant [mm], gradient [permille].

    Raises:
        InputError: Chainages that do not grow by a metre at least.
    """
    points = np.asarray(rows, dtype=np.float64)
    names = [f"track.alignment_rows[{i}]" for i in range(len(points))]
    if np.abs(points[:, 0]).max() > 1e6:
        i = int(np.argmax(np.abs(points[:, 0])))
        raise InputError(f"{names[i]}: chainage {points[i, 0]:g} m; must be within 1000 km of zero")
    short = np.flatnonzero(np.diff(points[:, 0]) < 1.0 / _ROUNDING)
    if len(short):
        i = int(short[0]) + 1
        raise InputError(
            f"{names[i]}: chainage {points[i, 0]:g} m after {points[i - 1, 0]:g} m; must grow by 1 m at least"
        )
    return points * [1.0, 1.0, 1e-3, 1e-3], names


def _check_points(points: Reals, names: Sequence[str]) -> None:
    """Check radius, cant, gradient at the points, twist and vertical radius between them."""
    x, curvature, cant, gradient = points.T
    step = np.diff(x)
    twist, bend = np.abs(np.diff(cant)) / step, np.abs(np.diff(gradient)) / step
    for size, largest, text in (
        (np.abs(curvature), 1.0 / SMALLEST_RADIUS, "radius {inverse:.4g} m; must be at least 250 m"),
        (np.abs(cant), LARGEST_CANT, "cant {mm:.4g} mm; must be within -200 and 200 mm"),
        (np.abs(gradient), STEEPEST, "gradient {mm:.4g} permille; must be within -50 and 50 permille"),
        (np.append(0.0, twist), LARGEST_TWIST, "track twist {mm:.4g} mm/m; must be at most 2.5 mm/m (cant ramp)"),
        (
            np.append(0.0, bend), 1.0 / SMALLEST_VERTICAL_RADIUS,
            "vertical curve of radius {inverse:.4g} m; must be at least 500 m",
        ),
    ):  # fmt: skip
        over = np.flatnonzero(size > largest * _ROUNDING)
        if len(over):
            i = int(over[0])
            raise InputError(f"{names[i]}: " + text.format(inverse=1.0 / size[i], mm=1e3 * size[i]))
