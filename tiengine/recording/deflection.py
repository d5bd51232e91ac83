"""Snapshots of the deflected rails and slabs along the whole window."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tiengine.engine.state import DISPLACEMENT
from tiengine.engine.stepper import Plan, Stepper
from tiengine.kernels import layout as at
from tiengine.parameters.arrays import Flags, Ints, Reals
from tiengine.result_files.layout import Block
from tiengine.track.plate_shapes import W, element_dofs, locate, tabulate_shapes
from tiengine.track.slab import Slab

__all__ = ["Deflection", "window_points"]

POINT_SPACING = 0.25
"""Approximate distance of the points [m]: two or three between neighbouring seats."""


def window_points(length: float) -> Reals:
    """Points of a window, from its rear end to its front end [m], shape (points,)."""
    return np.linspace(0.0, length, round(length / POINT_SPACING) + 1)


@dataclass(eq=False)
class Deflection:
    """Snapshots of one run.

    Attributes:
        stepper: Is watched.
        every: Steps from one snapshot to the next.
        steps: Steps before the present chunk.
    """

    stepper: Stepper
    every: int
    steps: int = 0

    def __post_init__(self) -> None:
        """Bind the rails at the points; shapes of the slabs under them as polynomials of x."""
        slab = self.stepper.ingredients.slab
        self._points = window_points(self.stepper.ingredients.length)
        self._rail = self.stepper.state.rail_deflection(self._points)
        self._slab_dofs = element_dofs(slab).reshape(slab.elements_x, slab.elements_y, 12)
        self._under_rails = [_cubic_along(slab, side * slab.seat_half_spacing) for side in (-1.0, 1.0)]
        self._snapshots: list[tuple[int, Reals]] = []

    @property
    def point_offset(self) -> Reals:
        """Points forward of the first vehicle's centre [m]."""
        return self._points - self.stepper.ingredients.centre_s

    @property
    def stage(self) -> str:
        """Name of its stage of the step."""
        return "deflection"

    def due(self, plan: Plan) -> Flags:
        """Steps after which a snapshot is taken."""
        return self._taken_after(plan.step)

    def watch(self) -> None:
        """Take a snapshot if it is time for one."""
        if self._taken_after(np.array(self.stepper.rows.step)):
            self._snapshots.append((self.stepper.rows.step, np.stack([self._rail(), self._slab()])))

    def blocks(self, time: Reals, position: Reals) -> list[Block]:
        """Snapshots of the chunk whose steps end at the given times [s], with the train at the given chainages [m]."""
        taken, self._snapshots = self._snapshots, []
        self.steps += len(time)
        steps = np.array([step for step, _ in taken], dtype=np.int64)
        trains = self.stepper.state.trains
        none = np.empty((2, 0, trains, 2, len(self._points)))
        rail, slab = np.concatenate([none, *(bent[:, None] for _, bent in taken)], axis=1)
        return [Block(time[steps], position[steps], {"rail": rail[:, b], "slab": slab[:, b]}) for b in range(trains)]

    def remainder(self) -> list[Block]:
        """Nothing is kept back."""
        return []

    def saved(self) -> dict[str, Reals]:
        """Values that the coming snapshots depend on."""
        return {"steps": np.array(float(self.steps))}

    def restore(self, saved: Mapping[str, Reals]) -> None:
        """Continue from the values of :meth:`saved`."""
        self.steps = int(saved["steps"])

    def _taken_after(self, step: Ints) -> Flags:
        """Whether a snapshot follows rows of the chunk."""
        taken: Flags = (self.steps + step + 1) % self.every == 0
        return taken

    def _slab(self) -> Reals:
        """Deflection of the slabs under the rails [m], shape (B, 2, points); NaN where there is none."""
        state, slab = self.stepper.state, self.stepper.ingredients.slab
        chainage = self.stepper.chunk.clock[self.stepper.rows.step, at.POSITION] + self._points
        number = np.floor(chainage / slab.pitch).astype(np.int64)
        x = chainage - (number + 0.5) * slab.pitch
        motion, slots = state.slab_motion(DISPLACEMENT), state.slots
        there = np.flatnonzero((np.abs(x) <= slab.length / 2.0) & (number < state.first_slab + slots))
        found = np.full((len(motion), 2, len(x)), np.nan)
        ex, xi = locate(x[there], slab.length, slab.elements_x)
        for side, (ey, cubic) in enumerate(self._under_rails):
            at_points = motion[:, (number[there] % slots)[:, None], self._slab_dofs[ex, ey]]
            shapes = np.vander(xi, 4) @ cubic
            # term by term: einsum's last bit depends on where its arguments lie in memory
            found[:, side, there] = sum(at_points[..., i] * shapes[:, i] for i in range(shapes.shape[1]))
        return found


def _cubic_along(slab: Slab, y: float) -> tuple[int, Reals]:
    """The line y [m] through an element: its number across the slab, and the shapes of w along it.

    They are cubics of the local coordinate xi; coefficients of xi^3, xi^2, xi, 1 of each shape, shape (4, 12).
    """
    ey, eta = locate(np.array([y]), slab.width, slab.elements_y)
    xi = np.array([-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0])
    shapes = tabulate_shapes(slab, np.stack([xi, np.full(4, eta[0])], axis=1))[:, W]
    return int(ey[0]), np.asarray(np.linalg.solve(np.vander(xi, 4), shapes), np.float64)
