"""Track with rails in sines under steady loads: d/dt = 0 in the moving frame, seats at their places at one instant.

Assembled from matrices on the host, independently of the kernels (which it also checks). A fastening's damper still
responds to the convective rate -V d/ds. Slabs are eliminated one by one, since each is joined to the rails only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from tiengine.engine.sine_state import SineState
from tiengine.kernels import layout as at
from tiengine.model.sine_model import SineModel
from tiengine.parameters.arrays import Reals
from tiengine.track.seat_points import mean_cosine

__all__ = ["Springs", "StaticTrack", "seat_springs"]


class StaticTrack:
    """Compliance of both rails on slabs; unknowns of a rail are w, theta_y, v, theta_z, theta_x, each N."""

    def __init__(self, model: SineModel, state: SineState, first_seat_s: float, V: float, train: int = 0) -> None:
        """Assemble and factorise.

        Args:
            model: Constant data.
            state: Slabs and fastenings of the window.
            first_seat_s: Rear seat [m from the window's rear end].
            V: Speed [m/s].
            train: Place of the train whose track is taken.
        """
        self.model, self.V = model, V
        n = model.ingredients.modes
        rail = la.block_diag(model.window.vertical(V)[2].toarray(), model.window.lateral(V)[2].toarray())
        K = la.block_diag(rail, rail)
        self._slabs: list[tuple[int, tuple[NDArray[np.float64], NDArray[np.int32]], NDArray[np.float64]]] = []
        slots = model.ingredients.slots
        for slab, springs in seat_springs(model, state, first_seat_s, V, train).items():
            K += springs.test.T @ springs.pull
            if slab >= state.first_slab + slots:
                continue  # beyond the modelled slabs the ground is rigid
            design = model.ingredients.designs.matrices[state.design[train, slab % slots]]
            own = springs.slab.T @ (springs.stiffness[:, None] * springs.slab)
            to_slab = -springs.slab.T @ springs.pull
            to_rail = -springs.test.T @ (springs.stiffness[:, None] * springs.slab)
            lu = la.lu_factor(design.K_plate + design.K_bed + own)
            K -= to_rail @ la.lu_solve(lu, to_slab)
            self._slabs.append((slab % slots, lu, to_slab))
        self._lu = la.lu_factor(K)
        shape = model.wheel_shape
        W = shape.shape[1]
        place = np.zeros((10 * n, W, 2, 3))
        for side in range(2):
            for component, field in enumerate((0, 2, 4)):
                rows = slice(side * 5 * n + field * n, side * 5 * n + (field + 1) * n)
                place[rows, :, side, component] = shape[0].T
        self._place = place.reshape(10 * n, -1)
        q = la.lu_solve(self._lu, self._place).reshape(2, 5, n, -1)
        fields = q[:, [0, 2, 4]]
        value, slope = (np.einsum("wn,rfnk->wrfk", shape[kind], fields) for kind in (0, 1))
        wheels = np.arange(W)[:, None], np.arange(2)
        value = np.ascontiguousarray(value)  # changed in place below
        missing = value.reshape(W, 2, 3, W, 2, 3)
        for m, compliance in enumerate(model.constants[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1]):
            missing[(*wheels, m, *wheels, m)] += (
                compliance  # of the truncated modes: a wheel responds to its own force only
            )
        self._compliance = np.concatenate([value, slope, np.zeros_like(value)], axis=2)

    def under_wheels(self, force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rail motion under the wheels.

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (B, W, 2, 3).

        Returns:
            w, v, theta_x, their slopes, their (zero) rates at constant s, shape (B, W, 2, 9).
        """
        flat = force.reshape(len(force), -1)
        under: NDArray[np.float64] = np.einsum("wrfk,bk->bwrf", self._compliance, flat)
        return under

    def settled(self, force: Reals) -> None:
        """See :class:`tiengine.engine.steady.Track`: the bed is linear.

        Args:
            force: Forces at the wheels, shape (W, 2, 3).
        """

    def motion(self, force: Reals) -> tuple[Reals, Reals, Reals]:
        """Generalised coordinates under wheel forces.

        Args:
            force: Forces on w, v, theta_x at the wheels, shape (W, 2, 3).

        Returns:
            Vertical coordinates of the rails, shape (2, 2 N), lateral ones, shape (2, 3 N), and slabs by slot, shape
            (slots, dofs).
        """
        return self.respond(self._place @ force.ravel())

    def respond(self, load: Reals) -> tuple[Reals, Reals, Reals]:
        """Generalised coordinates, as :meth:`motion`, under generalised forces on the rails, shape (10 N,)."""
        q = la.lu_solve(self._lu, load)
        slabs = np.zeros((self.model.ingredients.slots, int(self.model.dims[at.SLAB_DOFS])))
        for slot, lu, to_slab in self._slabs:
            slabs[slot] = -la.lu_solve(lu, to_slab @ q)
        rails, n = q.reshape(2, -1), self.model.ingredients.modes
        return rails[:, : 2 * n], rails[:, 2 * n :], slabs


def seat_springs(model: SineModel, state: SineState, s0: float, V: float, train: int) -> dict[int, Springs]:
    """Springs of the seats in the window, by slab; arguments as for :class:`StaticTrack`."""
    g = model.ingredients
    d, per_slab = g.slab.fastening_pitch, g.slab.fastenings
    j = np.arange(state.seat_scale.shape[1])
    s = np.asarray(s0 + j * d, dtype=np.float64)
    j = j[s < g.length]
    mean = mean_cosine(model.window.wave_numbers, g.fastening.length)
    phi, slope = mean * model.window.shape(s[j]), mean * model.window.shape_slope(s[j])
    slab, seat = np.divmod(state.first_seat + j, per_slab)
    found = {}
    for k in np.unique(slab):
        here = slab == k
        scale = state.seat_scale[train, j[here]]
        found[int(k)] = _slab_springs(model, seat[here], scale, phi[here], -V * slope[here])
    return found


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs between rails and one slab: force = pull . rails - stiffness (slab . slab's motion), along ``test``.

    Attributes:
        test, pull: Rows over the rails' coordinates, shape (m, 10 N).
        slab: Rows over the slab's, shape (m, dofs).
        stiffness, damping: k and c, shape (m,).
    """

    test: NDArray[np.float64]
    pull: NDArray[np.float64]
    slab: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    damping: NDArray[np.float64]


def _slab_springs(
    model: SineModel,
    seat: NDArray[np.int64],
    scale: NDArray[np.float64],
    phi: NDArray[np.float64],
    rate: NDArray[np.float64],
) -> Springs:
    """Vertical, rolling and lateral spring of each fastening (MODEL §3).

    Args:
        model: Constant data.
        seat: Seats on the slab, shape (k,).
        scale: Factors, shape (k, 2).
        phi: Rail shape at the seats, shape (k, N).
        rate: Its convective rate -V d/ds, shape (k, N).
    """
    fastening, r, n = model.ingredients.fastening, model.ingredients.rail, model.ingredients.modes
    a, b, design = r.arm_fastening, r.half_base, model.ingredients.designs.matrices[0]
    kinds = (  # arms on w, v, theta_x; stiffness, damping
        ((1.0, 0.0, 0.0), fastening.vertical_stiffness, fastening.vertical_damping),
        ((0.0, 0.0, b), fastening.vertical_stiffness, fastening.vertical_damping),
        ((0.0, 1.0, -a), fastening.lateral_stiffness, fastening.lateral_damping),
    )
    test = np.zeros((len(seat), 2, 3, 2, 5, n))
    flow = np.zeros_like(test)
    slab = np.zeros((len(seat), 2, 3, design.n))
    k, c = np.zeros((len(seat), 2, 3)), np.zeros((len(seat), 2, 3))
    for side in range(2):
        for kind, (arms, stiffness, damping) in enumerate(kinds):
            for field, arm in zip((0, 2, 4), arms, strict=True):
                test[:, side, kind, side, field] = arm * phi
                flow[:, side, kind, side, field] = arm * rate
            k[:, side, kind], c[:, side, kind] = scale[:, side] * stiffness, scale[:, side] * damping
        for i, j in enumerate(seat):
            slab[i, side, 0, design.seat_index[j, side]] = design.seat_w[j, side]
            slab[i, side, 1, design.seat_index[j, side]] = b * design.seat_slope[j, side]
            slab[i, side, 2, -2:] = 1.0, design.seat_x[j]
    m = k.size
    shapes, rates = test.reshape(m, -1), flow.reshape(m, -1)
    pull = k.reshape(m, 1) * shapes + c.reshape(m, 1) * rates
    return Springs(shapes, pull, slab.reshape(m, -1), k.ravel(), c.ravel())
