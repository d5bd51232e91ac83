"""Constant data of the step with sines, in the shapes that the kernels of :mod:`tiengine.kernels.step` read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from tiengine.kernels import layout as at
from tiengine.model.constant_data import MassAndStiffness, Model, shared_arrays, slab_operators
from tiengine.model.implicit_seats import smeared_fastening
from tiengine.model.ingredients import Ingredients
from tiengine.model.newmark import inverse
from tiengine.model.omitted_tables import OmittedTables
from tiengine.model.speed_blocks import Blocks
from tiengine.parameters.arrays import Reals
from tiengine.track.fastening import seat_tables
from tiengine.track.rail import RailWindow
from tiengine.track.sines import sine_products
from tiengine.track.slab_matrices import seat_shapes

__all__ = ["SineModel", "build_sine_model"]


@dataclass(frozen=True, eq=False)
class SineModel(Model):
    """Constant arrays of the step with sines.

    Attributes:
        window: Rail matrices.
        stiffness: Elastic coefficients of the rails by mode, shape (N, 8).
        flow_sine, flow_cosine: G of the sine and cosine fields, transposed, shape (N, N).
        seat_table: cos and sin of k_i j d, shape (2N, seats).
        slab_seats: Slab coordinates to the seats: w left and right, dw/dy left and right, y; shape (dofs, 5 seats).
        slab_linear: Matrices from a slab's u, and from its v, to its acceleration by its own stiffness and damping,
            shape (2, designs, dofs, dofs).
        slab_push: Matrices from the forces of the seats (as ``slab_seats``) to the slab's acceleration, shape
            (designs, 5 seats, dofs).
        slab_inverse: Inverses of the slab blocks, transposed, shape (designs, dofs, dofs).
        wheel_shape: sin(k_i s) and its slope under the wheels, shape (2, W, N).
        blocks: Inverses that depend on the speed.
        omitted: Compliance of the sines left out, if it is added at the seats.
    """

    window: RailWindow
    stiffness: Reals
    flow_sine: Reals
    flow_cosine: Reals
    seat_table: Reals
    slab_seats: Reals
    slab_linear: Reals
    slab_push: Reals
    slab_inverse: Reals
    wheel_shape: Reals
    blocks: Blocks
    omitted: OmittedTables | None = None

    @property
    def rails_at_rest(self) -> tuple[MassAndStiffness, MassAndStiffness]:
        """M and K at V = 0, field by field."""
        (M_v, _, K_v), (M_l, _, K_l) = self.window.vertical(0.0), self.window.lateral(0.0)
        return (M_v, K_v), (M_l, K_l)

    def refactor(self, V: float) -> None:
        """Fill the blocks that depend on the speed V [m/s]."""
        g = self.ingredients
        self.blocks.fill(self.window, g.fastening, g.slab.fastening_pitch, g.train, g.newmark, V, self.wheel_shape)


def build_sine_model(ingredients: Ingredients, V: float) -> SineModel:
    """Assemble and factorise everything for a speed V [m/s]."""
    window = RailWindow(ingredients.rail, ingredients.length, ingredients.modes)
    wheel_s, d = ingredients.wheel_s, ingredients.slab.fastening_pitch
    sine, cosine = sine_products(ingredients.modes)
    shared = shared_arrays(ingredients)
    c = shared["constants"]
    c[at.SMEARED_VERTICAL], c[at.SMEARED_LATERAL] = smeared_fastening(
        window, ingredients.fastening, d, ingredients.newmark
    )
    if ingredients.local_compliance:
        c[at.RESIDUAL_VERTICAL : at.RESIDUAL_TORSION + 1] = window.missing_compliance
    model = SineModel(
        **shared,
        window=window,
        stiffness=window.modal_stiffness,
        flow_sine=np.ascontiguousarray(sine.T),
        flow_cosine=np.ascontiguousarray(cosine.T),
        seat_table=seat_tables(ingredients.modes, ingredients.length, d, ingredients.fastening.length),
        **_slab_products(ingredients),
        wheel_shape=np.stack([window.shape(wheel_s), window.shape_slope(wheel_s)]),
        blocks=Blocks.empty(ingredients.modes, len(wheel_s), ingredients.train.n),
        omitted=OmittedTables.of(ingredients) if ingredients.static_compliance else None,
    )
    model.refactor(V)
    return model


def _slab_products(ingredients: Ingredients) -> dict[str, Any]:
    """Products and inverses of every slab design."""
    seats = seat_shapes(ingredients.designs.matrices[0])
    linear, push, inverses = [], [], []
    for A, K, C in slab_operators(ingredients):
        inverses.append(inverse(sp.csc_array(A), "slab").T)
        linear.append(-np.stack([K.T, C.T]) @ inverses[-1])
        push.append(seats.T @ inverses[-1])
    return {
        "slab_seats": seats,
        "slab_linear": np.stack(linear, axis=1),
        "slab_push": np.stack(push),
        "slab_inverse": np.stack(inverses),
    }
