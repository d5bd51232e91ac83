"""Klingel's wavelength: conical wheels after a single disturbance, free or held square in a rigid bogie, at 30 km/h.

References: ``closed_forms/klingel``. A car on two wheelsets 2.5 m apart carries 12 t a wheelset; vertical springs of
1e6 N/m connect them, and at the axles' height longitudinal and lateral springs of 1 N/m (each wheelset runs
independently) or 1e9 N/m (a rigid bogie). Wheels are cones of 1:40 or 1:20, railheads round with 300 mm, inclined 1:40,
friction 1 so that spin creep does not saturate.

Effects on the wavelength. Inertia (V^2 m/(2 f22) times the wave number k = 2 pi/L: 0.002 at 30 km/h), the stiffness of
the contact angles (2 N delta/(b 2 f22 k): 0.001), spin (f23 k/f11: 0.001) and, in the bogie, the rails' compliance
(f22 k over their lateral stiffness of about 2.5e7 N/m: 0.07) enter as odd powers of k: they damp or excite the wave,
and change its length by their squares, less than 1e-4 (rails: 2e-3). For the free wheelset there remain terms of
second order in the cone's slope delta, since the contact's kinematics are of first order in the angles: tolerance
delta^2. In the bogie creep is not zero. With the roll phi = -delta y/b the lateral slip is that of the contacts, y' (1
+ r delta/b), and its force has the same lever: f22 grows by up to 2 r delta/b, less the effect of spin as the loads of
left and right change (f23 delta/(N b)); saturation lowers f22 against f11 by (spin 0.8 delta + creep 0.01)/3. The
wavelength takes half of the share a^2 f22/(b^2 f11 + a^2 f22) = 0.71 of the largest of them, r delta/b.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from tiengine.contact.table import WheelRailPair
from tiengine.model.from_scenario import ingredients
from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import Scenario, load_scenario
from tiengine.simulation.simulate import run
from validation.closed_forms.klingel import free_wheelset, rigid_bogie, track_conicity
from validation.frame.case import Case

__all__ = ["CASES", "cone", "fit_wave", "round_head", "wagon", "write_kick"]

KMH, HALF_WHEELBASE, AXLE, HEAD_RADIUS, CORNER = 30.0, 1.25, 0.43, 0.3, 0.013
FREE, SQUARE = 1.0, 1e9  # N/m
SLOPES, WAVES = (0.025, 0.05), 2.0
KICK, KICK_START, KICK_LENGTH = 2e-3, 16.0, 8.0  # m


def _text(y: Reals, z: Reals) -> str:
    return "\n".join(f"{1e3 * a:.9f} {1e3 * b:.9f}" for a, b in zip(y, z, strict=True))


def round_head() -> dict[str, Any]:
    """Rail: an arc of 300 mm over 60 mm, corners of 13 mm, sides at 2 degrees."""
    edge = np.arcsin(0.03 / HEAD_RADIUS)
    crown = np.linspace(0.0, edge, 121)
    corner = np.linspace(edge, np.radians(88.0), 81)[1:]
    down = np.linspace(0.5e-3, 10e-3, 20)
    low = HEAD_RADIUS * (1.0 - np.cos(edge))
    y_corner = 0.03 + CORNER * (np.sin(corner) - np.sin(edge))
    z_corner = low + CORNER * (np.cos(edge) - np.cos(corner))
    y = np.concatenate([HEAD_RADIUS * np.sin(crown), y_corner, y_corner[-1] + down * np.tan(np.radians(2.0))])
    z = np.concatenate([HEAD_RADIUS * (1.0 - np.cos(crown)), z_corner, z_corner[-1] + down])
    return {"name": "R300", "points": _text(np.append(-y[:0:-1], y), np.append(z[:0:-1], z))}


def cone(slope: float) -> dict[str, Any]:
    """Wheel: a cone of a slope, without a flange."""
    y = np.linspace(-0.07, 0.07, 281)
    return {"name": "cone", "points": _text(y, -slope * y)}


def wagon(guidance: float) -> dict[str, Any]:
    """A car on two wheelsets; the guidance [N/m] is that of an axle box, longitudinally and laterally."""
    axles = ((f"wheelset {i + 1}", sign * HALF_WHEELBASE) for i, sign in enumerate((1.0, -1.0)))
    body = [{"name": "car", "mass": 20e3, "Jx": 2e4, "Jy": 2e4, "Jz": 2e4, "height": AXLE}]
    inertia = {"mass": 1850.0, "Jx": 967.0, "Jy": 123.0, "Jz": 967.0, "height": AXLE, "wheelset": True}
    spring = []
    for name, x in axles:
        body.append({"name": name, "x": x, **inertia})
        for y in (-1.0, 1.0):
            ends = {"a": "car", "b": name, "point_a": (x, y, AXLE), "point_b": (x, y, AXLE)}
            spring.append({**ends, "kx": guidance, "ky": guidance, "kz": 1e6, "cz": 3e4})
    size = {"wheel_radius": AXLE, "half_span_contact": 0.7465, "length_over_couplers": 6.0}
    return {"name": "wagon", **size, "body": tuple(body), "spring": tuple(spring)}


def _scenario(slope: float, guidance: float, distance: float, kick: Path | None) -> Scenario:
    return load_scenario(
        {
            "name": "klingel",
            "train": {
                "vehicles": (wagon(guidance),),
                "wheel_profile": cone(slope),
                "speed_kmh": KMH,
                "distance": distance,
            },
            "track": {"rail_profile": round_head(), "friction": 1.0},
            "irregularity": {"file": str(kick), "taper": 1.0} if kick else {"spectrum": "none"},
            "numerics": {"time_step": 1e-3, "passes": 4},
            "output": {"precision": "double", "body_interval": 1e-2},
        }
    )


@dataclass(frozen=True)
class Wave:
    """Wavelengths of a run and of the closed form.

    Attributes:
        measured: Wavelength of wheelset 1 [m].
        exact: Klingel's [m].
    """

    measured: float
    exact: float


@cache
def wave(slope: float, guidance: float) -> Wave:
    """Run cones of a slope with a guidance [N/m] and measure their wavelength."""
    kicked = KICK_START + KICK_LENGTH + 2.0 * HALF_WHEELBASE
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "kick.csv"
        write_kick(file, KICK_START, KICK_LENGTH, KICK)
        exact = _exact(slope, guidance)
        with run(_scenario(slope, guidance, kicked + WAVES * exact, file)) as result:
            body = result.body()
    y = body["displacement"][:, list(body["body"]).index("wheelset 1"), 0]
    x = body["position"]
    free = x > x[0] + kicked
    found = fit_wave(x[free] - x[free][0], y[free], 2j * np.pi / exact)
    return Wave(2.0 * np.pi / found.imag, exact)


def _exact(slope: float, guidance: float) -> float:
    """Klingel's wavelength at the contacts' position, and Kalker's ratio of creep coefficients at the static load."""
    scenario = _scenario(slope, guidance, 100.0, None)
    table = ingredients(scenario, 1e-3).contact
    at = WheelRailPair(scenario.parts.wheel, scenario.parts.rail_profile, table.settings).contacts(0.0, 0.0)
    b = table.settings.half_spacing + float(at.s_w.item())
    r = table.settings.wheel_radius + float(at.dz_w.item())
    conicity = track_conicity(slope, b, HEAD_RADIUS)
    if guidance == FREE:
        return free_wheelset(conicity, r, b)
    centre = dict(zip(table.COLUMNS, table.lookup(0.0, 0.0), strict=True))
    return rigid_bogie(conicity, r, b, HALF_WHEELBASE, float(centre["c22"] / centre["c11"]))


def fit_wave(x: Reals, y: Reals, guess: complex) -> complex:
    """Fit exp(g x) (A cos kx + B sin kx) + C + D x by least squares.

    Args:
        x: Distance or time, shape (n,).
        y: Motion, shape (n,).
        guess: g + i k to start from, per unit of x.

    Returns:
        g + i k.
    """

    def terms(p: Reals) -> Reals:
        grown = np.exp(p[0] * (x - x[-1]))
        return np.stack([grown * np.cos(p[1] * x), grown * np.sin(p[1] * x), np.ones_like(x), x], axis=1)

    def misfit(p: Reals) -> Reals:
        A = terms(p)
        left: Reals = (A @ np.linalg.lstsq(A, y, rcond=None)[0] - y) / np.abs(y).max()
        return left

    scale = abs(guess.imag)
    found = least_squares(misfit, [guess.real, guess.imag], x_scale=[0.1 * scale, 0.3 * scale])
    return complex(found.x[0], found.x[1])


def write_kick(file: Path, start: float, length: float, height: float) -> None:
    """Write a measured series with one bump of the alignment, height sin^2, points every 0.5 m [m]."""
    x = np.arange(0.0, length + 0.25, 0.5)
    rows = zip(start + x, height * np.sin(np.pi * x / length) ** 2, strict=True)
    file.write_text("x,y_a\n" + "".join(f"{a},{b}\n" for a, b in rows), encoding="utf-8")


def _case(slope: float, guidance: float) -> Case:
    free, ratio = guidance == FREE, f"1:{1.0 / slope:.0f}"
    return Case(
        name=f"klingel-{'free' if free else 'bogie'}-{1.0 / slope:.0f}",
        kind="verification",
        quantity=f"wavelength of {'a free wheelset' if free else 'a rigid bogie'}, cones {ratio}, 30 km/h [m]",
        source="Klingel 1883" + ("" if free else "; with Kalker's f22/f11") + "; roll of the axle after Wickens 2003",
        reference=lambda: wave(slope, guidance).exact,
        rtol=slope**2 if free else 0.71 * 0.43 * slope / 0.75,
        why="second order in the slope of the cone" if free else "lateral slip and its lever: 0.71 r delta/b",
        compute=lambda: wave(slope, guidance).measured,
        quick=free and slope == SLOPES[-1],
    )


CASES = tuple(_case(slope, guidance) for slope in SLOPES for guidance in (FREE, SQUARE))
