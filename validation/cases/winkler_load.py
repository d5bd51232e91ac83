"""A constant load on a continuous foundation, Euler and Timoshenko, damped and undamped: window against infinite beam.

References: ``closed_forms/winkler`` (Kenney 1954; Fryba 1999, ch. 13) for the Euler beam, ``closed_forms/timoshenko``
for the other. The rail is CHN60; for the Euler beam its shear modulus is 1e5 times and its density 1e-6 times the true
one (the mass per length stays), which removes shear and rotary inertia. Foundation: the paper's fastenings, smeared.
Signs: down positive, places ahead of the load positive.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from threadpoolctl import threadpool_limits

from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.track.rail import Rail, RailWindow
from validation.closed_forms.timoshenko import Beam, moving_load_deflection, static_missing_share
from validation.closed_forms.winkler import damped_deflection, undamped_deflection
from validation.frame.case import Case

__all__ = ["CASES"]

LENGTH, LOAD, MODES = 36.0, 70e3, 240
K, C = 4e7 / 0.63, 5e4 / 0.63  # the paper's fastening, smeared
PLACES = np.array([-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0])  # m ahead of the load
SPEEDS = {"350": 350.0 / 3.6, "fast": 300.0}  # m/s; the latter: 0.14 of the stiffness is lost to m V^2
STIFF, LIGHT = 1e5, 1e-6


@cache
def _rail(euler: bool) -> Rail:
    rail = load_scenario("paper").parts.rail
    return rail.model_copy(update={"G": STIFF * rail.G, "rho": LIGHT * rail.rho}) if euler else rail


def _beam(euler: bool) -> Beam:
    r = _rail(euler)
    return Beam(r.E * r.Iy, r.kappa_vertical * r.G * r.A, r.mass_per_length, r.rho * r.Iy)


@cache
def _flow() -> Reals:
    """Int W_i W_j' over the window, shape (MODES, MODES); the same for both rails."""
    window = RailWindow(_rail(True), LENGTH, MODES)
    with threadpool_limits(1):
        x, weight = np.polynomial.legendre.leggauss(2 * MODES + 40)
        s = 0.5 * LENGTH * (x + 1.0)
        flow: Reals = window.shape(s).T @ (0.5 * LENGTH * weight[:, None] * window.shape_slope(s))
    return flow


def _window(euler: bool, V: float, c: float) -> Reals:
    """Deflection of the window around a steady load at its middle [mm]: d/dt = 0 in the moving frame."""
    window = RailWindow(_rail(euler), LENGTH, MODES)
    A = window.vertical(V)[2].toarray()
    # Galerkin on k w - c V w', with int W_i W_j' by quadrature, independent of the engine's closed form
    A[:MODES, :MODES] += 0.5 * LENGTH * K * np.eye(MODES) - c * V * _flow()
    load = np.zeros(2 * MODES)
    load[:MODES] = LOAD * window.shape(np.array([LENGTH / 2.0]))[0]
    with threadpool_limits(1):
        q = np.linalg.solve(A, load)
    return 1e3 * window.shape(LENGTH / 2.0 + PLACES) @ q[:MODES]


def _exact(euler: bool, V: float, c: float) -> Reals:
    """Deflection of the infinite beam [mm]."""
    beam = _beam(euler)
    if not euler:
        return 1e3 * moving_load_deflection(beam, K, c, V, LOAD, PLACES)
    if c > 0.0:
        return 1e3 * damped_deflection(beam.EI, beam.m, K, c, V, LOAD, PLACES)
    return 1e3 * undamped_deflection(beam.EI, beam.m, K, V, LOAD, PLACES)


def _allowed(euler: bool, V: float) -> float:
    """1.1 times the deflection of the omitted modes under the load, with the softening by m V^2 [mm].

    It bounds the error everywhere, which is less away from the load. The Euler beam keeps 1e-5 of the shear compliance
    of every wave.
    """
    beam = _beam(euler)
    moving = Beam(beam.EI - beam.rho_I * V**2, beam.kGA - beam.m * V**2, beam.m, beam.rho_I)
    return 1.1e3 * LOAD * static_missing_share(moving, LENGTH, MODES)


CASES = tuple(
    Case(
        name=f"winkler-{'euler' if euler else 'timoshenko'}-{'damped' if c else 'undamped'}-{name}",
        kind="verification",
        quantity=f"deflection at nine places around 70 kN at {3.6 * V:.0f} km/h [mm], {MODES} modes in 36 m",
        source="Kenney 1954; Fryba 1999, ch. 13" if euler else "infinite Timoshenko beam, residues",
        reference=lambda euler=euler, V=V, c=c: _exact(euler, V, c),
        atol=_allowed(euler, V),
        why="1.1 times the compliance of the omitted modes at this speed",
        compute=lambda euler=euler, V=V, c=c: _window(euler, V, c),
    )
    for euler in (True, False)
    for c in (0.0, C)
    for name, V in SPEEDS.items()
)
