"""One block of a rail in the moving window, on seats on rigid ground, marched in plain NumPy.

The step is Newmark's average acceleration. Seats are taken exactly at the end of the step (a solve with them in the
matrix, every step), or as the engine takes them: explicit at the iterate of the passes, their smeared stand-in in the
constant matrix. Loads under the wheels are given, or come from two masses on a linear contact spring.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tiengine.track.rail_operators import RailOperators


@dataclass
class TwoMasses:
    """A wheel under a suspended mass; equilibrium under a static load is the origin.

    Attributes:
        wheel, body: Masses [kg].
        stiffness, damping: Between them [N/m, N s/m].
        contact: Stiffness of the contact [N/m].
        load: Static load [N].
    """

    wheel: float = 925.0
    body: float = 600.0
    stiffness: float = 1.176e6
    damping: float = 3e4
    contact: float = 1.4e9
    load: float = 68.7e3


@dataclass
class RailMarch:
    """A march of one block of one rail.

    Attributes:
        operators: Rail and functions.
        lateral: Which block; the seats' stretches are w, or foot and rolling.
        stiffness, damping: Of every kind of stretch, (1,) or (2,), the arms' squares included.
        V, dt: Speed and step.
        spacing, seat_length: Seats.
        wheel_s: Wheels [m].
        passes: Explicit passes, 0 for the exact step.
        factor: Of the smeared seats.
    """

    operators: RailOperators
    lateral: bool
    stiffness: np.ndarray
    damping: np.ndarray
    V: float
    dt: float
    spacing: float
    seat_length: float
    wheel_s: np.ndarray
    passes: int = 0
    factor: float = 1.0
    first: float = 0.0
    u: np.ndarray = field(init=False)

    def __post_init__(self):
        block = self.operators.lateral if self.lateral else self.operators.vertical
        self.M, self.C, self.K = (matrix.toarray() for matrix in block(self.V))
        self.b2, self.g1 = self.dt**2 / 4.0, self.dt / 2.0
        self.A = self.M + self.g1 * self.C + self.b2 * self.K
        z = self.b2 * self.stiffness + self.g1 * self.damping
        length = self.operators.functions.length
        self.A_s = np.zeros_like(self.M)
        if self.passes:
            # the smeared seats by quadrature of their stretches, not by the operators' own foundation
            x, w = np.polynomial.legendre.leggauss(4)
            knots = getattr(
                self.operators.functions, "knots", np.linspace(0.0, length, 4 * self.operators.functions.count)
            )
            s = (knots[:-1, None] + np.diff(knots)[:, None] * (x + 1.0) / 2.0).ravel()
            weight = (np.diff(knots)[:, None] * w / 2.0).ravel()
            for rows, zi in zip(self.stretch(s, 0, 0.0), z, strict=True):
                self.A_s = self.A_s + self.factor * zi / self.spacing * (rows.T * weight) @ rows
            self.inverse = np.linalg.inv(self.A + self.A_s)
        self.u, self.v, self.a = np.zeros((3, self.M.shape[0]))
        self.W = self.rows(self.wheel_s, (1.0, 0.0, self.operators.rail.arm_head) if self.lateral else (1.0, 0.0))
        self.X = 0.0
        self.force = np.zeros(0)

    def rows(self, s, arms, derivative=0, over=0.0):
        """Rows of a sum of the block's fields with these arms, (k, fields n)."""
        phi = self.operators.functions.shape(s, derivative, over)
        return (phi[:, :, None] * np.asarray(arms)).reshape(len(s), -1)

    def stretch(self, s, derivative, over):
        """Rows of the seats' stretches by kind."""
        rail = self.operators.rail
        arms = [(1.0, 0.0, -rail.arm_fastening), (0.0, 0.0, rail.half_base)] if self.lateral else [(1.0, 0.0)]
        return [self.rows(s, kind, derivative, over) for kind in arms]

    def seats(self):
        """Places of the seats now."""
        rear = np.ceil((self.X - self.first) / self.spacing)
        count = np.floor((self.X + self.operators.functions.length - self.first) / self.spacing) - rear + 1
        return self.first - self.X + self.spacing * (rear + np.arange(count))

    def _pull(self):
        """Rows B, and the factors of u and v in the seats' forces."""
        s = self.seats()
        B, B1 = (np.vstack(self.stretch(s, d, self.seat_length)) for d in (0, 1))
        k, c = (np.repeat(x, len(s))[:, None] for x in (self.stiffness, self.damping))
        return B, k * B - self.V * c * B1, c * B

    def step(self, load: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        """Advance; ``load(w0, compliance)`` gives the wheels' forces from the rail without them. Returns w there."""
        dt, b2, g1 = self.dt, self.b2, self.g1
        self.X += self.V * dt
        up, vp = self.u + dt * self.v + b2 * self.a, self.v + g1 * self.a
        B, Gu, Gv = self._pull()
        linear = -(self.C @ vp + self.K @ up)
        if self.passes == 0:
            rest = linear - B.T @ (Gu @ up + Gv @ vp)
            both = np.linalg.solve(self.A + B.T @ (b2 * Gu + g1 * Gv), np.column_stack([rest, self.W.T]))
            a0, answer = both[:, 0], both[:, 1:]
            a = a0 + answer @ load(self.W @ (up + b2 * a0), b2 * (self.W @ answer))
        else:
            a, answer = np.zeros_like(up), self.inverse @ self.W.T
            for _ in range(self.passes):
                force = Gu @ (up + b2 * a) + Gv @ (vp + g1 * a)
                a0 = self.inverse @ (linear - B.T @ force + self.A_s @ a)
                a = a0 + answer @ load(self.W @ (up + b2 * a0), b2 * (self.W @ answer))
        self.u, self.v, self.a = up + b2 * a, vp + g1 * a, a
        self.force = (Gu @ self.u + Gv @ self.v).reshape(len(self.stiffness), -1)
        return self.W @ self.u

    def energy(self):
        return 0.5 * (self.v @ (self.M @ self.v) + self.u @ (self.K @ self.u))


def constant_load(march: RailMarch, P: float, ramp: float, way: float, last: float):
    """March a load that grows over a ramp [m]; returns X and w under the wheels over the last metres, (n,), (n, W)."""
    steps, found = round(way / (march.V * march.dt)), []
    for _ in range(steps):
        t = min(1.0, (march.X + march.V * march.dt) / ramp)
        P_now = P * t**3 * (10.0 - 15.0 * t + 6.0 * t * t)
        w = march.step(lambda *_, P_now=P_now: np.full(len(march.wheel_s), P_now))
        if march.X > way - last:
            found.append((march.X, w))
    X, w = zip(*found, strict=True)
    return np.array(X), np.array(w)


class TwoMassWheels:
    """Two-mass wheels on a linear contact over a rough rail; exact within the step."""

    def __init__(self, masses: TwoMasses, wheels: int, dt: float) -> None:
        self.m, self.dt, self.b2, self.g1 = masses, dt, dt**2 / 4.0, dt / 2.0
        k, c = masses.stiffness, masses.damping
        link = np.array([[1.0, -1.0], [-1.0, 1.0]])
        self.C, self.K = c * link, k * link
        A = np.diag([masses.wheel, masses.body]) + self.g1 * self.C + self.b2 * self.K
        self.inverse = np.linalg.inv(A)
        self.u, self.v, self.a = np.zeros((3, 2, wheels))
        self.N = np.full(wheels, masses.load)

    def predict(self):
        self.up, self.vp = self.u + self.dt * self.v + self.b2 * self.a, self.v + self.g1 * self.a
        self.free = self.inverse @ -(self.C @ self.vp + self.K @ self.up)

    def load(self, roughness, rest):
        """Closure for :meth:`RailMarch.step`: ``rest`` is the rail's deflection under the static load."""

        def solve(w0, compliance):
            wheel0 = (self.up + self.b2 * self.free)[0]
            own = self.b2 * self.inverse[0, 0]
            flexibility = np.eye(len(w0)) / self.m.contact + own * np.eye(len(w0)) + compliance
            # N/k_c = N_0/k_c + wheel - (w - rest) - roughness; wheel falls by own (N - N_0)
            gap = self.m.load / self.m.contact + wheel0 + own * self.m.load - (w0 - rest) - roughness
            self.N = np.linalg.solve(flexibility, gap)
            return self.N

        return solve

    def finish(self):
        self.a = self.free - np.outer(self.inverse[:, 0], self.N - self.m.load)
        self.u, self.v = self.up + self.b2 * self.a, self.vp + self.g1 * self.a
