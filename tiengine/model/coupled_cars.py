"""Couplings between cars in the step: their forces are explicit, which only converges where they are soft in inertia.

A pass takes the forces at the motion that the pass before has found. With M + gamma dt C + beta dt^2 K = A of the cars
and elements of stiffness k and damping c along rows B, a change of the acceleration of one pass comes back in the next
multiplied by A^-1 B^T (gamma dt c + beta dt^2 k) B at most.
"""

from __future__ import annotations

import numpy as np

from tiengine.model.ingredients import Ingredients

__all__ = ["MOST_RETURNED", "coupling_returned"]

MOST_RETURNED = 0.1
"""Largest share of a change that may come back from a pass to the next: two passes leave a hundredth."""


def coupling_returned(ingredients: Ingredients) -> float:
    """Largest share of a change of acceleration that comes back through the couplings from a pass to the next.

    Args:
        ingredients: Train and time step.
    """
    train, newmark = ingredients.train, ingredients.newmark
    between = np.flatnonzero(train.element_between_cars)
    if not between.size:
        return 0.0
    B = np.zeros((len(between), train.n))
    for row, e in enumerate(between):
        np.add.at(B[row], train.element_index[e], train.element_row[e])
    points = train.element_table[between]
    steepest = (np.diff(points[..., 1]) / np.diff(points[..., 0])).max(axis=1)
    of_rate = train.element_kind[between] == 0
    strength = np.sqrt(steepest * np.where(of_rate, newmark.gamma_dt, newmark.beta_dt2))
    A = train.M + newmark.gamma_dt * train.C + newmark.beta_dt2 * train.K
    pulled = strength[:, None] * B
    return float(np.abs(np.linalg.eigvals(pulled @ np.linalg.solve(A, pulled.T))).max())
