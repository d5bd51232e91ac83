"""Knots of the splines, graded towards the wheels (MODEL §1a)."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from tiengine.parameters.errors import InputError
from tiengine.parameters.quantity import Params, Q

__all__ = ["Grading", "graded_knots", "uniform_knots"]


class Grading(Params):
    """Distance of knots: ``finest`` up to ``near`` from a wheel, then growing with the distance, to ``coarsest``.

    On a track with failed fastenings, voids or warped slabs it grows to ``coarsest_at_defects`` only. There the rails
    carry what their support does not, within a metre, also far from any wheel: the free end of a slab over a void
    swings on them. With knots 1 m apart they are too stiff for that, and the next bogie finds the slab in another
    phase (2.4 % of the peak force).
    """

    finest: Annotated[float, Q("m", "between knots near a wheel", ge=0.01, le=2)] = 0.15
    near: Annotated[float, Q("m", "from a wheel, within which knots are finest", ge=0, le=100)] = 0.5
    growth: Annotated[float, Q("-", "of the distance between knots per distance from the wheel", gt=0, le=1)] = 0.2
    coarsest: Annotated[float, Q("m", "between knots far from the wheels", ge=0.01, le=2)] = 1.0
    coarsest_at_defects: Annotated[
        float,
        Q("m", "the same on a track with failed fastenings, mortar voids or warped slabs, if smaller", ge=0.01, le=2),
    ] = 0.5

    @model_validator(mode="after")
    def _ordered(self) -> Grading:
        if self.coarsest < self.finest:
            raise InputError(f"grading: coarsest = {self.coarsest:g} m must not be below finest = {self.finest:g} m")
        return self

    def at_defects(self) -> Grading:
        """Grading of a track with failed fastenings, voids or warped slabs."""
        return self.model_copy(update={"coarsest": min(self.coarsest, max(self.coarsest_at_defects, self.finest))})

    def spans(self, distance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Spans between a wheel and a distance from it [m]: the integral of one over the distance of knots."""
        graded = (self.coarsest - self.finest) / self.growth  # m along which the distance of knots grows
        grown = np.log1p(self.growth / self.finest * np.clip(distance - self.near, 0.0, graded)) / self.growth
        far = np.maximum(distance - self.near - graded, 0.0) / self.coarsest
        spans: NDArray[np.float64] = np.minimum(distance, self.near) / self.finest + grown + far
        return spans

    def distance(self, spans: NDArray[np.float64]) -> NDArray[np.float64]:
        """Inverse of :meth:`spans` [m]."""
        within = self.near / self.finest
        graded = np.log(self.coarsest / self.finest) / self.growth
        grown = self.finest / self.growth * np.expm1(self.growth * np.clip(spans - within, 0.0, graded))
        far = np.maximum(spans - within - graded, 0.0) * self.coarsest
        distance: NDArray[np.float64] = np.minimum(spans, within) * self.finest + grown + far
        return distance


def graded_knots(length: float, wheel_s: NDArray[np.float64], grading: Grading | None = None) -> NDArray[np.float64]:
    """Knots of a window: one under every wheel, and between them whole spans as the grading asks, or a little shorter.

    Symmetric about the middle to rounding if the wheels are. Wheels closer than half the finest distance share a knot,
    so that no span is a sliver.

    Args:
        length: Window l [m].
        wheel_s: Wheels in it [m], in any order, shape (W,).
        grading: How knots are spread; by default its defaults.

    Returns:
        Ascending from 0 to l [m], shape (n,).

    Raises:
        InputError: No wheel, or one not well inside the window.
    """
    grading = grading or Grading()
    wheels = np.unique(wheel_s)
    sliver = 0.5 * grading.finest
    if len(wheels) == 0 or wheels[0] < sliver or wheels[-1] > length - sliver:
        raise InputError(f"window of {length:g} m: every wheel must stand at least {sliver:g} m from its ends")
    wheels = wheels[np.append(True, np.diff(wheels) >= sliver)]
    rear, front = _outward(wheels[0], grading), _outward(length - wheels[-1], grading)
    parts = [wheels[0] - rear[::-1]]
    for a, b in pairwise(wheels):
        parts.append(_between(a, b, grading)[1:])
    parts.append(wheels[-1] + front[1:])
    knots = np.concatenate(parts)
    knots[0], knots[-1] = 0.0, length
    return knots


def uniform_knots(length: float, spacing: float) -> NDArray[np.float64]:
    """Knots of about a spacing, or a little closer, from 0 to l [m], at least four."""
    return np.linspace(0.0, length, max(3, _whole(length / spacing)) + 1)


def _whole(spans: float) -> int:
    """Least whole number of spans, at least one."""
    return max(1, int(np.ceil(spans - 1e-9)))


def _outward(distance: float, grading: Grading) -> NDArray[np.float64]:
    """Distances of knots from the outermost wheel to the window's end [m]; three spans at least.

    Only the spans that no longer grow are made a little shorter, if the window is long enough for any: knots near the
    wheels do not depend on its length. A wheel feels them: 0.15 % of the lateral peak if all are stretched by 2 %.
    """
    total = float(grading.spans(np.array(distance)))
    spans = max(3, _whole(total))
    graded = _whole(grading.near / grading.finest + np.log(grading.coarsest / grading.finest) / grading.growth)
    if graded >= spans:
        return grading.distance(total / spans * np.arange(spans + 1.0))
    knots = grading.distance(np.arange(graded + 1.0))
    far: NDArray[np.float64] = np.linspace(knots[-1], distance, spans - graded + 1)
    return np.append(knots[:-1], far)


def _between(a: float, b: float, grading: Grading) -> NDArray[np.float64]:
    """Knots from wheel a to wheel b [m], mirrored about the middle between them."""
    half = float(grading.spans(np.array(0.5 * (b - a))))
    spans = _whole(2.0 * half)
    number = np.arange(spans + 1)
    nearest = np.minimum(number, spans - number).astype(np.float64)
    from_nearest = grading.distance(2.0 * half / spans * nearest)
    knots: NDArray[np.float64] = np.where(2 * number <= spans, a + from_nearest, b - from_nearest)
    return knots
