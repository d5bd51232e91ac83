"""Start from steady rolling at speed V over the seats at their places at t = 0 (MODEL §7).

With d/dt = 0 everywhere but for the wheelsets' spin, the track is linear: the rails' motion under the wheels follows
from the contact forces by a constant compliance. Unknowns are the train's coordinates (a wheelset's pitch is replaced
by its rate, such that its driving moment vanishes) and the generalised contact forces on the rails. Newton's method
takes the contact's derivatives by differences, all of them in one launch over as many perturbed trains.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tiengine.engine.state import ACCELERATION, DISPLACEMENT, VELOCITY, State
from tiengine.engine.steady import Track, put_track, steady_track
from tiengine.engine.window import window_clock
from tiengine.kernels import layout as at
from tiengine.kernels import patches as kernels
from tiengine.kernels.wheel_rail import N_CONTACT
from tiengine.model.constant_data import Model
from tiengine.parameters.errors import InputError
from tiengine.vehicle.connector import table_force
from tiengine.vehicle.given_loads import GivenLoads, no_loads

__all__ = ["ContactForces", "equilibrium", "evaluate_contact", "release"]

NEWTON = 60
AT_ONCE = 256  # trial states: those of sixteen vehicles, 1900, would take 200 MB
FORCE_TOLERANCE = 1e-4  # N: a billionth of a wheel load
EASY_FRICTION = 0.3  # from the guess Newton's method is known to converge
FRICTION_RATIO = 1.5  # from one friction to the next, where the creep forces change by a few per cent
FIRST_SHARE, SMALLEST_SHARE = 0.25, 1.0 / 256.0  # of the given loads: a step towards them
SETTLING = 6  # times that the bed may carry elsewhere; what is left is a newton at the edge of a contact
NUDGE_COORDINATE = 1e-8  # m, rad
NUDGE_RATE = 1e-6  # rad/s
NUDGE_FORCE = 1.0  # N


@dataclass(frozen=True, eq=False)
class ContactForces:
    """Results of the contact kernel; B trains, W wheelsets.

    Attributes:
        contact: Contact states, shape (B, W, CONTACT_ROWS, N_CONTACT), see ``layout``.
        local: N, Fx, Fy, Mz on the wheels, shape (B, W, CONTACT_ROWS, 4).
        wheelset: Forces on y, z, roll, pitch, yaw, shape (B, W, 5).
        rail: Forces on w, v, theta_x, shape (B, W, 2, 3).
    """

    contact: NDArray[np.float64]
    local: NDArray[np.float64]
    wheelset: NDArray[np.float64]
    rail: NDArray[np.float64]


def evaluate_contact(
    model: Model,
    V: float,
    irregularity: NDArray[np.float64],
    wheelset_u: NDArray[np.float64],
    wheelset_v: NDArray[np.float64],
    rail_motion: NDArray[np.float64],
) -> ContactForces:
    """Contact forces at given motions, for any number of trains.

    Args:
        model: Contact table and numbers.
        V: Speed [m/s].
        irregularity: Track channels, shape (B, W, N_IRREGULARITY).
        wheelset_u: y, z, roll, pitch, yaw, shape (B, W, 5).
        wheelset_v: Their rates.
        rail_motion: w, v, theta_x, slopes, rates at constant s, shape (B, W, 2, 9).
    """
    B, W = wheelset_u.shape[:2]
    patches = model.ingredients.contact.patches
    rows = at.CONTACT_ROWS[patches]
    out = ContactForces(
        np.zeros((B, W, rows, N_CONTACT)), np.zeros((B, W, rows, 4)), np.zeros((B, W, 5)), np.zeros((B, W, 2, 3))
    )
    kernels.wheel_forces(
        patches,
        int(model.ingredients.contacts is not None),
        V,
        int(model.dims[at.CROSS_LEVEL_ROLLS]),
        model.constants,
        model.ingredients.contact_values,
        model.wheel,
        np.ascontiguousarray(np.broadcast_to(irregularity, (B, W, at.N_IRREGULARITY))),
        np.ascontiguousarray(wheelset_u),
        np.ascontiguousarray(wheelset_v),
        np.ascontiguousarray(rail_motion),
        out.contact,
        out.local,
        out.wheelset,
        out.rail,
    )
    return out


def equilibrium(model: Model, state: State, X: float, V: float, V_rate: float = 0.0) -> None:
    """Put all trains of a state into steady rolling on a smooth track, in a curve if they stand in one.

    Args:
        model: Constant data.
        state: Written: displacements and velocities, the contact's forces, the slabs under the window.
        X: Chainage of the window's rear end [m].
        V: Speed [m/s].
        V_rate: Its rate [m/s^2].

    Raises:
        InputError: Newton's method found no equilibrium.
    """
    track = steady_track(model, state, _enter(model, state, X), V)
    given = _given(model, X, V, V_rate)
    problem = _Problem(model, track, V, V_rate, given)
    y = problem.solve()
    for _ in range(SETTLING):
        settled = track.settled(problem.split(y[None])[2][0])
        if settled is None:
            break
        track = settled
        problem = _Problem(model, track, V, V_rate, given)
        y = problem.solve()
    x, rates, rail_force = problem.split(y[None])
    state.put(DISPLACEMENT, "vehicles", x[0])
    state.put(VELOCITY, "vehicles", problem.spread(rates[0]))
    put_track(track, state, rail_force[0])
    forces = problem.contact(y[None])
    state.put_contact(forces.contact, forces.local, forces.wheelset, forces.rail)


def release(model: Model, state: State, X: float) -> None:
    """Put all trains onto the track without load, as the paper does: all zero but the weight's acceleration.

    Args:
        model: Constant data.
        state: Written.
        X: Chainage of the window's rear end [m].
    """
    _enter(model, state, X)
    train = model.ingredients.train
    falling = np.zeros(train.n)
    falling[: train.n_dof] = train.gravity[: train.n_dof] / np.diag(train.M)[: train.n_dof]
    state.put(ACCELERATION, "vehicles", falling)


def _enter(model: Model, state: State, X: float) -> float:
    """Let in seats and slabs under a window whose rear end is at X [m]; place of the rear seat in it [m]."""
    g = model.ingredients
    clock = window_clock(g.slab, np.array([X]), np.zeros(1), np.zeros(1), g.seat_reach)[0]
    state.enter(int(clock[at.FIRST_SEAT]), int(clock[at.FIRST_SLAB]))
    return float(clock[at.FIRST_SEAT_S])


def _given(model: Model, X: float, V: float, V_rate: float) -> GivenLoads:
    """Given loads of the train where it stands; those of the first train if they differ."""
    g = model.ingredients
    now = (np.zeros(1), np.array([X + g.centre_s]), np.array([V]), np.array([V_rate]))
    return g.given_loads(*now) or no_loads(g.train, 1)


class _Problem:
    """Residual of steady rolling: train (n), then contact forces on the rails (6 W)."""

    def __init__(self, model: Model, track: Track, V: float, V_rate: float, given: GivenLoads) -> None:
        self.model, self.track, self.V, self._share = model, track, V, 1.0
        self.train = model.ingredients.train
        self.pitch = self.train.wheelset_dof[:, 3]
        self._own_load, self._given = self.train.gravity + V_rate * self.train.acceleration_force, given
        self._wheel = model.wheel
        self._give(1.0)

    def _give(self, share: float) -> None:
        """Let a share of the given loads act, and of the differences between the radii of a wheelset's wheels."""
        given = self._given
        if self.model.ingredients.contacts is not None:
            wheel = self._wheel.copy()
            less = (share - 1.0) * self._raised
            wheel[:, at.RADIUS_LEFT : at.RADIUS_RIGHT + 1] += less
            wheel[:, at.LARGER_LEFT : at.LARGER_RIGHT + 1] += less
            self.model, self._share = replace(self.model, wheel=wheel), share
        self.load = self._own_load + share * given.force[0, 0]
        self.elongation, self.frame_rate = share * given.elongation[0, 0], share * given.frame_rate[0, 0]

    @property
    def _raised(self) -> NDArray[np.float64]:
        """Radii of the wheels less the means of their wheelsets [m], shape (W, 2); zero where all wheels are alike."""
        if self.model.ingredients.contacts is None:
            return np.zeros((len(self.pitch), 2))
        return self._wheel[:, at.RADIUS_LEFT : at.RADIUS_RIGHT + 1] - self._wheel[:, [at.NOMINAL_RADIUS]]

    def split(self, y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Coordinates (B, n), pitch rates (B, W), forces on the rails (B, W, 2, 3)."""
        n, W = self.train.n, len(self.pitch)
        x = y[:, :n].copy()
        rates = x[:, self.pitch]
        x[:, self.pitch] = 0.0
        return x, rates, y[:, n:].reshape(-1, W, 2, 3)

    def spread(self, rates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocities of the train's coordinates, shape (..., n), from the pitch rates."""
        v = np.zeros((*rates.shape[:-1], self.train.n))
        v[..., self.pitch] = rates
        return v

    def contact(self, y: NDArray[np.float64]) -> ContactForces:
        """Contact forces of B trial states."""
        x, rates, force = self.split(y)
        v = self.spread(rates)
        rail = self.track.under_wheels(force)
        dof = self.train.wheelset_dof
        smooth = np.zeros((1, len(dof), at.N_IRREGULARITY))
        v_wheelsets = v[:, dof]
        v_wheelsets[..., 4] += self.frame_rate[:, 0]
        return evaluate_contact(self.model, self.V, smooth, x[:, dof], v_wheelsets, rail)

    def residual(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces out of balance, shape (B, n + 6 W)."""
        x, rates, force = self.split(y)
        found = self.contact(y)
        out = np.broadcast_to(self.load, x.shape) - x @ self.train.K.T
        out = out - self.spread(rates) @ (self.train.C + self.V * self.train.C_speed).T
        out[:, self.train.wheelset_dof] += found.wheelset
        if self.model.ingredients.given or self.train.element_between_cars.any():
            out += self._beyond_linear(x, rates)
        return np.hstack([out, (found.rail - force).reshape(len(y), -1)])

    def _beyond_linear(self, x: NDArray[np.float64], rates: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces of nonlinear elements beyond their linear part, gyroscopic pair of pitch rates in moving frames."""
        out = self._suspension(x)
        spin = self.train.wheelset_spin_inertia * rates
        out[:, self.train.wheelset_dof[:, 2]] += spin * self.frame_rate[:, 0]
        out[:, self.train.wheelset_dof[:, 4]] -= spin * self.frame_rate[:, 1]
        return out

    def _suspension(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces of the nonlinear elements beyond their linear part, the bodies being at rest in their frames."""
        train, out = self.train, np.zeros_like(x)
        for e, kind in enumerate(train.element_kind):
            index, row = train.element_index[e], train.element_row[e]
            q = np.full(len(x), self.elongation[e]) + (x[:, index] @ row if kind else 0.0)
            if not q.any():
                continue
            deviation = table_force(train.element_table[e], q) - train.element_linear[e] * q
            np.add.at(out.T, index, -row[:, None] * deviation)
        return out

    def solve(self) -> NDArray[np.float64]:
        """Newton's method, from other guesses where it fails at once; shape (n + 6 W,).

        Where the track is uneven, on stiffened or failed fastenings, every wheel sinks by its own: a mean leaves wheels
        in the air.

        At low friction spin alone nearly saturates the creep forces: from the guess, which has none, Newton's method
        oversteps into sliding, where nothing tells the way back.
        """
        wanted = float(self.model.constants[at.FRICTION])
        y, size = self._newton(self._guess())
        if size < FORCE_TOLERANCE:
            return y
        apart, left = self._newton(self._guess(mean=False))
        if left < FORCE_TOLERANCE:
            return apart
        differs = self.model.ingredients.contacts is not None
        if (self.model.ingredients.given or differs) and (found := self._approach()) is not None:
            return found
        reached, y = np.inf, self._guess()
        steps = 1 + max(int(np.ceil(np.log(EASY_FRICTION / wanted) / np.log(FRICTION_RATIO))), 0)
        for friction in np.geomspace(max(EASY_FRICTION, wanted), wanted, steps):
            self._set_friction(float(friction))
            y, left = self._newton(y)
            if not left < FORCE_TOLERANCE and reached == np.inf:
                y, left = self._newton(self._guess(mean=False))
            if not left < FORCE_TOLERANCE:
                break
            reached = float(friction)
        self._set_friction(wanted)
        if reached <= wanted:
            return y
        limit = f", only down to track.friction = {reached:.3g}: wheels would slide" if np.isfinite(reached) else ""
        raise InputError(
            f"numerics.start = 'equilibrium': no steady rolling found at {self.V * 3.6:g} km/h"
            f" (forces out of balance by {size:.3g} N){limit}; use start = 'zero'"
        )

    def _approach(self) -> NDArray[np.float64] | None:
        """Newton's method from straight track and equal radii on, both growing by steps that are halved where it fails.

        In a sharp curve, or with wheels of different radii, flanges lie against the rails, where the guess, which is
        made for the treads, is of no use.
        """
        self._give(0.0)
        y, size = self._newton(self._guess())
        share, step, before = 0.0, FIRST_SHARE, (0.0, y)
        while size < FORCE_TOLERANCE and share < 1.0 and step > SMALLEST_SHARE:
            coming = min(share + step, 1.0)
            self._give(coming)
            ahead = y if share == 0.0 else y + (coming - share) / (share - before[0]) * (y - before[1])
            reached, left = self._newton(ahead)
            if left < FORCE_TOLERANCE:
                before, share, y, step = (share, y), coming, reached, 2.0 * step
            else:
                step *= 0.5
        self._give(1.0)
        return y if share == 1.0 else None

    def _set_friction(self, friction: float) -> None:
        constants = self.model.constants.copy()
        constants[at.FRICTION] = friction
        self.model = replace(self.model, constants=constants)

    def _newton(self, y: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
        """Newton's method with halved steps from a state; the last state, and how far it is out of balance [N]."""
        n, m = self.train.n, len(y)
        nudge = np.full(m, NUDGE_COORDINATE)
        nudge[self.pitch], nudge[n:] = NUDGE_RATE, NUDGE_FORCE
        size = np.inf
        for _ in range(NEWTON):
            trials = np.vstack([y, y + np.diag(nudge), y - np.diag(nudge)])
            parts = range(0, len(trials), AT_ONCE)
            values = np.vstack([self.residual(trials[first : first + AT_ONCE]) for first in parts])
            size = float(np.abs(values[0]).max())
            if size < FORCE_TOLERANCE:
                break
            J = (values[1 : m + 1] - values[m + 1 :]).T / (2.0 * nudge)
            step = np.linalg.lstsq(J, -values[0], rcond=1e-14)[0]
            shares = 0.5 ** np.arange(8)
            trials = y + shares[:, None] * step
            y = trials[int(np.argmin(np.abs(self.residual(trials)).max(axis=1)))]
        return y, size

    def _guess(self, mean: bool = True) -> NDArray[np.float64]:
        """Vertical equilibrium on linearised contact springs, the track sunk by the mean of the wheels or by each."""
        train, dof = self.train, self.train.wheelset_dof
        load = float(self.model.constants[at.STATIC_LOAD])
        centre = self.model.ingredients.contact.lookup(np.array(0.0), np.array(0.0))
        hertz = centre[at.HERTZ :: at.N_TABLE].max()  # of the slot that is not empty there
        approach = (load / hertz) ** (2.0 / 3.0)
        stiffness = 1.5 * load / approach
        K = train.K.copy()
        f = self.load.copy()
        force = np.zeros((len(dof), 2, 3))
        force[:, :, 0] = load
        sinking = self.track.under_wheels(force[None])[0, :, :, 0]
        common = sinking.mean(axis=1).mean()
        own = np.zeros_like(sinking) if mean else sinking - common
        own = own - self._share * self._raised
        for w, b0 in enumerate(train.half_spacing):
            K[dof[w, 1], dof[w, 1]] += 2.0 * stiffness
            K[dof[w, 2], dof[w, 2]] += 2.0 * stiffness * b0**2
            f[dof[w, 1]] += 2.0 * (stiffness * approach - load) + stiffness * own[w].sum()
            f[dof[w, 2]] += stiffness * b0 * (own[w, 1] - own[w, 0])
        x = np.linalg.lstsq(K, f, rcond=1e-12)[0]
        x[self.pitch] = 0.0
        x[1 : train.n_dof : 5] += common
        return np.concatenate([x, force.ravel()])
