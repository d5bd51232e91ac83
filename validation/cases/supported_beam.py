"""A simply supported beam under a moving force, mass, sprung mass: engine's matrices and Newmark against closed forms.

References: ``closed_forms/supported_beam``. The bridge and the vehicle are those of Y.-B. Yang and J.-D. Yau,
Vehicle-bridge interaction element for dynamic analysis, J. Struct. Eng. 123 (1997) 1512-1518: 25 m, E I = 2.87e9 N/m^2
x 2.90 m^4, 2303 kg/m, 5750 kg on 1595 kN/m at 100 km/h. The engine's rail window at V = 0 is that beam: shear
stiffness and rotary inertia are set so that they have no effect. A second beam, 6 m of CHN60 at 350 km/h, keeps its
shear. The moving mass is coupled to the window's matrices step by step, with the terms of the total derivative D^2 w =
w_tt + 2 V w_xt + V^2 w_xx at the contact. Splines carry the second beam only: w and its slope are of one degree, which
locks on a beam without shear (0.3 % too stiff for the bridge on 20 spans). Signs: down positive.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from threadpoolctl import threadpool_limits

from tiengine.model.newmark import Newmark
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.track.rail import Rail, RailWindow
from validation.cases.rail import vertical_beam
from validation.closed_forms.supported_beam import (
    Crossing,
    force_euler,
    force_timoshenko,
    moving_mass,
    sprung_mass,
)
from validation.closed_forms.timoshenko import Beam
from validation.frame.case import Case
from validation.frame.spline_window import SplineWindow

__all__ = ["CASES"]

BRIDGE = Crossing(2.87e9 * 2.90, 2303.0, 25.0, 100.0 / 3.6, 5750.0, 1595e3)
DAMPED = replace(BRIDGE, damping=0.05 * 2.0 * np.sqrt(1595e3 * 5750.0))
RAIL_SPAN, RAIL_SPEED = 6.0, 350.0 / 3.6
MODES, STEPS, SAMPLES = 20, 9000, 90
MANY = 400  # modes that leave 1e-4 of the rail's deflection
BED = 6e7  # N/m^2, a railway's: what splines lack under a load is local, so that any bed between 1e6 and 1e8 gives it
SOURCE = "Fryba 1999, ch. 1 and 2; bridge of Yang and Yau 1997"


@cache
def _bridge_window() -> RailWindow:
    """The bridge as a rail: kappa G A is 1e14 N, so that shear adds EI k^2 / kappa G A < 1e-3 to the twentieth mode."""
    rail = Rail(
        mass_per_length=2303.0, A=1.0, E=2.87e9, nu=0.2, G=1e14, rho=1e-3, Iy=2.90, Iz=2.90, I_polar=5.80, GK=1e9,
        kappa_vertical=1.0, kappa_lateral=1.0, arm_fastening=0.0, half_base=0.1, arm_head=0.1,
    )  # fmt: skip
    return RailWindow(rail, BRIDGE.length, MODES)


@cache
def _rail_window() -> RailWindow:
    return RailWindow(load_scenario("paper").parts.rail, RAIL_SPAN, MODES)


def _rail_crossing() -> Crossing:
    beam = vertical_beam()
    return Crossing(beam.EI, beam.m, RAIL_SPAN, RAIL_SPEED, 7000.0)


def _times(crossing: Crossing) -> Reals:
    """Instants of the comparison, ends of every hundredth step [s], shape (SAMPLES,)."""
    return np.arange(1.0, SAMPLES + 1) * (crossing.duration / SAMPLES)


def _coupled(
    what: str, crossing: Crossing, base: tuple[Reals, Reals], phi: Reals, slope: Reals, bend: Reals
) -> tuple[Reals, Reals, Reals, Reals]:
    """M, C, K and load including the vehicle; the last coordinate is the sprung mass.

    ``phi``, ``slope``, ``bend`` are the trial functions at the contact and their derivatives, zero for theta and
    vehicle.
    """
    M, K = (matrix.copy() for matrix in base)
    C, V = np.zeros_like(M), crossing.V
    M[-1, -1] = crossing.mass
    if what == "mass":
        M += crossing.mass * np.outer(phi, phi)
        C += 2.0 * V * crossing.mass * np.outer(phi, slope)
        K += V**2 * crossing.mass * np.outer(phi, bend)
    elif what == "sprung":
        strain, moved = -phi, -V * slope
        strain[-1] = 1.0
        C += crossing.damping * np.outer(strain, strain)
        K += crossing.stiffness * np.outer(strain, strain) + crossing.damping * np.outer(strain, moved)
    else:
        K[-1, -1] = 1.0
    return M, C, K, crossing.weight * phi


@threadpool_limits.wrap(limits=1)
def _march(what: str, window: RailWindow | SplineWindow, crossing: Crossing, steps: int) -> Reals:
    """Mid-span deflection and the sprung mass's displacement at the instants compared [m], shape (2, SAMPLES)."""
    n, newmark = 2 * window.modes + 1, Newmark(crossing.duration / steps)
    dt, padded = newmark.dt, []
    for matrix in window.vertical(0.0)[::2]:
        padded.append(np.zeros((n, n)))
        padded[-1][:-1, :-1] = matrix.toarray()
    base = padded[0], padded[1]
    place = np.zeros((3, n))
    middle = window.shape(np.array([window.length / 2.0]))[0]
    found = []
    u: Reals = np.zeros(n)
    v: Reals = np.zeros(n)
    a: Reals = np.zeros(n)
    for step in range(1, steps + 1):
        at = np.array([crossing.V * step * dt])
        place[0, : window.modes], place[1, : window.modes] = window.shape(at)[0], window.shape_slope(at)[0]
        if isinstance(window, RailWindow):  # the moving mass feels the curvature; it runs on sines
            place[2, : window.modes] = -(window.wave_numbers**2) * place[0, : window.modes]
        M, C, K, load = _coupled(what, crossing, base, *place)
        u = u + dt * v + (0.5 - newmark.beta) * dt**2 * a
        v = v + (1.0 - newmark.gamma) * dt * a
        A = M + newmark.gamma_dt * C + newmark.beta_dt2 * K
        a = np.asarray(np.linalg.solve(A, load - C @ v - K @ u), dtype=np.float64)
        u, v = u + newmark.beta_dt2 * a, v + newmark.gamma_dt * a
        if step % (steps // SAMPLES) == 0:
            found.append((middle @ u[: window.modes], u[-1]))
    return np.array(found).T


def _allowed(crossing: Crossing, steps: int) -> float:
    """Newmark's phase error under a moving force, mode by mode, at mid-span [mm].

    Average acceleration turns omega into omega (1 - (omega dt)^2 / 12): free waves are late by omega^3 dt^2 t / 12
    (out of phase at worst), forced ones too large by (Omega dt)^2 / 12. The factor 1.25 allows for the vehicle's mass.
    """
    k, omega = crossing.wave_numbers(MODES), crossing.frequencies(MODES)
    Omega, dt = k * crossing.V, crossing.duration / steps
    amplitude = 2.0 * crossing.weight / (crossing.m * crossing.length) / (omega**2 - Omega**2)
    late = np.minimum(2.0, omega**3 * dt**2 * crossing.duration / 12.0)
    odd = np.arange(1, MODES + 1) % 2  # even modes have a node at mid-span
    return float(1.25e3 * np.sum(odd * amplitude * (Omega / omega * late + (Omega * dt) ** 2 / 12.0)))


def _exact(what: str) -> Reals:
    """Mid-span deflection, and for a sprung mass its displacement as well [mm]."""
    if what == "rail":
        crossing = _rail_crossing()
        return 1e3 * force_timoshenko(vertical_beam(), crossing, RAIL_SPAN / 2.0, _times(crossing), MODES)
    x, t = BRIDGE.length / 2.0, _times(BRIDGE)
    if what == "force":
        return 1e3 * force_euler(BRIDGE, x, t, MODES)
    if what == "mass":
        return 1e3 * moving_mass(BRIDGE, x, t, MODES)
    return 1e3 * np.concatenate(sprung_mass(DAMPED if what == "damped" else BRIDGE, x, t, MODES))


def _ours(what: str) -> Reals:
    if what == "rail":
        return 1e3 * _march("force", _rail_window(), _rail_crossing(), STEPS)[0]
    sprung = what in ("sprung", "damped")
    crossing = DAMPED if what == "damped" else BRIDGE
    found = 1e3 * _march("sprung" if sprung else what, _bridge_window(), crossing, STEPS)
    return found.ravel() if sprung else found[0]


def _exact_rail() -> Reals:
    """Closed form with as many modes as matter, since splines have no end at the twentieth half wave [mm]."""
    return 1e3 * force_timoshenko(vertical_beam(), _rail_crossing(), RAIL_SPAN / 2.0, _times(_rail_crossing()), MANY)


def _missing() -> float:
    """Static deflection that splines on 20 spans lack under the load at mid-span, where a knot is [mm]."""
    window = SplineWindow.uniform(_rail_window().rail, RAIL_SPAN, RAIL_SPAN / MODES)
    return 1e3 * _rail_crossing().weight * window.missing(BED)


def _rail_by_splines() -> Reals:
    """Mid-span deflection of the rail by splines on knots at one distance [mm]."""
    window = SplineWindow.uniform(_rail_window().rail, RAIL_SPAN, RAIL_SPAN / MODES)
    return 1e3 * _march("force", window, _rail_crossing(), STEPS)[0]


def _order() -> float:
    """Order in the step of the mid-span deflection under the moving force, three modes, 3600 and 7200 steps."""
    window, r = replace(_bridge_window(), modes=3), _bridge_window().rail
    beam = Beam(
        r.E * r.Iy, r.G * r.A, r.mass_per_length, r.rho * r.Iy
    )  # its shear is 1e-6 of the deflection, not negligible here
    exact = force_timoshenko(beam, BRIDGE, BRIDGE.length / 2.0, _times(BRIDGE), 3)
    errors = [np.abs(_march("force", window, BRIDGE, steps)[0] - exact).max() for steps in (3600, 7200)]
    return float(np.log2(errors[0] / errors[1]))


_WHAT = {
    "force": "mid-span deflection under a moving force",
    "mass": "mid-span deflection under a moving mass",
    "sprung": "mid-span deflection and displacement of a moving sprung mass",
    "damped": "the same with a damper of 5 % parallel to the spring",
    "rail": "mid-span deflection of 6 m of CHN60 (shear, rotary inertia) under a force at 350 km/h",
}

CASES = (
    *(
        Case(
            name=f"supported-beam-{what}",
            kind="verification",
            quantity=f"{words} [mm], {SAMPLES} instants, {MODES} modes, {STEPS} steps",
            source=SOURCE,
            reference=lambda what=what: _exact(what),
            atol=_allowed(_rail_crossing() if what == "rail" else BRIDGE, STEPS),
            why="phase error of average acceleration, (omega dt)^2 / 12, mode by mode",
            compute=lambda what=what: _ours(what),
            quick=what in ("force", "sprung", "rail"),
        )
        for what, words in _WHAT.items()
    ),
    Case(
        name="supported-beam-splines-rail",
        kind="verification",
        quantity=f"{_WHAT['rail']} [mm], {SAMPLES} instants, splines on {MODES} spans, {STEPS} steps",
        source=SOURCE,
        reference=_exact_rail,
        atol=_allowed(_rail_crossing(), STEPS) + _missing(),
        why="as with sines, and the static compliance that the splines lack under the load",
        compute=_rail_by_splines,
    ),
    Case(
        name="supported-beam-order",
        kind="verification",
        quantity="order in the step, moving force, three modes, 3600 and 7200 steps",
        source="Newmark 1959: average acceleration is of second order",
        reference=2.0,
        atol=0.05,
        why="the phase error of the third mode, 0.1 rad, is not small",
        compute=_order,
    ),
)
