"""Curves: steady arcs against d'Alembert's forces and the rolling of a free wheelset, a wave by two descriptions.

References are closed forms: a vehicle of mass m on an arc of curvature kappa and cant angle phi presses on the rails
with m a_q, a_q = V^2 kappa cos phi - g sin phi; moments about the track's centre line give the load on either rail; a
slow free wheelset of conicity lambda rolls without slip at r0 b0/(lambda R) from the middle (K. Knothe, S. Stichel,
Rail Vehicle Dynamics (2017), ch. 6). A long lateral wave of the track may be given as an alignment, whose frame the
train's coordinates follow, or as an irregularity of straight track: two descriptions that share only vehicle and
contact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tiengine.engine import backend
from tiengine.engine.chunk import Chunk
from tiengine.engine.equilibrium import equilibrium
from tiengine.engine.kinds import make_stepper, state_at_rest
from tiengine.engine.state import DISPLACEMENT
from tiengine.kernels import layout as at
from tiengine.model.curve_loads import CurveLoads
from tiengine.model.from_scenario import ingredients
from tiengine.model.ingredients import Ingredients
from tiengine.model.model import build_model
from tiengine.parameters.arrays import Reals
from tiengine.parameters.conventions import GRAVITY
from tiengine.scenario.scenario import load_scenario
from tiengine.vehicle.train import TrainModel
from validation.cases.klingel import FREE, HEAD_RADIUS, cone, round_head, wagon
from validation.closed_forms.klingel import cone_conicity
from validation.frame.case import Case

__all__ = ["CASES", "long_wave"]

V, R, CANT = 350.0 / 3.6, 7000.0, 0.15
DT, CHUNK = 2e-4, 1000  # s, steps
SLOW, CONICITY = 10.0, 0.0256  # km/h, -
BEGIN, ROWS = 60.0, 2.0  # m: where a wave begins, spacing of the alignment's rows


@dataclass(frozen=True)
class Wave:
    """Lateral shape of the track, (1 - cos)^2.

    Attributes:
        length, height: [m].
    """

    length: float
    height: float

    def __call__(self, x: Reals) -> tuple[Reals, Reals, Reals]:
        """Offset [m], slope and curvature [1/m] over chainage, zero before it begins."""
        k = 2.0 * np.pi / self.length
        s = k * np.maximum(np.asarray(x) - BEGIN, 0.0)
        c = 1.0 - np.cos(s)
        return (
            0.25 * self.height * c**2,
            0.5 * self.height * k * c * np.sin(s),
            0.5 * self.height * k**2 * (np.sin(s) ** 2 + c * np.cos(s)),
        )


SHORT, LONG = Wave(400.0, 0.4), Wave(2000.0, 2.0)


@dataclass(frozen=True)
class Steady:
    """Steady rolling in an arc.

    Attributes:
        train: The train.
        u: Coordinates of its bodies, shape (bodies, 5).
        vertical, lateral: Forces of the wheels on the rails, shape (W, 2) [N].
    """

    train: TrainModel
    u: Reals
    vertical: Reals
    lateral: Reals

    @property
    def masses(self) -> Reals:
        """Masses of the bodies, shape (bodies,) [kg]."""
        return np.asarray(np.diag(self.train.M)[: self.train.n_dof : 5])


def _steady(tables: dict[str, Any], radius: float, cant: float) -> Steady:
    """Train of a scenario in the middle of an arc."""
    backend.start(1)
    arc = {"kind": "arc", "length": 1000.0, "radius": radius, "cant_mm": 1e3 * cant}
    track = {**tables.get("track", {}), "alignment": [arc]}
    scenario = load_scenario({"irregularity": {"spectrum": "none"}, **tables, "track": track})
    speed = scenario.train.speed.fastest
    model = build_model(ingredients(scenario, 2e-4), speed)
    state = state_at_rest(model)
    equilibrium(model, state, 100.0, speed)
    forces = state.forces_on_rails[0]
    train = model.ingredients.train
    u = state.part(0, "vehicles")[DISPLACEMENT][: train.n_dof].reshape(-1, 5)
    return Steady(train, u, forces[..., 0].copy(), forces[..., 1].copy())


@cache
def _arc(side: float = 1.0, radius: float = R, cant: float = CANT) -> Steady:
    """CRH380A at 350 km/h in an arc to the right (1) or left (-1)."""
    train = {"vehicles": ["CRH380A_v2"], "speed_kmh": 3.6 * V, "distance": 10.0}
    return _steady({"train": train}, side * radius, side * cant)


def _unbalanced(radius: float = R, cant: float = CANT) -> float:
    roll = np.arcsin(cant / 1.5)
    return float(V**2 / radius * np.cos(roll) - GRAVITY * np.sin(roll))


def _axle_force() -> float:
    return float(-_arc().lateral.sum()) / 4e3


def _axle_reference() -> float:
    return float(_arc().masses.sum()) * _unbalanced() / 4e3


def _balanced() -> float:
    radius = 9500.0
    cant = float(1.5 * np.sin(np.arctan(V**2 / (radius * GRAVITY))))
    return float(_arc(1.0, radius, cant).lateral.sum())


def _mirrored() -> float:
    right, left = _arc(), _arc(-1.0)
    return float(max(
        np.abs(left.vertical - right.vertical[:, ::-1]).max(), np.abs(left.lateral + right.lateral[:, ::-1]).max()
    ))  # fmt: skip


def _load_transfer() -> float:
    found = _arc()
    return 1e-3 * float((found.vertical[:, 0] - found.vertical[:, 1]).sum())


def _load_transfer_reference() -> float:
    """Difference of the rails' loads: levers of all bodies where they stand, and the spin of the wheelsets [kN]."""
    found = _arc()
    train, roll = found.train, np.arcsin(CANT / 1.5)
    down = GRAVITY * np.cos(roll) + V**2 / R * np.sin(roll)
    y = found.u[:, 0].copy()
    y[0] -= train.body_x[1] ** 2 / (2.0 * R)  # the bogies carry the car where they stand
    moment = np.sum(found.masses * (_unbalanced() * train.body_height - down * y))
    moment += np.sum(train.wheelset_spin_inertia / train.wheel_radius) * V**2 / R
    return 1e-3 * float(moment / train.half_spacing[0])


@cache
def _free_wheelset() -> float:
    """Mean offset of a wagon's free wheelsets from the middle, outward [mm]."""
    slope = brentq(lambda d: cone_conicity(d, 0.43, 0.7465, HEAD_RADIUS) - CONICITY, 0.02, 0.03)
    speed = SLOW / 3.6
    cant = 1.5 * speed**2 / (R * GRAVITY)  # balanced
    free = wagon(FREE)  # to yaw; across, the car goes with its wheelsets
    free["spring"] = tuple({**spring, "ky": 1e6} for spring in free["spring"])
    train = {"vehicles": (free,), "wheel_profile": cone(slope), "speed_kmh": SLOW, "distance": 10.0}
    tables = {"train": train, "track": {"rail_profile": round_head(), "friction": 1.0}}
    found = _steady(tables, R, cant)
    return -1e3 * float(found.u[found.train.wheelset_dof[:, 0] // 5, 0].mean())


@cache
def long_wave(wave: Wave, distance: float) -> tuple[Reals, Reals]:
    """Sum of Y of every wheelset by both descriptions [N], shape (steps, 4) each.

    Both without what the leaning train adds to the stiffness, which the engine includes with alignments only.
    """
    x = np.arange(0.0, distance + 100.0, ROWS)
    rows = tuple((float(a), float(b), 0.0, 0.0) for a, b in zip(x, wave(x)[2], strict=True))
    backend.start(1)
    train = {"vehicles": ["CRH380A_v2"], "speed_kmh": 3.6 * V, "distance": distance}
    scenario = load_scenario({"train": train, "track": {"alignment_rows": rows}})
    g = ingredients(scenario, DT)
    upright = replace(g.train, K=g.train.K - g.train.K_leaning, K_leaning=np.zeros_like(g.train.K))
    line = scenario.track.line
    assert line is not None
    steps = int(distance / (V * DT))
    curved = replace(g, train=upright, given=(CurveLoads(line, upright),))
    return _march(curved, steps), _march(replace(curved, given=()), steps, wave)


def _march(g: Ingredients, steps: int, wave: Wave | None = None) -> Reals:
    """Sum of Y of every wheelset over a number of steps; a wave is an irregularity."""
    model = build_model(g, V)
    state = state_at_rest(model)
    equilibrium(model, state, 0.0, V)
    chunk = Chunk.empty(g, CHUNK, 1)
    stepper = make_stepper(model, state, chunk)
    found = []
    for first in range(0, steps, CHUNK):
        count = min(CHUNK, steps - first)
        X = V * DT * np.arange(first + 1.0, first + count + 1.0)
        felt = np.zeros((1, count, len(g.wheel_s), at.N_IRREGULARITY))
        if wave:
            felt[..., at.Y_A], felt[..., at.Y_A_SLOPE], _ = wave(X[:, None] + g.wheel_s)
        speed, zero = np.full(count, V), np.zeros(count)
        stepper.load(X, speed, zero, felt, g.given_loads(X / V, X + g.centre_s, speed, zero))
        for i in range(count):
            stepper.step(i)
        found.append(chunk.wheel[0, :count, :, :, at.LATERAL_FORCE].sum(axis=-1))
    return np.concatenate(found)


def _wave_difference(wave: Wave, distance: float) -> float:
    first, second = long_wave(wave, distance)
    return float(np.abs(first - second).max() / np.abs(second).max())


_DALEMBERT = "d'Alembert's forces; MODEL section 12"

CASES = (
    Case(
        name="curve-axle-force",
        kind="verification",
        quantity="mean lateral force of an axle, 350 km/h, R 7000 m, cant 150 mm [kN]",
        source=_DALEMBERT,
        reference=_axle_reference,
        rtol=5e-3,
        why="the start is found to 1e-4 N; half a percent is asked for",
        compute=_axle_force,
    ),
    Case(
        name="curve-balanced",
        kind="verification",
        quantity="net lateral force of a vehicle at balanced cant, R 9500 m [N]",
        source=_DALEMBERT,
        reference=0.0,
        atol=0.01,
        why="the start is found to 1e-4 N in each equation",
        compute=_balanced,
    ),
    Case(
        name="curve-mirrored",
        kind="verification",
        quantity="largest difference of wheel forces in mirrored curves [N]",
        source="symmetry",
        reference=0.0,
        atol=0.01,
        why="both starts are found to 1e-4 N in each equation",
        compute=_mirrored,
    ),
    Case(
        name="curve-load-transfer",
        kind="verification",
        quantity="load of the outer rail less that of the inner one, the car leaning as computed [kN]",
        source="moments about the track's centre line",
        reference=_load_transfer_reference,
        rtol=0.03,
        why="the reference has the loads at b0; contacts stand up to 6 mm beside it and move with the wheelsets by 4 mm"
        " of 746",
        compute=_load_transfer,
    ),
    Case(
        name="curve-free-wheelset",
        kind="verification",
        quantity="offset of free wheelsets of conicity 0.0256 at 10 km/h, R 7000 m [mm]",
        source="Knothe and Stichel 2017, ch. 6: r0 b0/(lambda R)",
        reference=0.43 * 0.7465 / (CONICITY * R) * 1e3,
        rtol=0.02,
        why="contacts lie 6 mm beside b0, 0.8 %; rails tilt under the spin creep forces and change the conicity",
        compute=_free_wheelset,
    ),
    Case(
        name="curve-long-wave",
        kind="verification",
        quantity="largest difference of a wheelset's lateral force over its peak, first 140 m of a wave of 400 m as"
        " alignment and as irregularity",
        source="the two descriptions",
        reference=0.0,
        atol=1e-3,
        why="curvature is linear between rows 2 m apart, within (2 k h)^2/8 = 5e-4 of the wave's; 0.2e-3 with rows at"
        " 1 m",
        compute=lambda: _wave_difference(SHORT, 200.0),
    ),
    Case(
        name="curve-long-wave-2km",
        kind="verification",
        quantity="the same over the first kilometre of a wave of 2 km, 2 m high",
        source="the two descriptions",
        reference=0.0,
        atol=1e-4,
        why="interpolation between rows is within 2e-5 of the curvature; squares of angles of up to 4 mrad",
        compute=lambda: _wave_difference(LONG, 1060.0),
        quick=False,
    ),
)
