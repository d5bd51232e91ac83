"""Car body over settled ground, against public numbers of an independent model with ten degrees of freedom."""

from __future__ import annotations

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
)
