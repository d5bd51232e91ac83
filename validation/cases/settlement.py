"""Settled ground: a car body against public numbers, a file against its formula, ground that slides to either side."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tiengine.parameters.arrays import Reals
from tiengine.scenario.scenario import load_scenario
from tiengine.simulation.simulate import run
from validation.frame.case import Case

__all__ = ["CASES"]


def _car_body() -> list[float]:
    """Smallest and largest vertical acceleration of the car body [m/s^2]."""
    with run(load_scenario("settlement")) as result:
        acceleration: Reals = result.body()["acceleration"][:, 0, 1]
    return [float(acceleration.min()), float(acceleration.max())]


def _wheels(*changes: str) -> Reals:
    """Vertical and lateral forces of all wheels over a settlement, shape (2, steps, W, 2)."""
    short = ("train.start=100", "train.distance=80", "output.run_in=0", "output.precision='double'")
    with run(load_scenario("settlement", [*short, *changes])) as result:
        wheel = result.wheel()
    return np.stack([np.asarray(wheel[name], np.float64) for name in ("vertical_force", "lateral_force")])


def _file_against_formula() -> float:
    """Largest difference of vertical forces over the settlement from rows of 0.5 m and from its formula [N]."""
    x = np.arange(120.0, 180.01, 0.5)
    z = np.where(np.abs(x - 150.0) < 10.0, 7.5 * (1.0 + np.cos(np.pi * (x - 150.0) / 10.0)), 0.0)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "levels.csv"
        np.savetxt(path, np.stack([x, z], axis=1), delimiter=",", header="x [m], vertical [mm]", comments="")
        read = _wheels(f"track.ground=[{{kind='file', file='{path}'}}]")
    return float(np.abs(read - _wheels())[0].max())


def _mirrored() -> float:
    """Sum of lateral forces of opposite wheels over ground that slides to either side, over the largest force."""
    right, left = (
        _wheels(f"track.ground=[{{kind='cosine', at=150, length=20, lateral={side}}}]")[1] for side in (0.005, -0.005)
    )
    return float(np.abs(right + left[..., ::-1]).max() / np.abs(right).max())


CASES = (
    Case(
        name="settlement-car-body",
        kind="validation",
        quantity="vertical acceleration of the car body over 15 mm in 20 m at 250 km/h, smallest and largest [m/s^2]",
        source="independent model of ten degrees of freedom",
        reference=(-0.308, 0.267),
        rtol=0.03,
        why="that model is plane and its rails follow the ground; three digits are given",
        compute=_car_body,
    ),
    Case(
        name="settlement-file",
        kind="verification",
        quantity="vertical wheel forces over a settlement of 15 mm from rows of 0.5 m, against its formula [N]",
        source="cosine over 20 m: a spline through its points",
        reference=0.0,
        rule="at most",
        atol=30.0,
        why="the cosine's curvature jumps at its ends by 0.74 mm/m^2, which the spline rounds off over 0.5 m",
        compute=_file_against_formula,
    ),
    Case(
        name="settlement-mirrored-slide",
        kind="verification",
        quantity="lateral forces of opposite wheels over ground that slides 5 mm to either side, their sum [-]",
        source="symmetry",
        reference=0.0,
        rule="at most",
        atol=1e-3,
        why="contact solved to a tolerance",
        compute=_mirrored,
    ),
)
