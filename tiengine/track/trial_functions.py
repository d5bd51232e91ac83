r"""Trial functions of a rail in the moving window: the interface behind which sines and splines stand (MODEL §1, §1a).

All five fields have the same number n of functions on 0 <= s <= l, of two kinds:

| kind | fields | at both ends |
|---|---|---|
| displacement, phi | w, v, theta_x | phi = 0: pinned |
| slope, psi | theta_y, theta_z | psi' = 0: no bending moment |

Slopes are free at the ends, only their derivative vanishes, as it does for a pinned beam. Hence the weak form of the
convective stiffness has no boundary terms, int f f'' = -int f' f', for either kind, and what crosses the window's ends
is left in int f f' alone, which is skew for phi and has the boundary values [psi psi] / 2 for psi.

At the front this lets rail enter that already turns as the end does: a damper of -mu V/2 there. Waves of the slopes
that stay near the end, because knots far from the wheels carry no such short ones, then grow by 5 to 50 1/s, however
short the step. Splines therefore take up rail that is at rest: the momentum mu V psi psi dtheta/dt that it lacks makes
the damper one of +0. Sines stay as in the source paper; theirs reach over the whole window and lose at the rear what
they gain at the front.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["FieldProducts", "Products", "TrialFunctions"]


@dataclass(frozen=True, eq=False)
class FieldProducts:
    """Integrals over the window of one kind of functions f, sparse, shape (n, n) each.

    Attributes:
        values: int f_i f_j ds [m].
        flow: int f_i f_j' ds [-].
        slopes: int f_i' f_j' ds [1/m].
        entry: f_i f_j at the front where rail that is at rest enters [-]; zero where it enters in the end's motion.
    """

    values: sp.csr_array
    flow: sp.csr_array
    slopes: sp.csr_array
    entry: sp.csr_array


@dataclass(frozen=True, eq=False)
class Products:
    """Integrals that a Timoshenko beam needs.

    Attributes:
        displacement: Of phi.
        slope: Of psi.
        shear: int phi_i' psi_j ds [-], sparse, shape (n, n).
    """

    displacement: FieldProducts
    slope: FieldProducts
    shear: sp.csr_array


class TrialFunctions(Protocol):
    """Functions on a window; seats and wheels touch those of the displacement kind only."""

    @property
    def length(self) -> float:
        """Window l [m]."""

    @property
    def count(self) -> int:
        """Functions n of a field."""

    @property
    def products(self) -> Products:
        """Integrals of the functions."""

    def shape(self, s: NDArray[np.float64], derivative: int = 0, over: float = 0.0) -> NDArray[np.float64]:
        """Displacement functions phi at places, or their mean over a length.

        Args:
            s: Places, or middles of the lengths, in the window [m], shape (k,).
            derivative: Order of the derivative by s, 0 or 1.
            over: Length of rail along which the five-point Gauss mean is taken [m]; 0 for points.

        Returns:
            Shape (k, n) [1/m^derivative].
        """

    def slope_shape(self, s: NDArray[np.float64], derivative: int = 0) -> NDArray[np.float64]:
        """Slope functions psi at places s [m], shape (k, n) [1/m^derivative]."""
