"""Indices in curves: zones of a line, quasi-static values, Nadal's limit, wear number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tiengine.indices import curves, en14363
from tiengine.indices.ride import FloorPoint, Ride, Times
from tiengine.indices.zones import ZONES, stretches
from tiengine.parameters.arrays import Reals
from tiengine.parameters.input_files import to_tuples
from tiengine.parameters.quantity import build
from tiengine.scenario.tables import Track
from tiengine.track.alignment import Alignment
from tiengine.vehicle.connector import VehicleClass

SPEED, STATIC = 20.0, 60e3
ELEMENTS = (
    {"kind": "straight", "length": 300.0},
    {"kind": "transition", "length": 60.0},
    {"kind": "arc", "length": 200.0, "radius": -350.0, "cant_mm": -100.0},
    {"kind": "transition", "length": 40.0},
    {"kind": "arc", "length": 150.0, "radius": -500.0, "cant_mm": -60.0},
    {"kind": "transition", "length": 80.0},
    {"kind": "straight", "length": 400.0},
)


def line() -> Alignment:
    """Straight, two curves to the left, straight."""
    found = build(Track, to_tuples({"alignment": list(ELEMENTS)}), "track").line
    assert found is not None
    return found


class GivenRide(Ride):
    """One wheelset whose forces follow the curvature; every number can be told by hand."""

    body_times = None
    speed = SPEED
    where = "given"
    flange_angle = np.radians(70.0)

    def __init__(self, noise: float = 0.0) -> None:
        self.line = line()
        self.x = np.arange(0.0, 1200.0, 0.05)
        self.wheel_times = Times(self.x, 0.05 / SPEED, 0.0)
        self.noise = noise

    @property
    def vehicle_classes(self) -> tuple[VehicleClass | None, ...]:
        return ("coach",)

    def wheelsets(self, vehicle: int) -> list[int]:
        return [0]

    def floor(self, vehicle: int) -> list[FloorPoint]:
        return []

    def raw_forces(self, wheelset: int) -> tuple[Reals, Reals, Reals]:
        """Y of the right, outer, wheel 7e6 N m times the curvature to the left; Q moves outward by a tenth of it."""
        assert self.line is not None
        bend = -self.line.lines[0](self.x)
        wave = self.noise * np.sin(2.0 * np.pi * self.x / 1.0)  # 20 Hz: halved by the low pass
        Y = np.stack([-1e3 + 0.0 * bend, 7e6 * bend + wave], axis=1)
        Q = STATIC + np.stack([-7e5 * bend, 7e5 * bend], axis=1)
        return Y, Q, np.full(2, STATIC)

    def wear_number(self, wheelset: int) -> tuple[Reals, Reals] | None:
        assert self.line is not None
        curved = np.abs(self.line.lines[0](self.x))
        return self.x, np.stack([0.0 * curved, 52.5e3 * curved], axis=1)


def test_stretches_have_one_radius_and_leave_rounded_ends_out():
    found = list(stretches(line(), 0.0, 1200.0))
    assert [s.zone.number for s in found] == [1, 4, 3, 1]
    assert [(s.begin, s.end) for s in found] == [(0.0, 295.0), (365.0, 555.0), (605.0, 745.0), (835.0, 1200.0)]
    assert [s.outer for s in found[1:3]] == [1, 1]  # in a curve to the left the right wheel


@pytest.mark.parametrize(
    ("zone", "kmh", "length"), [(2, 140, 100), (2, 141, 250), (2, 221, 500), (3, 80, 100), (4, 80, 70)]
)
def test_sections_have_the_length_of_zone_and_speed(zone: int, kmh: float, length: float):
    assert ZONES[zone - 1].section(kmh / 3.6) == length


def values(ride: Ride) -> dict[tuple[str, str], Any]:
    """Indices by standard and name."""
    return {(i.standard, i.name): i for i in curves.wheel_indices(ride, 0)}


def test_quasi_static_values_are_those_of_the_arc():
    found = values(GivenRide())
    for number, name, radius in ((4, ZONES[3].name, 350.0), (3, ZONES[2].name, 500.0)):
        of_zone = {key[1]: i for key, i in found.items() if key[0] == f"EN 14363:2016, zone {number}: {name}"}
        bend = 1.0 / radius
        Q = STATIC + 7e5 * bend
        assert of_zone["quasi-static Y of the outer wheel"].value == pytest.approx(7e3 * bend, rel=1e-4)
        assert of_zone["quasi-static Q of the outer wheel"].value == pytest.approx(1e-3 * Q, rel=1e-6)
        assert of_zone["Y/Q of the outer wheel, 2 m mean"].value == pytest.approx(7e6 * bend / Q, rel=1e-3)
        assert of_zone["sum of Y, 2 m mean"].value == pytest.approx(7e3 * bend - 1.0, rel=1e-3)
        unloading = of_zone["quasi-static unloading of the inner wheel"].value
        assert unloading == pytest.approx(7e5 * bend / STATIC, rel=1e-4)
    roll = np.arcsin(0.1 / 1.5)
    deficiency = 1.5e3 / 9.81 * (SPEED**2 / 350.0 * np.cos(roll) - 9.81 * np.sin(roll))
    assert of_zone_value(found, 4, "cant deficiency") == pytest.approx(deficiency, rel=1e-9)
    assert all(i.shortfall for i in found.values())  # two curves are no assessment


def of_zone_value(found: dict[tuple[str, str], Any], number: int, name: str) -> float:
    return next(float(i.value) for key, i in found.items() if f"zone {number}:" in key[0] and key[1] == name)


def test_gb5599_is_given_by_zone_as_well():
    found = values(GivenRide())
    index = found["GB/T 5599-2019, curves of 250 to 400 m", "derailment coefficient"]
    assert index.value == pytest.approx(7e6 / 350.0 / (STATIC + 7e5 / 350.0), rel=1e-3)
    assert index.place == "wheelset 1 right"


def test_straight_track_is_judged_without_the_curves():
    """The largest Y on the straight is the 1 kN of the left wheel, in curves 20 kN."""
    index = next(i for i in en14363.wheel_indices(GivenRide(), 0) if i.name == "Y/Q, 2 m mean")
    assert index.value == pytest.approx(1e3 / STATIC, rel=1e-2)


def test_nadals_limit():
    """Nadal 1896: 70 degrees with 0.3 and 0.5."""
    assert curves.nadal_limit(np.radians(70.0), 0.3) == pytest.approx(1.34164, abs=1e-5)
    assert curves.nadal_limit(np.radians(70.0), 0.5) == pytest.approx(0.94681, abs=1e-5)
    index = values(GivenRide())["Nadal", "largest Y/Q, 2 m mean"]
    assert (index.place, index.verdict) == ("wheelset 1 right", "within")


def test_the_wear_number_has_british_rails_regimes():
    index = values(GivenRide())["wear", "wear number T gamma, mean in curves"]
    mean = (190.0 * 52.5e3 / 350.0 + 140.0 * 52.5e3 / 500.0) / 330.0  # both arcs by their lengths
    assert index.value == pytest.approx(mean, rel=1e-3)
    assert [curves.wear_regime(x) for x in (99.0, 150.0, 250.0)] == ["mild", "severe", "catastrophic"]


def test_a_straight_line_has_no_indices_of_curves():
    ride = GivenRide()
    ride.line = None
    assert not list(curves.wheel_indices(ride, 0))


class MixedRide(GivenRide):
    """The right wheel has a steep flange, the left one, which carries less, a flat one."""

    def flange_angle_of(self, wheelset: int, side: int) -> float | None:
        return float(np.radians((20.0, 70.0)[side]))


def test_nadals_limit_is_that_of_the_wheel_nearest_to_it():
    """Left Y is -1 kN throughout: only its own limit, 0.06 at 20 degrees and friction 0.3, decides for it."""
    (index,) = [each for each in curves.wheel_indices(MixedRide(), 0) if each.standard == "Nadal"]
    steep, flat = (curves.nadal_limit(np.radians(angle), 0.3) for angle in (70.0, 20.0))
    assert index.place in ("wheelset 1 left", "wheelset 1 right")
    assert index.limit == pytest.approx(steep if index.place.endswith("right") else flat)
    (alike,) = [each for each in curves.wheel_indices(GivenRide(), 0) if each.standard == "Nadal"]
    gaps = {"wheelset 1 right": alike.value - steep, "wheelset 1 left": 1e3 / STATIC - flat}
    assert index.place == max(gaps, key=lambda place: gaps[place])
    assert index.value - index.limit == pytest.approx(max(gaps.values()), rel=0.1)
