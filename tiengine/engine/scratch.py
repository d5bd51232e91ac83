"""Work arrays of the step with sines: factors and results of the host's matrix products."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tiengine.kernels import layout as at
from tiengine.model.sine_model import SineModel

__all__ = ["Scratch"]


@dataclass(frozen=True, eq=False)
class Scratch:
    """Arrays of no meaning between steps; B trains, N modes, n seats a slab.

    Attributes:
        seat_shape: sin(k_i s_j), then cos(k_i s_j), of the seats in the window, shape (2N, seats).
        flow: 2 V du/dt + dV/dt u of the fields w, v, theta_x, theta_y, theta_z, shape (5, B, 2, N); fields outermost,
            so that all trains are right-hand sides of one product.
        drift: G times these, same shape.
        rail_factor: Modal factors of the forces at the seats by the rails' motion (V, L, M), shape (B, 2, 3, 2N).
        rail_pull: These forces [N, N, N m], shape (B, 2, 3, seats).
        slab_factor: k u + c v of the slabs, shape (B, slots, dofs).
        slab_pull: Forces at the seats by their motion, at the predictors and at the iterate, moments over b^2,
            shape (2, B, slots, 5, n).
        slab_force: Forces of the seats on the slabs, shape (B, slots, 5, n).
        damped: Acceleration of slabs, then trains, by their own damping, shape (columns,).
        sines_under: w, v, theta_x of these by the sines alone, shape (B, W, 2, 3); used where omitted sines are added.
        rail_predicted: Rails under the wheels at the predictors: w, v, theta_x, slopes, rates, shape (B, W, 2, 9).
    """

    seat_shape: NDArray[np.float64]
    flow: NDArray[np.float64]
    drift: NDArray[np.float64]
    rail_factor: NDArray[np.float64]
    rail_pull: NDArray[np.float64]
    slab_factor: NDArray[np.float64]
    slab_pull: NDArray[np.float64]
    slab_force: NDArray[np.float64]
    damped: NDArray[np.float64]
    sines_under: NDArray[np.float64]
    rail_predicted: NDArray[np.float64]

    @classmethod
    def of(cls, model: SineModel) -> Scratch:
        """Zeros of the model's sizes."""
        sizes = (at.TRAINS, at.MODES, at.SEATS, at.WHEELSETS, at.SLOTS, at.SLAB_DOFS, at.SEATS_PER_SLAB)
        B, N, seats, W, slots, dofs, per_slab = (int(model.dims[size]) for size in sizes)
        vehicle = int(model.dims[at.VEHICLE_DOFS])
        return cls(
            seat_shape=np.zeros((2 * N, seats)),
            flow=np.zeros((5, B, 2, N)),
            drift=np.zeros((5, B, 2, N)),
            rail_factor=np.zeros((B, 2, 3, 2 * N)),
            rail_pull=np.zeros((B, 2, 3, seats)),
            slab_factor=np.zeros((B, slots, dofs)),
            slab_pull=np.zeros((2, B, slots, 5, per_slab)),
            slab_force=np.zeros((B, slots, 5, per_slab)),
            damped=np.zeros(B * (slots * dofs + vehicle)),
            sines_under=np.zeros((B, W, 2, 3)),
            rail_predicted=np.zeros((B, W, 2, 9)),
        )
