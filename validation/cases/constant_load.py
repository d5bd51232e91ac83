"""A constant load that moves on the engine's rails on discrete damped springs: the whole of the engine's own step.

The load is a wheelset that presses on both rails through a contact spring so soft, and so long compressed, that the
rails' motion does not change its force: N = K delta^1.5 with delta = 10 km and N = 70 kN, of which a deflection of
1 mm takes 10 mN. The track's irregularity, which lowers the rails or raises them towards the wheel, switches it on.
The wheelset itself weighs a million tons, and nothing creeps. Slabs are placed behind the window, and beyond them the
engine takes the ground as rigid. Everything else is the step as it is in a run, for either kind of trial functions.

The load grows over 3 m, another 3 m pass, then one pitch is recorded: all seats near the load together give the history
of one seat.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from threadpoolctl import threadpool_limits

from tiengine.contact.table import ContactTable
from tiengine.engine.chunk import Chunk
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.kernels import layout as at
from tiengine.model.from_scenario import ingredients
from tiengine.model.ingredients import Ingredients
from tiengine.model.model import build_model
from tiengine.model.newmark import Newmark
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.track.knots import Grading
from tiengine.track.seat_points import seat_points
from tiengine.vehicle.train import TrainModel
from validation.closed_forms.floquet import Seats

__all__ = ["LOAD", "NEAR", "History", "Numerics", "history", "seats_of"]

LOAD, NEAR = 70e3, 7.0  # N; m from the load within which seats are compared
RAMP, SETTLE = 3.0, 3.0  # m
COMPRESSION, MASS = 1e4, 1e9  # m, kg


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """How the rails are discretised.

    Attributes:
        window: Length, with the load in its middle [m].
        modes: Sines of a field in it; 0 for splines.
        refinement: Of the knots of splines; 1 for the default's.
        seat: Length of rail on which a seat presses [m].
        dt: Time step [s].
    """

    window: float = 16.0
    modes: int = 0
    refinement: float = 1.0
    seat: float = 0.15
    dt: float = 1e-4

    @property
    def label(self) -> str:
        """Text for the table."""
        knots = f"splines, knots {0.15 / self.refinement:.3g} m at the load" if not self.modes else ""
        seat = f"seats of {self.seat:g} m" if self.seat else "point seats"
        return f"{knots or f'{self.modes} sines'} in {self.window:g} m, step {self.dt:g} s, {seat}"

    @property
    def grading(self) -> Grading | None:
        """Knots of the splines."""
        if self.modes:
            return None
        return Grading(finest=0.15 / self.refinement, coarsest=1.0 / self.refinement)


@dataclass(frozen=True, eq=False)
class History:
    """One pitch of the steady state.

    Attributes:
        x: Load ahead of the seat [m], ascending, shape (n,).
        force: Force of the seat [N], shape (n,).
        phase: Load ahead of the seat behind it [m], shape (steps,).
        deflection: Of the rail under the load, by its trial functions [m], shape (steps,).
        missing: Static deflection under the load that they lack, by the engine's own account [m].
    """

    x: Reals
    force: Reals
    phase: Reals
    deflection: Reals
    missing: float


@cache
def _ingredients() -> Ingredients:
    given = ingredients(load_scenario("paper", ['track.slab="CRTS_II"']), 1e-4)  # seats every 0.65 m
    return replace(given, train=_wheelset(given), contact=_soft(given.contact), local_compliance=True)


def seats_of(numerics: Numerics) -> Seats:
    """The supports as the exact solution takes them."""
    given = _ingredients()
    offset, share = (tuple(float(x) for x in part) for part in seat_points(numerics.seat))
    return Seats(
        given.slab.fastening_pitch, given.fastening.vertical_stiffness, given.fastening.vertical_damping, offset, share
    )


def _wheelset(given: Ingredients) -> TrainModel:
    """A wheelset without suspension whose weight is twice the load; its mass keeps it where it is."""
    none, one = np.zeros((5, 5)), np.ones(1)
    return TrainModel(
        n_dof=5, n=5, M=MASS * np.eye(5), C=none, K=none, C_speed=none,
        gravity=np.array([0.0, 2.0 * LOAD, 0.0, 0.0, 0.0]), acceleration_force=np.zeros(5),
        wheelset_dof=np.arange(5, dtype=np.int32)[None], wheelset_x=np.zeros(1),
        wheelset_vehicle=np.zeros(1, dtype=np.int32), wheel_radius=given.train.wheel_radius[0] * one,
        half_spacing=given.train.half_spacing[0] * one, wheelset_mass=2.0 * LOAD / 9.81 * one,
        wheelset_spin_inertia=np.zeros(1), body_names=("wheelset",),
        body_x=np.zeros(1), body_height=np.zeros(1), body_vehicle_x=np.zeros(1), body_inertia=np.zeros((1, 3)),
        K_leaning=none, grade_force=np.zeros((5, 1)),
        element_index=np.zeros((0, 12), dtype=np.int32), element_row=np.zeros((0, 12)),
        element_kind=np.zeros(0, dtype=np.int32), element_linear=np.zeros(0), element_table=np.zeros((0, 2, 2)),
        element_names=(), element_between_cars=np.zeros(0, dtype=np.bool_),
    )  # fmt: skip


def _soft(table: ContactTable) -> ContactTable:
    """Level contact at the tape circle and the crown, of the soft spring, without creep."""
    values = np.zeros_like(table.values)
    names = list(table.COLUMNS)
    values[..., names.index("r_c")] = table.settings.wheel_radius
    values[..., names.index("hertz_K")] = LOAD / COMPRESSION**1.5
    return replace(table, values=values)


@cache
def history(speed: int, numerics: Numerics) -> History:
    """Advance the engine.

    Args:
        speed: [km/h].
        numerics: Discretisation.
    """
    V, given, dt = speed / 3.6, _ingredients(), numerics.dt
    d = given.slab.fastening_pitch
    model = build_model(
        replace(
            given, newmark=Newmark(dt), length=numerics.window, modes=max(1, numerics.modes), grading=numerics.grading,
            fastening=given.fastening.model_copy(update={"length": numerics.seat}),
        ),
        V,
    )  # fmt: skip
    missing = LOAD * float(model.constants[at.RESIDUAL_VERTICAL])
    model.vehicle_load[:] = 0.0
    steps, last = (int(np.ceil(distance / (V * dt))) for distance in (RAMP + SETTLE + d, d))
    state, chunk = state_at_rest(model), Chunk.empty(model.ingredients, steps, 1)
    stepper = make_stepper(model, state, chunk)
    X = V * dt * np.arange(1.0, steps + 1)
    stepper.load(X, np.full(steps, V), np.zeros(steps), _switched_on(chunk.irregularity, X))
    chunk.clock[:, at.FIRST_SLAB] = -1000
    place = float(model.ingredients.wheel_s[0])
    under = state.rail_deflection(np.array([place]))
    x, force, w = [], [], []
    with threadpool_limits(1):
        for i in range(steps):
            stepper.step(i)
            if i >= steps - last:
                now = state.seat_forces[0, 0, 0]
                ahead = place - chunk.clock[i, at.FIRST_SEAT_S] - d * np.arange(len(now))
                near = np.abs(ahead) < NEAR
                x.append(ahead[near])
                force.append(now[near])
                w.append(float(under()[0, 0, 0]))
    if not np.allclose(state.normal_force, LOAD, rtol=1e-6):
        raise RuntimeError(f"the load is {state.normal_force.ravel()} N")
    order = np.argsort(np.concatenate(x))
    phase = np.mod(X[-last:] + place - d / 2.0, d)
    return History(np.concatenate(x)[order], np.concatenate(force)[order], phase, np.array(w), missing)


def _switched_on(like: Reals, X: Reals) -> Reals:
    """Irregularity that raises the rails so far that the force grows as half a cosine over the first metres."""
    share = 0.5 - 0.5 * np.cos(np.pi * np.minimum(1.0, X / RAMP))
    channels = np.zeros_like(like)
    channels[..., at.Z_V] = (-COMPRESSION * share ** (2.0 / 3.0))[:, None]
    return channels
