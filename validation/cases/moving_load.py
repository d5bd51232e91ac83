"""A constant load at 350 km/h on a continuous foundation: the window against the infinite beam.

References: closed form by residues (``closed_forms/timoshenko``); see L. Fryba, Vibration of solids and
structures under moving loads (3rd ed., 1999), ch. 13, for the method.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.track.rail import RailWindow
from validation.cases.rail import vertical_beam
from validation.closed_forms.timoshenko import moving_load_deflection, static_missing_share
from validation.frame.case import Case
from validation.frame.spline_window import SplineWindow

LENGTH, V, LOAD = 36.0, 350.0 / 3.6, 70e3
K, C = 4e7 / 0.63, 5e4 / 0.63  # the paper's fastening, smeared
PLACES = np.array([-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0])  # m ahead of the load
SOURCE = "infinite Timoshenko beam, residues of its Fourier transform"


@cache
def _window(modes: int) -> Reals:
    """Deflection of the window around a steady load at its middle [mm]: d/dt = 0 in the moving frame."""
    window = RailWindow(load_scenario("paper").parts.rail, LENGTH, modes)
    A = window.vertical(V)[2].toarray()
    # Galerkin on k w - c V w', with int W_i W_j' by quadrature, independent of the engine's closed form
    x, weight = np.polynomial.legendre.leggauss(2 * modes + 40)
    s = 0.5 * LENGTH * (x + 1.0)
    flow = window.shape(s).T @ (0.5 * LENGTH * weight[:, None] * window.shape_slope(s))
    A[:modes, :modes] += 0.5 * LENGTH * K * np.eye(modes) - C * V * flow
    load = np.zeros(2 * modes)
    load[:modes] = LOAD * window.shape(np.array([LENGTH / 2.0]))[0]
    q = np.linalg.solve(A, load)
    return 1e3 * window.shape(LENGTH / 2.0 + PLACES) @ q[:modes]


@cache
def _splines(refinement: float) -> tuple[Reals, float]:
    """The same by splines; and the static deflection that they lack under the load, as the engine has it [mm]."""
    window = SplineWindow.graded(load_scenario("paper").parts.rail, LENGTH, refinement)
    n = window.modes
    A = window.vertical(V)[2].toarray()
    A[:n, :n] += K * window.values - C * V * window.flow
    load = np.zeros(2 * n)
    load[:n] = LOAD * window.shape(np.array([LENGTH / 2.0]))[0]
    q = np.linalg.solve(A, load)
    return 1e3 * window.shape(LENGTH / 2.0 + PLACES) @ q[:n], 1e3 * LOAD * window.missing(K)


def _corrected(refinement: float) -> Reals:
    """Deflection by splines [mm]; under the load with what they lack there."""
    found, missing = _splines(refinement)
    return found + missing * (PLACES == 0.0)


@cache
def _exact() -> Reals:
    return 1e3 * moving_load_deflection(vertical_beam(), K, C, V, LOAD, PLACES)


def _missing(modes: int) -> float:
    """Deflection of the omitted modes under the load [mm]."""
    return 1e3 * LOAD * static_missing_share(vertical_beam(), LENGTH, modes)


def _error(modes: int) -> float:
    """Error under the load, where the series of a kink converges slowest [um]."""
    return float(1e3 * (_exact()[4] - _window(modes)[4]))


CASES = (
    *(
        Case(
            name=f"moving-load-{modes}",
            kind="verification",
            quantity=f"deflection at nine places around 70 kN at 350 km/h [mm], {modes} modes in 36 m",
            source=SOURCE,
            reference=_exact,
            atol=lambda_atol,
            why="1.1 times the static compliance of the omitted modes",
            compute=lambda modes=modes: _window(modes),
        )
        for modes, lambda_atol in ((modes, 1.1 * _missing(modes)) for modes in (60, 120, 240, 480))
    ),
    *(
        Case(
            name=f"moving-load-splines-{refinement:g}",
            kind="verification",
            quantity="deflection at nine places around 70 kN at 350 km/h [mm], splines, knots from"
            f" {0.15 / refinement:g} m, under the load with what they lack there",
            source=SOURCE,
            reference=_exact,
            rtol=tolerance,
            atol=1e-4,
            why=why,
            compute=lambda refinement=refinement: _corrected(refinement),
        )
        for refinement, tolerance, why in (
            (1.0, 1e-3, "required bound: a fifth of the default's; 0.1 um beside it where the rail is at rest"),
            (2.0, 2.5e-4, "a quarter of the default's bound"),
        )
    ),
    Case(
        name="moving-load-convergence",
        kind="convergence",
        quantity="missing deflection under the load with 120, 240, 480 modes [um]",
        source=("static compliance of the omitted modes: 2/l times the sum of 1/(kGA k^2) + 1/(EI k^4), of order 1/N"),
        reference=lambda: [1e3 * _missing(modes) for modes in (120, 240, 480)],
        rtol=0.01,
        why="the foundation's share in modes beyond 120: k / (kGA k_i^2) < 1 %",
        compute=lambda: [_error(modes) for modes in (120, 240, 480)],
    ),
)
