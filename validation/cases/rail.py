"""Rail window at rest: pinned modes, static deflection over discrete seats; convective terms in motion.

References: frequency equation of the pinned Timoshenko beam (``closed_forms/timoshenko``); an
independent calculation, older than this program, of CHN60 on rigid slabs with springs of 4e7 N/m every
0.63 m under 70 kN in a window of 36 m.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import scipy.linalg

from tiengine.parameters.arrays import Reals
from tiengine.scenario.parts import Parts
from tiengine.scenario.scenario import load_scenario
from tiengine.track.rail import RailWindow
from validation.closed_forms.timoshenko import Beam, pinned_frequencies
from validation.frame.case import Case

__all__ = ["CASES", "vertical_beam"]

LENGTH, PITCH, LOAD, SPRING = 36.0, 0.63, 70e3, 4e7
MODES = (60, 120, 240)
INDEPENDENT = "independent calculation, CHN60, 4e7 N/m every 0.63 m, rigid slab"


@cache
def _parts() -> Parts:
    return load_scenario("paper").parts


def _window(modes: int) -> RailWindow:
    return RailWindow(_parts().rail, LENGTH, modes)


def vertical_beam() -> Beam:
    """CHN60 bending vertically."""
    r = _parts().rail
    return Beam(r.E * r.Iy, r.kappa_vertical * r.G * r.A, r.mass_per_length, r.rho * r.Iy)


def _lateral_beam() -> Beam:
    r = _parts().rail
    return Beam(r.E * r.Iz, r.kappa_lateral * r.G * r.A, r.mass_per_length, r.rho * r.Iz)


def _frequencies(plane: str, modes: int) -> Reals:
    """Sorted frequencies of the window at rest [Hz]; without torsion in the lateral plane."""
    M, _, K = getattr(_window(modes), plane)(0.0)
    omega2 = scipy.linalg.eigvalsh(K.toarray()[: 2 * modes, : 2 * modes], M.toarray()[: 2 * modes, : 2 * modes])
    return np.sqrt(omega2) / (2.0 * np.pi)


def _exact(beam: Beam, modes: int) -> Reals:
    return np.sort(pinned_frequencies(beam, LENGTH, modes).ravel()) / (2.0 * np.pi)


def _highest() -> Reals:
    """Highest of 60 modes in 36 m: vertical, lateral, torsion [Hz]."""
    window = _window(60)
    bending = [_frequencies(plane, 60)[59] for plane in ("vertical", "lateral")]
    torsion = np.sqrt(window.modal_stiffness[-1, 6] / window.modal_masses[4]) / (2.0 * np.pi)
    return np.array([*bending, torsion])


def _deflection(modes: int, over_seat: bool) -> float:
    """Deflection under the load [mm]: over the seat at 17.955 m or between it and the next, at 18.27 m."""
    window = _window(modes)
    K = window.vertical(0.0)[2].toarray()
    shape = window.shape(np.arange(PITCH / 2.0, LENGTH, PITCH))
    K[:modes, :modes] += SPRING * shape.T @ shape
    load = np.zeros(2 * modes)
    load[:modes] = LOAD * window.shape(np.array([17.955 if over_seat else 18.27]))[0]
    return float(1e3 * load @ np.linalg.solve(K, load) / LOAD)


def _convective_power() -> float:
    """Power not accounted for by the convective terms, relative to the power they transfer; three random states."""
    modes, V, worst = 60, 350.0 / 3.6, 0.0
    window = _window(modes)
    ends = np.cos(np.multiply.outer([0.0, LENGTH], window.wave_numbers))
    random = np.random.default_rng(1)
    for plane, masses in (("vertical", window.rail.densities[:2]), ("lateral", window.rail.densities[2:4])):
        C = getattr(window, plane)(V)[1].toarray()[: 2 * modes, : 2 * modes]
        for q in random.standard_normal((3, 2 * modes)):
            rate = ends @ q[modes:]  # of the section's slope at both ends
            through_ends = -V * masses[1] * (rate[1] ** 2 - rate[0] ** 2)
            worst = max(worst, abs(q @ C @ q - through_ends) / (np.abs(q) @ np.abs(C) @ np.abs(q)))
    return worst


CASES = (
    *(
        Case(
            name=f"rail-modes-{plane}",
            kind="verification",
            quantity=f"120 pinned frequencies of the Timoshenko beam, {plane} [Hz], V = 0",
            source="frequency equation of the pinned beam, both branches",
            reference=lambda beam=beam: _exact(beam(), 60),
            rtol=1e-7,
            why="rounding: the spectrum spans 1e5, squared",
            compute=lambda plane=plane: _frequencies(plane, 60),
        )
        for plane, beam in (("vertical", vertical_beam), ("lateral", _lateral_beam))
    ),
    Case(
        name="rail-highest-mode",
        kind="validation",
        quantity="highest of 60 modes in 36 m: vertical, lateral, torsion [Hz]",
        source="independent calculation",
        reference=(1129.0, 549.0, 681.0),
        atol=0.5,
        why="printed digits",
        compute=_highest,
    ),
    *(
        Case(
            name=f"rail-static-{where}",
            kind="validation",
            quantity=f"deflection under 70 kN {words} [mm], 60, 120, 240 modes in 36 m",
            source=INDEPENDENT,
            reference=printed,
            atol=0.5e-5,
            why="printed digits",
            compute=lambda over=where == "seat": [_deflection(n, over) for n in MODES],
        )
        for where, words, printed in (
            ("seat", "over a seat", (0.69702, 0.70551, 0.70745)),
            ("midspan", "between two seats", (0.69778, 0.72013, 0.72637)),
        )
    ),
    Case(
        name="rail-convective-power",
        kind="verification",
        quantity=(
            "power of the convective terms less the flux through the window's ends, relative, random states, 350 km/h"
        ),
        source="q' C q' = -V mu [theta_t^2] at the ends for cosine fields, 0 for sine fields",
        reference=0.0,
        atol=120 * np.finfo(float).eps,
        why="rounding of sums of 120 terms",
        compute=_convective_power,
    ),
)
