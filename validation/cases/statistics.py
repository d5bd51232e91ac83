"""Wheel forces on rough track: growth with speed and with the class of the track.

References: order of the classes by their densities; A_v of the German spectra (the standard deviation of a linear
system is proportional to its root). All runs have the same realisation; standard deviations leave out the first 50 m.
"""

from __future__ import annotations

import numpy as np

from validation.frame.case import Case
from validation.frame.runs import simulate

__all__ = ["CASES"]

RUN_IN, WAY = 50.0, 200.0  # m
SPEEDS = (200, 250, 300, 350)  # km/h


def _deviation(kmh: float, spectrum: str, force: str = "vertical") -> float:
    """Standard deviation of all wheels' forces [kN]."""
    changes = (f"train.speed_kmh={kmh}", f'irregularity.spectrum="{spectrum}"', f"train.distance={WAY}")
    found = simulate("default", *changes)
    late = found.position > found.position[0] + RUN_IN
    return float(1e-3 * getattr(found, force)[late].std(axis=0).mean())


def _growth(force: str, speeds: tuple[int, ...], quick: bool) -> Case:
    listed = ", ".join(map(str, speeds[1:]))
    return Case(
        name=f"statistics-speed-{force}" + ("-quick" if quick else ""),
        kind="verification",
        quantity=f"standard deviation of the {force} wheel forces at {listed} km/h, German low [kN]",
        source=f"at {', '.join(map(str, speeds[:-1]))} km/h on the same track",
        reference=lambda: [_deviation(kmh, "german_low", force) for kmh in speeds[:-1]],
        rule="at least",
        why="a bound: the same waves are passed faster, S_F over frequency rises with V up to P2",
        compute=lambda: [_deviation(kmh, "german_low", force) for kmh in speeds[1:]],
        quick=quick,
    )


def _order(name: str, kmh: float, spectra: tuple[str, ...], force: str = "vertical") -> Case:
    return Case(
        name=f"statistics-class-{name}-{force}",
        kind="verification",
        quantity=f"standard deviation of the {force} wheel forces at {kmh:g} km/h: {', '.join(spectra[1:])} [kN]",
        source=f"that of {', '.join(spectra[:-1])}",
        reference=lambda: [_deviation(kmh, spectrum, force) for spectrum in spectra[:-1]],
        rule="at least",
        why="a bound: rougher classes of track",
        compute=lambda: [_deviation(kmh, spectrum, force) for spectrum in spectra[1:]],
        quick=False,
    )


CASES = (
    _growth("vertical", (SPEEDS[0], SPEEDS[-1]), quick=True),
    _growth("vertical", SPEEDS, quick=False),
    _growth("lateral", SPEEDS, quick=False),
    *(_order("German", 200.0, ("china_ballastless", "german_low", "german_high"), f) for f in ("vertical", "lateral")),
    *(_order("FRA", 120.0, ("fra_6", "fra_5", "fra_4"), force) for force in ("vertical", "lateral")),
    Case(
        name="statistics-German-ratio",
        kind="verification",
        quantity="standard deviation of the vertical wheel forces at 200 km/h, German high over German low",
        source="root of the ratio of A_v, 1.08e-6 over 4.032e-7, also that of the cross level",
        reference=float(np.sqrt(1.08e-6 / 4.032e-7)),
        rtol=0.03,
        why=(
            "linear except for the Hertz spring (8 % of the compliance, a third power of the load) and the lateral"
            " motion"
        ),
        compute=lambda: _deviation(200.0, "german_high") / _deviation(200.0, "german_low"),
        quick=False,
    ),
)
