"""Car bodies and running gears of vehicles of all kinds."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest

from tiengine.cli.reading import CLASSES
from tiengine.vehicle.connector import VehicleClass
from tiengine.vehicle.running_gear import cars, running_gears
from tiengine.vehicle.vehicle import Vehicle, load_vehicle, vehicle_from_table, vehicle_names

DATA = Path(__file__).parents[1] / "data" / "vehicles"
INERTIA = {"Jx": 1e4, "Jy": 1e5, "Jz": 1e5}


def body(name: str, mass: float, x: float, **more: object) -> dict:
    return {"name": name, "mass": mass, "x": x, "height": 1.0, **INERTIA, **more}


def spring(a: str, b: str, x: float) -> dict:
    bending = dict.fromkeys(("k_roll", "k_pitch", "k_yaw"), 1e6)
    return {
        "a": a,
        "b": b,
        "point_a": (x, 0.0, 1.0),
        "point_b": (x, 0.0, 1.0),
        "kx": 1e7,
        "ky": 1e6,
        "kz": 1e6,
        **bending,
    }


def vehicle(bodies: list[dict], springs: list[dict]) -> Vehicle:
    frame = {"name": "made", "wheel_radius": 0.46, "half_span_contact": 0.75, "length_over_couplers": 40.0}
    return vehicle_from_table({**frame, "body": bodies, "spring": springs})


def articulated() -> Vehicle:
    """Two cars of 22 m that share the middle one of three bogies; a transformer hangs below the rear one."""
    bogies = {"f1": 19.0, "f2": 0.0, "f3": -19.0}
    bodies = [body("front car", 26e3, 9.5), body("rear car", 22e3, -9.5), body("transformer", 9e3, -9.5)]
    springs = [spring("front car", "f1", 19.0), spring("front car", "f2", 0.3), spring("rear car", "f2", -0.3)]
    springs += [spring("rear car", "f3", -19.0), spring("rear car", "transformer", -8.0)]
    springs += [spring("front car", "rear car", 0.0)]
    for frame, x in bogies.items():
        bodies.append(body(frame, 3e3, x))
        for i, axle in enumerate((x + 1.25, x - 1.25)):
            bodies.append(body(f"{frame} {i}", 1500.0, axle, wheelset=True))
            springs.append(spring(frame, f"{frame} {i}", axle))
    return vehicle(bodies, springs)


@pytest.mark.parametrize("name", vehicle_names())
def test_coaches_have_one_car_on_two_bogies(name):
    """The heaviest body, over the means of the axles of either half, as indices always took them."""
    coach = load_vehicle(name)
    (car,) = cars(coach)
    axles = coach.axle_positions
    assert car.body.name == "car"
    assert [gear.centre for gear in car.gears] == pytest.approx([axles[:2].mean(), axles[2:].mean()])
    assert car.middle == pytest.approx(0.0)


def test_cars_that_share_a_bogie():
    """Three bogies; both cars rest on the middle one, each has its own middle, the transformer is no car."""
    front, rear = cars(articulated())
    assert (front.body.name, rear.body.name) == ("front car", "rear car")
    assert [gear.centre for gear in front.gears] == pytest.approx([19.0, 0.0])
    assert [gear.centre for gear in rear.gears] == pytest.approx([0.0, -19.0])
    assert (front.middle, rear.middle) == pytest.approx((9.5, -9.5))


def test_two_axle_wagon():
    """Wheelsets below the car are running gears of their own."""
    bodies = [body("car", 30e3, 0.0), *(body(f"w{x}", 1200.0, x, wheelset=True) for x in (4.0, -4.0))]
    (car,) = cars(vehicle(bodies, [spring("car", f"w{x}", x) for x in (4.0, -4.0)]))
    assert [gear.axles for gear in car.gears] == [(4.0,), (-4.0,)]


def test_classes_of_the_command_line():
    """Written out there, since the vehicle takes half a second to import."""
    assert get_args(VehicleClass) == CLASSES


def test_wheelsets_alone_have_no_car():
    assert cars(vehicle([body("w", 1200.0, 0.0, wheelset=True)], [])) == ()


@pytest.mark.parametrize(
    ("file", "axles", "centres"), [("locomotive.toml", 3, (5.2, -5.2)), ("three_piece_wagon.toml", 2, (4.35, -4.35))]
)
def test_locomotive_and_wagon(file, axles, centres):
    """Three axles in a bogie, and side frames with a bolster: the car rests on two running gears."""
    found = load_vehicle(str(DATA / file))
    (car,) = cars(found)
    assert car.body.name == "car"
    assert [len(gear.axles) for gear in running_gears(found)] == [axles, axles]
    assert [gear.centre for gear in car.gears] == pytest.approx(centres)
