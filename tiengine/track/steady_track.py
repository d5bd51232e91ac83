r"""Both rails on seats on slabs under steady loads: d/dt = 0 in the moving frame, seats as they stand at one instant.

Assembled from matrices on the host, apart from the kernels (which it also checks). With r the rows that give a
fastening's stretch from rails and slabs (rail less slab) and r' the same of the rails' slopes, the damper feels the
convective rate -V r', so that

    K q = f,   K = K_rails(V) + K_slabs + sum r^T (k r - V c r')

summed over the vertical, rolling and lateral springs of every seat (MODEL §3). Rails in splines leave K sparse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import SuperLU, splu

from tiengine.parameters.arrays import Reals
from tiengine.track.fastening import Fastening
from tiengine.track.rail_operators import RailOperators
from tiengine.track.slab_matrices import SlabMatrices

__all__ = ["RIGID_GROUND", "SeatsInWindow", "SteadyTrack", "track_stiffness", "vertical_stretch"]


RIGID_GROUND = -1
"""Slab of a seat that stands on rigid ground."""


@dataclass(frozen=True, eq=False)
class SeatsInWindow:
    """Fastenings at one instant.

    Attributes:
        s: Places of their middles in the window [m], shape (k,).
        slab: Number of the slab under each among those given, -1 for rigid ground, shape (k,).
        seat: Number of the seat on its slab, shape (k,).
        scale: Factors of the fastenings left and right, shape (k, 2).
        length: Length of rail on which a seat presses [m].
    """

    s: Reals
    slab: NDArray[np.int64]
    seat: NDArray[np.int64]
    scale: Reals
    length: float


class SteadyTrack:
    """Compliance of both rails on slabs.

    Unknowns: (w, theta_y) of the left rail function by function, its (v, theta_z, theta_x), the right rail's, slabs.
    """

    def __init__(
        self,
        operators: RailOperators,
        fastening: Fastening,
        seats: SeatsInWindow,
        slabs: Sequence[SlabMatrices],
        V: float,
        wheel_s: Reals,
        wheel_residual: Reals | None = None,
        beds: Sequence[Reals] | None = None,
        slab_load: Reals | None = None,
    ) -> None:
        """Assemble and factorise.

        Args:
            operators: Rail and trial functions, n a field.
            fastening: Sound fastening.
            seats: Those in the window.
            slabs: Slabs under it, all of one size.
            V: Speed [m/s].
            wheel_s: Wheels in the window [m], shape (W,).
            wheel_residual: Static compliance that the trial functions lack under every wheel in w, v, theta_x,
                shape (W, 3).
            beds: Stiffness of the bed under each slab, shape (dofs, dofs); that of its design by default.
            slab_load: Constant forces on the slabs, shape (slabs, dofs); none by default.
        """
        self._n, self._slabs = operators.functions.count, len(slabs)
        K = track_stiffness(operators, fastening, seats, slabs, beds or [slab.K_bed for slab in slabs], V)
        self._lu: SuperLU = splu(K)
        value, slope = (_under_wheels(operators, wheel_s, d, K.shape[0]) for d in (0, 1))
        self._place = sp.csc_array(value.T)
        W = len(wheel_s)
        moved, turned = (np.empty((W, 2, 3, W, 2, 3)) for _ in range(2))
        for u in range(W):  # wheel by wheel: displacements of all unknowns under all wheels would take 100 MB
            q = self._lu.solve(self._place[:, 6 * u : 6 * u + 6].toarray())
            moved[:, :, :, u], turned[:, :, :, u] = ((rows @ q).reshape(W, 2, 3, 2, 3) for rows in (value, slope))
        if wheel_residual is not None:
            wheel, side, field = np.ix_(np.arange(W), np.arange(2), np.arange(3))
            moved[wheel, side, field, wheel, side, field] += wheel_residual[:, None]
        self._compliance = np.concatenate([moved, turned, np.zeros_like(moved)], axis=2)
        self._own = np.zeros(K.shape[0])
        if slab_load is not None:
            self._own = self._lu.solve(np.concatenate([np.zeros(10 * self._n), slab_load.ravel()]))
        own = [(rows @ self._own).reshape(W, 2, 3) for rows in (value, slope)]
        self._under_own = np.concatenate([*own, np.zeros((W, 2, 3))], axis=2)

    def under_wheels(self, force: Reals) -> Reals:
        """Rail motion under the wheels.

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (B, W, 2, 3).

        Returns:
            w, v, theta_x, their slopes, their (zero) rates at constant s, shape (B, W, 2, 9).
        """
        shape = self._compliance.shape[:3]
        moved = force.reshape(len(force), -1) @ self._compliance.reshape(np.prod(shape), -1).T
        under: Reals = moved.reshape(len(force), *shape) + self._under_own
        return under

    def motion(self, force: Reals) -> tuple[Reals, Reals, Reals]:
        """Generalised coordinates under wheel forces.

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (W, 2, 3).

        Returns:
            Vertical unknowns, shape (2, 2n), lateral ones, shape (2, 3n), and slabs, shape (slabs, dofs).
        """
        return self.respond(self._place @ force.ravel())

    def respond(self, load: Reals) -> tuple[Reals, Reals, Reals]:
        """As :meth:`motion`, under generalised forces on all unknowns."""
        q, n = self._own + self._lu.solve(load), self._n
        rails = q[: 10 * n].reshape(2, 5 * n)
        return rails[:, : 2 * n], rails[:, 2 * n :], q[10 * n :].reshape(self._slabs, -1)


def track_stiffness(
    operators: RailOperators,
    fastening: Fastening,
    seats: SeatsInWindow,
    slabs: Sequence[SlabMatrices],
    beds: Sequence[Reals],
    V: float,
) -> sp.csc_array:
    """Stiffness of rails, fastenings and slabs, unknowns as in :class:`SteadyTrack`.

    Args:
        operators: Rail and trial functions.
        fastening: Sound fastening.
        seats: Those in the window.
        slabs: Slabs under it.
        beds: Stiffness of the bed under each, shape (dofs, dofs).
        V: Speed [m/s].
    """
    stretch, flow, stiffness, damping = _springs(operators, fastening, seats, slabs)
    rail = (operators.vertical(V)[2], operators.lateral(V)[2])
    plates = [sp.csr_array(slab.K_plate + bed) for slab, bed in zip(slabs, beds, strict=True)]
    pull = sp.diags_array(stiffness) @ stretch - V * sp.diags_array(damping) @ flow
    return sp.csc_array(sp.block_diag([*rail, *rail, *plates], format="csc") + stretch.T @ pull)


def vertical_stretch(operators: RailOperators, seats: SeatsInWindow, slabs: Sequence[SlabMatrices]) -> sp.csr_array:
    """Rows that give the vertical stretch of every fastening, rail less slab, left ones first, shape (2 k, unknowns).

    Args:
        operators: Rail and trial functions.
        seats: Fastenings.
        slabs: Slabs under them.
    """
    n, w = operators.functions.count, operators.under(seats.s, 0, seats.length)[0]
    sides = [
        sp.hstack([_on_side(side, w, None, n), -_slab_rows(seats, slabs, side, 0, operators.rail.half_base)])
        for side in range(2)
    ]
    return sp.csr_array(sp.vstack(sides))


def _on_side(side: int, vertical: sp.csr_array | None, lateral: sp.csr_array | None, n: int) -> sp.csr_array:
    """Rows over both rails from rows over the vertical and the lateral unknowns of one, shape (k, 10 n)."""
    rows = next(block.shape[0] for block in (vertical, lateral) if block is not None)
    parts = [sp.csr_array((rows, 2 * n)) if vertical is None else vertical]
    parts.append(sp.csr_array((rows, 3 * n)) if lateral is None else lateral)
    other = [sp.csr_array((rows, 5 * n))]
    return sp.csr_array(sp.hstack([*other, *parts] if side else [*parts, *other]))


def _under_wheels(operators: RailOperators, s: Reals, derivative: int, size: int) -> sp.csr_array:
    """Rows for w, v, theta_x of both rails under the wheels, shape (6 W, size), by wheel, side, field."""
    n = operators.functions.count
    w, v, x = operators.under(s, derivative)
    rows = [_on_side(side, y, z, n) for side in range(2) for y, z in ((w, None), (None, v), (None, x))]
    stacked = sp.csr_array(sp.vstack(rows))
    order = np.arange(6 * len(s)).reshape(6, len(s)).T.ravel()
    return sp.csr_array(sp.hstack([stacked[order], sp.csr_array((6 * len(s), size - 10 * n))]))


def _springs(
    operators: RailOperators, fastening: Fastening, seats: SeatsInWindow, slabs: Sequence[SlabMatrices]
) -> tuple[sp.csr_array, sp.csr_array, Reals, Reals]:
    """Vertical, rolling and lateral spring of every fastening.

    Returns:
        Rows of stretch and of the rails' slopes, shape (6 k, unknowns), stiffness and damping, shape (6 k,).
    """
    n, a, b = operators.functions.count, operators.rail.arm_fastening, operators.rail.half_base
    (w, v, x), (w1, v1, x1) = (operators.under(seats.s, d, seats.length) for d in (0, 1))
    kv, cv = fastening.vertical_stiffness, fastening.vertical_damping
    kl, cl = fastening.lateral_stiffness, fastening.lateral_damping
    kinds = (  # stretch of the rail and its slope by vertical and lateral unknowns; stiffness, damping
        ((w, None), (w1, None), kv, cv),
        ((None, b * x), (None, b * x1), kv, cv),
        ((None, v - a * x), (None, v1 - a * x1), kl, cl),
    )
    stretch, flow, stiffness, damping = [], [], [], []
    for side in range(2):
        for kind, (value, slope, k, c) in enumerate(kinds):
            answer = _slab_rows(seats, slabs, side, kind, b)
            stretch.append(sp.hstack([_on_side(side, *value, n), -answer]))
            flow.append(sp.hstack([_on_side(side, *slope, n), sp.csr_array(answer.shape)]))
            stiffness.append(k * seats.scale[:, side])
            damping.append(c * seats.scale[:, side])
    rows = (sp.csr_array(sp.vstack(part)) for part in (stretch, flow))
    return (*rows, np.concatenate(stiffness), np.concatenate(damping))


def _slab_rows(seats: SeatsInWindow, slabs: Sequence[SlabMatrices], side: int, kind: int, b: float) -> sp.csr_array:
    """Rows for the slabs' motion at the seats: w, b dw/dy, or lateral, shape (k, slabs dofs)."""
    dofs = slabs[0].n if slabs else 0
    rows = sp.lil_array((len(seats.s), len(slabs) * dofs))
    for i, (slab, seat) in enumerate(zip(seats.slab, seats.seat, strict=True)):
        if slab == RIGID_GROUND:
            continue
        design, first = slabs[slab], int(slab) * dofs
        if kind == 2:
            rows[i, [first + dofs - 2, first + dofs - 1]] = 1.0, design.seat_x[seat]
        else:
            shape = design.seat_w if kind == 0 else b * design.seat_slope
            rows[i, first + design.seat_index[seat, side]] = shape[seat, side]
    return sp.csr_array(rows)
