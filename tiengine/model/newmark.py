r"""Implicit part of the step: Newmark's average acceleration on constant blocks, factorised once.

The semi-discrete equations M a + C v + K u = f(u, v, t) are advanced with (Newmark 1959; predictor form of Hughes and
Liu 1978)

    u~ = u_n + dt v_n + (1/2 - beta) dt^2 a_n        u_{n+1} = u~ + beta dt^2 a_{n+1}
    v~ = v_n + (1 - gamma) dt a_n                    v_{n+1} = v~ + gamma dt a_{n+1}
    A a^{k+1} = -(C v~ + K u~) + f(u^k, v^k, t_{n+1}) + A_s a^k,   A = M + gamma dt C + beta dt^2 K + A_s

k = 0, 1, ... passes from a^0 = 0. Everything that moves or is nonlinear is in f, evaluated by the kernels at the
iterate. A_s = beta dt^2 K_s + gamma dt C_s is a constant approximation of the part of f that would make the iteration
diverge: fastenings smeared along the rail. It cancels as the passes converge. With beta = 1/4, gamma = 1/2 the
method is of second order; two passes keep that order, because the error of a after the first is of order dt^2.

A_s omits the convective part -V c d/ds of the smeared fastenings, a few per cent of A_s: being an approximation, it
changes the rate of convergence of the passes, not their limit. The slabs' blocks contain their seats exactly, also
those outside the window that exert no force at the moment: there the block has some kilograms too much
(gamma dt c + beta dt^2 k per seat, of order dt), on slabs that the wheels do not reach.

| symbol | meaning |
|---|---|
| M, C, K | mass, damping and convection, stiffness of the linear constant part |
| f | fastenings, nonlinear suspension, mortar without tension, gravity, contact |
| A^-1 | explicit inverse: at these sizes a dense product beats a sparse triangular solve five times |
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from tiengine.parameters.errors import InputError

__all__ = ["Newmark", "inverse"]

INVERSE_TOLERANCE = 1e-7  # ||A A^-1 - I||: an ill-conditioned block (cond 1e9) is refused


@dataclass(frozen=True)
class Newmark:
    """Step and coefficients.

    Attributes:
        dt: Time step [s].
        beta: Newmark's beta.
        gamma: Newmark's gamma.
    """

    dt: float
    beta: float = 0.25
    gamma: float = 0.5

    @property
    def beta_dt2(self) -> float:
        """Beta dt^2 [s^2]: end-of-step displacement per unit acceleration."""
        return self.beta * self.dt**2

    @property
    def gamma_dt(self) -> float:
        """Gamma dt [s]: end-of-step velocity per unit acceleration."""
        return self.gamma * self.dt

    @property
    def predictor(self) -> NDArray[np.float64]:
        """Rows u~, v~ from u, v, a; shape (2, 3)."""
        dt = self.dt
        return np.array([[1.0, dt, (0.5 - self.beta) * dt**2], [0.0, 1.0, (1.0 - self.gamma) * dt]])

    @property
    def corrector(self) -> NDArray[np.float64]:
        """Rows u, v at the end of the step from a, u~, v~; shape (2, 3)."""
        return np.array([[self.beta_dt2, 1.0, 0.0], [self.gamma_dt, 0.0, 1.0]])

    def operator(self, M: sp.sparray, C: sp.sparray, K: sp.sparray) -> sp.csc_array:
        """M + gamma dt C + beta dt^2 K."""
        return sp.csc_array(M + self.gamma_dt * C + self.beta_dt2 * K)


def inverse(A: sp.csc_array, name: str) -> NDArray[np.float64]:
    """Explicit inverse of a block by sparse LU, checked.

    Args:
        A: Square operator, shape (n, n).
        name: Name of the block for the error.

    Returns:
        A^-1, dense, shape (n, n).

    Raises:
        InputError: The block is singular or too ill-conditioned for an explicit inverse.
    """
    try:
        result: NDArray[np.float64] = splu(sp.csc_array(A)).solve(np.eye(A.shape[0]))
    except RuntimeError as error:
        raise InputError(f"{name} block: singular ({error}); a mass or stiffness is missing") from error
    miss = float(np.abs(A @ result - np.eye(A.shape[0])).max())
    if not miss < INVERSE_TOLERANCE:
        raise InputError(f"{name} block: residual of its inverse {miss:.1e} must be below {INVERSE_TOLERANCE:g}")
    return result
