r"""How the explicit passes over the seats converge, and a seat's own compliance at the end of a step (MODEL §8, §1a).

A pass over one rail on rigid ground, with z = beta dt^2 k + gamma dt c of a seat and B its rows (w; or the foot
v - a theta_x, and b theta_x), is

    A a' = ... + (A_s - sum_seats B^T (z B - beta dt^2 V c B')) a,   A = M + gamma dt C + beta dt^2 K + A_s

A_s, the seats smeared along the rail, drops out as the passes converge; they do if the spectral radius of what turns
a into a' is below one. If they do not, each seat can be solved against its own compliance B A^-1 B^T instead, which
is a table over s, since A is constant in the window.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from tiengine.parameters.arrays import Reals
from tiengine.track.fastening import Fastening
from tiengine.track.rail_operators import RailOperators

__all__ = ["CONTRACTION", "FACTORS", "SeatPasses", "least_factor"]


CONTRACTION = 0.9
"""Spectral radius below which two passes a step are trusted to be stable (energy of free vibration, tests)."""
FACTORS = (1.0, 2.0, 4.0, 8.0, 16.0)
"""Factors on the smeared seats, the least first: a larger one slows the passes down. Stiffened seats need the larger
ones."""
PHASES = 4  # places of the seats in a pitch at which the passes are tried
ITERATIONS = 60  # of the power method: the modulus of the largest eigenvalue to a few per cent


@dataclass(frozen=True, eq=False)
class SeatPasses:
    """One rail, its seats on rigid ground, and a step.

    Attributes:
        operators: Rail and trial functions, n a field.
        fastening: Sound fastening.
        spacing: Seat pitch d [m].
        seat_length: Length of rail on which a seat presses [m].
        beta_dt2: Newmark's beta dt^2 [s^2].
        gamma_dt: Newmark's gamma dt [s].
        V: Speed [m/s].
        factor: Of the smeared seats in A_s.
        stiffest: Factor of the stiffest seats on the track.
    """

    operators: RailOperators
    fastening: Fastening
    spacing: float
    seat_length: float
    beta_dt2: float
    gamma_dt: float
    V: float
    factor: float = 1.0
    stiffest: float = 1.0

    @property
    def impedance(self) -> tuple[float, float]:
        """Factors z of a seat, vertical and lateral [kg]."""
        f = self.fastening
        return (
            self.beta_dt2 * f.vertical_stiffness + self.gamma_dt * f.vertical_damping,
            self.beta_dt2 * f.lateral_stiffness + self.gamma_dt * f.lateral_damping,
        )

    @property
    def lag(self) -> float:
        """Part of the acceleration that a pass leaves where waves are long and seats sound.

        Smeared and discrete seats are the same to them, so that nothing is left with the factor 1.
        """
        share: float = max(self.impedance) / (self.spacing * self.operators.rail.densities[0])
        return (self.factor - 1.0) * share / (1.0 + self.factor * share)

    @cached_property
    def smeared(self) -> tuple[sp.csr_array, sp.csr_array]:
        """A_s of (w, theta_y), shape (2n, 2n), and of (v, theta_z, theta_x), shape (3n, 3n)."""
        vertical, lateral = (self.factor * z / self.spacing for z in self.impedance)
        return self.operators.foundation(vertical, lateral)

    @cached_property
    def blocks(self) -> tuple[sp.csc_array, sp.csc_array]:
        """A of both blocks, A_s included."""
        matrices = self.operators.vertical(self.V), self.operators.lateral(self.V)
        vertical, lateral = (
            sp.csc_array(M + self.gamma_dt * C + self.beta_dt2 * K + A_s)
            for (M, C, K), A_s in zip(matrices, self.smeared, strict=True)
        )
        return vertical, lateral

    @cached_property
    def _solvers(self) -> tuple[Callable[[Reals], Reals], ...]:
        return tuple(splu(A).solve for A in self.blocks)

    def own_compliance(self, s: Reals) -> tuple[Reals, Reals]:
        """B A^-1 B^T of single seats at s [m].

        Returns:
            Of w [1/kg], shape (k,), and of (foot, b theta_x), shape (k, 2, 2).
        """
        vertical, lateral = self._rows(s, 0)
        found = []
        for rows, solve in zip((vertical, lateral), self._solvers, strict=True):
            dense = rows.reshape(-1, rows.shape[-1])
            answer = solve(np.ascontiguousarray(dense.T)).T.reshape(rows.shape)
            found.append(np.einsum("kin,kjn->kij", rows, answer))
        return found[0][:, 0, 0], found[1]

    def contraction(self, first_seat: float) -> float:
        """Spectral radius of a pass over the stiffest seats, the larger of both blocks.

        Args:
            first_seat: Rear seat in the window [m].
        """
        s = np.arange(first_seat, self.operators.functions.length, self.spacing)
        f = self.fastening
        z_v, z_l = (self.stiffest * z for z in self.impedance)
        flow_v, flow_l = (self.stiffest * self.beta_dt2 * self.V * c for c in (f.vertical_damping, f.lateral_damping))
        weights = ((np.array([z_v]), np.array([flow_v])), (np.array([z_l, z_v]), np.array([flow_l, flow_v])))
        rows, slopes = self._rows(s, 0), self._rows(s, 1)
        radius = 0.0
        for block in range(2):
            z, flow = (np.tile(w, len(s)) for w in weights[block])
            B, B1 = (sp.csr_array(part[block].reshape(len(z), -1)) for part in (rows, slopes))
            seats = B.T @ (sp.diags_array(z) @ B - sp.diags_array(flow) @ B1)
            radius = max(radius, _spectral_radius(sp.csr_array(self.smeared[block] - seats), self._solvers[block]))
        return radius

    def _rows(self, s: Reals, derivative: int) -> tuple[Reals, Reals]:
        """Rows B of the vertical block, shape (k, 1, 2n), and of the lateral one, shape (k, 2, 3n)."""
        rail = self.operators.rail
        w, v, x = self.operators.under(s, derivative, self.seat_length)
        lateral = np.stack([(v - rail.arm_fastening * x).toarray(), rail.half_base * x.toarray()], axis=1)
        return w.toarray()[:, None], lateral


def least_factor(passes: SeatPasses) -> float | None:
    """Least factor of the smeared seats with which the passes contract well enough; none if no factor does."""
    for factor in FACTORS:
        tried = replace(passes, factor=factor)
        seats = passes.spacing * (np.arange(PHASES) + 0.5) / PHASES
        if max(tried.contraction(float(s)) for s in seats) <= CONTRACTION:
            return factor
    return None


def _spectral_radius(rest: sp.csr_array, solve: Callable[[Reals], Reals]) -> float:
    """Growth a pass in the long run, by the power method on four vectors (complex pairs of eigenvalues)."""
    basis = np.random.Generator(np.random.Philox(key=0)).standard_normal((rest.shape[0], 4))
    size = 0.0
    for _ in range(ITERATIONS):
        basis, _ = np.linalg.qr(basis)
        image = solve(rest @ basis)
        size = float(np.abs(np.linalg.eigvals(basis.T @ image)).max())
        basis = image
    return size
