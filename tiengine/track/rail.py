"""The rail in the moving window: a Timoshenko beam with five fields and convective inertia (MODEL §1).

Trial functions on the window 0 <= s <= l: sin(k_i s) for v, w, theta_x and cos(k_i s) for theta_y, theta_z, with
k_i = i pi / l, i = 1..N. The inertia of a field of mass density mu is mu (d2u/dt2 - 2 V du'/dt + V^2 u'' - dV/dt u'),
projected in this strong form, so that the cosine fields include the flux through the ends of the window.

Symbols: w, v vertical and lateral displacement; theta_y, theta_z slopes of the section (shear strains w' - theta_y,
v' - theta_z); theta_x torsion; EI, kappa G A, GK stiffnesses. Torsion has the St Venant constant GK, not G (Iy + Iz).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.special import zeta

from tiengine.parameters.quantity import Name, Params, Q, Source
from tiengine.track.sines import sine_products

__all__ = ["Rail", "RailWindow"]


class Rail(Params):
    """Section and material of a rail; y is the lateral axis, z the vertical axis."""

    name: Name = "rail"
    source: Source = ""
    mass_per_length: Annotated[float, Q("kg/m", "mass per length", gt=0)]
    A: Annotated[float, Q("m^2", "area", gt=0)]
    E: Annotated[float, Q("Pa", "Young's modulus", gt=0)]
    nu: Annotated[float, Q("-", "Poisson's ratio", ge=0, lt=0.5)]
    G: Annotated[float, Q("Pa", "shear modulus", gt=0)]
    rho: Annotated[float, Q("kg/m^3", "density", gt=0)]
    Iy: Annotated[float, Q("m^4", "vertical bending", gt=0)]
    Iz: Annotated[float, Q("m^4", "lateral bending", gt=0)]
    I_polar: Annotated[float, Q("m^4", "Iy + Iz, torsional inertia", gt=0)]
    GK: Annotated[float, Q("N m^2", "St Venant torsional stiffness", gt=0)]
    kappa_vertical: Annotated[float, Q("-", "shear coefficient of w", gt=0, le=1)]
    kappa_lateral: Annotated[float, Q("-", "shear coefficient of v", gt=0, le=1)]
    arm_fastening: Annotated[float, Q("m", "a: torsion centre down to the lateral fastening force", ge=0)]
    half_base: Annotated[float, Q("m", "b: half width between the two half springs", gt=0)]
    arm_head: Annotated[float, Q("m", "h_r: torsion centre up to the top of the head", gt=0)]

    @property
    def densities(self) -> NDArray[np.float64]:
        """Mass density of w, theta_y, v, theta_z, theta_x [kg/m, kg m, kg/m, kg m, kg m], shape (5,)."""
        m = self.mass_per_length
        return np.array([m, self.rho * self.Iy, m, self.rho * self.Iz, self.rho * self.I_polar])


@dataclass(frozen=True)
class RailWindow:
    """Matrices of one rail in a window of length l with N modes per field.

    Attributes:
        rail: Section.
        length: Window l [m].
        modes: N.
    """

    rail: Rail
    length: float
    modes: int

    @property
    def wave_numbers(self) -> NDArray[np.float64]:
        """k_i = i pi / l [1/m], shape (N,)."""
        return np.arange(1.0, self.modes + 1.0) * (np.pi / self.length)

    @property
    def modal_masses(self) -> NDArray[np.float64]:
        """Generalised mass mu l/2 of each field, in the order w, theta_y, v, theta_z, theta_x; shape (5,)."""
        return self.rail.densities * self.length / 2.0

    @property
    def modal_stiffness(self) -> NDArray[np.float64]:
        """Elastic coefficients by mode: ww, w-theta_y, theta_y, vv, v-theta_z, theta_z, torsion, k^2; shape (N, 8)."""
        r, k, half = self.rail, self.wave_numbers, self.length / 2.0
        shear_w, shear_v = r.kappa_vertical * r.G * r.A * half, r.kappa_lateral * r.G * r.A * half
        return np.stack(
            [
                shear_w * k**2,
                -shear_w * k,
                shear_w + r.E * r.Iy * half * k**2,
                shear_v * k**2,
                -shear_v * k,
                shear_v + r.E * r.Iz * half * k**2,
                r.GK * half * k**2,
                k**2,
            ],
            axis=1,
        )

    @property
    def missing_compliance(self) -> NDArray[np.float64]:
        """Static compliance of the truncated modes at a point under its own load, averaged over the window.

        In w and v [m/N] (2/l) sum over i > N of 1/2 [1/(kappa G A k_i^2) + 1/(EI k_i^4)], in theta_x [rad/(N m)] the
        same with 1/(GK k_i^2); the supports are soft against waves as short as these. Shape (3,), order w, v, theta_x.
        """
        r, n = self.rail, self.modes
        k1 = np.pi / self.length
        inverse_squares, inverse_fourths = zeta(2.0, n + 1.0) / k1**2, zeta(4.0, n + 1.0) / k1**4
        shear, bending = r.G * r.A * np.array([r.kappa_vertical, r.kappa_lateral]), r.E * np.array([r.Iy, r.Iz])
        across = inverse_squares / shear + inverse_fourths / bending
        missing: NDArray[np.float64] = np.append(across, inverse_squares / r.GK) / self.length
        return missing

    def vertical(self, V: float, V_rate: float = 0.0) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """Return M, C, K of (w, theta_y) at speed V [m/s] and rate V_rate [m/s^2]; each (2N, 2N)."""
        s = self.modal_stiffness
        K = _two_fields(s[:, 0], s[:, 1], s[:, 2])
        return self._moving(K, (0, 1), (0, 1), V, V_rate)

    def lateral(self, V: float, V_rate: float = 0.0) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """Return M, C, K of (v, theta_z, theta_x) at speed V [m/s] and rate V_rate [m/s^2]; each (3N, 3N)."""
        s = self.modal_stiffness
        K = sp.block_diag([_two_fields(s[:, 3], s[:, 4], s[:, 5]), sp.diags_array(s[:, 6])])
        return self._moving(K, (2, 3, 4), (0, 1, 0), V, V_rate)

    def shape(self, s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Evaluate sin(k_i s), shape (len(s), N)."""
        return np.sin(np.multiply.outer(s, self.wave_numbers))

    def shape_slope(self, s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Evaluate d/ds of :meth:`shape` [1/m], shape (len(s), N)."""
        k = self.wave_numbers
        return k * np.cos(np.multiply.outer(s, k))

    def _moving(
        self, K: sp.csr_array, fields: tuple[int, ...], kinds: tuple[int, ...], V: float, V_rate: float
    ) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """Add the convective terms of the fields (kind 0 sine, 1 cosine) to an elastic stiffness."""
        half, k2 = self.length / 2.0, self.wave_numbers**2
        masses = self.modal_masses[list(fields)]
        G = sine_products(self.modes)
        M = sp.diags_array(np.repeat(masses, self.modes))
        flow = sp.block_diag([sp.csr_array(m / half * G[kind]) for m, kind in zip(masses, kinds, strict=True)])
        softening = sp.diags_array(np.concatenate([m * V**2 * k2 for m in masses]))
        return sp.csr_array(M), sp.csr_array(-2.0 * V * flow), sp.csr_array(K - softening - V_rate * flow)


def _two_fields(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> sp.csr_array:
    """[[diag a, diag b], [diag b, diag c]]."""
    return sp.csr_array(
        sp.block_array([[sp.diags_array(a), sp.diags_array(b)], [sp.diags_array(b), sp.diags_array(c)]])
    )
