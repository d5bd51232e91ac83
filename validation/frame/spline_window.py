"""A rail's vertical plane in splines, its coordinates field by field as those of the sines' window stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tiengine.parameters.arrays import Reals
from tiengine.track.knots import Grading, graded_knots, uniform_knots
from tiengine.track.rail import Rail
from tiengine.track.rail_operators import RailOperators
from tiengine.track.residual_compliance import Foundation, ResidualCompliance
from tiengine.track.splines import Splines

__all__ = ["SplineWindow"]


@dataclass(frozen=True, eq=False)
class SplineWindow:
    """Window with n splines of w, then n of theta_y.

    Attributes:
        rail: Section.
        functions: The splines.
    """

    rail: Rail
    functions: Splines

    @classmethod
    def graded(cls, rail: Rail, length: float, refinement: float = 1.0) -> SplineWindow:
        """Knots as the default's about a load in the middle, all their distances divided by a refinement."""
        grading = Grading(finest=0.15 / refinement, coarsest=1.0 / refinement)
        return cls(rail, Splines(graded_knots(length, np.array([0.5 * length]), grading)))

    @classmethod
    def uniform(cls, rail: Rail, length: float, spacing: float) -> SplineWindow:
        """Knots at one distance [m]."""
        return cls(rail, Splines(uniform_knots(length, spacing)))

    @property
    def length(self) -> float:
        """Window l [m]."""
        return self.functions.length

    @property
    def modes(self) -> int:
        """Functions of a field, n."""
        return self.functions.count

    @cached_property
    def operators(self) -> RailOperators:
        """Matrices function by function."""
        return RailOperators(self.rail, self.functions)

    def vertical(self, V: float) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """M, C, K of (w, theta_y) at speed V [m/s], field by field."""
        order = np.concatenate([np.arange(0, 2 * self.modes, 2), np.arange(1, 2 * self.modes, 2)])
        M, C, K = (sp.csr_array(matrix[order][:, order]) for matrix in self.operators.vertical(V))
        return M, C, K

    @property
    def values(self) -> Reals:
        """Int W W ds, shape (n, n)."""
        found: Reals = self.functions.products.displacement.values.toarray()
        return found

    @property
    def flow(self) -> Reals:
        """Int W W' ds, shape (n, n)."""
        found: Reals = self.functions.products.displacement.flow.toarray()
        return found

    def shape(self, s: NDArray[np.float64]) -> Reals:
        """Functions of w at places s [m], shape (k, n)."""
        return self.functions.shape(s)

    def shape_slope(self, s: NDArray[np.float64]) -> Reals:
        """Their slopes."""
        return self.functions.shape(s, 1)

    def missing(self, foundation: float) -> float:
        """Static compliance that they lack under a load in the middle, on a bed [N/m^2]; the engine's own [m/N]."""
        place = np.array([0.5 * self.length])
        return float(ResidualCompliance(self.operators, Foundation(foundation, 1.0, 1.0), place).wheels[0, 0])
