r"""Simply supported rectangular plate on a Winkler bed under an even load on a rectangle: Navier's double sine series.

    q_mn = 16 P/(pi^2 m n L B) sin(m pi x0/a) sin(m pi L/2a) sin(n pi y0/b) sin(n pi B/2b)
    w_mn = q_mn / (D (alpha^2 + beta^2)^2 + k),   alpha = m pi/a, beta = n pi/b

with the middle of the rectangle L x B at (x0, y0) from a corner of the plate a x b (Timoshenko and Woinowsky-Krieger,
Theory of plates and shells, art. 29; the bed adds k to the denominator). M_x = D (alpha^2 + nu beta^2) w.
"""

from __future__ import annotations

import numpy as np

from tiengine.parameters.arrays import Reals

__all__ = ["patch_moments"]


def patch_moments(
    sides: tuple[float, float],
    rigidity: float,
    nu: float,
    bed: float,
    patch: tuple[float, float],
    middle: tuple[float, float],
    terms: int = 600,
) -> Reals:
    """M_x, M_y [N m/m] in the middle of a rectangle under a unit load [N] on it, shape (2,).

    Args:
        sides: a, b [m].
        rigidity: D [N m].
        nu: Poisson's ratio.
        bed: k [N/m^3].
        patch: L, B [m].
        middle: x0, y0 [m].
        terms: Of the series in either direction; the rest falls with their third power.
    """
    order = np.arange(1, terms + 1)
    wave, load, here = [], [], []
    for side, length, place in zip(sides, patch, middle, strict=True):
        k = order * np.pi / side
        wave.append(k)
        load.append(4.0 / (np.pi * order * length) * np.sin(k * place) * np.sin(k * length / 2.0))
        here.append(np.sin(k * place))
    squares = wave[0][:, None] ** 2 + wave[1] ** 2
    w = np.outer(load[0], load[1]) / (rigidity * squares**2 + bed) * np.outer(here[0], here[1])
    x, y = (w * wave[0][:, None] ** 2).sum(), (w * wave[1] ** 2).sum()
    return rigidity * np.array([x + nu * y, y + nu * x])
