"""A constant load that moves on a rail on discrete damped springs: the engine's step against Floquet's exact solution.

Reference: ``closed_forms/floquet``. CHN60, fastening ACE2021 (4e7 N/m, 5e4 N s/m) every 0.65 m, rigid ground, 70 kN
at 100, 250 and 350 km/h. Ours is the engine's own step, all of it, with splines and with sines
(``cases/constant_load``); one pitch of the steady state is compared, with the history of one seat.

Point seats, sines. The exact history jumps down by 3 % of its peak when the load crosses a seat (``floquet.jump``),
since the rail's slope has a kink under a point load and the seat's damper feels V w'. A truncated series runs through a
jump over l / 2N on either side and overshoots by 9 % of it (Gibbs) beyond, at any number of modes. The history is
therefore compared while the load is l / 2N or more from every seat (the jump reaches the neighbours, too); the largest
difference anywhere, which tends to half the jump, is listed for information. The deflection under the load is
continuous and is compared over the whole pitch; it lacks the compliance of the omitted modes, which falls as 1/N:
8 modes per metre leave 0.6 %, hence 12 a metre for the rows that are judged.

Seats of 0.15 m, splines. A seat is five Gauss points in the engine and here, each with its own share of the jump, at
most 28 % of it; an evenly pressed pad has none. Forces are therefore compared as means over 50 mm of travel, more than
the points are apart. The deflection counts what the engine adds under a wheel, the static compliance that its
splines lack.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.parameters.arrays import Reals
from validation.cases.constant_load import LOAD, NEAR, Numerics, history, seats_of
from validation.cases.rail import vertical_beam
from validation.closed_forms.floquet import deflection_under_load, jump, seat_force
from validation.frame.case import Case

__all__ = [
    "CASES", "DEFAULT", "LADDER", "REFINEMENTS", "deflection_error", "exact_force", "force_error", "mean_force_error",
    "mean_square", "sines", "splines",
]  # fmt: skip

SPEEDS = (350, 250, 100)  # km/h
LADDER = (60, 72, 144, 288, 432)  # modes in 36 m
REFINEMENTS = (0.5, 1.0, 2.0)
MEAN, GRID = 0.05, 1e-3  # m
PLACES = 12  # of the load in a pitch where its deflection is compared
SOURCE = "infinite Timoshenko rail on discrete springs, Floquet transform"


def sines(modes: int, length: float = 36.0, dt: float = 1e-4) -> Numerics:
    """Sines on point seats."""
    return Numerics(window=length, modes=modes, seat=0.0, dt=dt)


def splines(refinement: float, dt: float = 1e-4) -> Numerics:
    """Splines on seats of 0.15 m in a window that does not matter."""
    return Numerics(window=24.0, refinement=refinement, dt=dt)


DEFAULT = Numerics(dt=2e-4)
"""As in a run of the default scenario: its knots, step and seats, 8 m of window at either side of the load."""
CONVERGED = sines(288, 24.0)  # 12 a metre, as 432 in 36 m


@cache
def _exact(speed: int, seat: float) -> tuple[Reals, Reals]:
    """Load ahead of the seat [m], and the seat's force [N]."""
    x = np.arange(-NEAR - MEAN, NEAR + MEAN, GRID)
    return x, seat_force(vertical_beam(), seats_of(Numerics(seat=seat)), speed / 3.6, LOAD, x)


def exact_force(speed: int, x: Reals, seat: float = 0.0) -> Reals:
    """Force of a seat at ``speed`` [km/h] over the load's distance x ahead of it [m], shape of x [N]."""
    return seat_force(vertical_beam(), seats_of(Numerics(seat=seat)), speed / 3.6, LOAD, x)


def _peak(speed: int, seat: float) -> float:
    """Largest seat force [N]."""
    return float(_exact(speed, seat)[1].max())


@cache
def deflection_error(speed: int, numerics: Numerics, corrected: bool = False) -> tuple[float, float]:
    """Largest and mean difference under the load over one pitch, over the largest deflection [%].

    Args:
        speed: [km/h].
        numerics: Discretisation.
        corrected: Add the static deflection that the trial functions lack.
    """
    ours = history(speed, numerics)
    chosen = slice(None, None, max(1, len(ours.phase) // PLACES))
    exact = deflection_under_load(vertical_beam(), seats_of(numerics), speed / 3.6, LOAD, ours.phase[chosen])
    found = ours.deflection[chosen] + (ours.missing if corrected else 0.0)
    difference = 100.0 * (found - exact) / exact.max()
    return float(np.abs(difference).max()), float(difference.mean())


def force_error(speed: int, numerics: Numerics, apart: float | None = None) -> float:
    """Largest difference over the peak [%], while the load is ``apart`` [m] (l / 2N) or more from every seat."""
    ours, pitch = history(speed, numerics), seats_of(numerics).pitch
    difference = np.abs(ours.force - exact_force(speed, ours.x, numerics.seat))
    aside = np.abs(ours.x - pitch * np.round(ours.x / pitch))
    limit = numerics.window / (2.0 * numerics.modes) if apart is None else apart
    return float(100.0 * difference[aside >= limit].max() / _peak(speed, numerics.seat))


def mean_force_error(speed: int, numerics: Numerics) -> float:
    """Largest difference of the means over 50 mm of travel, over the peak [%]."""
    ours, (x, exact) = history(speed, numerics), _exact(speed, numerics.seat)
    inside = (x > ours.x[0]) & (x < ours.x[-1])
    difference = np.interp(x[inside], ours.x, ours.force) - exact[inside]
    box = round(MEAN / GRID)
    mean = np.convolve(difference, np.full(box, 1.0 / box), mode="valid")
    return float(100.0 * np.abs(mean).max() / _peak(speed, numerics.seat))


def mean_square(speed: int, numerics: Numerics) -> float:
    """Root mean square difference while the load is within 1 m, jumps included, over the peak [%]."""
    ours = history(speed, numerics)
    near = np.abs(ours.x) < 1.0
    difference = (ours.force - exact_force(speed, ours.x, numerics.seat))[near]
    return float(100.0 * np.sqrt(np.mean(difference**2)) / _peak(speed, numerics.seat))


def _orders() -> list[float]:
    """Order in 1 / N, 144 to 288 modes in 36 m: mean deflection under the load, mean square of the seat force."""
    pairs = [[deflection_error(350, sines(n))[1], mean_square(350, sines(n))] for n in (144, 288)]
    return [float(x) for x in np.log2(np.array(pairs[0]) / np.array(pairs[1]))]


def _everything(numerics: Numerics) -> list[float]:
    """Errors at 350 km/h: seat force off the jumps and anywhere; deflection, largest, mean, mean when corrected."""
    forces = [force_error(350, numerics, apart) for apart in (0.0625, 0.0)]
    return [*forces, *deflection_error(350, numerics), deflection_error(350, numerics, corrected=True)[1]]


def _of_splines(numerics: Numerics) -> list[float]:
    """Errors at 350 km/h: seat force as means over 50 mm, anywhere; deflection, largest, raw and corrected."""
    return [
        mean_force_error(350, numerics),
        force_error(350, numerics, 0.0),
        deflection_error(350, numerics)[0],
        deflection_error(350, numerics, corrected=True)[0],
    ]


def _half_jump() -> float:
    """Half of what a point seat's force falls by as the load crosses it at 350 km/h, over the peak [%]."""
    return 50.0 * jump(vertical_beam(), seats_of(sines(60)), 350 / 3.6, LOAD) / _peak(350, 0.0)


_JUMPS = "required bound; Gibbs' 9 % of the jump (3 % of the peak) is 0.27 % of the peak"
_MISSING = "required bound; the compliance of the omitted modes, under load and at seats, is 0.3 %"

CASES = (
    *(
        Case(
            name=f"floquet-{name}-{speed}",
            kind="verification",
            quantity=f"{quantity} at {speed} km/h, splines, default settings, seats of 0.15 m [%]",
            source=SOURCE,
            reference=bound,
            rule="at most",
            why=why,
            compute=lambda measure=measure, speed=speed: measure(speed),
            quick=speed == 350,
        )
        for speed in SPEEDS
        for name, quantity, bound, why, measure in (
            (
                "default-seat",
                "seat force as means over 50 mm, largest difference over peak",
                0.3,
                "required bound",
                lambda speed: mean_force_error(speed, DEFAULT),
            ),
            (
                "default-deflection",
                "deflection under the load, largest difference over one pitch",
                0.1,
                "required bound: a fifth of what the default may be off",
                lambda speed: deflection_error(speed, DEFAULT, corrected=True)[0],
            ),
        )
    ),
    Case(
        name="floquet-default-converges",
        kind="convergence",
        quantity="350 km/h, twice as many knots, 24 m, step 5e-5 s [%]: seat force as means over 50 mm, deflection",
        source=SOURCE,
        reference=(0.15, 0.05),
        rule="at most",
        why="half of the bounds of the default",
        compute=lambda: [
            mean_force_error(350, splines(2.0, 5e-5)),
            deflection_error(350, splines(2.0, 5e-5), corrected=True)[0],
        ],
        quick=False,
    ),
    *(
        Case(
            name=f"floquet-{name}-{speed}",
            kind="verification",
            quantity=f"{quantity} at {speed} km/h, 288 sines in 24 m, point seats [%]",
            source=SOURCE,
            reference=0.5,
            rule="at most",
            why=why,
            compute=lambda measure=measure, speed=speed: measure(speed),
            quick=speed == 350,
        )
        for speed in SPEEDS
        for name, quantity, why, measure in (
            (
                "seat",
                "seat force, largest difference over peak, load l/2N or more from a seat",
                _JUMPS,
                lambda speed: force_error(speed, CONVERGED),
            ),
            (
                "deflection",
                "deflection under the load, largest difference over one pitch",
                _MISSING,
                lambda speed: deflection_error(speed, CONVERGED)[0],
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
            name=f"floquet-splines-{refinement:g}",
            kind="information",
            quantity=(
                f"350 km/h, {splines(refinement).label} [%]: seat force as means over 50 mm, anywhere (jumps included);"
                " deflection, largest, with what the splines lack added"
            ),
            source=SOURCE,
            reference=np.zeros(4),
            why="the second number cannot fall below 14 % of a point seat's jump, 0.4 %",
            compute=lambda refinement=refinement: _of_splines(splines(refinement)),
            quick=False,
        )
        for refinement in REFINEMENTS
    ),
    *(
        Case(
            name=f"floquet-{modes}-modes-36-m",
            kind="information",
            quantity=(
                f"350 km/h, {sines(modes).label} [%]: seat force 62 mm or more from a seat,"
                " anywhere (jump included); deflection, largest, mean, mean with the load's missing compliance added"
            ),
            source=SOURCE,
            reference=lambda: (
                [0.0, 50.0 * jump(vertical_beam(), seats_of(sines(60)), 350 / 3.6, LOAD) / _peak(350, 0.0)] + [0.0] * 3
            ),
            why="the second number cannot fall below half the jump",
            compute=lambda modes=modes: _everything(sines(modes)),
            quick=False,
        )
        for modes in LADDER
    ),
)
