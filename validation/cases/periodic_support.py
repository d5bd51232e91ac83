"""A constant load that moves on a rail on discrete damped springs: the engine's step against Floquet's exact solution.

Reference: ``closed_forms/floquet``. CHN60, fastening ACE2021 (4e7 N/m, 5e4 N s/m) every 0.65 m, rigid ground, 70 kN
at 100, 250 and 350 km/h. Ours is the engine's own step, all of it: rail kernels, fastening kernel, passes, inverses.
Everything else of a run is excluded: the slabs are placed behind the window, and beyond them the
engine takes the ground as rigid; the track is 1 m lower than the wheels, which carry no weight and do not touch it;
the load is added to the left rail's right-hand side in the middle of the window. The load grows over 3 m, another 3 m
pass, then one pitch is compared: all seats within 10 m of the load together give the history of one seat.

Accuracy of a sum of sines. The exact history jumps down by 3 % of its peak when the load crosses a seat
(``floquet.jump``), since the rail's slope has a kink under a point load and the force of the seat's damper contains V
w'. A truncated series runs through a jump over l / 2N on either side and overshoots by 9 % of it (Gibbs) beyond, at
any number of modes. The history is therefore compared while the load is l / 2N or more from every seat (the jump
reaches the neighbours, too); the largest difference anywhere, which tends to half the jump, is listed for information.
The deflection under the load is continuous and is compared over the whole pitch; it lacks the compliance of the
omitted modes, which falls as 1/N: 8 modes per metre leave 0.6 %, hence 12 a metre for the rows that are judged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from threadpoolctl import threadpool_limits

from tiengine.engine.chunk import Chunk
from tiengine.engine.sine_state import SineState
from tiengine.engine.sine_stepper import SineStepper
from tiengine.engine.stepper import Stage
from tiengine.kernels import layout as at
from tiengine.model.from_scenario import ingredients
from tiengine.model.ingredients import Ingredients
from tiengine.model.newmark import Newmark
from tiengine.model.sine_model import SineModel, build_sine_model
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.track.rail import RailWindow
from validation.cases.rail import vertical_beam
from validation.closed_forms.floquet import Seats, deflection_under_load, jump, seat_force
from validation.frame.case import Case

__all__ = ["CASES", "LADDER", "deflection_error", "exact_force", "force_error", "history", "mean_square"]

LOAD, NEAR = 70e3, 10.0  # N; m from the load within which seats are compared
RAMP, SETTLE = 3.0, 3.0  # m
SPEEDS = (350, 250, 100)  # km/h
LADDER = (60, 72, 144, 288, 432)  # modes in 36 m
CONVERGED = (24.0, 288)  # window [m] and modes: 12 a metre, as 432 in 36 m
DEFAULT = (28.0, 182, 2e-4)  # of a default scenario: window [m], modes, step [s]
SOURCE = "infinite Timoshenko rail on discrete springs, Floquet transform"


class _Loaded(SineStepper):
    """The engine's step with a load in the middle of the left rail, added to what its forces have left in F."""

    def __init__(self, model: SineModel, state: SineState, chunk: Chunk) -> None:
        self.weight = 0.0
        self._shape = model.window.shape(np.array([model.ingredients.length / 2.0]))[0]
        super().__init__(model, state, chunk)

    def _stages(self) -> Iterator[Stage]:
        """Stages of the step, the load after its forces."""
        for name, call in super()._stages():
            yield name, call
            if name == "forces and contact":
                yield "load", self._load_rail

    def _load_rail(self) -> None:
        self.state.view(at.F, "vertical")[0, 0, : len(self._shape)] += self.weight * self._shape


@dataclass(frozen=True, eq=False)
class History:
    """One pitch of the steady state.

    Attributes:
        x: Load ahead of the seat [m], ascending, shape (n,).
        force: Force of the seat [N], shape (n,).
        phase: Load ahead of the seat behind it [m], shape (steps,).
        deflection: Of the rail under the load [m], shape (steps,).
    """

    x: Reals
    force: Reals
    phase: Reals
    deflection: Reals


@cache
def _ingredients() -> Ingredients:
    return ingredients(load_scenario("paper", ['track.slab="CRTS_II"']), 1e-4)  # seats every 0.65 m


def _seats() -> Seats:
    given = _ingredients()
    return Seats(given.slab.fastening_pitch, given.fastening.vertical_stiffness, given.fastening.vertical_damping)


def _prepare(model: SineModel, V: float, steps: int) -> tuple[SineState, Chunk, _Loaded, Reals]:
    """Weightless wheels over a lowered track, slabs far behind; window's rear end at every step."""
    model.vehicle_load[:] = 0.0
    state, chunk = SineState.at_rest(model), Chunk.empty(model.ingredients, steps, 1, 1)
    stepper = _Loaded(model, state, chunk)
    channels = np.zeros_like(chunk.irregularity)
    channels[..., at.Z_V] = 1.0
    X = V * model.ingredients.newmark.dt * np.arange(1.0, steps + 1)
    stepper.load(X, np.full(steps, V), np.zeros(steps), channels)
    chunk.clock[:, at.FIRST_SLAB] = -1000
    return state, chunk, stepper, X


@cache
def history(speed: int, length: float, modes: int, dt: float = 1e-4) -> History:
    """Advance the engine.

    Args:
        speed: [km/h].
        length: Window [m].
        modes: Modes in it.
        dt: Step [s].
    """
    V, d = speed / 3.6, _seats().pitch
    model = build_sine_model(replace(_ingredients(), newmark=Newmark(dt), length=length, modes=modes), V)
    steps, last = (int(np.ceil(distance / (V * dt))) for distance in (RAMP + SETTLE + d, d))
    state, chunk, stepper, X = _prepare(model, V, steps)
    shape = model.window.shape(np.array([length / 2.0]))[0]
    x, force, w = [], [], []
    with threadpool_limits(1):
        for i in range(steps):
            stepper.weight = LOAD * (0.5 - 0.5 * np.cos(np.pi * min(1.0, X[i] / RAMP)))
            stepper.step(i)
            if i >= steps - last:
                ahead = length / 2.0 - chunk.clock[i, at.FIRST_SEAT_S] - d * np.arange(state.seat_force.shape[3])
                near = np.abs(ahead) < NEAR
                x.append(ahead[near])
                force.append(state.seat_force[0, 0, 0, near])
                w.append(shape @ state.view(at.U, "vertical")[0, 0, :modes])
    if state.force.any():
        raise RuntimeError("a wheel has touched the rail")
    order = np.argsort(np.concatenate(x))
    phase = np.mod(X[-last:] + length / 2.0 - d / 2.0, d)
    return History(np.concatenate(x)[order], np.concatenate(force)[order], phase, np.array(w))


@cache
def _peak(speed: int) -> float:
    """Largest seat force [N]."""
    return float(exact_force(speed, np.linspace(-1.0, 1.0, 4001)).max())


@cache
def _largest_deflection(speed: int) -> float:
    """Under the load, over one pitch [m]."""
    places = np.linspace(0.0, _seats().pitch, 14)
    return float(deflection_under_load(vertical_beam(), _seats(), speed / 3.6, LOAD, places).max())


def exact_force(speed: int, x: Reals) -> Reals:
    """Force of a seat at ``speed`` [km/h] over the load's distance x ahead of it [m], shape of x [N]."""
    return seat_force(vertical_beam(), _seats(), speed / 3.6, LOAD, x)


@cache
def deflection_error(speed: int, length: float, modes: int, dt: float = 1e-4) -> tuple[float, float]:
    """Largest and mean difference under the load over one pitch, over the largest deflection [%]."""
    ours = history(speed, length, modes, dt)
    exact = deflection_under_load(vertical_beam(), _seats(), speed / 3.6, LOAD, ours.phase[::2])
    difference = 100.0 * (ours.deflection[::2] - exact) / _largest_deflection(speed)
    return float(np.abs(difference).max()), float(difference.mean())


def force_error(speed: int, length: float, modes: int, dt: float = 1e-4, apart: float | None = None) -> float:
    """Largest difference over the peak [%], while the load is ``apart`` [m] (l / 2N) or more from every seat."""
    ours, pitch = history(speed, length, modes, dt), _seats().pitch
    difference = np.abs(ours.force - exact_force(speed, ours.x))
    from_seat = np.abs(ours.x - pitch * np.round(ours.x / pitch))
    chosen = difference[from_seat >= (length / (2.0 * modes) if apart is None else apart)]
    return float(100.0 * chosen.max() / _peak(speed))


def mean_square(speed: int, length: float, modes: int) -> float:
    """Root mean square difference while the load is within 1 m, jumps included, over the peak [%]."""
    ours = history(speed, length, modes)
    near = np.abs(ours.x) < 1.0
    difference = (ours.force - exact_force(speed, ours.x))[near]
    return float(100.0 * np.sqrt(np.mean(difference**2)) / _peak(speed))


def _orders() -> list[float]:
    """Order in 1 / N, 144 to 288 modes in 36 m: mean deflection under the load, mean square of the seat force."""
    pairs = [[deflection_error(350, 36.0, n)[1], mean_square(350, 36.0, n)] for n in (144, 288)]
    return [float(x) for x in np.log2(np.array(pairs[0]) / np.array(pairs[1]))]


def _everything(length: float, modes: int, dt: float) -> list[float]:
    """Errors at 350 km/h: seat force off the jumps and anywhere; deflection, largest, mean, mean when corrected."""
    forces = [force_error(350, length, modes, dt, apart) for apart in (0.0625, 0.0)]
    largest, mean = deflection_error(350, length, modes, dt)
    missing = LOAD * RailWindow(_ingredients().rail, length, modes).missing_compliance[0]
    return [*forces, largest, mean, mean + 100.0 * missing / _largest_deflection(350)]


_JUMPS = "required bound; Gibbs' 9 % of the jump (3 % of the peak) is 0.27 % of the peak"
_MISSING = "required bound; the compliance of the omitted modes, under load and at seats, is 0.3 %"

CASES = (
    *(
        Case(
            name=f"floquet-{name}-{speed}",
            kind="verification",
            quantity=f"{quantity} at {speed} km/h, 288 modes in 24 m [%]",
            source=SOURCE,
            reference=0.5,
            rule="at most",
            why=why,
            compute=lambda measure=measure, speed=speed: measure(speed, *CONVERGED),
            quick=speed == 350,
        )
        for speed in SPEEDS
        for name, quantity, why, measure in (
            ("seat", "seat force, largest difference over peak, load l/2N or more from a seat", _JUMPS, force_error),
            (
                "deflection",
                "deflection under the load, largest difference over one pitch",
                _MISSING,
                lambda *case: deflection_error(*case)[0],
            ),
        )
    ),
    Case(
        name="floquet-order",
        kind="convergence",
        quantity="order in 1/N of the mean deflection under the load, 144 to 288 modes in 36 m, 350 km/h",
        source="compliance of the omitted modes",
        reference=1.0,
        atol=0.1,
        why="144 modes hold 2.6 half waves between seats: not quite the asymptotic law",
        compute=lambda: _orders()[0],
        quick=False,
    ),
    Case(
        name="floquet-order-seat",
        kind="information",
        quantity="order in 1/N of the seat force's mean square difference, jumps included, 144 to 288 modes, 350 km/h",
        source="a truncated jump in the mean square",
        reference=0.5,
        why="the smooth part falls faster: the order approaches 1/2 from above",
        compute=lambda: _orders()[1],
        quick=False,
    ),
    *(
        Case(
            name=f"floquet-{modes}-modes-{length:g}-m",
            kind="information",
            quantity=(
                f"350 km/h, {modes} modes in {length:g} m, step {dt:g} s [%]: seat force 62 mm or more from a seat,"
                " anywhere (jump included); deflection, largest, mean, mean with the load's missing compliance added"
            ),
            source=SOURCE,
            reference=lambda: [
                0.0,
                50.0 * jump(vertical_beam(), _seats(), 350 / 3.6, LOAD) / _peak(350),
                0.0,
                0.0,
                0.0,
            ],
            why=f"{'default settings; ' if dt == DEFAULT[2] else ''}the second number cannot fall below half the jump",
            compute=lambda length=length, modes=modes, dt=dt: _everything(length, modes, dt),
            quick=dt == DEFAULT[2],
        )
        for length, modes, dt in (DEFAULT, *((36.0, modes, 1e-4) for modes in LADDER))
    ),
)
