r"""Static compliance that the trial functions lack under a wheel and at a seat (MODEL §1a, §8).

Finite trial functions make a point of the rail too stiff under its own force. The difference is local, a matter of
waves shorter than the trial functions follow, which neither bed nor inertia reach: it is the static deflection of the
exact beam, pinned at the window's ends and on its fastenings smeared along it, less that of the same beam in the trial
functions at V = 0. In series with the contact it is what the wheel feels; wheels stand still in the window, so that it
is a constant.

At a seat the missing deflection is that of its own force and of a wheel close by: it stretches the spring, and its rate
the damper. Few sines need it (without the rate 72 of them in 36 m are three times as far off: 0.25 against 0.7 % of
the peak of N at the 99th percentile, 2.3 % without any); splines graded towards the wheels only need the wheels' own.

Endless Timoshenko beam on a foundation k, under a unit force, with q_j the roots of EI q^4 + (EI k / S) q^2 + k = 0 of
positive imaginary part:

    g(x) = sum_j i (1 + EI q_j^2 / S) / (4 EI q_j^3 + 2 (EI k / S) q_j) exp(i q_j |x|)

and for torsion exp(-|x| sqrt(k_t / GK)) / (2 sqrt(k_t GK)). Pinned ends are images of the force: + at s' + 2 n l and
- at -s' + 2 n l. v and theta_x are taken apart here, each on its own foundation; their coupling is smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import SuperLU, splu

from tiengine.parameters.arrays import Reals
from tiengine.track.fastening import Fastening
from tiengine.track.rail import Rail
from tiengine.track.rail_operators import RailOperators
from tiengine.track.seat_points import seat_points

__all__ = ["Foundation", "ResidualCompliance"]


IMAGES = 2
"""Lengths of the window at either side from which images count: an image further off is exp(-2 l / 1 m)."""
REACH = 1.0
"""Farthest seat from a wheel to which the wheel's residual counts [m]; beyond it is the tail of an alternating sum."""


@dataclass(frozen=True)
class Foundation:
    """Fastenings smeared along the rail.

    Attributes:
        vertical: Of w [N/m^2].
        lateral: Of v [N/m^2].
        torsion: Of theta_x [N].
    """

    vertical: float
    lateral: float
    torsion: float

    @classmethod
    def of(cls, rail: Rail, fastening: Fastening, spacing: float) -> Foundation:
        """Smear the springs of fastenings at a pitch [m]."""
        vertical, lateral = fastening.vertical_stiffness / spacing, fastening.lateral_stiffness / spacing
        return cls(vertical, lateral, rail.half_base**2 * vertical + rail.arm_fastening**2 * lateral)


@dataclass(frozen=True, eq=False)
class ResidualCompliance:
    """Exact less discretised static compliance, in w [m/N], v [m/N] and theta_x [rad/(N m)].

    Attributes:
        operators: Rail and trial functions.
        foundation: What the rail lies on.
        wheel_s: Wheels in the window [m], shape (W,).
        seat_length: Length of rail on which a seat presses [m].
    """

    operators: RailOperators
    foundation: Foundation
    wheel_s: Reals
    seat_length: float = 0.0

    @cached_property
    def wheels(self) -> Reals:
        """Residual compliance of a wheel under its own force, shape (W, 3)."""
        s = self.wheel_s
        found = []
        for exact, solve in self._fields:
            phi = self.operators.functions.shape(s)
            found.append(exact(s, s) - np.einsum("wn,nw->w", phi, solve(phi.T)))
        return np.stack(found, axis=1)

    def seats(self, s: Reals) -> Reals:
        """Residual compliance of seats at s [m] under their own force, shape (k, 3)."""
        offset, weight = seat_points(self.seat_length)
        phi = self.operators.functions.shape(s, over=self.seat_length)
        at = np.clip(np.add.outer(s, offset), 0.0, self.operators.functions.length)
        found = []
        for exact, solve in self._fields:
            mean = np.einsum("kgh,g,h->k", exact(at[:, :, None], at[:, None, :]), weight, weight)
            found.append(mean - np.einsum("kn,nk->k", phi, solve(phi.T)))
        return np.stack(found, axis=1)

    def seats_by_wheels(self, s: Reals) -> Reals:
        """Residual compliance between seats at s [m] and wheels, shape (k, W, 3); zero beyond a metre."""
        offset, weight = seat_points(self.seat_length)
        functions = self.operators.functions
        phi, under = functions.shape(s, over=self.seat_length), functions.shape(self.wheel_s)
        at = np.clip(np.add.outer(s, offset), 0.0, functions.length)
        near = np.abs(np.subtract.outer(s, self.wheel_s)) < REACH
        found = []
        for exact, solve in self._fields:
            mean = np.einsum("kgw,g->kw", exact(at[:, :, None], self.wheel_s), weight)
            found.append(np.where(near, mean - phi @ solve(under.T), 0.0))
        return np.stack(found, axis=2)

    @cached_property
    def _fields(self) -> tuple[tuple[Callable[[Reals, Reals], Reals], Callable[[Reals], Reals]], ...]:
        """For w, v, theta_x: exact compliance between places, and generalised forces to coordinates."""
        r, f, length = self.operators.rail, self.foundation, self.operators.functions.length
        one = self.operators.functions.products.displacement.values
        vertical, lateral = (self.operators.vertical(0.0)[2], self.operators.lateral(0.0)[2])
        beds = self.operators.foundation(f.vertical, 0.0)[0], self.operators.foundation(0.0, f.lateral)[1]
        across = _fields_of(lateral + beds[1], 3, 2)
        turn = _fields_of(lateral, 3, 3, first=2) + f.torsion * one
        S = r.G * r.A * np.array([r.kappa_vertical, r.kappa_lateral])
        return (
            (lambda a, b: _beam(a, b, r.E * r.Iy, S[0], f.vertical, length), _solver(vertical + beds[0], 2)),
            (lambda a, b: _beam(a, b, r.E * r.Iz, S[1], f.lateral, length), _solver(across, 2)),
            (lambda a, b: _shaft(a, b, r.GK, f.torsion, length), _solver(turn, 1)),
        )


def _fields_of(block: sp.csr_array, fields: int, stop: int, first: int = 0) -> sp.csr_array:
    """Fields first .. stop - 1 of a block in which the fields of a function stand side by side."""
    kept = np.arange(block.shape[0]).reshape(-1, fields)[:, first:stop].ravel()
    return sp.csr_array(block[kept][:, kept])


def _solver(K: sp.csr_array, fields: int) -> Callable[[Reals], Reals]:
    """From forces on the first field's functions, shape (n, k), to its coordinates."""
    lu: SuperLU = splu(sp.csc_array(K))

    def solve(force: Reals) -> Reals:
        load = np.zeros((K.shape[0], force.shape[1]))
        load[::fields] = force
        answer: Reals = lu.solve(load)[::fields]
        return answer

    return solve


def _pinned(endless: Callable[[Reals], Reals], a: Reals, b: Reals, length: float) -> Reals:
    """Compliance between a and b of a beam with pinned ends, by images."""
    turns = 2.0 * length * np.arange(-IMAGES, IMAGES + 1)
    parts = [endless(a - b + turn) - endless(a + b + turn) for turn in turns]
    total: Reals = np.sum(parts, axis=0)
    return total


def _beam(a: Reals, b: Reals, EI: float, S: float, k: float, length: float) -> Reals:
    """Timoshenko beam on a foundation [m/N]."""
    squares = np.roots([EI, EI * k / S, k]).astype(np.complex128)
    q = np.sqrt(squares)
    q = np.where(q.imag < 0.0, -q, q)
    amplitude = 1j * (1.0 + EI * squares / S) / (4.0 * EI * q**3 + 2.0 * EI * k / S * q)

    def endless(x: Reals) -> Reals:
        waves: Reals = np.sum(amplitude * np.exp(1j * q * np.abs(x)[..., None]), axis=-1).real
        return waves

    return _pinned(endless, a, b, length)


def _shaft(a: Reals, b: Reals, GK: float, k: float, length: float) -> Reals:
    """Torsion on a foundation [rad/(N m)]."""
    decay = np.sqrt(k / GK)
    return _pinned(lambda x: np.exp(-decay * np.abs(x)) / (2.0 * decay * GK), a, b, length)
